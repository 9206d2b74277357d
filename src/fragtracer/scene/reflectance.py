# SPDX-License-Identifier: MIT
"""Reflectance at normal incidence of metals and dielectrics, linear Rec. 709."""

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


def grazing_reflectance(f0: float) -> float:
    """Reflectance at grazing incidence of a surface with reflectance ``f0`` at normal incidence.

    1 for real materials. Below an ``f0`` of 0.02, that of water, it falls in proportion to 0, so that
    an ``f0`` of 0 reflects nothing at any angle (Lagarde and de Rousiers 2014, Moving
    Frostbite to Physically Based Rendering, section 3.1.2).
    """
    return min(1.0, 50 * f0)
