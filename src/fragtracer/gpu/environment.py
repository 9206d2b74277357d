# SPDX-License-Identifier: MIT
"""The textures that an environment is read from."""

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.packing.environment import EnvironmentTables

WIDTH = 4096  # ENVIRONMENT_WIDTH of emitter/environment.glsl


class EnvironmentTextures:
    """Holds the tables of one environment on the GPU, and uploads only what has changed."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._tables: EnvironmentTables | None = None
        self._textures: list[moderngl.Texture] = []

    def load(self, tables: EnvironmentTables | None) -> None:
        """Take over other tables, or none. Raises :class:`DeviceError` if the GPU cannot hold them."""
        if tables is self._tables:
            return
        self.release()
        if tables is not None:
            try:
                self._textures = [folded_texture(self._ctx, texels) for texels in (tables.texels, tables.tree)]
            except moderngl.Error as error:
                width, height = tables.size
                raise DeviceError(f"the GPU cannot hold an environment of {width}x{height} pixels: {error}") from None
        self._tables = tables

    def use(self, map_unit: int, tree_unit: int) -> None:
        """Bind the textures, if there are any, to their units."""
        for texture, unit in zip(self._textures, (map_unit, tree_unit), strict=False):
            texture.use(unit)

    @property
    def gpu_bytes(self) -> int:
        """Size of the textures."""
        return sum(texture.width * texture.height * (8 if texture.dtype == "f2" else 16) for texture in self._textures)

    def release(self) -> None:
        for texture in self._textures:
            texture.release()
        self._textures, self._tables = [], None


def folded_texture(ctx: moderngl.Context, texels: NDArray[Any]) -> moderngl.Texture:
    """A texture of ``texels``, float16, float32 or uint32 (n, 4), in rows of WIDTH."""
    whole = len(texels) // WIDTH
    rows = -(-len(texels) // WIDTH)
    texture = ctx.texture((WIDTH, rows), 4, dtype=f"{texels.dtype.kind}{texels.dtype.itemsize}")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    if whole:
        texture.write(texels[: whole * WIDTH].data, (0, 0, WIDTH, whole))
    if rows > whole:
        last = np.zeros((WIDTH, 4), texels.dtype)
        last[: len(texels) - whole * WIDTH] = texels[whole * WIDTH :]
        texture.write(last.data, (0, whole, WIDTH, 1))
    return texture
