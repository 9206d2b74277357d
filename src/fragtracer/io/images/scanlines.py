# SPDX-License-Identifier: MIT
"""The scanlines of Radiance files: flat, or run-length encoded in the newer or the older way.

Pixels are uint8 (n, 4), mantissas and exponent. Damaged data raise ValueError.
"""

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
_DAMAGED = "a run-length encoded row is damaged"
_ROWS_AT_ONCE = 64  # bounds the memory


def decode_scanlines(data: bytes, start: int, lines: int, length: int) -> Bytes:
    """The pixels, (lines, length, 4), of ``data`` from byte ``start`` on."""
    marker = bytes((2, 2, length >> 8 & 255, length & 255))
    if 8 <= length < 2**15 and data.startswith(marker, start):
        return _newer(data, start, lines, length, marker)
    whole = (len(data) - start) // 4
    pixels = np.frombuffer(data, np.uint8, 4 * whole, start).reshape(-1, 4)
    repeats = (pixels[:, :3] == 1).all(axis=1)
    if repeats[: lines * length].any():
        pixels = _older(pixels, repeats, lines * length)
    if len(pixels) < lines * length:
        raise ValueError(f"it holds {len(pixels)} pixels where {lines * length} are needed")
    return pixels[: lines * length].reshape(lines, length, 4)


def _newer(data: bytes, start: int, lines: int, length: int, marker: bytes) -> Bytes:
    """Each row is a marker and four channels, one after the other: a code up to 128 is followed by as many literal
    bytes, a larger one by a byte that is repeated (code - 128) times."""
    if (len(data) - start) // 4 < lines:  # before any memory is taken
        raise ValueError(_DAMAGED)
    source = np.frombuffer(data, np.uint8)
    pixels = np.empty((lines, length, 4), np.uint8)
    at = start
    for first in range(0, lines, _ROWS_AT_ONCE):
        rows = pixels[first : first + _ROWS_AT_ONCE]
        codes: list[int] = []
        for _ in rows:
            if not data.startswith(marker, at):
                raise ValueError(_DAMAGED)
            at = _row(data, at + 4, 4 * length, codes)
        rows[:] = _expand(source, np.array(codes)).reshape(len(rows), 4, length).swapaxes(1, 2)
    return pixels


def _row(data: bytes, at: int, size: int, codes: list[int]) -> int:
    """Append the offsets of the codes of one row of ``size`` bytes; return the offset of its end."""
    found = 0
    append = codes.append
    try:
        while found < size:
            code = data[at]
            append(at)
            if code > 128:
                found += code - 128
                at += 2
            elif code:
                found += code
                at += code + 1
            else:
                raise ValueError(_DAMAGED)
    except IndexError:
        raise ValueError(_DAMAGED) from None
    if found != size or at > len(data):
        raise ValueError(_DAMAGED)
    return at


def _expand(source: Bytes, codes: NDArray[np.int64]) -> Bytes:
    """The decoded bytes of the codes at these offsets."""
    code = source[codes].astype(np.int64)
    is_run = code > 128
    counts = np.where(is_run, code - 128, code)
    starts = np.cumsum(counts) - counts
    # The place of each byte less that of the one before: 1 within what stands as it is, 0 within a run.
    step = np.repeat(np.where(is_run, 0, 1), counts)
    ends = codes + 1 + np.where(is_run, 0, counts - 1)
    step[starts] = codes + 1 - np.concatenate([[0], ends[:-1]])
    expanded: Bytes = source[np.cumsum(step)]
    return expanded


def _older(pixels: Bytes, repeats: NDArray[np.bool_], size: int) -> Bytes:
    """A pixel (1, 1, 1, n) repeats the previous one n times; each further one in a row counts 256 times as much."""
    index = np.arange(len(pixels))
    last = np.maximum.accumulate(np.where(repeats, -1, index))
    if last[0] < 0:
        raise ValueError(_DAMAGED)
    shift = np.minimum(8 * (index - last - 1), 32).clip(0)
    counts = np.where(repeats, pixels[:, 3].astype(np.int64) << shift, 1)
    used = int(np.searchsorted(np.cumsum(np.minimum(counts, size)), size)) + 1
    counts = counts[:used]
    if counts.sum() != size:
        raise ValueError(_DAMAGED)
    return np.repeat(pixels[last[:used]], counts, axis=0)
