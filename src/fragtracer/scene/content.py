# SPDX-License-Identifier: MIT
"""Large arrays, which nobody changes, are told apart by what they hold."""

import hashlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray


def kept(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any]:
    """``values`` in an array that cannot be written; a copy, if the caller could still write in his own."""
    with np.errstate(over="ignore", invalid="ignore"):
        array = np.ascontiguousarray(values, dtype)
    if array.flags.writeable and isinstance(values, np.ndarray) and np.may_share_memory(array, values):
        array = array.copy()
    array.setflags(write=False)
    return array


def content_digest(*parts: NDArray[Any] | str | None) -> str:
    """A name for the content of arrays and texts, the same in every process (BLAKE2b, 128 bits)."""
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
    return digest.hexdigest()
