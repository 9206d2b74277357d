# SPDX-License-Identifier: MIT
"""A thin film on facets: what it makes of their Fresnel term, by Airy's sum at every tenth nanometre.

What red, green and blue see is by the curves of CIE 1931, which Mitsuba has, of light of the illuminant D65.

References
----------
- Airy 1833, "On the phaenomena of Newton's rings when formed between two transparent substances of different refractive
  powers".
- CIE 2018, "CIE standard illuminant D65" (from 380 nm, relative to 560 nm), doi:10.25039/CIE.DS.hjfjmt59.
- IEC 61966-2-1 1999, "Default RGB colour space – sRGB" (the matrix).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

_FIRST, _STEP = 380, 10  # nm
_D65 = (
    *(49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811),
    *(109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991),
    *(87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856),
    *(75.087, 63.5927, 46.4182, 66.8054, 63.3828),
)
_FROM_XYZ = ((3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.204, 1.057))
_LEAST_COSINE = 1e-4
_LARGEST_ROOT = 0.9999  # of F0


def sensitivities(step: int = _STEP) -> tuple[Any, Any]:
    """Wavelengths in nm (n,), and what red, green and blue see of white light there, (n, 3) with the sums 1."""
    import mitsuba as mi

    known = _FIRST + _STEP * np.arange(len(_D65))
    wavelengths = np.arange(_FIRST, known[-1] + step, step)
    curve: Any = mi.cie1931_xyz
    curves = np.array([[float(np.ravel(c)[0]) for c in curve(float(at))] for at in wavelengths])
    seen = np.interp(wavelengths, known, _D65)[:, None] * curves @ np.transpose(_FROM_XYZ)
    return wavelengths, seen / seen.sum(0)


@lru_cache(maxsize=4)
def _table(variant: str) -> list[tuple[float, list[float]]]:
    wavelengths, seen = sensitivities()
    return list(zip(wavelengths.tolist(), seen.tolist(), strict=True))


@dataclass(frozen=True)
class ThinFilm:
    """A film of a ``weight``, an ``index`` of refraction and a ``thickness`` in nm."""

    weight: Any
    index: Any
    thickness: Any

    def change(self, c: Any, f0: Any, f90: Any) -> Any:
        """What is reflected at a cosine with the film, less what is without it, by Schlick's term of F0 and F90."""
        import drjit as dr
        import mitsuba as mi

        share = self.weight * dr.clip(c / _LEAST_COSINE, 0, 1)
        c = dr.clip(c, _LEAST_COSINE, 1)
        root = dr.minimum(dr.sqrt(f0), _LARGEST_ROOT)
        base = (1 + root) / (1 - root)
        sin2 = 1 - dr.square(c)
        in_film, in_base = dr.sqrt(1 - sin2 / dr.square(self.index)), dr.sqrt(1 - sin2 / dr.square(base))
        # Amplitudes at the film and within it at the base, perpendicular and parallel.
        amplitudes = [
            (_ratio(c, self.index * in_film), _ratio(self.index * in_film, base * in_base)),
            (_ratio(self.index * c, in_film), _ratio(base * in_film, self.index * in_base)),
        ]
        bare, filmed = mi.Color3f(0), mi.Color3f(0)
        for r, s in amplitudes:
            bare += dr.square((r + s) / (1 + r * s)) / 2
        for wavelength, seen in _table(mi.variant()):
            cosine = dr.cos(4 * dr.pi / wavelength * self.index * self.thickness * in_film)
            for r, s in amplitudes:
                twice = 2 * r * s * cosine
                squares = dr.square(r) + dr.square(s)
                filmed += mi.Color3f(seen) / 2 * (squares + twice) / (1 + dr.square(r * s) + twice)
        schlick = f0 + (f90 - f0) * (1 - c) ** 5
        more = 1 - (1 - schlick) * (1 - filmed) / dr.maximum(1 - bare, 1e-6)
        less = schlick * filmed / dr.maximum(bare, 1e-6)
        return share * (dr.clip(dr.select(filmed < bare, less, more), 0, 1) - schlick)


def _ratio(a: Any, b: Any) -> Any:
    return (a - b) / (a + b)
