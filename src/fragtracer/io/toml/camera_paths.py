# SPDX-License-Identifier: MIT
"""Camera paths in TOML: a table ``[[key]]`` for each keyframe, with the fields of :class:`Keyframe`."""

from itertools import pairwise
from pathlib import Path

from pydantic import ValidationError

from fragtracer.camera_path import CameraPath, Keyframe
from fragtracer.errors import SceneError
from fragtracer.io.toml import read_document
from fragtracer.io.toml.tables import build, show, suggest
from fragtracer.scene import Camera


def load_camera_path(file: str | Path, camera: Camera) -> CameraPath:
    """Read a path; ``camera`` is the scene's, whose values the keys need not repeat.

    Raises
    ------
    SceneError
        If the file cannot be read or is no path; the message has a line for each mistake.
    """
    document, mistakes = read_document(Path(file)), []
    mistakes += [f"{name}: there is no such key; {suggest(name, ['key'])}" for name in document if name != "key"]
    tables = document.get("key", [])
    if not isinstance(tables, list) or not tables:
        mistakes.append(f"key: must be tables [[key]], one for each keyframe, got {show(tables)}")
        tables = []
    keys = [build(Keyframe, table, f"key[{index}]", mistakes) for index, table in enumerate(tables)]
    cameras = {}
    for index, key in enumerate(keys):
        try:
            if key is not None:
                cameras[key.frame] = key.camera(camera)
        except ValidationError as error:
            mistakes.append(f"key[{index}]: {error.errors()[0]['msg'].removeprefix('Value error, ')}")
    for index, (one, other) in enumerate(pairwise(keys), start=1):
        if one is not None and other is not None and other.frame <= one.frame:
            mistakes.append(f"key[{index}].frame: must be greater than that of the key before, {one.frame}")
    if mistakes:
        raise SceneError("\n".join(f"{file}: {mistake}" for mistake in mistakes))
    return CameraPath(cameras)
