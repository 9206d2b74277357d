# SPDX-License-Identifier: MIT
"""The accumulation textures: running mean, variance, half-difference and counts of every pixel (film/film.glsl)."""

import moderngl
import numpy as np

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import max_size, nearest_texture
from fragtracer.gpu.layers import LayerTextures
from fragtracer.gpu.outputs import Outputs
from fragtracer.sampling.pixels import Pixels

_TEXTURES = 3


class Film:
    """Two sets of float textures that take turns: a pass reads the front and draws the back.

    ``width`` and ``height`` are in pixels. A program that has ``layers`` draws them after its own textures; the film
    keeps and releases them. Raises :class:`DeviceError` if the GPU cannot hold it.
    """

    def __init__(self, ctx: moderngl.Context, width: int, height: int, layers: LayerTextures | None = None) -> None:
        if max(width, height) > max_size(ctx):
            raise DeviceError(f"this GPU renders at most {max_size(ctx)} pixels a side, not {width}x{height}")
        self.size = (width, height)
        self.layers = layers
        self.stage = 0  # whose streams of random numbers its samples take
        self._sets: list[list[moderngl.Texture]] = [[], []]
        self._outputs: list[Outputs] = []
        try:
            for textures in self._sets:
                for _ in range(_TEXTURES):
                    textures.append(nearest_texture(ctx, self.size))
                self._outputs.append(Outputs(ctx, [*textures, *(layers.targets if layers else ())]))
        except moderngl.Error as error:
            self.release()
            _ = ctx.error  # takes the driver's own note of it away
            raise DeviceError(f"the GPU has no memory for an image of {width}x{height}: {error}") from None
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        for outputs in self._outputs:
            outputs.clear()
        if self.layers is not None:
            self.layers.keep()
        self._front = 0
        self.samples = 0  # of each pixel

    def bind(self, first_unit: int) -> None:
        """Read from the front set at texture units ``first_unit`` and the next, draw to the back."""
        for unit, texture in enumerate(self._sets[self._front], first_unit):
            texture.use(unit)
        if self.layers is not None:
            self.layers.use(first_unit + _TEXTURES)
        self._outputs[1 - self._front].use()

    def restrict(self, bottom: int, rows: int) -> None:
        """Limit drawing to ``rows`` rows of pixels from ``bottom`` (0 is the lowest) upwards."""
        self._outputs[1 - self._front].restrict(bottom, rows)

    def swap(self, samples: int) -> None:
        """Make what was drawn the front, after every pixel of it has been drawn ``samples`` times more."""
        self._front = 1 - self._front
        self.samples += samples
        if self.layers is not None:
            self.layers.keep()

    def drawn_samples(self, bottom: int, rows: int) -> int:
        """The least number of samples that a pixel of some rows has in the back set, which is being drawn."""
        back = self._outputs[1 - self._front]
        finite, others = (back.read(i, bottom, rows)[..., 3] for i in range(2))
        return int((finite + others).min())

    def read(self) -> Pixels:
        """The front set."""
        return read_pixels(self._outputs[self._front], 0, self.size[1])

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """``rows`` rows of the front set from ``bottom`` (0 is the lowest) upwards."""
        return read_pixels(self._outputs[self._front], bottom, rows)

    def write(self, pixels: Pixels, samples: int) -> None:
        """Go on from what :meth:`read` has returned, after ``samples`` samples of each pixel."""
        half_difference = np.pad(pixels.half_difference, [(0, 0), (0, 0), (0, 1)])
        for texture, image in zip(self.textures, (pixels.mean, pixels.variance, half_difference), strict=True):
            texture.write(np.ascontiguousarray(image[::-1], np.float32))
        self.samples = samples

    @property
    def back_textures(self) -> tuple[moderngl.Texture, ...]:
        """The set that the next pass draws."""
        return tuple(self._sets[1 - self._front])

    @property
    def textures(self) -> tuple[moderngl.Texture, ...]:
        """The front set, in the order of :class:`Pixels`; row 0 at the bottom."""
        return tuple(self._sets[self._front])

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures."""
        return 2 * _TEXTURES * 16 * self.size[0] * self.size[1] + (self.layers.gpu_bytes if self.layers else 0)

    def release(self) -> None:
        for outputs in self._outputs:
            outputs.release()
        for texture in (t for textures in self._sets for t in textures):
            texture.release()
        if self.layers is not None:
            self.layers.release()


def read_pixels(outputs: Outputs, bottom: int, rows: int) -> Pixels:
    """``rows`` rows of the three textures of a film from ``bottom`` (0 is the lowest) upwards."""
    mean, variance, half_difference = (outputs.read(i, bottom, rows)[::-1] for i in range(_TEXTURES))
    return Pixels(mean, variance, half_difference[..., :3])
