# SPDX-License-Identifier: MIT
"""Arrays that took long to compute, kept on disk for the next start."""

import hashlib
import io
import logging
import os
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from fragtracer.errors import OutputError
from fragtracer.output import replacing

Arrays = dict[str, NDArray[Any]]

_log = logging.getLogger(__name__)

LIMIT = 2 * 2**30  # bytes; beyond it, the files that were not used for longest go
_UNTRIMMED = 1 / 64  # of LIMIT that a process writes before it trims again
_untrimmed: float = LIMIT  # bytes written since this process has trimmed; so many that its first file lets it do so
_DIGEST = 16  # bytes at the head of a file, of the key and of all that follows


def cache_folder() -> Path:
    """Where the files lie: ``FRAGTRACER_CACHE``, else the folder that the system has for caches."""
    return Path(os.environ.get("FRAGTRACER_CACHE") or platformdirs.user_cache_path("fragtracer", False))


def cached(kind: str, key: str, make: Callable[[], Mapping[str, NDArray[Any]]], doing: str = "") -> Arrays:
    """What ``make`` returns, from the disk if it was made before.

    Parameters
    ----------
    kind
        What is kept, as "bvh": the beginning of the file's name.
    key
        Names the content of everything that the result depends on, the version of the code that makes
        it included; at most 64 letters, digits and hyphens (:func:`fragtracer.scene.content.content_digest`).
    make
        Computes the arrays, by name.
    doing
        What that is, for the log: "building a BVH".

    Notes
    -----
    A file that is damaged, or of another key, is noticed by its digest and made anew. Where the folder
    cannot be written, a warning says so, and the next start computes again.
    """
    path = cache_folder() / f"{kind}-{key}.arrays"
    found = _read(path, key)
    if found is not None:
        return found
    if doing:
        _log.info(doing)
    made = dict(make())
    _write(path, key, made)
    return made


def _read(path: Path, key: str) -> Arrays | None:
    try:
        content = path.read_bytes()
    except OSError:
        return None
    if content[:_DIGEST] != _digest(key, content[_DIGEST:]):
        warnings.warn(f"{path}: is damaged and is made anew", stacklevel=3)
        return None
    with suppress(OSError):
        os.utime(path)
    with np.load(io.BytesIO(content[_DIGEST:]), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _write(path: Path, key: str, arrays: dict[str, Any]) -> None:
    file = io.BytesIO()
    np.savez(file, **arrays)
    content = file.getvalue()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(_digest(key, content) + content)
        _trim_after(len(content), path)
    except (OSError, OutputError) as error:
        warnings.warn(f"nothing is kept for the next start: {error}", stacklevel=3)


def _digest(key: str, content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_DIGEST, key=key.encode()[:64]).digest()


def _trim_after(written: int, kept: Path) -> None:
    """Trim after the first file of this process, and then not after each: many small ones may follow each other, and to
    trim looks at all that are there."""
    global _untrimmed
    _untrimmed += written
    if _untrimmed > _UNTRIMMED * LIMIT:
        _trim(kept)
        _untrimmed = 0


def _trim(kept: Path) -> None:
    """Delete the files that were not used for longest until the others take no more than LIMIT."""
    found = []
    for file in kept.parent.glob("*.arrays"):
        with suppress(FileNotFoundError):  # another process may trim, too
            status = file.stat()
            found.append((status.st_mtime, status.st_size, file))
    size = 0
    for _, of_file, file in sorted(found, reverse=True):
        size += of_file
        if size > LIMIT and file != kept:
            file.unlink(missing_ok=True)
