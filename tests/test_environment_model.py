# SPDX-License-Identifier: MIT
"""The model of an environment: which way its pictures lie, what they hold, and what it refuses."""

import numpy as np
import pytest
from pydantic import ValidationError

from fragtracer.scene import Environment, Gradient, Panorama
from fragtracer.scene.environment import direction_of, lookup, place_of


@pytest.mark.parametrize(
    ("place", "direction"),
    [
        ((0.5, 0.5), (0, 0, -1)),
        ((0.75, 0.5), (1, 0, 0)),
        ((0.25, 0.5), (-1, 0, 0)),
        ((0.0, 0.5), (0, 0, 1)),
        ((0.3, 0.0), (0, 1, 0)),
        ((0.3, 1.0), (0, -1, 0)),
    ],
)
def test_places_lie_where_the_description_says(place, direction):
    np.testing.assert_allclose(direction_of(*place), direction, atol=1e-15)


def test_places_and_directions_are_each_others_inverse():
    places = np.random.default_rng(0).random((1000, 2))
    np.testing.assert_allclose(place_of(3 * direction_of(*places.T)), places, atol=1e-12)


def test_rotation_is_counter_clockwise_from_above():
    turned = Environment(radiance=1.0, rotation_degrees=90).rotation
    np.testing.assert_allclose(turned @ (0, 0, -1), (-1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(turned @ (0, 1, 0), (0, 1, 0), atol=1e-15)


def test_lookup_meets_texel_centres_wraps_around_and_ends_at_the_poles():
    pixels = np.random.default_rng(1).random((3, 4, 3)).astype(np.float32)
    centres = direction_of((np.arange(4) + 0.5) / 4, (np.arange(3)[:, None] + 0.5) / 3 + np.zeros(4))
    np.testing.assert_allclose(lookup(pixels, centres), pixels, atol=1e-6)
    np.testing.assert_allclose(lookup(pixels, direction_of(0.0, 0.5)), (pixels[1, 0] + pixels[1, 3]) / 2, atol=1e-6)
    np.testing.assert_allclose(lookup(pixels, direction_of(0.125, 0.02)), pixels[0, 0], atol=1e-6)
    np.testing.assert_allclose(lookup(pixels, direction_of(0.125, 0.98)), pixels[2, 0], atol=1e-6)


def test_a_reduced_map_has_the_means_of_blocks() -> None:
    pixels = np.random.default_rng(3).random((12, 24, 3), np.float32)
    panorama = Panorama(pixels)
    expected = pixels.reshape(3, 4, 6, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(panorama.reduced(6).pixels, expected, rtol=1e-6)
    assert panorama.reduced(1).pixels.shape == (3, 6, 3), "three rows are not halved"
    assert panorama.reduced(24) is panorama


def test_gradient_has_its_three_colours():
    pixels = Environment(gradient=Gradient(zenith=(0, 0, 4), horizon=1.0, ground=(0.5, 0, 0))).pixels
    for y, color in ((1, (0, 0, 4)), (0, (1, 1, 1)), (-1, (0.5, 0, 0)), (0.5, (0.5, 0.5, 2.5))):
        direction = (np.sqrt(1 - y * y), y, 0)
        np.testing.assert_allclose(lookup(pixels, direction), color, atol=0.01)


def test_constant_is_the_same_everywhere():
    pixels = Environment(radiance=(1.0, 2.0, 3.0)).pixels
    assert (pixels == np.float32((1, 2, 3))).all()


def test_scale_is_strength_times_tint():
    assert Environment(radiance=1.0, strength=2, tint=(1, 0.5, 0)).scale == (2.0, 1.0, 0.0)


def test_panoramas_are_told_apart_by_content():
    pixels = np.ones((2, 4, 3), np.float32)
    assert Panorama(pixels) == Panorama(pixels.copy(), "some.hdr")
    assert Panorama(pixels) != Panorama(2 * pixels)
    assert hash(Environment(image=Panorama(pixels))) == hash(Environment(image=Panorama(pixels.copy())))


@pytest.mark.parametrize(
    "pixels", [np.zeros((2, 2)), np.zeros((0, 2, 3)), np.full((1, 1, 3), np.nan), np.full((1, 1, 3), -1.0)]
)
def test_pixels_that_are_no_radiance_are_refused(pixels):
    with pytest.raises(ValueError, match="pixels of an environment"):
        Panorama(pixels)


@pytest.mark.parametrize("sources", [{}, {"radiance": 1.0, "gradient": Gradient(1.0, 1.0, 1.0)}])
def test_an_environment_has_exactly_one_source(sources):
    with pytest.raises(ValidationError, match="exactly one"):
        Environment(**sources)
