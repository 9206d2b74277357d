# SPDX-License-Identifier: MIT
"""Notices when files change, by looking at them now and then: it works on every file system."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

_PERIOD = 0.3  # seconds between two looks


class Watch:
    """Tells when any of the files that ``list_files`` names has changed, come or gone."""

    def __init__(self, list_files: Callable[[], Iterable[Path]]) -> None:
        self._list_files = list_files
        self._looked_at = 0.0
        self._known = self._look()

    def changed(self) -> bool:
        """Whether something changed since the last call that said so."""
        now = time.monotonic()
        if now - self._looked_at < _PERIOD:
            return False
        self._looked_at = now
        seen = self._look()
        changed, self._known = seen != self._known, seen
        return changed

    def accept(self) -> None:
        """Take the files as they are for known: after writing one oneself."""
        self._known = self._look()

    def _look(self) -> dict[Path, tuple[int, int]]:
        found = {}
        for path in self._list_files():
            try:
                status = path.stat()
            except OSError:
                continue
            found[path] = (status.st_mtime_ns, status.st_size)
        return found


def shader_files(root: Path) -> Iterable[Path]:
    """All files of shader source below ``root``."""
    return (path for path in root.rglob("*") if path.suffix in (".glsl", ".frag", ".vert"))
