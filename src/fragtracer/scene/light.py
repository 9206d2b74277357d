# SPDX-License-Identifier: MIT
"""Lights that are not emissive shapes, and ambient light."""

from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import (
    CONFIG,
    LARGEST,
    Many,
    NonNegative,
    Point,
    Strength,
    Triple,
    Vector,
    kinds_of,
    length,
)

NARROWEST_SPOT = 0.001  # degrees: to smaller angles float32 knows directions too coarsely

__all__ = ["Ambient", "DirectionalLight", "Light", "SpotLight"]


@dataclass(frozen=True, config=CONFIG)
class Light:
    """A spherical light; its surface reflects nothing.

    Exactly one of ``power`` (radiant flux in W per colour channel, independent of the
    radius) and ``radiance`` (W/m²/sr at its surface) is given. Radius 0 is a point light, which
    casts hard shadows, is invisible and needs ``power``.
    """

    position: Point
    radius: NonNegative = 0.0
    power: Strength | None = None
    radiance: Strength | None = None

    def __post_init__(self) -> None:
        if (self.power is None) == (self.radiance is None):
            raise ValueError("give either power (watts) or radiance (W/m²/sr), and only one of them")
        if self.radius == 0 and self.power is None:
            raise ValueError("a light of radius 0 has no surface to have a radiance; give its power instead")
        if self.radius > 0 and self.power is not None and max(self.power) >= LARGEST * 4 * np.pi**2 * self.radius**2:
            raise ValueError("the radius is so small that the radiance is no float32; radius 0 is a point light")

    @property
    def surface_radiance(self) -> Triple:
        """Radiance of the surface in W/m²/sr, power / (4 π² radius²); needs a radius above 0."""
        if self.radiance is not None:
            return self.radiance
        assert self.power is not None
        r, g, b = (p / (4 * np.pi**2 * self.radius**2) for p in self.power)
        return (r, g, b)

    @property
    def intensity(self) -> Triple:
        """Radiant intensity of a point light in W/sr, power / 4 π."""
        assert self.power is not None
        r, g, b = (p / (4 * np.pi) for p in self.power)
        return (r, g, b)


@dataclass(frozen=True, config=CONFIG)
class SpotLight:
    """A point light that emits into a cone around ``direction`` (of any length), away from ``position``.

    ``intensity`` is the radiant intensity on the axis in W/sr. It is constant up to ``inner_degrees`` from
    the axis and falls to 0 at ``outer_degrees`` as t², t being linear in the cosine of the angle
    (Khronos Group, KHR_lights_punctual, "Inner and Outer Cone Angles").
    """

    position: Point
    direction: Vector
    intensity: Strength
    inner_degrees: Annotated[float, Field(ge=0, lt=90)] = 0.0
    outer_degrees: Annotated[float, Field(ge=NARROWEST_SPOT, le=90)] = 45.0

    def __post_init__(self) -> None:
        if not length(self.direction) > 0:
            raise ValueError("direction must not have length zero; [0, -1, 0] points down")
        if not self.inner_degrees < self.outer_degrees:
            raise ValueError(f"inner_degrees must be less than outer_degrees, {self.outer_degrees:g}")

    @property
    def power(self) -> Triple:
        """Radiant flux in W, the integral of the intensity over the cone."""
        inner, outer = 2 * np.sin(np.radians([self.inner_degrees, self.outer_degrees]) / 2) ** 2  # 1 - cos
        solid_angle = float(2 * np.pi * (2 * inner + outer) / 3)
        r, g, b = (solid_angle * i for i in self.intensity)
        return (r, g, b)


@dataclass(frozen=True, config=CONFIG)
class DirectionalLight:
    """Light from infinitely far away that travels along ``direction`` (of any length).

    ``irradiance`` is what a surface that faces the light receives, in W/m².
    """

    direction: Vector
    irradiance: Strength

    def __post_init__(self) -> None:
        if not length(self.direction) > 0:
            raise ValueError("direction must not have length zero; [0, -1, 0] points down")


@dataclass(frozen=True, config=CONFIG, kw_only=True)
class LightLists:
    """The lights of a scene. The tables of a scene file have the names of the fields without their s."""

    lights: Many[Light] = ()
    spot_lights: Many[SpotLight] = ()
    directional_lights: Many[DirectionalLight] = ()


LIGHTS = kinds_of(LightLists)


@dataclass(frozen=True, config=CONFIG)
class Ambient:
    """The same radiance (W/m²/sr) from all directions, occluded by objects."""

    radiance: Strength = (0.0, 0.0, 0.0)
