# SPDX-License-Identifier: MIT
"""The window shows paths and photons as a picture of both is."""

from typing import Any

import numpy as np
import pytest

from fragtracer.apps.viewer import lit_film
from fragtracer.apps.viewer.lit_film import LitFilm
from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.specialise import Level
from fragtracer.light_tracing import LightTracing
from fragtracer.packing import pack
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import RenderSettings, Scene

SIZE = WIDTH, HEIGHT = 6, 5


def with_photons(light: LightTracing, passes: int) -> None:
    """Give ``light`` that many passes of photons."""
    sums = np.random.default_rng(passes).random((3, HEIGHT, WIDTH, 3)) * passes * 1e6
    sums[2] *= 1e6
    counts = {"photons_per_sample": 0.5, "light_passes": passes, "light_non_finite": 0}
    light.restore(counts, {"light.sums": sums})


def assert_shows(shown: Pixels, expected: Pixels) -> None:
    for name, image in vars(expected).items():
        np.testing.assert_allclose(getattr(shown, name), image, rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("software", [True, False])
def test_a_film_is_shown_with_the_light_of_photons(ctx: Any, monkeypatch: Any, software: bool) -> None:
    monkeypatch.setattr("fragtracer.light_tracing.sums.is_software", lambda _: software)
    rng = np.random.default_rng(5)
    mean, variance = rng.random((2, HEIGHT, WIDTH, 4), np.float32)
    mean[..., 3] = rng.integers(1, 8, (HEIGHT, WIDTH))
    half_difference = rng.random((HEIGHT, WIDTH, 3), np.float32)
    film, light, lit = Accumulation(ctx, *SIZE, "off"), LightTracing(ctx), LitFilm(ctx)
    film._film.write(Pixels(mean, variance, half_difference), 4)
    light.load(pack(Scene(), RenderSettings(), *SIZE), Scene(), SIZE, 0.5, Level.NOTHING)
    lit.begin(film, light)
    for passes in (0, 5, 8):
        if passes:
            with_photons(light, passes)
        lit._uploads_at = 0.0  # a while after the last upload
        expected = light.added_to(film.read())
        assert_shows(lit.read_rows(0, HEIGHT), expected)
        assert_shows(lit.read_rows(1, 2), Pixels(*(image[-3:-1] for image in vars(expected).values())))
        texels = [np.frombuffer(texture.read(), np.float32).reshape(HEIGHT, WIDTH, 4) for texture in lit.textures]
        assert_shows(Pixels(texels[0][::-1], texels[1][::-1], texels[2][::-1, :, :3]), expected)
    with_photons(light, 10)
    if software:
        lit._uploads_at = np.inf
        assert_shows(lit.read_rows(0, HEIGHT), expected)
    for part in (lit, light, film):
        part.release()


def test_bands_of_an_upload_are_all_of_the_light(ctx: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(lit_film, "_BAND", 2)
    test_a_film_is_shown_with_the_light_of_photons(ctx, monkeypatch, software=True)
