# SPDX-License-Identifier: MIT
"""Participating media: what absorbs and scatters light between surfaces."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.content import Content, content_digest, read_only
from fragtracer.scene.fields import CONFIG, Point, Reflectance, Strength, Triple, as_tuple

ALBEDO = 0.75  # where none is given, as of Mitsuba's media
_PAIRS = (("extinction", "mean_free_path"), ("extinction", "scattering"), ("mean_free_path", "scattering"))

Box = Annotated[tuple[Point, Point], BeforeValidator(as_tuple)]


class Density(Content):
    """A grid of densities; two are equal if their content is.

    ``values`` is (z, y, x), float32, at the centres of voxels, as in Mitsuba; between them it is interpolated. ``file``
    is the file they were read from, if any.

    Raises ``ValueError`` for an array of another kind.
    """

    def __init__(self, values: ArrayLike, file: str | None = None) -> None:
        array = np.asarray(values)
        if array.ndim != 3 or array.size == 0:
            raise ValueError(f"a grid of densities is (z, y, x) numbers, of rank 3, got {array.shape}")
        if array.dtype.kind not in "fiu":
            raise ValueError(f"densities are numbers, got {array.dtype}")
        self.values: NDArray[np.float32] = read_only(array, np.float32)
        if not np.isfinite(self.values).all():
            count = int((~np.isfinite(self.values)).sum())
            raise ValueError(f"densities must be finite; {count} are not, which numpy.nan_to_num would mend")
        if self.values.min() < 0:
            raise ValueError(f"densities must not be negative, the least is {self.values.min():g}")
        self.file = file
        self.digest = content_digest(self.values)


@dataclass(frozen=True, config=CONFIG)
class Medium:
    """What light meets on its way, such as fog, smoke or the inside of wax (docs/media.md).

    It is given by its ``extinction`` coefficient σt in 1/m, or by the ``mean_free_path`` 1/σt in m, together with the
    ``albedo`` σs/σt of a single scattering; or by its ``scattering`` and ``absorption`` coefficients σs and σa in 1/m.
    Left out, the extinction is 1/m, the albedo 0.75. ``g`` is the mean cosine of the angle by which light is scattered
    (Henyey and Greenstein 1941): above 0 forwards, below 0 backwards.

    A grid of ``density`` multiplies the extinction within a box, the two corners ``bounds`` in m of the world; there is
    nothing outside of it.
    """

    extinction: Strength | None = None
    mean_free_path: Strength | None = None
    albedo: Reflectance | None = None
    scattering: Strength | None = None
    absorption: Strength | None = None
    g: Annotated[float, Field(gt=-1, lt=1)] = 0.0
    density: Density | None = None
    bounds: Box | None = None

    def __post_init__(self) -> None:
        for one, other in _PAIRS:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise ValueError(f"{one} and {other} both say how dense the medium is; give one of them")
        if (self.scattering is None) != (self.absorption is None):
            one, other = ("absorption", "scattering") if self.scattering is None else ("scattering", "absorption")
            raise ValueError(f"{one} must come with {other}; 0 is none")
        if self.scattering is not None and self.albedo is not None:
            raise ValueError("albedo is scattering / (scattering + absorption); leave albedo out")
        if (self.density is None) != (self.bounds is None):
            one, other = ("bounds", "density") if self.density is None else ("density", "bounds")
            raise ValueError(f"{one} must come with {other}, the box of the grid; [[-1, 0, -1], [1, 2, 1]] is one")
        if self.bounds is not None and not all(low < high for low, high in zip(*self.bounds, strict=True)):
            raise ValueError("bounds must be two corners, each number of the first less than that of the second")
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
