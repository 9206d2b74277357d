# SPDX-License-Identifier: MIT
"""Scene files in TOML, to a :class:`Scene` and back.

The tables are ``[camera]``, ``[render]``, ``[ambient]``, ``[environment]``, ``[fog]``, ``[medium.NAME]``,
``[material.NAME]``, ``[[light]]``, ``[[spot_light]]``, ``[[directional_light]]``,
``[[sphere]]``, ``[[plane]]``, ``[[rectangle]]``, ``[[disk]]``,
``[[triangle]]`` and ``[[mesh]]``, under a ``description``; their keys are the fields of the dataclasses of
:mod:`fragtracer.scene`, with the name of a file where these hold pixels or triangles. The
``f0`` of a material may also name a dielectric of ``DIELECTRIC_F0``.
"""

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rtoml
import tomli_w

from fragtracer import output, resources
from fragtracer.arguments import check_scene
from fragtracer.errors import OutputError, SceneError
from fragtracer.io import SUFFIXES, AnimationError, files_of, note_files, open_gltf, read_model, staging
from fragtracer.io import qualified as with_qualified_names
from fragtracer.io.model import MITSUBA, stem
from fragtracer.io.playing import moments
from fragtracer.io.toml.beside import with_files
from fragtracer.io.toml.document import from_document, to_document
from fragtracer.io.toml.meshes import pose_tables
from fragtracer.io.toml.tables import show, suggest
from fragtracer.io.toml.unused import unused
from fragtracer.scene import Image, Pose, Scene
from fragtracer.scene.environment import Panorama

_MOST_MISTAKES = 10


def load(
    name_or_path: str | Path, light_models: bool = True, animation: str | int | None = None, time: float | None = None
) -> Scene:
    """Read a scene.

    Parameters
    ----------
    name_or_path
        The name of a bundled scene, as "three-spheres", or the path of a .toml file, of a Mitsuba scene (.xml) or of a
        model (.obj, .ply, .stl, .gltf, .glb, .npz). A model without a camera is framed.
    light_models
        Whether a model without lights gets default ones; false if an environment will be added.
    animation
        One of a model, or of meshes of a scene, by name or number, whose pose is shown in place of that of the file.
    time
        Of the animation, in seconds; left out, it plays in frames, and begins in a picture. Without ``animation``, that
        of the poses in a scene file.

    Raises
    ------
    AnimationError
        If there is no such animation.
    SceneError
        If the file cannot be read or is not a scene; the message has a line for each mistake.
    """
    animation = None if animation is None else str(animation)
    files = _bundled_files()
    path = files.get(str(name_or_path), Path(name_or_path))
    with _told(path, lambda: f"no such file or bundled scene; {suggest(path.stem, files)}"):
        if path.suffix.lower() in SUFFIXES:
            return _staged(path, light_models, animation, time)
        if is_mitsuba(path):
            return _of_mitsuba(path, animation, time)
        if path.suffix.lower() != ".toml" and path.is_file():
            known = f".toml or {MITSUBA}, which are Mitsuba's, a model in {', '.join(SUFFIXES)}"
            raise SceneError(f"{path}: a scene file ends in {known}")
        text = path.read_bytes().decode("utf-8-sig")
    return parse(text, path, animation, time)


def is_model(name_or_path: str | Path) -> bool:
    """Whether :func:`load` reads a bare model there."""
    return str(name_or_path) not in _bundled_files() and Path(name_or_path).suffix.lower() in SUFFIXES


def is_mitsuba(name_or_path: str | Path) -> bool:
    """Whether :func:`load` reads a Mitsuba scene there."""
    return str(name_or_path) not in _bundled_files() and Path(name_or_path).suffix.lower() == MITSUBA


def _of_mitsuba(path: Path, animation: str | None, time: float | None) -> Scene:
    if animation is not None or time is not None:
        raise AnimationError(f"{path}: Mitsuba scenes have no animations")
    if not path.is_file():
        raise FileNotFoundError(path)
    from fragtracer.io.mitsuba import read_scene

    scene, files = read_scene(path)
    note_files(path, files)
    return scene


def _staged(path: Path, light: bool, animation: str | None, time: float | None) -> Scene:
    """A bare model in a scene of its own."""
    if animation is None and time is not None:
        names = ", ".join(open_gltf(path).animations.names) or "there are none"
        raise AnimationError(f"{path}: name the animation that the time is of: {names}")
    pose = None if animation is None else Pose(animation, time)
    model = with_qualified_names(read_model(path, pose), stem(path))
    seen = () if animation is None else moments(open_gltf(path), animation)
    return staging.stage(model, stem(path), light, seen)


def read_document(path: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises :class:`SceneError` if it cannot be read or is none."""
    with _told(path, lambda: "no such file"):
        return _toml(path.read_bytes().decode("utf-8-sig"), path)


@contextmanager
def _told(path: Path, missing: Callable[[], str]) -> Iterator[None]:
    """Make :class:`SceneError` of what goes wrong as a file is read, with what is to be said where there is none."""
    try:
        yield
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not UTF-8 text at byte {error.start}; save the file as UTF-8") from error
    except (FileNotFoundError, NotADirectoryError) as error:
        raise SceneError(f"{path}: {missing()}") from error
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: cannot read: {getattr(error, 'strerror', None) or error}") from error


def files_behind(scene: Scene) -> set[Path]:
    """The files that a scene refers to: models and their dependencies, textures, and the environment map."""
    files = {path for mesh in scene.meshes if mesh.file for path in files_of(mesh.file)}
    textures = (texture for material in scene.materials.values() for texture in material.textures.values())
    images: list[Image | Panorama] = [texture.image for texture in textures]
    if scene.environment is not None and scene.environment.image is not None:
        images.append(scene.environment.image)
    grids = {Path(medium.density.file) for medium in scene.media.values() if medium.density and medium.density.file}
    return files | grids | {Path(image.file) for image in images if image.file}


def bundled() -> dict[str, str]:
    """The names and descriptions of the bundled scenes."""
    return {name: rtoml.loads(path.read_text("utf-8"))["description"] for name, path in _bundled_files().items()}


def _bundled_files() -> dict[str, Path]:
    return {path.stem: path for path in sorted(resources.folder("scenes").glob("*.toml"))}


def parse(text: str, file: str | Path = "scene.toml", animation: str | None = None, time: float | None = None) -> Scene:
    """Parse the text of a scene file; ``file`` gives the scene its name and opens the messages. ``animation`` and
    ``time`` are those of :func:`load`.

    Raises
    ------
    AnimationError
        If no mesh has such an animation.
    SceneError
        If the text is not a scene; the message has a line for each mistake, the first ten at most.

    Warns
    -----
    UserWarning
        A line for each material of which something has no effect.
    """
    document = _toml(text, file)
    if animation is not None or time is not None:
        tables = document.get("mesh")
        pose_tables(tables if isinstance(tables, list) else [], Path(file), animation, time)
    mistakes: list[str] = []
    scene = from_document(document, stem(file), Path(file).parent, mistakes)
    if scene is None:
        lines = [f"{file}: {mistake}" for mistake in mistakes[:_MOST_MISTAKES]]
        rest = len(mistakes) - _MOST_MISTAKES
        raise SceneError("\n".join(lines + ([f"{file}: … and {rest} more mistakes"] if rest > 0 else [])))
    for note in unused(scene):
        warnings.warn(f"{file}: {note}", stacklevel=2)
    return scene


def _toml(text: str, file: str | Path) -> dict[str, Any]:
    try:
        return rtoml.loads(text)
    except rtoml.TomlParsingError as error:
        number = re.search(r"at line (\d+) column", str(error))
        line = text.split("\n")[int(number[1]) - 1].strip() if number else ""
        shown = f": {show(line)}" if line else ""
        raise SceneError(f"{file}: not a TOML file: {error}{shown}") from error


def dump(scene: Scene, folder: str | Path = ".") -> str:
    """The text of a scene file in ``folder``, the inverse of :func:`parse`; defaults are left out."""
    text = tomli_w.dumps(to_document(scene, Path(folder)))
    # tomli_w gives each number of an array its own line; no other line ends in a bracket or a comma.
    for pattern, joined in ((r"\[\n\s+", "["), (r",\n\s*\]", "]"), (r",\n\s+", ", ")):
        text = re.sub(pattern, joined, text)
    return text


def save(scene: Scene, path: str | Path) -> None:
    """Write a scene file; its name becomes that of the scene when it is read again.

    Models and images that have files are referred to by paths relative to the new file. Meshes and images made in
    Python are written beside it, as .npz, and as .png or, if the pixels are floats, .exr and .npy. Meshes without
    triangles are left out.

    Raises
    ------
    OutputError
        If ``path`` does not end in .toml or cannot be written, or if a file that it refers to has a name that is not
        UTF-8.
    """
    check_scene(scene)
    output.check_writable(path, [".toml"])
    stored = with_files(scene, Path(path))
    text = dump(stored, Path(path).parent)
    try:
        encoded = text.encode()
    except UnicodeEncodeError as error:
        line = text[text.rfind("\n", 0, error.start) + 1 :].partition("\n")[0]
        shown = line.encode(errors="backslashreplace").decode()
        raise OutputError(f"{path}: a scene file is UTF-8, which this name is not; rename the file: {shown}") from None
    with output.replacing(path) as part:
        part.write_bytes(encoded)
