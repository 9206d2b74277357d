# SPDX-License-Identifier: MIT
"""The computed sky: against closed forms where there are any, and what every clear sky has."""

import numpy as np
import pytest

from fragtracer.scene import Environment, Sky
from fragtracer.scene import sky as model
from fragtracer.scene.environment import direction_of
from fragtracer.scene.sky import sky_pixels, sun_irradiance

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
ROWS, COLUMNS = 128, 256  # a pixel is the sky at its middle, so a map of fewer is no less exact
V, U = np.meshgrid((np.arange(ROWS) + 0.5) / ROWS, (np.arange(COLUMNS) + 0.5) / COLUMNS, indexing="ij")
SOLID_ANGLE = np.sin(np.pi * V) * 2 * np.pi**2 / (ROWS * COLUMNS)


@pytest.fixture(autouse=True, scope="module")
def _small_maps():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "SIZE", (ROWS, COLUMNS))
        sky_pixels.cache_clear()
        yield
        sky_pixels.cache_clear()


def sky(turbidity=3.0, elevation=45.0, azimuth=0.0, albedo=0.2):
    return sky_pixels(turbidity, np.radians(elevation), np.radians(azimuth), albedo).astype(np.float64)


def diffuse(pixels):
    """Irradiance of the ground by the sky."""
    cosine = np.maximum(0, np.cos(np.pi * V))
    return (pixels * (SOLID_ANGLE * cosine)[..., None]).sum((0, 1))


def test_sunlight_is_that_of_a_black_body_as_far_as_the_sun():
    """The visible part of 1361 W/m²: Planck's law has 40.9 % of it from 380 to 720 nm."""
    total = model._solar_irradiance().sum() * 20
    assert total == pytest.approx(0.409 * 1361, rel=0.01)


def test_sun_in_the_zenith_is_weakened_by_the_optical_depth():
    """Lambert's law for a shell of the scale heights; turbidity is the depth over that of molecules at 550 nm."""
    at_550 = int(np.argmin(np.abs(model._WAVELENGTHS - 0.55)))
    for turbidity in (1.0, 3.0, 8.0):
        extinction = model._extinction(turbidity)
        columns = np.array([model._HEIGHTS[0], model._HEIGHTS[1], model._OZONE_HALF])
        depth = columns @ extinction
        found = model._sunlight(np.array(model._EYE), np.array(1.0), extinction)
        np.testing.assert_allclose(found, np.exp(-depth), rtol=3e-3)  # some air is above the shell's top
        molecules, aerosols = (columns[:2, None] * extinction[:2])[:, at_550]
        assert (molecules + aerosols) / molecules == pytest.approx(turbidity, rel=1e-6)


def test_daylight_has_its_known_strength():
    """Clear sky, sun at 60°: 80 to 100 klx from the sun, 10 to 30 klx from the sky (683 lm/W)."""
    direct = 0.683 * sun_irradiance(3.0, np.radians(60)) @ LUMINANCE
    assert 80 < direct < 100
    assert 10 < 0.683 * diffuse(sky(3.0, 60.0)) @ LUMINANCE < 30


@pytest.mark.parametrize(("turbidity", "elevation"), [(10.0, -6.0), (1.0, 5.0), (10.0, 90.0)])
def test_sky_is_finite_and_gives_no_more_than_the_sun(turbidity, elevation):
    pixels = sky(turbidity, elevation, albedo=0.5)
    assert np.isfinite(pixels).all()
    assert pixels.min() >= 0
    received = model._rec709(model._solar_irradiance()) * max(0, np.sin(np.radians(elevation)))
    direct = sun_irradiance(turbidity, np.radians(elevation)) * max(0, np.sin(np.radians(elevation)))
    if elevation >= 5:  # with a bright ground the sky gets some of its light a second time
        assert ((diffuse(pixels) + direct) @ LUMINANCE) < 1.05 * received @ LUMINANCE


def test_sky_is_brightest_around_the_sun_and_blue_away_from_it():
    pixels = sky(2.0, 30.0, azimuth=100.0)
    row, column = np.unravel_index((pixels @ LUMINANCE).argmax(), pixels.shape[:2])
    sun = Sky(sun_elevation_degrees=30.0, sun_azimuth_degrees=100.0).disc
    assert sun is not None
    assert direction_of((column + 0.5) / COLUMNS, (row + 0.5) / ROWS) @ sun.direction > np.cos(np.radians(2))
    assert sun.direction[0] > 0.8  # 90 is +x
    red, green, blue = pixels[0, 0]
    assert blue > 1.3 * green > 1.3 * red


def test_low_sun_is_red():
    high, low = (sun_irradiance(3.0, np.radians(elevation)) for elevation in (60, 3))
    assert low[0] / low[1] > 2 * high[0] / high[1]
    assert low.max() < 0.1 * high.max()


def test_map_is_symmetric_about_the_sun():
    pixels = sky(azimuth=0.0)
    np.testing.assert_allclose(pixels, pixels[:, ::-1], rtol=1e-5)
    np.testing.assert_allclose(np.roll(pixels, COLUMNS // 4, axis=1), sky(azimuth=90.0), rtol=1e-4)


# The same air a second time, in vectors from the middle of the earth.
GROUND, TOP = 6360e3, 6420e3
EYE = np.array([0.0, GROUND + 2, 0.0])
NANOMETRES = (450, 550, 650)
LINES = [(0.2, 0.6), (0.35, 0.8), (0.43, 0.1), (0.48, 0.4)]  # of sight, v and u


def air(turbidity):
    """Scattering and extinction where the air is densest, 1/m, of molecules, aerosols and ozone, (3, wavelengths)."""

    def molecules(um):
        return 0.008569 * um**-4 * (1 + 0.0113 * um**-2 + 0.00013 * um**-4)

    um = np.array(NANOMETRES) / 1000
    ozone = 300 * 2.687e20 * np.array([0.17, 3.3, 2.5]) * 1e-25
    depths = [molecules(um), (turbidity - 1) * molecules(0.55) * (um / 0.55) ** -1.3, ozone]
    extinction = np.divide(depths, [[8000], [1200], [15e3]])
    return extinction * [[1], [0.9], [0]], extinction


def profile(points):
    h = np.linalg.norm(points, axis=-1) - GROUND
    layer = np.maximum(0, 1 - np.abs(h - 25e3) / 15e3)
    return np.stack([np.exp(-h / 8000), np.exp(-h / 1200), layer], axis=-1)


def phases(cosine):
    """Of molecules (Rayleigh) and aerosols (Cornette and Shanks), and none of ozone."""
    aerosols = 0.36 * (1 + cosine**2) / (2.64 * (1.64 - 1.6 * cosine) ** 1.5)
    return np.stack([3 / (16 * np.pi) * (1 + cosine**2), 3 / (8 * np.pi) * aerosols, 0 * cosine], axis=-1)


def nodes_to_the_top(points, direction, count):
    """Distances (n, count), and their weights."""
    b = points @ direction
    far = -b + np.sqrt(b**2 - (points**2).sum(-1) + TOP**2)
    x, w = np.polynomial.legendre.leggauss(count)
    return far[:, None] * ((x + 1) / 2) ** 2, far[:, None] * (x + 1) / 2 * w


def transmittance(points, direction, extinction):
    """To the top of the atmosphere, 0 where the earth is in the way."""
    t, w = nodes_to_the_top(points, direction, 48)
    columns = np.einsum("nkc,nk->nc", profile(points[:, None] + t[..., None] * direction), w)
    b = points @ direction
    shaded = (b < 0) & (b**2 > (points**2).sum(-1) - GROUND**2)
    return np.where(shaded[:, None], 0, np.exp(-columns @ extinction))


def small_map(monkeypatch, turbidity):
    """Radiance over the sun's irradiance at NANOMETRES along LINES, over black ground; the lines, and the sun."""
    monkeypatch.setattr(model, "SIZE", (64, 128))
    bands = [int(np.argmin(np.abs(1000 * model._WAVELENGTHS - nm))) for nm in NANOMETRES]
    monkeypatch.setattr(model, "_rec709", lambda spectrum: spectrum[..., bands])
    pixels = sky_pixels.__wrapped__(turbidity, np.radians(45), np.radians(70), 0.0) / model._solar_irradiance()[bands]
    rows, columns = (np.array([int(size * x[i]) for x in LINES]) for i, size in enumerate((64, 128)))
    lines = direction_of((columns + 0.5) / 128, (rows + 0.5) / 64)
    return pixels[rows, columns], lines, np.array(Sky(sun_elevation_degrees=45, sun_azimuth_degrees=70).disc.direction)


@pytest.mark.parametrize(("turbidity", "tolerance"), [(1.0, 0.001), (3.0, 0.015)])
def test_single_scattering_is_the_integral(monkeypatch, turbidity, tolerance):
    """Of the same air along the line of sight, computed anew, with many more nodes."""
    monkeypatch.setattr(model, "_Multiple", lambda *_: lambda *_: 0.0)
    found, lines, sun = small_map(monkeypatch, turbidity)
    scattering, extinction = air(turbidity)
    for line, radiance in zip(lines, found, strict=True):
        t, w = (x[0] for x in nodes_to_the_top(EYE[None], line, 200))
        points = EYE + t[:, None] * line
        passed = transmittance(EYE[None], line, extinction) / transmittance(points, line, extinction)
        source = (profile(points) * phases(line @ sun)) @ scattering
        expected = w @ (passed * source * transmittance(points, sun, extinction))
        np.testing.assert_allclose(radiance, expected, rtol=tolerance)


def test_all_orders_are_those_of_a_monte_carlo_simulation(monkeypatch):
    """Of pure air, whose light scattered more than once is nearly the same in all directions, as the series has it."""
    found, lines, sun = small_map(monkeypatch, 1.0)
    rng, count = np.random.default_rng(1), 1 << 15
    scattering, extinction = (x[:, 0] for x in air(1.0))
    for i in (0, 1):
        samples, path = np.zeros(count), np.arange(count)
        points, directions, weight = np.tile(EYE, (count, 1)), np.tile(lines[i], (count, 1)), np.ones(count)
        while len(path):  # delta tracking, a sample of the sun at each event
            points = points - np.log1p(-rng.random(len(path)))[:, None] / extinction.sum() * directions
            radius = np.linalg.norm(points, axis=-1)
            inside = (radius > GROUND) & (radius < TOP)
            points, directions, weight, path = points[inside], directions[inside], weight[inside], path[inside]
            density = profile(points)
            real = rng.random(len(path)) * extinction.sum() < density @ extinction
            events = density[real]
            weight[real] *= (events @ scattering) / (events @ extinction)
            cosine = directions[real] @ sun
            light = phases(cosine)[:, 0] * transmittance(points[real], sun, extinction[:, None])[:, 0]
            np.add.at(samples, path[real], weight[real] * light)
            turned = rng.normal(size=(np.count_nonzero(real), 3))
            turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
            weight[real] *= 4 * np.pi * phases((turned * directions[real]).sum(-1))[:, 0]
            directions[real] = turned
        error = samples.std() / np.sqrt(count)
        assert error < 0.02 * samples.mean()
        assert found[i, 0] == pytest.approx(samples.mean(), abs=4 * error + 0.02 * samples.mean())


def test_a_sun_below_the_horizon_or_switched_off_is_none():
    assert Environment(sky=Sky(sun_elevation_degrees=-5.0)).sun is None
    assert Environment(sky=Sky(sun=False)).sun is None


def test_a_wider_sun_gives_the_same_light():
    narrow, wide = (Sky(sun_radius_degrees=radius).disc for radius in (0.2666, 5.0))
    for channel in range(3):
        light = [s.radiance[channel] * s.one_minus_cos * (2 - s.one_minus_cos) for s in (narrow, wide)]
        assert light[0] == pytest.approx(light[1], rel=1e-6)
