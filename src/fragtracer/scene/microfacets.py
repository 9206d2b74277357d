# SPDX-License-Identifier: MIT
"""What a rough interface of two dielectrics reflects and passes, by quadrature over its GGX facets."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_FACETS = 40  # nodes of the quadrature, for each of two coordinates
_ANGLES = 32  # and for an angle, on each side of the critical one


def fresnel(cosine: ArrayLike, eta: float) -> Floats:
    """What a smooth interface reflects of unpolarised light, 1 where it reflects all; ``eta`` is the index of
    refraction beyond it over that before it."""
    c = np.asarray(cosine, np.float64)
    refracted = np.sqrt(np.maximum(1 - (1 - c**2) / eta**2, 0))
    parallel = (eta * c - refracted) / (eta * c + refracted)
    perpendicular = (c - eta * refracted) / (c + eta * refracted)
    return np.where(1 - c**2 < eta**2, (parallel**2 + perpendicular**2) / 2, 1.0)


def rough_interface(alpha: float, eta: float, cosine: ArrayLike) -> tuple[Floats, Floats]:
    """Shares of light that the facets reflect and pass, each (n,), of light that arrives at the angles ``cosine`` (n,)
    to the mean normal.

    By single scattering: the Fresnel term of the facets visible from there, and Smith's shadowing of what leaves them
    (Walter et al. 2007, with the visible normals of Dupuy and Benyoub 2023). They add up to less than 1.
    """
    c = np.asarray(cosine, np.float64)[:, None]
    x, weights = np.polynomial.legendre.leggauss(_FACETS)
    turns = (np.arange(_FACETS) + 0.5) / _FACETS  # of half a circle: the other half is its mirror image
    height, angle = (grid.ravel() for grid in np.meshgrid((x + 1) / 2, np.pi * turns, indexing="ij"))
    shares = np.repeat(weights / 2 / _FACETS, _FACETS)
    stretched = np.sqrt(alpha**2 * (1 - c**2) + c**2)
    side, up = alpha * np.sqrt(1 - c**2) / stretched, c / stretched
    z = (1 - height) * (1 + up) - up
    radius = np.sqrt(np.maximum(1 - z**2, 0))
    wh_x, wh_y, wh_z = alpha * (radius * np.cos(angle) + side), alpha * radius * np.sin(angle), np.maximum(z + up, 0)
    wh_x, wh_z = (axis / np.sqrt(wh_x**2 + wh_y**2 + wh_z**2) for axis in (wh_x, wh_z))
    cos_o = np.sqrt(1 - c**2) * wh_x + c * wh_z
    reflectance = fresnel(cos_o, eta)
    refracted = np.sqrt(np.maximum(1 - (1 - cos_o**2) / eta**2, 0))
    above, below = 2 * cos_o * wh_z - c, (refracted - cos_o / eta) * wh_z + c / eta
    reflected = (shares * reflectance * _unshadowed(alpha, above)).sum(axis=1)
    return reflected, (shares * (1 - reflectance) * _unshadowed(alpha, below)).sum(axis=1)


def _unshadowed(alpha: float, cosine: Floats) -> Floats:
    """Smith's G1 of GGX, 0 below the horizon."""
    c2 = np.maximum(cosine, 1e-30) ** 2
    return np.where(cosine > 0, 2 / (1 + np.sqrt(1 + alpha**2 * (1 / c2 - 1))), 0.0)


@lru_cache(maxsize=256)
def internal_reflectance(alpha: float, ior: float) -> float:
    """Share of diffuse light within a dielectric of index ``ior`` that the facets of its surface reflect."""
    x, weights = np.polynomial.legendre.leggauss(_ANGLES)
    critical = np.sqrt(1 - 1 / ior**2)
    total = 0.0
    for low, high in ((0.0, critical), (critical, 1.0)):
        cosine = low + (high - low) * (x + 1) / 2
        total += (high - low) * float(weights @ (cosine * rough_interface(alpha, 1 / ior, cosine)[0]))
    return total
