# SPDX-License-Identifier: MIT
"""A clear sky and its sun, by a model of scattering in the atmosphere.

The atmosphere is a shell of molecules, aerosols and ozone over a sphere (the model of Bruneton and Neyret 2008,
Precomputed Atmospheric Scattering). Light scattered once is integrated along each line of sight at 17 wavelengths;
what is scattered more often is the isotropic series of Hillaire 2020, A Scalable and Production Ready Sky and
Atmosphere Rendering Technique, section 5.5, with the ground's part in it. The numbers of the air:

- molecules: optical depth of Hansen and Travis 1974, Light Scattering in Planetary Atmospheres, eq. 2.29
- aerosols: (turbidity - 1) times the optical depth of the molecules at 550 nm, which defines turbidity; their
  wavelengths by Ångström's exponent 1.3 (as Preetham et al. 1999, A Practical Analytic Model for Daylight);
  phase function of Cornette and Shanks 1992
- ozone: 300 Dobson units, cross-sections of the Chappuis band rounded from Gorshelev et al. 2014
- sunlight: Planck's law at 5772 K, 1361 W/m² in all

Spectra become Rec. 709 by the colour matching functions of Wyman et al. 2013, Simple Analytic Approximations to the
CIE XYZ Color Matching Functions, eq. 4. Radiance is in W/m²/sr weighted by these, so that 683 lm/W times the luminance
of a pixel is its luminance in cd/m²: some 3,000 to 10,000 cd/m² for a blue sky.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SIZE = (256, 512)  # rows and columns of the map
_WAVELENGTHS = np.arange(0.39, 0.711, 0.02)  # micrometres
_STEP = 20.0  # nanometres
_GROUND, _TOP = 6360e3, 6420e3  # metres from the centre of the earth
_EYE = _GROUND + 2.0
_HEIGHTS = np.array([8000.0, 1200.0])  # over which molecules and aerosols thin out by e
_OZONE_MIDDLE, _OZONE_HALF = 25e3, 15e3
_ALBEDO_OF_AEROSOLS, _ANISOTROPY = 0.9, 0.8
_CHAPPUIS = {  # 1e-25 m² by nanometres
    400: 0.01,
    425: 0.04,
    450: 0.17,
    475: 0.40,
    500: 1.2,
    525: 2.1,
    550: 3.3,
    575: 4.7,
    600: 5.0,
    625: 3.6,
    650: 2.5,
    675: 1.5,
    700: 0.88,
    725: 0.5,
}
_OZONE_COLUMN = 300 * 2.687e20  # molecules over a square metre
_SUN_HALF_ANGLE = 4.6529e-3  # radians
_TO_REC709 = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_AZIMUTHS = 25  # from towards the sun to away from it, between which the integrals hardly change

_x, _w = np.polynomial.legendre.leggauss(32)
# For a line of sight of length 1, crowded at its near end where the air is thick.
_NODES, _WEIGHTS = ((_x + 1) / 2) ** 2, _w * (_x + 1) / 2


def _extinction(turbidity: float) -> Floats:
    """At sea level (or the middle of the layer, for ozone), 1/m, of molecules, aerosols and ozone: (3, wavelengths)."""
    inverse = _WAVELENGTHS**-2
    molecules = 0.008569 * inverse**2 * (1 + 0.0113 * inverse + 0.00013 * inverse**2)
    at_550 = 0.008569 * 0.55**-4 * (1 + 0.0113 * 0.55**-2 + 0.00013 * 0.55**-4)
    aerosols = (turbidity - 1) * at_550 * (_WAVELENGTHS / 0.55) ** -1.3
    cross_section = np.interp(1000 * _WAVELENGTHS, list(_CHAPPUIS), list(_CHAPPUIS.values())) * 1e-25
    return np.stack([molecules / _HEIGHTS[0], aerosols / _HEIGHTS[1], cross_section * _OZONE_COLUMN / _OZONE_HALF])


def _densities(radius: Floats) -> tuple[Floats, Floats, Floats]:
    """Of molecules, aerosols and ozone relative to where they are densest, each (...)."""
    height = np.maximum(radius - _GROUND, 0)
    ozone = np.maximum(0, 1 - np.abs(height - _OZONE_MIDDLE) / _OZONE_HALF)
    return np.exp(-height / _HEIGHTS[0]), np.exp(-height / _HEIGHTS[1]), ozone


def _density(radius: Floats) -> Floats:
    """All three of :func:`_densities`, (..., 3)."""
    return np.stack(_densities(radius), axis=-1)


def _path_length(radius: Floats, cosine: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Length in metres of a line of sight through the atmosphere, and whether it ends at the ground."""
    b = radius * cosine
    to_ground = b**2 - (radius**2 - _GROUND**2)
    meets = (cosine < 0) & (to_ground >= 0)
    far = -b + np.sqrt(b**2 - radius**2 + _TOP**2)
    return np.where(meets, -b - np.sqrt(np.maximum(to_ground, 0)), far), meets


def _sunlight(radius: Floats, cosine: Floats, extinction: Floats) -> Floats:
    """The part of sunlight that arrives, (..., wavelengths), from a sun at ``cosine`` to the vertical."""
    horizon = -np.sqrt(np.maximum(0, 1 - (_GROUND / radius) ** 2))
    risen = np.clip(0.5 + (cosine - horizon) / (2 * _SUN_HALF_ANGLE), 0, 1)  # of the disc
    far, _ = _path_length(radius, np.maximum(cosine, horizon))
    t = far[..., None] * _NODES
    along = np.sqrt(radius[..., None] ** 2 + t**2 + 2 * t * (radius * np.maximum(cosine, horizon))[..., None])
    columns = far[..., None] * np.stack([density @ _WEIGHTS for density in _densities(along)], axis=-1)
    light: Floats = risen[..., None] * np.exp(-columns @ extinction)
    return light


class _Multiple:
    """Radiance scattered more than once, the same in all directions, for a solar irradiance of 1."""

    def __init__(self, extinction: Floats, scattering: Floats, albedo: float) -> None:
        self.heights = np.array([0.0, 500, 1500, 3000, 6000, 10e3, 16e3, 25e3, 40e3, 59e3])
        self.cosines = np.sin(np.radians([-20.0, -10, -6, -3, -1, 0, 1, 3, 6, 10, 20, 35, 50, 70, 90]))
        radius = (_GROUND + 1 + self.heights)[:, None, None, None]
        sun = self.cosines[:, None, None]
        x, weight_x = np.polynomial.legendre.leggauss(12)  # of the vertical
        turns = np.pi * (np.arange(6) + 0.5) / 6
        up, turn = x[:, None], turns[None, :]
        view = up + 0 * turn
        to_sun = up * sun + np.sqrt(1 - up**2) * np.sqrt(1 - sun**2) * np.cos(turn)
        share = weight_x[:, None] / 2 / len(turns) + 0 * turn  # of the sphere
        shape = np.broadcast_shapes(radius.shape, to_sun.shape)
        radius, view, to_sun, sun = (np.broadcast_to(a, shape).astype(float) for a in (radius, view, to_sun, sun))
        once, again, transmitted, meets = _march(radius, view, sun, to_sun, extinction, scattering)
        far, _ = _path_length(radius, view)
        at_ground = np.clip((radius * sun + far * to_sun) / _GROUND, -1, 1)
        lit = _sunlight(np.full(shape, _GROUND + 1.0), at_ground, extinction) * np.maximum(at_ground, 0)[..., None]
        ground = (meets[..., None] * transmitted) * lit * albedo / np.pi
        second = ((once.sum(axis=-2) / (4 * np.pi) + ground) * share[..., None]).sum(axis=(-3, -2))
        part = (again * share[..., None]).sum(axis=(-3, -2))
        self.radiance = second / (1 - part)

    def __call__(self, radius: Floats, sun: Floats) -> Floats:
        height = np.clip(radius - _GROUND, self.heights[0], self.heights[-1])
        cosine = np.clip(sun, self.cosines[0], self.cosines[-1])
        i, f = _between(self.heights, height)
        j, g = _between(self.cosines, cosine)
        low = self.radiance[i, j] * (1 - g) + self.radiance[i, j + 1] * g
        high = self.radiance[i + 1, j] * (1 - g) + self.radiance[i + 1, j + 1] * g
        result: Floats = low * (1 - f) + high * f
        return result


def _between(grid: Floats, values: Floats) -> tuple[NDArray[np.intp], Floats]:
    i = np.clip(np.searchsorted(grid, values) - 1, 0, len(grid) - 2)
    return i, ((values - grid[i]) / (grid[i + 1] - grid[i]))[..., None]


def _march(
    radius: Floats,
    view: Floats,
    sun: Floats,
    to_sun: Floats,
    extinction: Floats,
    scattering: Floats,
    multiple: _Multiple | None = None,
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Along lines of sight (...) from ``radius`` whose cosine to the vertical is ``view``, that of the sun ``sun``,
    and that between the two ``to_sun``: sunlight scattered towards their start before the phase function,
    by molecules and aerosols (..., 2, wavelengths); what is scattered of a light that is 1 everywhere, or
    that of ``multiple`` (..., wavelengths); the light that passes; and whether the line ends at the ground."""
    far, meets = _path_length(radius, view)
    once = np.zeros((*radius.shape, 2, len(_WAVELENGTHS)))
    again = np.zeros((*radius.shape, len(_WAVELENGTHS)))
    columns = np.zeros((*radius.shape, 3))
    t_before, density_before = np.zeros(radius.shape), _density(radius)
    for node, weight in [*zip(_NODES, _WEIGHTS, strict=True), (1.0, 0.0)]:
        t = far * node
        along = np.sqrt(radius**2 + t**2 + 2 * t * radius * view)
        density = _density(along)
        columns += (density + density_before) * ((t - t_before) / 2)[..., None]
        t_before, density_before = t, density
        passed = np.exp(-columns @ extinction)
        if weight == 0:
            break
        reaching = passed * (far * weight)[..., None]
        cosine = np.clip((radius * sun + t * to_sun) / along, -1, 1)
        scattered = density[..., :2, None] * scattering
        once += scattered * (reaching * _sunlight(along, cosine, extinction))[..., None, :]
        light = 1.0 if multiple is None else multiple(along, cosine)
        again += scattered.sum(axis=-2) * reaching * light
    return once, again, passed, meets


def _rec709(spectrum: Floats) -> Floats:
    """Colours (..., 3) of spectra (..., wavelengths) in W/m²/sr/nm, or of irradiances."""

    def lobe(middle: float, left: float, right: float) -> Floats:
        x = 1000 * _WAVELENGTHS - middle
        return np.asarray(np.exp(-0.5 * (x / np.where(x < 0, left, right)) ** 2))

    matching = [
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7) - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    ]
    color: Floats = np.maximum(0, spectrum @ np.stack(matching, axis=-1) * _STEP @ _TO_REC709.T)
    return color


def _solar_irradiance() -> Floats:
    """Above the atmosphere, W/m²/nm."""
    wavelength = _WAVELENGTHS * 1e-6
    planck = 2 * 6.62607015e-34 * 299792458.0**2 / wavelength**5 / np.expm1(0.014387769 / (wavelength * 5772))
    irradiance: Floats = np.pi * planck * np.tan(_SUN_HALF_ANGLE) ** 2 * 1e-9
    return irradiance


def _phases(cosine: Floats) -> Floats:
    """Of molecules and aerosols, 1/sr, (..., 2)."""
    g = _ANISOTROPY
    rayleigh = 3 / (16 * np.pi) * (1 + cosine**2)
    shape = (1 - g**2) * (1 + cosine**2) / ((2 + g**2) * (1 + g**2 - 2 * g * cosine) ** 1.5)
    return np.stack([rayleigh, 3 / (8 * np.pi) * shape], axis=-1)


def sun_irradiance(turbidity: float, elevation: float) -> Floats:
    """Of a surface that faces the sun at ``elevation`` radians, through the air, W/m² as Rec. 709 (3,)."""
    light = _sunlight(np.array(_EYE), np.array(np.sin(elevation)), _extinction(turbidity))
    return _rec709(light * _solar_irradiance())


@lru_cache(maxsize=8)
def sky_pixels(turbidity: float, elevation: float, azimuth: float, albedo: float) -> NDArray[np.float32]:
    """The equirectangular map of a sky without the sun's disc, and of the ground under it, (256, 512, 3).

    ``elevation`` and ``azimuth`` of the sun are in radians, azimuth from the middle of the map to the right;
    ``albedo`` is that of the ground.
    """
    extinction = _extinction(turbidity)
    scattering = extinction[:2] * np.array([[1.0], [_ALBEDO_OF_AEROSOLS]])
    rows, columns = SIZE
    theta = np.pi * (np.arange(rows) + 0.5) / rows
    turns = np.linspace(0, np.pi, _AZIMUTHS)
    view = np.cos(theta)[:, None] + 0 * turns
    sun = np.sin(elevation)

    def to_sun(turn: Floats) -> Floats:
        cosine: Floats = view[:, :1] * sun + np.sin(theta)[:, None] * np.cos(elevation) * np.cos(turn)
        return cosine

    radius = np.full(view.shape, _EYE)
    multiple = _Multiple(extinction, scattering, albedo)
    once, again, passed, meets = _march(radius, view, sun + 0 * view, to_sun(turns), extinction, scattering, multiple)
    phi = 2 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5) - azimuth
    turn = np.abs((phi + np.pi) % (2 * np.pi) - np.pi)
    i, f = _between(turns, turn)
    phases = _phases(to_sun(turn))
    spectrum = _mixed(again, i, f)
    for kind in range(2):
        spectrum += _mixed(once[:, :, kind], i, f) * phases[..., kind, None]
    above = theta < np.pi / 2
    weights = (np.sin(theta) * np.cos(theta))[above, None, None] * 2 * np.pi**2 / (rows * columns)
    diffuse = (spectrum[above] * weights).sum(axis=(0, 1))
    direct = _sunlight(np.array(_EYE), np.array(sun), extinction) * max(0.0, sun)
    spectrum += (passed * meets[..., None])[:, :1] * (direct + diffuse) * albedo / np.pi
    pixels = _rec709(spectrum * _solar_irradiance()).astype(np.float32)
    pixels.setflags(write=False)
    return pixels


def _mixed(values: Floats, i: NDArray[np.intp], f: Floats) -> Floats:
    mixed: Floats = values[:, i] * (1 - f) + values[:, i + 1] * f
    return mixed
