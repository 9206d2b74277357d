# SPDX-License-Identifier: MIT
"""Reflectance at normal incidence of metals and dielectrics, linear Rec. 709."""

import numpy as np

from fragtracer.scene.microfacets import fresnel

METAL_F0: dict[str, tuple[float, float, float]] = {
    # Hoffman 2010, Background: Physically-Based Shading, table 1.
    "aluminium": (0.91, 0.92, 0.92),
    "copper": (0.95, 0.64, 0.54),
    "gold": (1.00, 0.71, 0.29),
    "iron": (0.56, 0.57, 0.58),
    "silver": (0.95, 0.93, 0.88),
    # Akenine-Möller et al. 2018, Real-Time Rendering, 4th edition, table 9.2, from measured spectra.
    "brass": (0.910, 0.778, 0.423),
    "chromium": (0.549, 0.556, 0.554),
    "nickel": (0.660, 0.609, 0.526),
    "palladium": (0.733, 0.697, 0.652),
    "platinum": (0.673, 0.637, 0.585),
    "titanium": (0.542, 0.497, 0.449),
    "zinc": (0.664, 0.824, 0.850),
}

Triple = tuple[float, float, float]

# Index of refraction and extinction coefficient, as colours: of the spectra that Mitsuba 3.9 has (luxpop.com's tables
# of optical constants; of nickel Palik 1985, Handbook of Optical Constants of Solids), weighted as Mitsuba does.
METAL_INDEX: dict[str, tuple[Triple, Triple]] = {
    "aluminium": ((1.6575, 0.880405, 0.521244), (9.22381, 6.2695, 4.837)),
    "chromium": ((4.36967, 2.91651, 1.6549), (5.20655, 4.23131, 3.7547)),
    "copper": ((0.201005, 0.92375, 1.10222), (3.91326, 2.45305, 2.14209)),
    "gold": ((0.143036, 0.375307, 1.44205), (3.983, 2.38556, 1.60336)),
    "iridium": ((3.0863, 2.08219, 1.61791), (5.59215, 4.06709, 3.26731)),
    "mercury": ((2.39894, 1.44003, 0.90957), (6.32759, 4.37192, 3.42176)),
    "molybdenum": ((4.48397, 3.52513, 2.77631), (4.11144, 3.42083, 3.15061)),
    "nickel": ((2.3673, 1.66337, 1.46708), (4.49881, 3.05015, 2.34544)),
    "silver": ((0.155276, 0.116728, 0.138388), (4.82835, 3.12222, 2.1469)),
    "tungsten": ((4.37082, 3.30025, 2.99841), (3.50064, 2.60487, 2.27323)),
}

# Hoffman 2010, table 1, too.
DIELECTRIC_F0: dict[str, float] = {
    "water": 0.02,
    "plastic": 0.03,
    "glass": 0.03,
    "plastic, high": 0.05,
    "glass, high": 0.08,
    "ruby": 0.08,
    "diamond": 0.17,
}


def reflectance_from_ior(ior: float) -> float:
    """Fresnel reflectance at normal incidence, ((n - 1) / (n + 1))², of ``ior`` against air."""
    return ((ior - 1) / (ior + 1)) ** 2


def conductor_reflectance(eta: Triple, k: Triple) -> Triple:
    """Fresnel reflectance at normal incidence of a conductor of index ``eta`` + i ``k``, each (3,)."""
    r, g, b = (((n - 1) ** 2 + e**2) / ((n + 1) ** 2 + e**2) for n, e in zip(eta, k, strict=True))
    return (r, g, b)


def internal_diffuse_transmittance(ior: float) -> float:
    """Share of diffuse light within a dielectric of index ``ior`` that its smooth surface passes: T / ior², T being
    what passes of diffuse light from outside, by quadrature of the exact Fresnel term."""
    x, weights = np.polynomial.legendre.leggauss(64)
    cosine = (x + 1) / 2
    reflected = float(weights @ (cosine * fresnel(cosine, ior)))
    return (1 - reflected) / ior**2


def grazing_reflectance(f0: float) -> float:
    """Reflectance at grazing incidence of a surface with reflectance ``f0`` at normal incidence.

    1 for real materials. Below an ``f0`` of 0.02, that of water, it falls in proportion to 0, so that
    an ``f0`` of 0 reflects nothing at any angle (Lagarde and de Rousiers 2014, Moving
    Frostbite to Physically Based Rendering, section 3.1.2).
    """
    return min(1.0, 50 * f0)
