# SPDX-License-Identifier: MIT
"""Light that no shape of the scene gives."""

import numpy as np
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import CONFIG, NonNegative, Strength, Triple, Vector


@dataclass(frozen=True, config=CONFIG)
class Light:
    """A spherical light, black where it is lit itself.

    Exactly one of ``power`` (watts in all directions together, per colour channel; unchanged by the
    radius) and ``radiance`` (W/m²/sr at its surface) is given. Radius 0 is a point light, which
    casts hard shadows, cannot be seen and needs ``power``.
    """

    position: Vector
    radius: NonNegative = 0.0
    power: Strength | None = None
    radiance: Strength | None = None

    def __post_init__(self) -> None:
        if (self.power is None) == (self.radiance is None):
            raise ValueError("give either power (watts) or radiance (W/m²/sr), and only one of them")
        if self.radius == 0 and self.power is None:
            raise ValueError("a light of radius 0 has no surface to have a radiance; give its power instead")

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
class Ambient:
    """The same radiance (W/m²/sr) from everywhere that no object hides."""

    radiance: Strength = (0.0, 0.0, 0.0)
