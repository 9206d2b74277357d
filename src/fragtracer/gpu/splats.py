# SPDX-License-Identifier: MIT
"""Photons added to the pixels that see them, by blending."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import max_size, nearest_texture
from fragtracer.gpu.program import PointsProgram
from fragtracer.resources import folder


class SplatSums:
    """Three sums for each pixel of a picture of ``size``, (width, height): of radiances in two halves, and of all their
    squares; float32, each addend in the order in which it was drawn.

    Of n numbers alike the sum is wrong by about √n · 2^-26 of it, where that of random ones has a noise of 1/√n: up to
    six million for a pixel, rounding is less than a tenth of that.

    Raises :class:`DeviceError` if the GPU has no memory for them.
    """

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        self._ctx, self._size = ctx, size
        width, height = size
        self._program = PointsProgram(ctx, folder("shaders"), "film/splat.vert", "film/splat.frag")
        # Above the picture, a row for what is counted.
        self._program.set({"u_splats": 0, "u_places": 1, "u_size": (width, height + 1)})
        self.textures: tuple[moderngl.Texture, ...] = ()
        self._halves: list[moderngl.Framebuffer] = []
        try:
            for _ in range(3):
                self.textures += (nearest_texture(ctx, (width, height + 1)),)
            self._halves = [ctx.framebuffer([half, self.textures[2]]) for half in self.textures[:2]]
        except moderngl.Error as error:
            self.release()
            _ = ctx.error  # takes the driver's own note of it away
            raise DeviceError(f"the GPU has no memory for the photons of {width}x{height}: {error}") from None
        self.clear()

    @staticmethod
    def fits(ctx: moderngl.Context, size: tuple[int, int]) -> bool:
        """Whether a picture of ``size`` leaves room for another row."""
        return size[1] < max_size(ctx)

    def works(self) -> bool:
        """Whether the driver adds up in 32 bits, as not all old ones do; nothing may have been added yet."""
        value = 1 + 2.0**-20
        splats = np.array([(value, 0, 0, 1), (value, 0, 0, 1)], np.float32)
        drawn = [nearest_texture(self._ctx, (2, 1), 4, texels.tobytes()) for texels in (splats, np.zeros_like(splats))]
        self.add(drawn[0], drawn[1], 1)
        found = self.read(0, 1)[:, 0, 0, 0]
        self.clear()
        for texture in drawn:
            texture.release()
        return found[0] == 0 and np.allclose(found[1:], (2 * value, 2 * value**2), rtol=1e-7, atol=0)

    def clear(self) -> None:
        """Set all sums to 0."""
        before = self._ctx.detect_framebuffer()
        for half in self._halves:
            half.use()  # or clearing keeps to the rows that the framebuffer in use is restricted to
            half.clear()
        before.use()

    def add(self, splats: moderngl.Texture, places: moderngl.Texture, half: int) -> tuple[int, int]:
        """Add what light_tracing.frag has drawn, to the half 0 or 1; the numbers of all photons so far that are not
        finite, and of those that the driver has ended early."""
        before = self._ctx.detect_framebuffer()
        self._halves[half].use()
        splats.use(0)
        places.use(1)
        self._program.add(splats.width * splats.height)
        not_finite, ended, *_ = self._rows(2, self._size[1], 1)[0, 0]
        before.use()
        return int(not_finite), int(ended)

    def read(self, bottom: int, rows: int) -> NDArray[np.float32]:
        """``rows`` rows of the three sums from ``bottom`` (0 is the lowest) upwards, (3, rows, width, 3)."""
        return np.stack([self._rows(i, bottom, rows)[..., :3] for i in range(3)])

    def _rows(self, number: int, bottom: int, rows: int) -> NDArray[np.float32]:
        framebuffer, attachment = (self._halves[number], 0) if number < 2 else (self._halves[0], 1)
        texels = framebuffer.read((0, bottom, self._size[0], rows), 4, attachment=attachment, dtype="f4")
        return np.frombuffer(texels, np.float32).reshape(rows, self._size[0], 4)

    def write(self, sums: NDArray[np.float32], not_finite: int) -> None:
        """Go on from what :meth:`read` has returned of all rows, and :meth:`add` as photons that are not finite."""
        for texture, image in zip(self.textures, sums, strict=True):
            texels = np.pad(image, [(0, 1), (0, 0), (0, 1)])
            texels[-1, 0, 0] = not_finite
            texture.write(np.ascontiguousarray(texels, np.float32))

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures."""
        return 3 * 16 * self._size[0] * (self._size[1] + 1)

    def release(self) -> None:
        for framebuffer in self._halves:
            framebuffer.release()
        for texture in self.textures:
            texture.release()
        self._program.release()
