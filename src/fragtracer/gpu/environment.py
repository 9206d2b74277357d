# SPDX-License-Identifier: MIT
"""The textures that an environment is read from."""

import moderngl

from fragtracer.errors import DeviceError
from fragtracer.gpu.tables import folded_texture
from fragtracer.packing.environment import EnvironmentTables


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
