# SPDX-License-Identifier: MIT
"""``fragtracer_sphere_light``: the ``area`` emitter of a sphere, exact where the sphere is small or far away.

Mitsuba's sphere computes the solid angle 2 pi (1 - cos) of its cone with 1 - cos as a difference of float32 numbers,
and its ``area`` emitter has that error. Here 1 - cos is sin² / (1 + cos). Its parameters: ``center`` and
``radius``, those of the sphere that it is a child of, and ``radiance``, three numbers.
"""

import math
from typing import Any

from .records import empty_direction_sample

_ROUNDING = 1e-5  # relative, of the distance from the centre of a point on the sphere


def sphere_light_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class SphereLight(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.center, self.radius = mi.Point3f([float(x) for x in props["center"]]), float(props["radius"])
            self.radiance = mi.Color3f([float(x) for x in props["radiance"]])
            self.m_flags = mi.EmitterFlags.Surface

        def eval(self, si: Any, active: Any = True) -> Any:
            return dr.select(active & (si.wi.z > 0), self.radiance, 0)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            """A direction of the cone, all alike; from inside there is none, nor from its own surface."""
            towards = self.center - it.p
            distance = dr.norm(towards)
            one_minus_cos_max = dr.maximum(self._one_minus_cos_max(it.p), 1e-30)
            one_minus_cos = sample.x * one_minus_cos_max
            sine, cosine = dr.safe_sqrt(one_minus_cos * (2 - one_minus_cos)), 1 - one_minus_cos
            phi = 2 * math.pi * sample.y
            local = mi.Vector3f(sine * dr.cos(phi), sine * dr.sin(phi), cosine)
            ds = empty_direction_sample(mi, dr)
            ds.d = mi.Frame3f(towards / distance).to_world(local)
            nearest = distance * sine  # of the centre to the ray
            ds.dist = distance * cosine - dr.safe_sqrt((self.radius - nearest) * (self.radius + nearest))
            ds.n = dr.normalize(it.p + ds.dist * ds.d - self.center)
            ds.p, ds.time = self.center + self.radius * ds.n, it.time
            outside = active & (distance > self.radius * (1 + _ROUNDING))
            ds.pdf = dr.select(outside, 1 / (2 * math.pi * one_minus_cos_max), 0)
            return ds, dr.select(outside, self.radiance * (2 * math.pi * one_minus_cos_max), 0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            one_minus_cos_max = self._one_minus_cos_max(it.p)
            density = 1 / (2 * math.pi * dr.maximum(one_minus_cos_max, 1e-30))
            return dr.select(active & (one_minus_cos_max > 0), density, 0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return dr.select(active & (dr.dot(ds.d, ds.n) < 0), self.radiance, 0)

        def to_string(self) -> str:
            return f"FragtracerSphereLight[center={self.center}, radius={self.radius}, radiance={self.radiance}]"

        def _one_minus_cos_max(self, point: Any) -> Any:
            """Of the half angle of the cone that the sphere fills, 0 inside."""
            square = dr.squared_norm(self.center - point)
            sine2 = self.radius**2 / square
            return dr.select(sine2 < 1, sine2 / (1 + dr.safe_sqrt(1 - sine2)), 0)

    return SphereLight
