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


@pytest.mark.parametrize("elevation", [-6.0, 5.0, 90.0])
@pytest.mark.parametrize("turbidity", [1.0, 10.0])
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


def test_integrals_have_converged(monkeypatch):
    """Twice the nodes along lines of sight and twice the azimuths change next to nothing."""
    monkeypatch.setattr(model, "SIZE", (ROWS // 2, COLUMNS // 2))
    coarse = sky_pixels.__wrapped__(3.0, np.radians(12.0), 0.0, 0.2).astype(np.float64)
    x, w = np.polynomial.legendre.leggauss(64)
    monkeypatch.setattr(model, "_NODES", ((x + 1) / 2) ** 2)
    monkeypatch.setattr(model, "_WEIGHTS", w * (x + 1) / 2)
    monkeypatch.setattr(model, "_AZIMUTHS", 49)
    fine = sky_pixels.__wrapped__(3.0, np.radians(12.0), 0.0, 0.2).astype(np.float64)
    difference = np.abs(coarse - fine) @ LUMINANCE / (fine @ LUMINANCE)
    assert np.median(difference) < 0.004
    assert difference.max() < 0.015


def test_a_sun_below_the_horizon_or_switched_off_is_none():
    assert Environment(sky=Sky(sun_elevation_degrees=-5.0)).sun is None
    assert Environment(sky=Sky(sun=False)).sun is None


def test_a_wider_sun_gives_the_same_light():
    narrow, wide = (Sky(sun_radius_degrees=radius).disc for radius in (0.2666, 5.0))
    for channel in range(3):
        light = [s.radiance[channel] * s.one_minus_cos * (2 - s.one_minus_cos) for s in (narrow, wide)]
        assert light[0] == pytest.approx(light[1], rel=1e-6)
