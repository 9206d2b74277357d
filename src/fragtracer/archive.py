# SPDX-License-Identifier: MIT
"""Named arrays with a header in one file, whole or not at all: a .npz of NumPy, without compression or pickles.

The header is the member "header", JSON in UTF-8 as bytes; it holds the digest of all arrays.
"""

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FilmError
from fragtracer.output import replacing
from fragtracer.scene.content import content_digest

Arrays = dict[str, NDArray[Any]]
_HEADER, _DIGEST = "header", "digest"
# What zipfile and NumPy raise for bytes that are not what they were.
_DAMAGES = (
    *(ValueError, KeyError, TypeError, EOFError, RuntimeError, NotImplementedError, OverflowError, MemoryError),
    *(struct.error, zlib.error, zipfile.BadZipFile),
)


def write_archive(path: Path, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file in the place of the one that is there, which stays until the new one is on the disk.

    Raises
    ------
    OutputError
        If it cannot be written, as on a full disk.
    """
    contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    text = json.dumps({**header, _DIGEST: _digest(contiguous)}, allow_nan=False)
    members: dict[str, Any] = {_HEADER: np.frombuffer(text.encode(), np.uint8), **contiguous}
    with replacing(path, durable=True) as part, part.open("wb") as file:
        np.savez(file, **members)


def read_archive(path: Path) -> tuple[dict[str, Any], Arrays]:
    """The header and the arrays of a file.

    Raises
    ------
    FilmError
        If it is missing, or any bit of what it holds is not as it was written.
    """
    try:
        if not path.is_file():
            raise FilmError(f"{path}: there is no such file")
        with zipfile.ZipFile(path) as file:
            arrays = {name.removesuffix(".npy"): _member(file.read(name)) for name in file.namelist()}
        header = json.loads(arrays.pop(_HEADER).tobytes())
        if not isinstance(header, dict):
            raise ValueError("its header is no JSON object")
        if header.pop(_DIGEST) != _digest(arrays):
            raise ValueError("its content has another digest")
    except OSError as error:
        raise FilmError(f"{path}: cannot read: {error.strerror or error}") from error
    except _DAMAGES as error:
        raise FilmError(f"{path}: this film is damaged, or not one: {error}") from error
    return header, arrays


def _member(content: bytes) -> NDArray[Any]:
    """An array from bytes whose checksum was right."""
    array: NDArray[Any] = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    return array


def _digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    return content_digest(*(part for name in sorted(arrays) for part in (name, arrays[name])))
