# SPDX-License-Identifier: MIT
"""The arrays that textures are read from (shaders/texture/texture.glsl)."""

from typing import Any

import moderngl
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.packing.atlas import Atlas

SAMPLERS = ("u_byte_texels", "u_float_texels")


class AtlasTextures:
    """Holds one atlas on the GPU, and uploads only another one."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._atlas: Atlas | None = None
        self._arrays: dict[str, moderngl.TextureArray] = {}

    def load(self, atlas: Atlas) -> None:
        """Take over another atlas. Raises :class:`DeviceError` if the GPU cannot hold it."""
        if atlas is self._atlas:
            return
        self.release()
        arrays: tuple[NDArray[Any], ...] = (atlas.bytes, atlas.floats)
        for name, array, dtype in zip(SAMPLERS, arrays, ("f1", "f4"), strict=True):
            layers, height, width, _ = array.shape
            if not layers:
                continue
            try:
                texture = self._ctx.texture_array((width, height, layers), 4, array.data, dtype=dtype)
            except moderngl.Error as error:
                size = f"{layers} times {width}x{height}"
                raise DeviceError(f"the GPU cannot hold textures of {size} texels together: {error}") from None
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._arrays[name] = texture
        self._atlas = atlas

    def use(self, first_unit: int) -> None:
        """Bind the arrays that there are, those of :data:`SAMPLERS` in order from ``first_unit`` on."""
        for unit, name in enumerate(SAMPLERS, first_unit):
            if name in self._arrays:
                self._arrays[name].use(unit)

    @property
    def gpu_bytes(self) -> int:
        """Size of the arrays."""
        return self._atlas.bytes.nbytes + self._atlas.floats.nbytes if self._atlas else 0

    def release(self) -> None:
        for texture in self._arrays.values():
            texture.release()
        self._arrays, self._atlas = {}, None
