# SPDX-License-Identifier: MIT
"""The textures that the split-sum integrator looks up (shaders/split_sum/maps.glsl)."""

from typing import Any

import moderngl
import numpy as np

from fragtracer.gpu.cube_maps import MapSizes, brdf_map, environment_maps, texture_of
from fragtracer.packing.environment import EnvironmentTables

_SIZES = MapSizes()
_NAMES = ("u_irradiance_map", "u_prefiltered_map", "u_brdf_map")


class MapTextures:
    """Holds the maps of one environment on the GPU; makes them when they are first wanted."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._tables: EnvironmentTables | None = None
        self._textures: dict[str, moderngl.Texture] = {}

    def load(self, tables: EnvironmentTables | None) -> None:
        """Take over the maps of another environment, in the unit of its tables, or of none."""
        if not self._textures:
            self._put("u_brdf_map", brdf_map(self._ctx, "KARIS_ENVIRONMENT", _SIZES))
            self._textures["u_brdf_map"].repeat_x = False
        elif tables is self._tables:
            return
        black = np.zeros((1, 1, 3), np.float32)
        maps = {"irradiance": black, "prefiltered": black}
        if tables is not None:
            width, height = tables.size
            pixels = tables.texels[:, :3].astype(np.float32).reshape(height, width, 3)
            maps = environment_maps(self._ctx, pixels, _SIZES)
        for name, pixels in maps.items():
            self._put(f"u_{name}_map", pixels)
        self._tables = tables

    def has(self, tables: EnvironmentTables | None) -> bool:
        """Whether :meth:`load` has nothing to do."""
        return bool(self._textures) and tables is self._tables

    def _put(self, name: str, pixels: Any) -> None:
        if name in self._textures:
            self._textures[name].release()
        self._textures[name] = texture_of(self._ctx, pixels)

    @staticmethod
    def uniforms(first_unit: int) -> dict[str, int]:
        """What a program needs to know of the maps."""
        sizes = {
            "u_irradiance_size": _SIZES.irradiance,
            "u_prefiltered_size": _SIZES.prefiltered,
            "u_prefiltered_levels": _SIZES.levels,
        }
        return {name: first_unit + i for i, name in enumerate(_NAMES)} | sizes

    def use(self, first_unit: int) -> None:
        """Bind the textures, if there are any, to three units."""
        for name, texture in self._textures.items():
            texture.use(first_unit + _NAMES.index(name))

    @property
    def gpu_bytes(self) -> int:
        """Size of the textures."""
        return sum(12 * texture.width * texture.height for texture in self._textures.values())

    def release(self) -> None:
        for texture in self._textures.values():
            texture.release()
        self._textures, self._tables = {}, None
