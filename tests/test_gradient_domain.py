# SPDX-License-Identifier: MIT
"""The gradient domain: pictures from differences have no bias and less error, and their standard error is true."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer import guiding, light_tracing
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.decisions import gradient_domain
from fragtracer.errors import FilmError
from fragtracer.films import SavedFilm, merge
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.sampling.allocation import FIRST_STAGE
from fragtracer.sampling.gradients import UNKNOWN, GradientPilot, Weights, reconstruct
from fragtracer.scene import PLAIN, RenderSettings

Floats = NDArray[np.float64]

EVEN = {"adaptive": "off", "guiding": "off", "light_tracing": "off"}
found_by = GradientPilot.found


def test_the_picture_is_the_nearest_one() -> None:
    """To pixels and differences of which each has its weight: against numpy's least squares, at an odd size."""
    height, width = 5, 7
    rng = np.random.default_rng(0)
    aligned, shifted = rng.normal(size=(2, 1, height, width))
    weights = Weights.of(rng.exponential(size=(height, width)) ** 2, 0.1)
    number = np.arange(height * width).reshape(height, width)
    rows, right = [], []

    def equation(weight: float, coefficients: dict[int, float], value: float) -> None:
        rows.append(np.zeros(height * width))
        for place, coefficient in coefficients.items():
            rows[-1][place] = np.sqrt(weight) * coefficient
        right.append(np.sqrt(weight) * value)

    for y, x in np.ndindex(height, width):
        equation(weights.pixels[y, x], {number[y, x]: 1}, (aligned[0, y, x] + shifted[0, y, x]) / 2)
        for dy, dx, of_neighbours, first in ((0, 1, weights.rows, x), (1, 0, weights.columns, y)):
            if y + dy < height and x + dx < width:
                found = shifted[0] if first % 2 else aligned[0]
                pair = {number[y, x]: -1, number[y + dy, x + dx]: 1}
                equation(of_neighbours[y, x], pair, found[y + dy, x + dx] - found[y, x])
    expected = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0].reshape(height, width)
    np.testing.assert_allclose(reconstruct(aligned, shifted, weights)[0], expected, atol=3e-3)


def test_reconstruction_has_no_bias() -> None:
    """It is linear, and leaves a picture alone whose differences are the given ones."""
    rng = np.random.default_rng(1)
    weights = Weights.of(rng.exponential(size=(9, 8)) ** 2, 0.4)
    pictures = rng.normal(size=(5, 9, 8))
    np.testing.assert_allclose(reconstruct(pictures, pictures, weights), pictures, atol=1e-12)
    one, other, three, four = pictures[:4, None]
    separate = reconstruct(one, other, weights) + 2 * reconstruct(three, four, weights)
    np.testing.assert_allclose(reconstruct(one + 2 * three, other + 2 * four, weights), separate, atol=1e-12)


def boxes(ctx: Any, side: int, seeds: int) -> tuple[dict[str, tuple[NDArray[Any], NDArray[Any]]], float, float]:
    """Pictures of the Cornell box with 160 samples and their standard errors (seeds, side, side, 3) each, from
    differences and without, by "on" and "off"; and the mean relative variances of both."""
    found = {}
    for choice in ("on", "off"):
        images, errors = [], []
        with Renderer(
            load("cornell-box"), (side, side), context=ctx, gradient_domain=choice, bounces=4, **EVEN
        ) as renderer:
            for seed in range(seeds):
                renderer.reset(seed=seed)
                renderer.sample(160)
                images.append(renderer.image().astype(np.float64))
                errors.append(renderer.standard_error().astype(np.float64))
            assert renderer.spp == 160
            np.testing.assert_array_equal(renderer.samples(), 160)
        found[choice] = np.array(images), np.array(errors)
    weight = relative_weight((found["on"][0].mean(axis=0) + found["off"][0].mean(axis=0)) / 2)
    on, off = (float((images.var(axis=0, ddof=1) * weight).mean()) for images, _ in (found["on"], found["off"]))
    return found, on, off


def test_differences_lower_the_error(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """By 30 % at least in the Cornell box with few samples, as pilots say; the mean stays the same, and the standard
    error is true."""
    promised, seeds = [], 8
    monkeypatch.setattr(GradientPilot, "found", lambda pilot: promised.append(told := found_by(pilot)) or told)
    found, on, off = boxes(ctx, 128, seeds)
    assert on < 0.7 * off
    assert len(promised) == seeds
    assert np.mean([gradients.gain for gradients in promised]) == pytest.approx(off / on, rel=0.15)
    for images, errors in found.values():
        true, said = np.sqrt(images.var(axis=0, ddof=1).mean()), np.sqrt((errors**2).mean())
        assert said == pytest.approx(true, rel=0.2)
    tiles = [images.reshape(seeds, 8, 16, 8, 16, 3).mean(axis=(2, 4)) for images, _ in found.values()]
    spread = sum(tile.var(axis=0, ddof=1) / seeds for tile in tiles)
    score = np.abs(tiles[0].mean(axis=0) - tiles[1].mean(axis=0)) / np.sqrt(spread)
    # Student's t with 7 degrees of freedom at least: 1e-2 over 192 comparisons (Šidák).
    assert score.max() < 8.7


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_pilot_goes_on_where_its_first_tiles_leave_too_much_open(
    ctx: Any, monkeypatch: pytest.MonkeyPatch, goes_on: bool
) -> None:
    """The first tiles have the same samples then."""
    pilots: list[GradientPilot] = []
    monkeypatch.setattr(GradientPilot, "found", lambda pilot: pilots.append(pilot) or found_by(pilot))
    monkeypatch.setattr(GradientPilot, "asks_for_more", lambda pilot, *_: pilots.append(pilot) or goes_on)
    with Renderer(load("cornell-box"), (160, 112), context=ctx, gradient_domain="on", bounces=2, **EVEN) as renderer:
        renderer.sample(34)
    first, pilot = pilots
    assert (len(first.tiles.weights), len(pilot.tiles.weights)) == (16, 18 if goes_on else 16)
    np.testing.assert_array_equal(pilot.items.mean[: len(first.items.mean)], first.items.mean)
    np.testing.assert_array_equal(pilot.tiles.pixels[:16], first.tiles.pixels)
    monkeypatch.undo()
    gain = pilot.found().gain
    for least, asks in ((1.02, True), (0.25, False)):
        assert pilot.asks_for_more(least * gain, 8 * 160, 8 * 112) == asks
    for dots, least, asks in ((1, 0.25, True), (3, 0.25, True), (1, 4.0, False), (60, 0.25, False)):
        pilot.__dict__["_dots"] = np.zeros((len(pilot.tiles.weights), 16, 16))
        pilot._dots.reshape(len(pilot.tiles.weights), -1).T.flat[: 2 * dots : 2] = 1
        assert pilot.asks_for_more(least * gain, 8 * 160, 8 * 112) == asks, dots


def test_no_sample_of_the_picture_decides(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Or their weight would depend on them."""
    with Renderer(load("cornell-box"), (64, 64), context=ctx, spp=2**12, bounces=2, **PLAIN) as renderer:
        film = renderer._film
        film.adaptive = film.gradient_domain = "auto"
        renderer.sample(FIRST_STAGE)
        monkeypatch.setattr(film._film, "read", None)
        for _ in film._decide(renderer._tracer, None):
            pass
        assert film._gradients not in (None, UNKNOWN)


def test_it_is_used_where_it_pays(ctx: Any) -> None:
    """In a room with matte walls, but not where it would leave dots, where adaptive sampling promises more, nor where
    light is traced from the lights; the first samples are those of single pixels."""
    alone = {"guiding": "off", "light_tracing": "off"}
    for name, settings, said in (
        ("cornell-box", alone, "on: at equal samples it divides the squared error by"),
        ("weekend", alone | {"adaptive": "off"}, "off: at equal samples it divides the squared error by"),
        ("three-spheres", alone, "off: samples are placed adaptively"),
        ("fog", alone, "off: bright samples are so rare that differences would leave dark dots"),
        ("five-lights", {"light_tracing": "on", "guiding": "off"}, "off: light is traced from the lights"),
    ):
        with Renderer(load(name), (128, 128), context=ctx, spp=2**10, **settings) as renderer:
            renderer.sample(40)
            assert said in renderer.metadata()["gradient_domain_decision"], name
    images = []
    for choice in ("on", "off"):
        with Renderer(load("cornell-box"), (20, 20), context=ctx, gradient_domain=choice, **EVEN) as renderer:
            renderer.sample(32)
            images.append(renderer.image())
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"gradient_domain": "off"}, "off: as asked for"),
        ({"gradient_domain": "on"}, "on: as asked for"),
        ({"integrator": "split-sum"}, "off: the integrator is split-sum"),
        ({"adaptive": "on"}, "off: adaptive sampling was asked for"),
        ({"aovs": ["emission"]}, "off: layers of light"),
        ({"spp": 64}, "off: the 64 samples per pixel are too few"),
        ({"spp": 2**24}, "off: there are no more than 32 samples"),
    ],
    ids=str,
)
def test_the_decision_says_why(ctx: Any, settings: dict[str, Any], reason: str) -> None:
    with Renderer(load("cornell-box"), (8, 8), context=ctx, guiding="off", **settings) as renderer:
        assert renderer.metadata()["gradient_domain_decision"].startswith(reason)


@pytest.mark.parametrize(("spp", "has_meshes", "asks"), [(128, False, True), (127, False, False), (255, True, True)])
def test_small_pictures_ask_no_pilot(spp: int, has_meshes: bool, asks: bool) -> None:
    """Of less than 2^23 samples."""
    decided = light_tracing.Decision(False, ""), guiding.Decision(None, "")
    choice, _ = gradient_domain(RenderSettings(width=256, height=256), spp, has_meshes, decided, "")
    assert choice == ("auto" if asks else "off")


def test_it_excludes_adaptive_sampling() -> None:
    with pytest.raises(ValueError, match='adaptive and gradient_domain must not both be "on"'):
        RenderSettings(adaptive="on", gradient_domain="on")


def test_films_of_differences_are_not_merged(ctx: Any, tmp_path: Path) -> None:
    film = tmp_path / "film.npz"
    with Renderer(load("cornell-box"), (8, 8), context=ctx, gradient_domain="on", **EVEN) as renderer:
        renderer.sample(40)
        renderer.save(film)
    with pytest.raises(FilmError, match="--gradient-domain off"):
        merge({"one": SavedFilm.read(film), "two": SavedFilm.read(film)})
