# SPDX-License-Identifier: MIT
"""The ``[environment]`` table of a scene file, and environment maps."""

import os
import warnings
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.images import read_image
from fragtracer.io.toml.tables import build, join, plain, show, suggest
from fragtracer.io.toml.textures import relative
from fragtracer.scene import Environment, Gradient, Panorama, Sky

_SOURCES = {"gradient": Gradient, "sky": Sky}
_KEYS = ("file", *(item.name for item in fields(Environment) if item.name != "image"))


def read_panorama(path: str | Path) -> Panorama:
    """The equirectangular map in an .hdr, .exr, .npy or .png file.

    Pixels that are NaN or infinite become black, of negative ones the negative channels alone 0; a warning counts them.

    Raises
    ------
    FragtracerError
        If the file cannot be read.
    """
    pixels = read_image(path)
    finite = np.asarray(np.isfinite(pixels).all(axis=2))
    negative = finite & (pixels < 0).any(axis=2)
    bad = {
        "are NaN or infinite and give no light": np.count_nonzero(~finite),
        "are negative in a channel, which gives no light": np.count_nonzero(negative),
    }
    if counted := "; ".join(f"{count} pixels {what}" for what, count in bad.items() if count):
        warnings.warn(f"{path}: {counted}", stacklevel=2)
        pixels = np.maximum(np.where(finite[..., None], pixels, np.float32(0)), np.float32(0))
    return Panorama(pixels, os.path.abspath(path))


def environment(table: Any, folder: Path, mistakes: list[str]) -> Environment | None:
    """Make the environment of a table of a scene file.

    Parameters
    ----------
    table
        What the file holds under ``[environment]``.
    folder
        What the path of the map is relative to.
    mistakes
        Takes "path: sentence" for each mistake.

    Returns
    -------
    Environment or None
        None if there is a mistake.
    """
    values, before = dict(table), len(mistakes)
    unknown = [key for key in table if key not in _KEYS]
    mistakes += [f"{join('environment', key)}: there is no such key; {suggest(key, _KEYS)}" for key in unknown]
    if "file" in values and isinstance(file := values.pop("file"), str):
        try:
            values["image"] = read_panorama(folder / file)
        except (FragtracerError, ValueError) as error:
            mistakes.append(f"environment.file: {error}")
    elif "file" in table:
        mistakes.append(f"environment.file: must be a text in quotes, got {show(table['file'])}")
    for key in _SOURCES.keys() & values.keys():
        values[key] = build(_SOURCES[key], values[key], f"environment.{key}", mistakes)
    if len(mistakes) > before:
        return None
    given = [key for key in ("file", "radiance", *_SOURCES) if key in table]
    if len(given) != 1:
        mistake = f"give only one of these, not {' and '.join(given)}" if given else "give one of these"
        mistakes.append(f"environment: {mistake}: file, radiance, [environment.gradient] or [environment.sky]")
        return None
    return build(Environment, values, "environment", mistakes)


def plain_environment(environment: Environment, folder: Path) -> dict[str, Any]:
    """The table of the file for an environment, the inverse of :func:`environment`.

    Raises
    ------
    OutputError
        If its map has no file.
    """
    table = plain(environment)
    for key in _SOURCES.keys() & table.keys():
        table[key] = plain(table[key])
    if (image := table.pop("image", None)) is not None:
        if image.file is None:
            raise OutputError("environment: its map is in no file; fragtracer.save writes one beside the scene")
        table = {"file": relative(image.file, folder)} | table
    return table
