# SPDX-License-Identifier: MIT
"""Result files: refused before the work where they cannot be written, and then written whole or not at all."""

import os
import uuid
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fragtracer.errors import OutputError


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
        If the extension is not one of ``suffixes``, the path is a folder or a file that is write-protected,
        or its folder is missing or cannot be written to.
    """
    try:
        problem = _problem(Path(path), suffixes)
    except (OSError, ValueError) as error:
        problem = getattr(error, "strerror", None) or str(error)
    if problem:
        raise OutputError(f"{path}: {problem}")


def _problem(path: Path, suffixes: Collection[str]) -> str | None:
    folder = Path(os.path.realpath(path)).parent
    if path.is_dir():
        return "this is a folder; give the name of a file"
    if path.suffix.lower() not in suffixes:
        return f"cannot write {path.suffix or 'a file without an extension'}; choose from {', '.join(suffixes)}"
    if not folder.is_dir():
        return f"there is no folder {folder}; make it first"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"no permission to write in the folder {folder}"
    if path.exists() and not os.access(path, os.W_OK):
        return "this file exists and is write-protected"
    return None


_PART = ".fragtracer-{}.part"


@contextmanager
def replacing(path: str | Path, durable: bool = False) -> Iterator[Path]:
    """Give the name of a temporary file in the folder of ``path``, which takes its place at the end.

    After an exception, Ctrl-C included, ``path`` is as it was and the temporary file is gone. A ``durable`` one has
    reached the disk before it takes the place, and the new name in its folder before this returns.

    Raises
    ------
    OutputError
        If the file cannot be written, as on a full disk.
    """
    target = Path(os.path.realpath(path))
    part = target.with_name(_PART.format(uuid.uuid4().hex))
    try:
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


def _flush(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def remove_parts(folder: Path) -> None:
    """Delete the temporary files that killed processes have left in a folder."""
    for part in folder.glob(_PART.format("*")):
        with suppress(OSError):
            part.unlink()
