# SPDX-License-Identifier: MIT
"""Large read-only arrays, compared by a digest of their content."""

import hashlib
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, Self, TypeVar, TypeVarTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

C = TypeVar("C", bound="Content")
R = TypeVar("R")
Ts = TypeVarTuple("Ts")


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


class _Key:
    """Equal to others of the same digest; a cache may keep it without the content."""

    def __init__(self, content: Content) -> None:
        self.digest, self.content = content.digest, content

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def kept_by_digest(most: int) -> Callable[[Callable[[C, *Ts], R]], Callable[[C, *Ts], R]]:
    """As ``lru_cache``, for functions whose first argument is a :class:`Content`, which is not kept."""

    def keeping(function: Callable[[C, *Ts], R]) -> Callable[[C, *Ts], R]:
        @lru_cache(most)
        def kept(key: Any, *others: *Ts) -> R:
            return function(key.content, *others)

        @wraps(function)
        def found(content: C, *others: *Ts) -> R:
            key: Any = _Key(content)
            try:
                return kept(key, *others)
            finally:
                del key.content

        return found

    return keeping


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
