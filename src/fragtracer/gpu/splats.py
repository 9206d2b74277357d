# SPDX-License-Identifier: MIT
"""Photons added to the pixels that see them by the GPU."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import max_size, nearest_texture
from fragtracer.gpu.program import PointsProgram
from fragtracer.resources import folder

Floats = NDArray[np.float64]
Drawn = tuple[moderngl.Texture, moderngl.Texture]  # by light_tracing.frag: a pass of photons, and their places


class GpuSums:
    """:class:`.Sums` in float32, by blending, each addend in the order in which it was drawn.

    Of n numbers alike the sum is wrong by about √n · 2^-26 of it, where that of random ones has a noise of 1/√n: up to
    six million for a pixel, rounding is less than a tenth of that.

    Raises :class:`DeviceError` if the GPU has no memory for a picture of ``size``, (width, height).
    """

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        self._ctx, self._size = ctx, size
        width, height = size
        self._program = PointsProgram(ctx, folder("shaders"), "film/splat.frag", vertex="film/splat.vert")
        # Above the picture, a row for what is counted.
        self._program.set({"u_splats": 0, "u_places": 1, "u_size": (width, height + 1)})
        self.textures: tuple[moderngl.Texture, ...] = ()
        self._halves: list[moderngl.Framebuffer] = []
        try:
            for _ in range(3):
                self.textures += (nearest_texture(ctx, (width, height + 1)),)
            for half in self.textures[:2]:
                self._halves.append(ctx.framebuffer([half, self.textures[2]]))
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
        self.add((drawn[0], drawn[1]), 1)
        found = self.read(self._size[1] - 1, 1)[:, 0, 0, 0]
        self.clear()
        for texture in drawn:
            texture.release()
        return np.allclose(found, (0, 2 * value, 2 * value**2), rtol=1e-7, atol=0)

    def clear(self) -> None:
        before = self._ctx.detect_framebuffer()
        for half in self._halves:
            half.use()  # or clearing keeps to the rows that the framebuffer in use is restricted to
            half.clear()
        before.use()
        self.non_finite = 0

    def add(self, drawn: Drawn, half: int) -> None:
        splats, places = drawn
        before = self._ctx.detect_framebuffer()
        self._halves[half].use()
        splats.use(0)
        places.use(1)
        self._program.add(splats.width * splats.height)
        counted = self._texels(2, self._size[1], 1)[0, 0]
        before.use()
        self.non_finite = int(counted[0])
        if counted[1]:
            raise ended_early()

    def read(self, top: int, rows: int) -> Floats:
        bottom = self._size[1] - top - rows
        sums = [self._texels(number, bottom, rows)[::-1, :, :3] for number in range(3)]
        return np.stack(sums, dtype=np.float64)

    def _texels(self, number: int, bottom: int, rows: int) -> NDArray[np.float32]:
        """``rows`` rows of a texture from ``bottom`` (0 is the lowest) upwards, (rows, width, 4), the lowest first."""
        framebuffer, attachment = (self._halves[number], 0) if number < 2 else (self._halves[0], 1)
        texels = framebuffer.read((0, bottom, self._size[0], rows), 4, attachment=attachment, dtype="f4")
        return np.frombuffer(texels, np.float32).reshape(rows, self._size[0], 4)

    def write(self, sums: Floats, non_finite: int) -> None:
        for texture, image in zip(self.textures, sums, strict=True):
            texels = np.pad(image[::-1].astype(np.float32), [(0, 1), (0, 0), (0, 1)])
            texels[-1, 0, 0] = non_finite
            texture.write(texels)
        self.non_finite = non_finite

    @property
    def gpu_bytes(self) -> int:
        return 3 * 16 * self._size[0] * (self._size[1] + 1)

    def release(self) -> None:
        for framebuffer in self._halves:
            framebuffer.release()
        for texture in self.textures:
            texture.release()
        self._program.release()


def ended_early() -> DeviceError:
    """For photons whose ways the driver has cut."""
    return DeviceError("the driver ended the ways of photons early; render with fewer bounces")
