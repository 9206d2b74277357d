# SPDX-License-Identifier: MIT
"""The textures that meshes are read from."""

import moderngl

from fragtracer.errors import DeviceError
from fragtracer.gpu.tables import WIDTH, folded_texture
from fragtracer.packing.meshes import PackedMeshes


class MeshTextures:
    """Holds the meshes of one scene on the GPU, and uploads only what has changed."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._meshes: PackedMeshes | None = None
        self._textures: dict[str, moderngl.Texture] = {}

    def load(self, meshes: PackedMeshes | None) -> None:
        """Take over other meshes, or none. Raises :class:`DeviceError` if the GPU cannot hold them."""
        if meshes is self._meshes:
            return
        self.release()
        self._textures = {} if meshes is None else mesh_textures(self._ctx, meshes)
        self._meshes = meshes

    def use(self, units: dict[str, int]) -> None:
        """Bind the textures, if there are any, to the units of their samplers."""
        for sampler, texture in self._textures.items():
            texture.use(units[sampler])

    @property
    def gpu_bytes(self) -> int:
        """Size of the textures."""
        return sum(16 * texture.width * texture.height for texture in self._textures.values())

    def release(self) -> None:
        for texture in self._textures.values():
            texture.release()
        self._textures, self._meshes = {}, None


def mesh_textures(ctx: moderngl.Context, meshes: PackedMeshes) -> dict[str, moderngl.Texture]:
    """The textures by sampler. Raises :class:`DeviceError` if the GPU cannot hold them."""
    made: dict[str, moderngl.Texture] = {}
    most = int(ctx.info["GL_MAX_TEXTURE_SIZE"])
    for sampler, texels in meshes.textures.items():
        try:
            if len(texels) > WIDTH * most:
                raise moderngl.Error(f"its textures have {most} rows at most")
            made[sampler] = folded_texture(ctx, texels)
        except moderngl.Error as error:
            for texture in made.values():
                texture.release()
            size = sum(table.nbytes for table in meshes.textures.values())
            raise DeviceError(f"the GPU cannot hold the meshes, {size / 1e6:,.0f} MB: {error}") from None
    return made
