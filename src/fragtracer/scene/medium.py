# SPDX-License-Identifier: MIT
"""Participating media: what absorbs and scatters light between surfaces."""

from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import CONFIG, Reflectance, Strength, Triple

ALBEDO = 0.75  # where none is given, as of Mitsuba's media
_PAIRS = (("extinction", "mean_free_path"), ("extinction", "scattering"), ("mean_free_path", "scattering"))


@dataclass(frozen=True, config=CONFIG)
class Medium:
    """What light meets on its way, such as fog, smoke or the inside of wax (docs/media.md).

    It is given by its ``extinction`` coefficient σt in 1/m, or by the ``mean_free_path`` 1/σt in m, together with the
    ``albedo`` σs/σt of a single scattering; or by its ``scattering`` and ``absorption`` coefficients σs and σa in 1/m.
    Left out, the extinction is 1/m, the albedo 0.75. ``g`` is the mean cosine of the angle by which light is scattered
    (Henyey and Greenstein 1941): above 0 forwards, below 0 backwards.
    """

    extinction: Strength | None = None
    mean_free_path: Strength | None = None
    albedo: Reflectance | None = None
    scattering: Strength | None = None
    absorption: Strength | None = None
    g: Annotated[float, Field(gt=-1, lt=1)] = 0.0

    def __post_init__(self) -> None:
        for one, other in _PAIRS:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise ValueError(f"{one} and {other} both say how dense the medium is; give one of them")
        if (self.scattering is None) != (self.absorption is None):
            one, other = ("absorption", "scattering") if self.scattering is None else ("scattering", "absorption")
            raise ValueError(f"{one} must come with {other}; 0 is none")
        if self.scattering is not None and self.albedo is not None:
            raise ValueError("albedo is scattering / (scattering + absorption); leave albedo out")
        if self.mean_free_path is not None and min(self.mean_free_path) <= 0:
            raise ValueError("mean_free_path must be greater than 0; a large one is a thin medium")

    @property
    def sigma_t(self) -> Triple:
        """Extinction coefficient in 1/m."""
        if self.mean_free_path is not None:
            r, g, b = (1 / length for length in self.mean_free_path)
            return (r, g, b)
        if self.scattering is not None and self.absorption is not None:
            r, g, b = (s + a for s, a in zip(self.scattering, self.absorption, strict=True))
            return (r, g, b)
        return self.extinction or (1.0, 1.0, 1.0)

    @property
    def single_albedo(self) -> Triple:
        """What of extinction is scattering."""
        if self.scattering is not None:
            r, g, b = (s / t if t > 0 else 0.0 for s, t in zip(self.scattering, self.sigma_t, strict=True))
            return (r, g, b)
        return self.albedo or (ALBEDO, ALBEDO, ALBEDO)


@dataclass(frozen=True, config=CONFIG)
class Fog:
    """The medium that is everywhere where no shape has another one, without an end."""

    medium: str
