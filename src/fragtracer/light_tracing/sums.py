# SPDX-License-Identifier: MIT
"""What photons bring to pixels, summed up: by the process, or by a GPU, which else would wait for it."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.context import is_software
from fragtracer.gpu.splats import Drawn, GpuSums, ended_early

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NOT_FINITE, _ENDED = -1, -2  # in the place of whether a photon is seen


@dataclass(frozen=True)
class Splats:
    """Photons that are seen: the ``column`` (n,) and the ``row`` (n,) of the pixel of each, counted from the left and
    from the top, and its ``radiance`` (3, n) there. ``target`` (n,) are the numbers of what they were sent to;
    ``non_finite`` more are left out, being NaN or infinite."""

    column: Ints
    row: Ints
    radiance: NDArray[np.float32]
    target: Ints
    non_finite: int

    @staticmethod
    def read(drawn: Drawn, height: int) -> "Splats":
        """Those of a pass, in a picture of so many rows.

        Raises :class:`DeviceError` if the driver ended their ways before their time.
        """
        splat, place = (np.frombuffer(texture.read(), np.float32).reshape(-1, 4) for texture in drawn)
        is_seen = splat[:, 3]
        if (is_seen == _ENDED).any():
            raise ended_early()
        there = np.flatnonzero(is_seen > 0)
        column, from_below, target = place[there, :3].T.astype(np.int64)
        radiance = np.ascontiguousarray(splat[there, :3].T)
        return Splats(column, height - 1 - from_below, radiance, target, int((is_seen == _NOT_FINITE).sum()))


class Sums(Protocol):
    """Of the radiance of photons, for each pixel, in two halves, and of its squares; ``non_finite`` photons are left
    out."""

    non_finite: int

    def add(self, drawn: Drawn, half: int) -> None:
        """Add a pass to the half 0 or 1. Raises :class:`DeviceError` if the driver ended its ways before their time."""

    def read(self, top: int, rows: int) -> Floats:
        """Both halves and the squares in some rows, (3, rows, width, 3), row 0 at the top."""

    def write(self, sums: Floats, non_finite: int) -> None:
        """Go on from what :meth:`read` has returned of all rows."""

    def clear(self) -> None:
        """Set all to 0."""

    @property
    def textures(self) -> tuple[Any, ...]:
        """Both halves and the squares, row 0 at the bottom; none if they are not on the GPU."""

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU."""

    def release(self) -> None: ...


def sums_of(ctx: Any, size: tuple[int, int]) -> Sums:
    """For a picture of ``size``, (width, height); of the process, if the GPU cannot add up."""
    if not is_software(ctx) and GpuSums.fits(ctx, size):
        sums = GpuSums(ctx, size)
        if sums.works():
            return sums
        sums.release()
    return ProcessSums(size)


class ProcessSums:
    """:class:`Sums` in float64, by the process."""

    textures: tuple[Any, ...] = ()
    gpu_bytes = 0

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self.clear()

    def clear(self) -> None:
        self.non_finite = 0
        self._sums = np.zeros((3, 3, self._size[0] * self._size[1]))  # halves and squares, of each channel

    def add(self, drawn: Drawn, half: int) -> None:
        width, height = self._size
        splats = Splats.read(drawn, height)
        pixel = splats.row * width + splats.column
        radiance = splats.radiance.astype(np.float64)
        for sums, values in ((self._sums[half], radiance), (self._sums[2], radiance**2)):
            for channel in range(3):
                np.add.at(sums[channel], pixel, values[channel])
        self.non_finite += splats.non_finite

    def read(self, top: int, rows: int) -> Floats:
        width = self._size[0]
        part = self._sums[..., top * width : (top + rows) * width]
        return part.swapaxes(1, 2).reshape(3, rows, width, 3)

    def write(self, sums: Floats, non_finite: int) -> None:
        self._sums = np.ascontiguousarray(sums.reshape(3, -1, 3).swapaxes(1, 2), np.float64)
        self.non_finite = non_finite

    def release(self) -> None:
        pass
