# SPDX-License-Identifier: MIT
"""``fragtracer_spot``: a spot light with the smooth edge of glTF 2.0.

Mitsuba's own ``spot`` falls off linearly in the angle. This one is constant up to ``inner_degrees`` from its axis
and falls as t² to 0 at ``outer_degrees``, t being linear in the cosine of the angle (Khronos Group,
KHR_lights_punctual, "Inner and Outer Cone Angles"). Its other parameters: ``position``, ``direction`` (of any length)
and ``intensity`` (radiant intensity on the axis), three numbers each.
"""

import math
from typing import Any

from .records import empty_direction_sample


def spot_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class Spot(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            position, direction, intensity = (
                [float(x) for x in props[name]] for name in ("position", "direction", "intensity")
            )
            length = math.hypot(*direction)
            self.position, self.intensity = mi.Point3f(position), mi.Color3f(intensity)
            self.axis = mi.Vector3f([x / length for x in direction])
            self.cos_inner = math.cos(math.radians(float(props["inner_degrees"])))
            self.cos_outer = math.cos(math.radians(float(props["outer_degrees"])))
            self.m_flags = mi.EmitterFlags.DeltaPosition

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = empty_direction_sample(mi, dr)
            ds.p, ds.time, ds.pdf, ds.delta = self.position, it.time, mi.Float(1), mi.Bool(True)
            to_light = self.position - it.p
            ds.dist = dr.norm(to_light)
            ds.d = to_light / ds.dist
            cosine = -dr.dot(ds.d, self.axis)
            t = dr.clip((cosine - self.cos_outer) / (self.cos_inner - self.cos_outer), 0, 1)
            return ds, dr.select(active, self.intensity * dr.square(t / ds.dist), 0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0)

        def to_string(self) -> str:
            return f"FragtracerSpot[position={self.position}, axis={self.axis}, intensity={self.intensity}]"

    return Spot
