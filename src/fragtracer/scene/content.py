# SPDX-License-Identifier: MIT
"""Large read-only arrays, compared by a digest of their content."""

import hashlib
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray


class Content:
    """Arrays that never change: equal to others of their class that have the same :attr:`digest`, and never copied."""

    digest: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __deepcopy__(self, _: object) -> Self:
        return self

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)  # which pickle forgets


def read_only(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any]:
    """``values`` as a C-contiguous read-only array; a copy where the caller could still write to the memory."""
    with np.errstate(over="ignore", invalid="ignore"):
        array = np.ascontiguousarray(values, dtype)
    if array.flags.writeable and isinstance(values, np.ndarray) and np.may_share_memory(array, values):
        array = array.copy()
    array.setflags(write=False)
    return array


def content_digest(*parts: NDArray[Any] | str | None) -> str:
    """A BLAKE2b digest (128 bits, hexadecimal) of arrays and strings, the same in every process."""
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
    return digest.hexdigest()
