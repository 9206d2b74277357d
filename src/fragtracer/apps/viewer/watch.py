# SPDX-License-Identifier: MIT
"""Notices when files change by polling them, which works on every file system."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from fragtracer.io import files_of, toml
from fragtracer.scene import Scene

_PERIOD = 0.3  # seconds between two polls


class Watch:
    """Tells which of the files that ``list_files`` names have changed, come or gone.

    With ``whole_folder``, a file that enters or leaves the list has come or gone. Without, the list follows
    the scene, and a file that enters or leaves it is no change.
    """

    def __init__(self, list_files: Callable[[], Iterable[Path]], whole_folder: bool = False) -> None:
        self._list_files = list_files
        self._whole_folder = whole_folder
        self._looked_at = 0.0
        self._known = self._look()

    def changed(self) -> set[Path]:
        """The files that have changed since the last call."""
        now = time.monotonic()
        if now - self._looked_at < _PERIOD:
            return set()
        self._looked_at = now
        seen, known = self._look(), self._known
        self._known = seen
        paths = seen.keys() | known.keys() if self._whole_folder else seen.keys() & known.keys()
        return {path for path in paths if seen.get(path) != known.get(path)}

    def accept(self) -> None:
        """Ignore the changes so far, such as of a file that the viewer itself has written."""
        self._known = self._look()

    def _look(self) -> dict[Path, tuple[int, int] | None]:
        found: dict[Path, tuple[int, int] | None] = {}
        for path in self._list_files():
            try:
                status = path.stat()
                found[path] = (status.st_mtime_ns, status.st_size)
            except OSError:
                found[path] = None
        return found


def scene_files(scene: Scene, path: Path | None) -> Iterable[Path]:
    """The file of a scene, if it has one, and those that it includes, and of its meshes, textures and environment."""
    own = [] if path is None else [path, *(file for file in files_of(path) if file != path.absolute())]
    folder = path.parent if path else Path()
    return own + [folder / file for file in sorted(toml.files_behind(scene))]


def shader_files(root: Path) -> Iterable[Path]:
    """All files of shader source below ``root``."""
    return (path for path in root.rglob("*") if path.suffix in (".glsl", ".frag", ".vert"))
