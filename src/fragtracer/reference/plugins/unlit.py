# SPDX-License-Identifier: MIT
"""``fragtracer_unlit``: a surface that emits its colour to both sides and is never sampled as a light.

Its parameters: ``albedo`` (three numbers), the children ``albedo_texture`` and ``alpha_texture`` with their sets
of coordinates, ``opacity``, ``alpha_mode``, ``alpha_cutoff``, ``double_sided``, ``has_color`` and ``has_alpha``, all as
those of ``fragtracer_surface``, which has the opacity; and ``of``, the name of its shape: of emitters that are equal
Mitsuba makes one, which no two shapes can have.
"""

from typing import Any

from .records import empty_direction_sample
from .surface import surface_class


def unlit_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""
    surface = surface_class(mi, dr)

    class Unlit(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.surface, self.of = surface(props), str(props["of"])
            self.m_flags = mi.EmitterFlags.Surface | mi.EmitterFlags.SpatiallyVarying

        def eval(self, si: Any, active: Any = True) -> Any:
            shown = self.surface.albedo_at(si, active) * self.surface.opacity_at(si, active)
            return dr.select(active, shown, 0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            """Nothing: it is not sampled as a light."""
            return empty_direction_sample(mi, dr), mi.Color3f(0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0)

        def to_string(self) -> str:
            return f"FragtracerUnlit[of={self.of}, {self.surface}]"

    return Unlit
