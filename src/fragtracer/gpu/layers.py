# SPDX-License-Identifier: MIT
"""Textures that a film has besides its own: running means that a pass reads and draws again (film/layers.glsl)."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError


class LayerTextures:
    """``count`` textures of (width, height) pixels: drawn as targets, read as the slices of one array.

    Raises :class:`DeviceError` if the GPU cannot hold them.
    """

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int], count: int) -> None:
        width, height = self._size = size
        self.targets: list[moderngl.Texture] = []
        self._owned: list[moderngl.Texture | moderngl.TextureArray | moderngl.Buffer] = []
        try:
            for _ in range(count):
                self.targets.append(ctx.texture(size, 4, dtype="f4"))
                self._owned.append(self.targets[-1])
            self._array = ctx.texture_array((width, height, count), 4, dtype="f4")
            self._array.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._between = ctx.buffer(reserve=16 * width * height)
            self._owned += [self._array, self._between]
        except moderngl.Error as error:
            self.release()
            _ = ctx.error  # takes the driver's own note of it away
            raise DeviceError(f"the GPU has no memory for {count} layers of {width}x{height}: {error}") from None

    def use(self, unit: int) -> None:
        """Read what was kept last at a texture unit."""
        self._array.use(unit)

    def keep(self) -> None:
        """Have the next pass read what is in the targets; nothing of it leaves the GPU."""
        for layer, target in enumerate(self.targets):
            target.read_into(self._between)
            self._array.write(self._between, (0, 0, layer, *self._size, 1))

    def read(self) -> NDArray[np.float32]:
        """What was kept last, (count, height, width, 4), row 0 at the top."""
        width, height = self._size
        texels = np.frombuffer(self._array.read(), np.float32)
        return texels.reshape(-1, height, width, 4)[:, ::-1]

    def write(self, images: NDArray[np.float32]) -> None:
        """Go on from what :meth:`read` has returned."""
        self._array.write(np.ascontiguousarray(images[:, ::-1], np.float32))

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures, and of the buffer between them."""
        width, height = self._size
        return (2 * len(self.targets) + 1) * 16 * width * height

    def release(self) -> None:
        for one in self._owned:
            one.release()
