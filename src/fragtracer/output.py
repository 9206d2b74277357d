# SPDX-License-Identifier: MIT
"""Result files: refused before the work where they cannot be written, and then written whole or not at all."""

import hashlib
import os
import sys
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from fragtracer.errors import OutputError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_NO_FILE = "this is a device, a pipe or the like, which a file would replace; give the name of a file"


def check_writable(path: str | Path, suffixes: Collection[str]) -> None:
    """Find out, before any work is done, that a file could not be written.

    Parameters
    ----------
    path
        The file to write; it need not exist.
    suffixes
        The extensions that can be written, in lower case with their dot.

    Raises
    ------
    OutputError
        If the extension is not one of ``suffixes``, the path is a folder, a file that is write-protected, or something
        else than a file, or its folder is missing or cannot be written to.
    """
    try:
        problem = _problem(Path(path), suffixes)
    except (OSError, TypeError, ValueError) as error:
        problem = getattr(error, "strerror", None) or str(error)
    if problem:
        raise OutputError(f"{path}: {problem}")


def _problem(path: Path, suffixes: Collection[str]) -> str | None:
    folder = Path(os.path.realpath(path)).parent
    if path.is_dir():
        return "this is a folder; give the name of a file"
    if path.exists() and not path.is_file():
        return _NO_FILE
    if path.suffix.lower() not in suffixes:
        return f"cannot write {path.suffix or 'a file without an extension'}; choose from {', '.join(suffixes)}"
    if not folder.is_dir():
        return f"there is no folder {folder}; make it first"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"no permission to write in the folder {folder}"
    if path.exists() and not os.access(path, os.W_OK):
        return "this file exists and is write-protected"
    return None


@contextmanager
def replacing(path: str | Path, durable: bool = False) -> Iterator[Path]:
    """Give the name of a temporary file in the folder of ``path``, which takes its place at the end.

    After an exception, Ctrl-C included, ``path`` is as it was and the temporary file is gone. A ``durable`` one has
    reached the disk before it takes the place, and the new name in its folder before this returns.

    Raises
    ------
    OutputError
        If the file cannot be written, as on a full disk, or if ``path`` is there and no file.
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(_part(target, uuid.uuid4().hex))
    try:
        if target.exists() and not (target.is_file() or target.is_dir()):
            raise OutputError(f"{path}: {_NO_FILE}")
        yield part
        if durable:
            _flush(part)
        os.replace(part, target)
        if durable and os.name == "posix":  # others do not open folders
            _flush(target.parent)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            part.unlink()


def write_each(writers: Mapping[Path, Callable[[Path], None]]) -> None:
    """Have each file written by its own function, those after one that cannot be, too.

    Raises
    ------
    OutputError
        In the end, of all that could not be written.
    """
    problems = []
    for path, write in writers.items():
        try:
            write(path)
        except OutputError as error:
            problems.append(str(error))
    if problems:
        raise OutputError("; ".join(problems))


def _part(target: Path, which: str) -> str:
    """The name of a temporary file, which is short however long that of its target is."""
    return f".fragtracer-{hashlib.blake2b(os.fsencode(target.name), digest_size=8).hexdigest()}-{which}.part"


def _flush(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def remove_parts(path: Path) -> None:
    """Delete the temporary files of ``path`` that killed processes have left; those of living ones, too, so that there
    must be none (:func:`locked`)."""
    target = Path(os.path.realpath(path))
    for part in target.parent.glob(_part(target, "*")):
        with suppress(OSError):
            part.unlink()


@contextmanager
def locked(path: Path) -> Iterator[bool]:
    """Lock the file ``path``, which holds nothing, against other processes; False where its file system has no locks.

    The system itself unlocks it when this process ends, in whatever way.

    Raises
    ------
    BlockingIOError
        If another process has locked it.
    OSError
        If it cannot be written.
    """
    with ExitStack() as files:
        while True:
            file = files.enter_context(path.open("ab"))
            has_locks = _lock(file)
            if not has_locks or _is_at(path, file):
                break
        try:
            yield has_locks
        finally:
            with suppress(OSError):  # of Windows, which removes no file that is open: there it stays
                path.unlink()


def _lock(file: BinaryIO) -> bool:
    try:
        if sys.platform == "win32":
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError) as error:  # the latter on Windows, and by SMB
        raise BlockingIOError(*error.args) from error
    except OSError:
        return False
    return True


def _is_at(path: Path, file: BinaryIO) -> bool:
    """Whether ``file`` was not removed from ``path`` between its opening and its locking."""
    try:
        return sys.platform == "win32" or os.path.samefile(path, file.fileno())
    except FileNotFoundError:
        return False
