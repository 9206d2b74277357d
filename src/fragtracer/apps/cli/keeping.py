# SPDX-License-Identifier: MIT
"""Checkpoints of a render."""

import shutil
import time
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from fragtracer.errors import DeviceError, FilmError, OutputError
from fragtracer.films import NAME, most_bytes
from fragtracer.output import locked, remove_parts
from fragtracer.scene import RenderSettings

_LOCK = "film.lock"  # of a folder that is in use


class Resumable(Protocol):
    """A render, on this machine or on a cluster."""

    @property
    def settings(self) -> RenderSettings: ...
    @property
    def spp(self) -> float: ...
    @property
    def can_go_on(self) -> bool: ...
    def save(self, path: Path) -> None: ...
    def resume(self, path: Path) -> None: ...


@dataclass(frozen=True)
class Keeping:
    """Where checkpoints lie, the seconds between them, and whether to go on from what is there. No process but this one
    uses a ``folder`` that ``is_locked``."""

    folder: Path
    every: float
    resume: bool
    is_locked: bool = False

    def begin(self, renderer: Resumable, frame: str = "") -> "Keeper":
        """For a render, perhaps of a frame; raises as :class:`Keeper`."""
        return Keeper(renderer, self.folder / frame, self.every, self.resume, self.is_locked)


@contextmanager
def keeping(folder: Path, every: float, resume: bool) -> Iterator[Keeping]:
    """Make ``folder`` where there is none, and keep other processes out of it, if its file system can.

    Raises
    ------
    OutputError
        If another process uses it, or it cannot be written.
    """
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            is_locked = stack.enter_context(locked(folder / _LOCK))
        except BlockingIOError:
            mend = "wait until it has ended, or give --checkpoint another folder"
            raise OutputError(f"{folder}: another process keeps its checkpoints here; {mend}") from None
        except OSError as error:
            raise _unfit(folder, error) from error
        yield Keeping(folder, every, resume, is_locked)


def _unfit(folder: Path, error: OSError) -> OutputError:
    return OutputError(f"{folder}: cannot be the folder of a checkpoint: {error.strerror or error}")


class Keeper:
    """Keeps the film of ``renderer`` in ``folder``, a checkpoint every so many seconds.

    A checkpoint that cannot be written later, as on a disk that has filled up, is a warning: the render goes on, and
    the last one stays.

    Raises
    ------
    OutputError
        If the folder cannot be written, or its disk has no room for a checkpoint.
    FilmError
        If there is a checkpoint and ``resume`` is false, or if it is damaged or of another picture.
    """

    def __init__(self, renderer: Resumable, folder: Path, every: float, resume: bool, is_locked: bool) -> None:
        self._renderer, self._path, self._every = renderer, folder / NAME, every
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if is_locked:  # otherwise they may be of a process that lives
                remove_parts(self._path)
            free = shutil.disk_usage(folder).free
        except OSError as error:
            raise _unfit(folder, error) from error
        needed = most_bytes(renderer.settings)
        if free < needed:
            needs = f"a checkpoint takes up to {-(-needed // 10**6)} MB"
            raise OutputError(f"{folder}: {needs}, {free // 10**6} MB are free")
        if self._path.exists() and not resume:
            raise FilmError(f"{self._path}: there is a checkpoint; go on from it with --resume, or delete it")
        if self._path.exists():
            renderer.resume(self._path)
        self._kept, self._last = renderer.spp, time.monotonic()

    def __call__(self, is_last: bool) -> None:
        """After a pass."""
        is_due = is_last or time.monotonic() - self._last >= self._every
        if is_due and self._renderer.spp != self._kept:
            self._write()

    def finish(self) -> None:
        """Keep what was drawn since the last checkpoint, if a render can go on from it."""
        if self._renderer.spp != self._kept and self._renderer.can_go_on:
            self._write()

    def remove(self) -> None:
        """Forget the checkpoint of a picture that is finished, and its folder."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
            self._path.parent.rmdir()

    def _write(self) -> None:
        try:
            self._renderer.save(self._path)
            self._kept = self._renderer.spp
        except (OutputError, DeviceError) as error:
            warnings.warn(f"no checkpoint: {error}", stacklevel=2)
        self._last = time.monotonic()
