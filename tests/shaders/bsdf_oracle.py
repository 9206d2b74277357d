# SPDX-License-Identifier: MIT
"""The BSDFs in float64: the formulas of their literature, not of the shader's code.

Arguments broadcast; directions are (..., 3), local, with z = normal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from . import Floats

Direction = tuple[float, float, float]

REC_709 = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Material:
    """Of BSDF_COOK_TORRANCE."""

    diffuse: Direction = (0.0, 0.0, 0.0)
    alpha: float = 1.0
    f0: Direction = (0.0, 0.0, 0.0)
    f90: Direction = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Lambert:
    """Of BSDF_DIFFUSE."""

    diffuse: Direction


@dataclass(frozen=True)
class Filmed(Material):
    """With a thin film on its facets, of a thickness in nm."""

    iridescence: float = 0.0
    iridescence_ior: float = 1.3
    iridescence_thickness: float = 400.0


def lambert_eval(p: Lambert, wo: Floats, wi: Floats) -> Floats:
    """albedo / pi cos_i."""
    return np.multiply(p.diffuse, wi[..., 2:] / np.pi)


def lambert_pdf(p: Lambert, wo: Floats, wi: Floats) -> Floats:
    return wi[..., 2] / np.pi


def fresnel(f0: ArrayLike, f90: ArrayLike, cosine: ArrayLike) -> Floats:
    """Schlick's approximation, (..., 3)."""
    grazing = (1 - np.asarray(cosine, np.float64)[..., None]) ** 5
    return np.asarray(f0, np.float64) * (1 - grazing) + np.asarray(f90, np.float64) * grazing


def fresnel_dielectric(cosine: ArrayLike, eta: float) -> Floats:
    """Of unpolarised light, as sines and tangents of the two angles (Fresnel's own form), 1 beyond the critical angle;
    ``eta`` is the index beyond the interface over that before it."""
    one = np.arccos(np.clip(np.asarray(cosine, np.float64), 1e-9, 1 - 1e-12))
    other = np.arcsin(np.minimum(np.sin(one) / eta, 1.0))
    s, p = np.sin(one - other) / np.sin(one + other), np.tan(one - other) / np.tan(one + other)
    return np.where(np.sin(one) < eta, (s**2 + p**2) / 2, 1.0)


def fresnel_conductor(cosine: ArrayLike, eta: ArrayLike, k: ArrayLike) -> Floats:
    """Of unpolarised light, by complex amplitudes, (..., 3)."""
    index = np.asarray(eta, np.float64) + 1j * np.asarray(k, np.float64)
    one = np.asarray(cosine, np.float64)[..., None]
    other = np.sqrt(1 - (1 - one**2) / index**2)
    s, p = (one - index * other) / (one + index * other), (index * one - other) / (index * one + other)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2


def ggx_d(alpha: ArrayLike, wh: Floats) -> Floats:
    """Trowbridge-Reitz in terms of cos theta."""
    a2, c2 = np.asarray(alpha, np.float64) ** 2, wh[..., 2] ** 2
    return a2 / (np.pi * (c2 * (a2 - 1) + 1) ** 2)


def g1_smith(alpha: ArrayLike, cosine: ArrayLike) -> Floats:
    """1 / (1 + Lambda) with Lambda = (sqrt(1 + alpha² tan²) - 1) / 2."""
    c2 = np.asarray(cosine, np.float64) ** 2
    return 2 / (1 + np.sqrt(1 + np.asarray(alpha, np.float64) ** 2 * (1 - c2) / c2))


def g1(term: str, alpha: ArrayLike, cosine: ArrayLike) -> Floats:
    """The masking term of GEOMETRY_<term>."""
    alpha = np.asarray(alpha, np.float64)
    if "SMITH" in term:
        return g1_smith(alpha, cosine)
    k = np.sqrt(2 * alpha**2 / np.pi) if term == "SCHLICK_BECKMANN" else (np.sqrt(alpha) + 1) ** 2 / 8
    return cosine / (cosine * (1 - k) + k)


def g(term: str, alpha: ArrayLike, co: ArrayLike, ci: ArrayLike) -> Floats:
    """Masking and shadowing of GEOMETRY_<term>: their product, or 1 / (1 / G1(co) + 1 / G1(ci) - 1) if the height of a
    facet correlates them (Heitz 2014, eq. 99)."""
    one, other = g1(term, alpha, co), g1(term, alpha, ci)
    return 1 / (1 / one + 1 / other - 1) if term == "SMITH_HEIGHT_CORRELATED" else one * other


# Of the fit to what sheen reflects (docs/material.md): a row for each power of the root of the cosine.
SHEEN_FIT = [
    [0.1183, -1.1427, 0.8352, -0.002],
    [0.9044, 0.0743, -1.1209, -0.2244],
    [-3.5838, 4.8836, 1.4523, 0.3529],
    [1.8672, -16.8722, 4.0374, -3.5829],
    [3.3552, 15.1436, -7.1205, 2.3312],
]


def sheen_lambda(roughness: float, cosine: Floats) -> Floats:
    """Lambda of the sheen by the fit of Estevez and Kulla 2017, mirrored at a cosine of 1/2."""
    t = (1 - roughness**2) ** 2
    a, b, c, d, e = (1 - t) * np.array([21.5473, 3.82987, 0.19823, -1.97760, -4.32054]) + t * np.array(
        [25.3245, 3.32435, 0.16801, -1.27393, -4.85967]
    )

    def log(x: Floats) -> Floats:
        return a / (1 + b * x**c) + d * x + e

    half = np.full_like(cosine, 0.5)
    low, high = log(np.minimum(cosine, half)), 2 * log(half) - log(np.minimum(1 - cosine, half))
    return np.exp(np.where(cosine < 0.5, low, high))


def sheen_lobe(roughness: float, wo: Floats, wi: Floats) -> Floats:
    """D V cos_i, whose cosines in V are at least 0.001."""
    alpha, wh = roughness**2, (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    o, i = np.maximum(wo[..., 2], 1e-3), np.maximum(wi[..., 2], 1e-3)
    d = (2 + 1 / alpha) * np.hypot(wh[..., 0], wh[..., 1]) ** (1 / alpha) / (2 * np.pi)
    return d * wi[..., 2] / ((1 + sheen_lambda(roughness, o) + sheen_lambda(roughness, i)) * 4 * o * i)


def sheen_albedo(roughness: float, cosine: Floats) -> Floats:
    """The fit to the integral of sheen_lobe() over wi."""
    c = np.maximum(cosine, 1e-3)
    rows = np.array(SHEEN_FIT) @ [1, np.log(roughness), roughness, 1 / roughness]
    return np.exp(np.polynomial.polynomial.polyval(np.sqrt(c), rows)) / (4 * c * (1 + sheen_lambda(roughness, c)))


def width_along(alpha: float, anisotropy: float, w: Floats) -> Floats:
    """The width of facets along w; along x it is alpha + (1 - alpha) anisotropy²."""
    if anisotropy == 0:
        return np.full(w.shape[:-1], alpha)
    turn = np.arctan2(w[..., 1], w[..., 0])
    return np.hypot((alpha + (1 - alpha) * anisotropy**2) * np.cos(turn), alpha * np.sin(turn))


def facets_d(alpha: float, anisotropy: float, wh: Floats) -> Floats:
    """Trowbridge-Reitz of two widths, by slopes."""
    x, y = alpha + (1 - alpha) * anisotropy**2, alpha
    slopes = (wh[..., 0] / x) ** 2 + (wh[..., 1] / y) ** 2 + wh[..., 2] ** 2
    return 1 / (np.pi * x * y * slopes**2)


def facets_g1(alpha: float, anisotropy: float, w: Floats) -> Floats:
    return g1_smith(width_along(alpha, anisotropy, w), np.abs(w[..., 2]))


def visible_normal_pdf(alpha: ArrayLike, wo: Floats, wh: Floats) -> Floats:
    """G1 D max(0, wo . wh) / cos_o."""
    cosine = np.maximum(0, (wo * wh).sum(-1))
    return g1_smith(alpha, wo[..., 2]) * cosine * ggx_d(alpha, wh) / wo[..., 2]


# Of the fit to what red, green and blue see of white light (docs/material.md): the real and the imaginary part of a
# wave number in 1/um, and of its weights.
FILM_WAVES = np.array(
    [
        [1.5212, 0.0846, -0.1278, 0.0014, 0.0083, 0.3158, -0.0337, 0.0009],
        [1.6256, 0.0850, 1.3779, -0.2440, -0.0049, 0.7028, -0.0040, 0.0024],
        [1.7471, 0.1210, 0.5537, 0.6127, -0.1248, -1.4271, 0.8555, -0.0926],
        [1.9150, 0.1196, -0.8949, 0.7738, -0.1306, 0.2605, -0.7294, 0.0790],
        [2.1533, 0.1245, 0.0418, -0.1125, 1.1362, 0.2716, -0.1968, 0.7786],
        [2.3327, 0.1200, 0.0493, -0.0314, 0.1158, -0.1213, 0.1073, -0.7631],
    ]
)


def film_interfaces(m: Filmed, cosine: ArrayLike) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Of light that meets a film: its optical path to and fro in um (..., 1), and of both polarisations the amplitudes
    at the film and, within, at a base of the index that f0 says (..., 3)."""
    one = np.maximum(np.asarray(cosine, np.float64), 1e-4)[..., None]
    root = np.minimum(np.sqrt(m.f0), 0.9999)
    n, base = m.iridescence_ior, (1 + root) / (1 - root)
    two, three = (np.sqrt(1 - (1 - one**2) / index**2) for index in (n, base))
    s = (one - n * two) / (one + n * two), (n * two - base * three) / (n * two + base * three)
    p = (n * one - two) / (n * one + two), (base * two - n * three) / (base * two + n * three)
    return 2e-3 * n * m.iridescence_thickness * two, [s, p]


def film_fresnel(m: Filmed, cosine: ArrayLike, reflected: Floats) -> Floats:
    """Schlick's term, with what it leaves or what it reflects, the lesser of both after the film, in the ratio in which
    the film changes that of the exact terms, (..., 3), below a cosine of 1e-4 in proportion; ``reflected`` is by the
    exact terms with the film."""
    bare = np.mean([((r + s) / (1 + r * s)) ** 2 for r, s in film_interfaces(m, cosine)[1]], axis=0)
    schlick = fresnel(m.f0, m.f90, np.maximum(cosine, 1e-4))
    more, less = 1 - (1 - schlick) * (1 - reflected) / np.maximum(1 - bare, 1e-6), schlick * reflected
    filmed = np.clip(np.where(reflected < bare, less / np.maximum(bare, 1e-6), more), 0, 1)
    share = m.iridescence * np.minimum(1, np.asarray(cosine) / 1e-4)[..., None]
    return fresnel(m.f0, m.f90, cosine) + share * (filmed - schlick)


def film_reflectance(m: Filmed, cosine: ArrayLike) -> Floats:
    """By the exact terms, with the fit to the spectrum: a series of powers of exp(2 pi i path / wavelength), summed."""
    path, interfaces = film_interfaces(m, cosine)
    passed = []
    for r, s in interfaces:
        rho, total = r * s, np.zeros(np.shape(r * s))
        for k, decay, *weights in FILM_WAVES:
            z = np.exp(2j * np.pi * (k + 1j * decay) * path)
            weight = np.array(weights[:3]) + 1j * np.array(weights[3:])
            total = total + (weight * (1 - rho * z) / (1 + rho * z)).real
        passed.append((1 - r**2) * (1 - s**2) / (1 - rho**2) * total)
    return 1 - np.mean(passed, axis=0)


def facet_fresnel(m: Material, cosine: ArrayLike) -> Floats:
    """Of facets, with a film or without, (..., 3)."""
    if not isinstance(m, Filmed) or m.iridescence == 0:
        return fresnel(m.f0, m.f90, cosine)
    return film_fresnel(m, cosine, film_reflectance(m, cosine))


def interface_reflectance(m: Material, cosine: ArrayLike, term: str = "SMITH") -> Floats:
    """R, what the rough interface keeps from the base: Schlick towards max((1 - alpha) f90, f0), (..., 3); with the
    height-correlated term of 0.95 alpha. With a film, also the larger one of what it adds at two angles, and less of
    what it takes away."""
    alpha = 0.95 * m.alpha if term == "SMITH_HEIGHT_CORRELATED" else m.alpha
    bare = fresnel(m.f0, np.maximum((1 - alpha) * np.asarray(m.f90), m.f0), cosine)
    if not isinstance(m, Filmed) or m.iridescence == 0:
        return bare
    c = np.asarray(cosine, np.float64)
    places = c * (1 - 0.9 * m.alpha), (c + np.sqrt(m.alpha**2 + (1 - m.alpha**2) * c**2)) / 2
    change = np.maximum(*(facet_fresnel(m, at) - fresnel(m.f0, m.f90, at) for at in places))
    return np.clip(bare + np.where(change < 0, 1 - m.alpha, 1) * change, 0, 1)


def specular_probability(m: Material, wo: Floats, term: str = "SMITH") -> Floats:
    """How often the specular lobe is sampled."""
    r = interface_reflectance(m, wo[..., 2], term)
    specular, diffuse = r @ REC_709, (np.asarray(m.diffuse) * (1 - r) * (1 - np.asarray(m.f0))) @ REC_709
    return specular / np.maximum(specular + diffuse, 1e-300)


def bsdf_eval(m: Material, term: str, wo: Floats, wi: Floats) -> Floats:
    """f |cos_i| of the glossy and the diffuse lobe, (..., 3), for directions above the surface."""
    wh, co, ci = _half(wo, wi), wo[..., 2], wi[..., 2]
    f = facet_fresnel(m, (wo * wh).sum(-1))
    specular = f * (ggx_d(m.alpha, wh) * g(term, m.alpha, co, ci) / (4 * co * ci))[..., None]
    return (specular + _diffuse(m, co, ci, term)) * ci[..., None]


def bsdf_eval_compensated(m: Material, wo: Floats, wi: Floats, single: ArrayLike) -> Floats:
    """The same for Smith's term, with the specular lobe times 1 + F0 (1 - E) / E (Turquin 2019), E being ``single``:
    what the lobe of a white metal reflects of all light towards ``wo``."""
    single = np.asarray(single, np.float64)[..., None]
    diffuse = bsdf_eval_diffuse(m, wo, wi)
    return diffuse + (bsdf_eval(m, "SMITH", wo, wi) - diffuse) * (1 + np.asarray(m.f0) * (1 - single) / single)


def bsdf_eval_diffuse(m: Material, wo: Floats, wi: Floats, term: str = "SMITH") -> Floats:
    """f |cos_i| of the diffuse lobe alone."""
    return _diffuse(m, wo[..., 2], wi[..., 2], term) * wi[..., 2:]


def bsdf_pdf(m: Material, wo: Floats, wi: Floats, term: str = "SMITH") -> Floats:
    """Density of sampling the lobes, in 1/sr, but for a delta lobe."""
    wh, p = _half(wo, wi), specular_probability(m, wo, term)
    diffuse: Floats = (1 - p) * wi[..., 2] / np.pi
    if m.alpha == 0:
        return diffuse
    return p * visible_normal_pdf(m.alpha, wo, wh) / (4 * (wo * wh).sum(-1)) + diffuse


def _diffuse(m: Material, co: Floats, ci: Floats, term: str) -> Floats:
    passed = (1 - interface_reflectance(m, co, term)) * (1 - interface_reflectance(m, ci, term))
    return np.asarray(m.diffuse) / np.pi * passed


def _half(wo: Floats, wi: Floats) -> Floats:
    wh = wo + wi
    return wh / np.linalg.norm(wh, axis=-1, keepdims=True)
