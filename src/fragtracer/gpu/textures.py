# SPDX-License-Identifier: MIT
"""The textures that a scene is read from: each on its unit, and uploaded only where it has changed."""

from collections.abc import Iterable, Mapping
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import has_images
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.packing import Table

WIDTH = 4096  # of a folded texture, as shaders/scene/storage.glsl and light/environment.glsl have it
_WRITTEN = 1024  # rows of it that are converted at a time

# The texture unit of each sampler; every driver has 16.
UNITS = {
    name: unit
    for unit, name in enumerate(
        (
            *("u_random_texture", "u_film_mean", "u_film_variance", "u_film_half_difference", "u_work"),
            *("u_scene", "u_shapes", "u_vertices", "u_mesh_lights"),
            *("u_byte_texels", "u_float_texels", "u_environment", "u_environment_tree"),
            *("u_irradiance_map", "u_prefiltered_map", "u_brdf_map"),
        )
    )
}
# All 16 are taken: the guiding, of programs that trace paths, has that of a map that they do not look up.
UNITS["u_guiding"] = UNITS["u_brdf_map"]
UNITS["u_layers"] = UNITS["u_work"]  # and a program that draws layers has no lists of work
_WHAT = {
    "u_shapes": "the shapes and meshes of the scene",
    "u_vertices": "the vertices of the meshes",
    "u_byte_texels": "the textures",
    "u_float_texels": "the textures",
    "u_environment": "the environment",
    "u_environment_tree": "the environment",
}
Texture = moderngl.Texture | moderngl.TextureArray


class _BoundTextures:
    """Textures by the names of their samplers."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures: dict[str, Texture] = {}

    def use(self, program: FullscreenProgram) -> None:
        """Have ``program`` read every texture, at its unit."""
        for name, texture in self._textures.items():
            program.use(name, texture, UNITS[name])

    @property
    def gpu_bytes(self) -> int:
        """Size of the textures."""
        return sum(_bytes(texture) for texture in self._textures.values())

    def release(self) -> None:
        for name in list(self._textures):
            self._forget(name)

    def _forget(self, name: str) -> None:
        if name in self._textures:
            self._textures.pop(name).release()


class SceneTextures(_BoundTextures):
    """Holds the tables of one scene on the GPU."""

    def __init__(self, ctx: moderngl.Context) -> None:
        super().__init__(ctx)
        self._tables: dict[str, Table] = {}

    def load(self, tables: Mapping[str, Table]) -> None:
        """Take over other tables. Parts that are the same arrays as before are not uploaded again.

        Raises :class:`DeviceError` if the GPU cannot hold them.
        """
        for name in self._textures.keys() - tables.keys():
            self._forget(name)
        for name, table in tables.items():
            if not any(part.size for part in table):
                self._forget(name)
            elif not _is_same(table, self._tables.get(name, ())):
                self._put(name, table)

    def _put(self, name: str, table: Table) -> None:
        before, texture = self._tables.pop(name, ()), self._textures.get(name)  # unknown until all is written
        if texture is None or not before or _shape(before) != _shape(table) or before[0].dtype != table[0].dtype:
            self._forget(name)
            before, texture = (), self._made(name, table)
            self._textures[name] = texture
        if isinstance(texture, moderngl.TextureArray):
            texture.write(table[0].data)
        else:
            row, lie_alike = 0, [*map(_rows, before)] == [*map(_rows, table)]
            for i, part in enumerate(table):
                if not lie_alike or part is not before[i]:
                    _write_rows(texture, part, row)
                row += _rows(part)
        self._tables[name] = table

    def _made(self, name: str, table: Table) -> Texture:
        kind = "f1" if table[0].dtype == np.uint8 else f"{table[0].dtype.kind}{table[0].dtype.itemsize}"
        if kind == "f2" and has_images(self._ctx):
            kind = "f4"  # images say in the source what they hold
        try:
            if table[0].ndim == 4:
                layers, height, width, _ = table[0].shape
                texture: Texture = self._ctx.texture_array((width, height, layers), 4, dtype=kind)
            else:
                width, height = _shape(table)
                if height > (most := int(self._ctx.info["GL_MAX_TEXTURE_SIZE"])):
                    raise moderngl.Error(f"textures have {most} rows at most")
                texture = self._ctx.texture((width, height), 4, dtype=kind)
        except moderngl.Error as error:
            size = sum(part.nbytes for part in table) / 1e6
            what = _WHAT.get(name, "the scene")
            raise DeviceError(f"the GPU cannot hold {what}, {size:,.0f} MB: {error}") from None
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _forget(self, name: str) -> None:
        super()._forget(name)
        self._tables.pop(name, None)


class MapTextures(_BoundTextures):
    """The maps of the split-sum approximation (shaders/light/maps.glsl), filtered linearly."""

    def put(self, maps: Mapping[str, NDArray[np.float32]]) -> None:
        """Take over maps (rows, columns, 3), row 0 the lowest, by the names of their samplers."""
        for name, pixels in maps.items():
            self._forget(name)
            height, width, _ = pixels.shape
            texture = self._ctx.texture((width, height), 3, np.ascontiguousarray(pixels).data, dtype="f4")
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.repeat_x = texture.repeat_y = False
            self._textures[name] = texture


def _is_same(table: Table, before: Table) -> bool:
    return len(table) == len(before) and all(a is b for a, b in zip(table, before, strict=True))


def _rows(part: NDArray[Any]) -> int:
    return max(1, -(-len(part) // WIDTH))


def _shape(table: Table) -> tuple[int, ...]:
    """Width and height of the texture of a table, or the shape of an array of layers."""
    return table[0].shape if table[0].ndim == 4 else (WIDTH, sum(_rows(part) for part in table))


def _write_rows(texture: moderngl.Texture, part: NDArray[Any], row: int) -> None:
    """Write texels (n, 4) from the beginning of a row on."""
    for first in range(0, len(part), _WRITTEN * WIDTH):
        piece = part[first : first + _WRITTEN * WIDTH]
        if texture.dtype == "f4":
            piece = piece.astype(np.float32, copy=False)
        whole = len(piece) // WIDTH
        if whole:
            texture.write(np.ascontiguousarray(piece[: whole * WIDTH]).data, (0, row, WIDTH, whole))
        if len(piece) > whole * WIDTH:
            rest = np.ascontiguousarray(piece[whole * WIDTH :])
            texture.write(rest.data, (0, row + whole, len(rest), 1))
        row += whole


def _bytes(texture: Texture) -> int:
    return texture.width * texture.height * getattr(texture, "layers", 1) * texture.components * int(texture.dtype[1])


def folded_textures(ctx: moderngl.Context, tables: Mapping[str, Table], names: Iterable[str]) -> dict[str, Texture]:
    """Textures of some tables by sampler, for a program of one's own; the caller releases them."""
    textures = SceneTextures(ctx)
    textures.load({name: tables[name] for name in names if name in tables})
    return textures._textures
