# SPDX-License-Identifier: MIT
"""Textures of a scene file: the name of an image file, or a table with its mapping and filter."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, cast, get_args

from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.textures import read_texture
from fragtracer.io.toml.tables import build, join, plain, show, suggest
from fragtracer.scene import Image, Texture
from fragtracer.scene.material import TEXTURED
from fragtracer.scene.texture import ColorSpace

TEXTURES = tuple(f"{name}_texture" for name in TEXTURED)
_LINEAR_SUFFIXES = (".exr", ".hdr", ".npy")
_COLORS = tuple(
    f"{name}_texture" for name in ("albedo", "emission", "transmittance", "sheen_color", "diffuse_transmission_color")
)
_SPACES: tuple[ColorSpace, ...] = get_args(ColorSpace)
KEYS = ("file", "color_space", *(item.name for item in fields(Texture) if item.name != "image"))


@dataclass
class SceneImages:
    """The image files of one scene file, each read once; their paths are relative to ``folder``."""

    folder: Path
    _read: dict[tuple[Path, ColorSpace], Image] = field(default_factory=dict)

    def image(self, file: str, color_space: ColorSpace) -> Image:
        """The image in ``file``. Raises FragtracerError if it cannot be read."""
        path = Path(os.path.abspath(self.folder / file))
        if (path, color_space) not in self._read:
            image = read_texture(path, color_space)
            same = image.color_space == color_space
            self._read[path, color_space] = image if same else Image(image.pixels, color_space, str(path))
        return self._read[path, color_space]


def texture(key: str, value: Any, path: str, images: SceneImages, mistakes: list[str]) -> Texture | None:
    """Make the texture of a value of a scene file.

    Parameters
    ----------
    key
        One of :data:`TEXTURES`; it implies the default color space.
    value
        What the scene file holds, the name of an image file or a table if it is right.
    path
        Where it stands in the scene file, for the messages.
    images
        Reads the image.
    mistakes
        Takes "path: sentence" for each mistake.

    Returns
    -------
    Texture or None
        None if there is a mistake.
    """
    table = {"file": value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        mistakes.append(f'{path}: must be the name of an image file or a table {{ file = "…" }}, got {show(value)}')
        return None
    file, space = table.get("file"), table.get("color_space")
    if not isinstance(file, str):
        got = f"must be a text in quotes, got {show(file)}" if file is not None else "is missing; name an image file"
        mistakes.append(f"{path}.file: {got}")
        return None
    if space is not None and space not in _SPACES:
        mistakes.append(f"{path}.color_space: must be one of {', '.join(map(show, _SPACES))}, got {show(space)}")
        return None
    unknown = [name for name in table if name not in KEYS]
    mistakes += [f"{join(path, name)}: there is no such key; {suggest(name, KEYS)}" for name in unknown]
    try:
        image = images.image(file, cast(ColorSpace, space) or implied_space(key, file))
    except (FragtracerError, ValueError) as error:
        mistakes.append(f"{path}: {error}")
        return None
    rest = {name: item for name, item in table.items() if name in KEYS[2:]}
    return build(Texture, {"image": image, **rest}, path, mistakes)


def implied_space(key: str, file: str) -> ColorSpace:
    """The default color space of an image file: sRGB for 8-bit albedo and emission."""
    return "srgb" if key in _COLORS and Path(file).suffix.lower() not in _LINEAR_SUFFIXES else "linear"


def plain_texture(key: str, texture: Texture, folder: Path) -> str | dict[str, Any]:
    """The value of ``texture`` for a scene file in ``folder``, the inverse of :func:`texture`.

    Raises
    ------
    OutputError
        If the image is in no file.
    """
    if texture.image.file is None:
        raise OutputError(f"{key}: this image is in no file; fragtracer.save writes one beside the scene")
    file = relative(texture.image.file, folder)
    table: dict[str, Any] = {"file": file}
    if texture.image.color_space != implied_space(key, file):
        table["color_space"] = texture.image.color_space
    table |= {name: value for name, value in plain(texture).items() if name != "image"}
    return table if len(table) > 1 else file


def relative(file: str, folder: Path) -> str:
    """``file`` relative to ``folder``, with slashes; absolute if it is on another drive."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return Path(file).as_posix()
