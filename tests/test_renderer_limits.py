# SPDX-License-Identifier: MIT
"""What a renderer counts, and when it stops: samples that are no numbers, time, errors, memory, an interruption."""

import time
from dataclasses import replace

import numpy as np
import pytest
from agreement import assert_mean
from rendering import Planter, rendered
from scene_builders import box, lambert
from small_pictures import SIZE, SPP, picture

from fragtracer.errors import DeviceError, FragtracerError
from fragtracer.films import MOST_SAMPLES
from fragtracer.gpu import tracer
from fragtracer.gpu.accumulation import are_fewer
from fragtracer.gpu.context import is_software
from fragtracer.io.toml import load
from fragtracer.renderer import Progress, Renderer
from fragtracer.scene import PLAIN, Ambient, Camera, Scene

NAN, INF = "uintBitsToFloat(0x7fc00000u)", "uintBitsToFloat(0x7f800000u)"


@pytest.mark.parametrize("value", [NAN, INF, f"-{INF}"], ids=["nan", "inf", "-inf"])
@pytest.mark.parametrize("channel", ["vec3({0})", "vec3(0.0, {0}, 0.0)"], ids=["all", "one"])
def test_samples_that_are_not_finite_are_counted(ctx, monkeypatch, tmp_path, value, channel):
    """One in four is spoilt here: counted, left out, and the mean of the others is untouched."""
    sample = f"(film.next % 4u == 1u ? path.radiance + {channel.format(value)} : path.radiance)"
    Planter(monkeypatch, tmp_path)(
        "integrator/path.glsl",
        "film_add_if(ends, film, moments_of_path(path.moments, path.radiance));",
        f"film_add_if(ends, film, {sample});",
    )
    scene = Scene(Camera(), ambient=Ambient((0.1, 0.2, 0.3)))
    with Renderer(scene, SIZE, context=ctx, rays=2) as renderer:
        renderer.sample(16)
        assert renderer.non_finite_samples() == SIZE[0] * SIZE[1] * 4
        assert renderer.metadata()["non_finite_samples"] == str(SIZE[0] * SIZE[1] * 4)
        np.testing.assert_allclose(renderer.image(), np.broadcast_to(np.float32((0.1, 0.2, 0.3)), (*SIZE[::-1], 3)))
        assert np.isfinite(renderer.standard_error()).all()
        renderer.reset()
        assert renderer.non_finite_samples() == 0


def test_pixel_without_any_number(ctx, monkeypatch, tmp_path):
    """Where all samples are spoilt the pixel is black, and its error infinite, not NaN."""
    Planter(monkeypatch, tmp_path)(
        "integrator/path.glsl",
        "film_add_if(ends, film, moments_of_path(path.moments, path.radiance));",
        f"film_add_if(ends, film, vec3({NAN}));",
    )
    with Renderer(Scene(Camera(), ambient=Ambient(1.0)), SIZE, context=ctx) as renderer:
        renderer.sample(8)
        assert not renderer.image().any()
        assert np.isinf(renderer.standard_error()).all()
        assert renderer.non_finite_samples() == SIZE[0] * SIZE[1] * 8


def test_image_that_the_gpu_cannot_hold(ctx, monkeypatch):
    monkeypatch.setattr("fragtracer.gpu.film.max_size", lambda _: 64)
    for size in ((65, 8), (8, 65)):
        with pytest.raises(DeviceError, match=r"at most 64 pixels a side, not \d+x\d+"):
            Renderer(load("furnace"), size, context=ctx)


def test_image_that_memory_cannot_hold(ctx):
    if not is_software(ctx):
        pytest.skip("a GPU may well have the 16 GiB that this takes")
    with pytest.raises(DeviceError, match="no memory for an image of 16384x16384"):
        Renderer(load("furnace"), (16384, 16384), context=ctx)
    assert ctx.error in ("GL_OUT_OF_MEMORY", "GL_NO_ERROR")  # and now it has been read
    picture(ctx, "cornell-box")


def test_time_runs_out(ctx):
    with Renderer(load("cornell-box"), SIZE, context=ctx, rays=2, adaptive="off") as renderer:
        start = time.perf_counter()
        renderer.render(seconds=0.3)
        assert 0.3 <= time.perf_counter() - start < 10
        assert renderer.spp > 2
        assert renderer.spp % 2 == 0
        done = renderer.spp
        renderer.render(seconds=0.0)
        assert done < renderer.spp <= done + 64  # a pass


@pytest.mark.parametrize("radiance", [1e-20, 1e20])
def test_an_error_whose_square_is_no_float32_is_not_known(ctx, radiance):
    """And is said to be none of those that are asked for, once."""
    scene = load("cornell-box")
    lamp = replace(scene.materials["lamp"], emission=radiance)
    with Renderer(replace(scene, materials={**scene.materials, "lamp": lamp}), SIZE, context=ctx) as renderer:
        with pytest.warns(UserWarning, match="the error of the picture is not known") as said:
            renderer.render(48, until=0.5, worst=0.5)
        assert len(said) == 1
        assert renderer.spp == 48
        assert renderer.relative_error() == renderer.worst_error() == np.inf


def test_error_is_small_enough(ctx):
    with Renderer(load("cornell-box"), SIZE, context=ctx) as renderer:
        heard: list[Progress] = []
        renderer.render(until=0.05, progress=heard.append)
        assert renderer.relative_error() <= 0.05
        assert 16 < renderer.spp < 10_000
        assert heard[-1].spp == renderer.spp
        assert any(progress.relative_error is not None for progress in heard)
        renderer.reset()
        renderer.sample(1)
        assert (renderer.relative_error(), renderer.worst_error()) == (np.inf, np.inf)
        renderer.reset()
        renderer.render(until=0.0, spp=40)
        assert renderer.spp == 40


def test_no_pixel_has_more_samples_than_float32_counts(ctx, monkeypatch):
    monkeypatch.setattr("fragtracer.renderer.MOST_SAMPLES", 40)
    with Renderer(load("furnace"), SIZE, context=ctx, **PLAIN) as renderer:
        renderer.render(seconds=60.0)
        assert renderer.spp == 40
        renderer.render(100)
        assert renderer.spp == 40


@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_more_samples_than_a_film_counts_are_refused(ctx, monkeypatch, adaptive):
    monkeypatch.setattr("fragtracer.renderer.MOST_SAMPLES", 40)
    with Renderer(load("furnace"), SIZE, context=ctx, **PLAIN | {"adaptive": adaptive}) as renderer:
        with pytest.raises(FragtracerError, match="41 samples per pixel are more than the 40 that a film can count"):
            renderer.sample(41)
        assert renderer.spp == 0
        renderer.sample(40)
        with pytest.raises(FragtracerError, match="it has 40"):
            renderer.sample(1)
        assert renderer.spp == 40


def test_a_film_counts_to_the_last_sample(ctx):
    with Renderer(load("furnace"), SIZE, context=ctx, **PLAIN) as renderer:
        renderer.sample(8)
        state, arrays = renderer._film.state()
        spp = MOST_SAMPLES - 8
        arrays["film.mean"] = np.concatenate([arrays["film.mean"][..., :3], np.full((*SIZE[::-1], 1), spp)], axis=2)
        renderer._film.restore(state | {"spp": spp, "in_stage": spp}, arrays)
        renderer.sample(8)
        assert (renderer.samples() == MOST_SAMPLES).all()
        with pytest.raises(FragtracerError, match="a film can count"):
            renderer.sample(1)


def test_samples_as_asked(ctx):
    with Renderer(load("cornell-box"), SIZE, context=ctx, spp=6, rays=4) as renderer:
        heard: list[Progress] = []
        renderer.render(progress=heard.append)
        assert renderer.spp == 6
        assert [p.spp for p in heard] == sorted(p.spp for p in heard)
        assert heard[-1].spp == 6
        renderer.render(spp=5)
        assert renderer.spp == 6  # there already
        renderer.render(spp=24)
        np.testing.assert_array_equal(renderer.image(), rendered(ctx, load("cornell-box"), 24, SIZE))


def test_interrupted(ctx, monkeypatch):
    """Ctrl-C in the middle of a pass: the finished passes are the picture, and one may go on from there."""
    monkeypatch.setattr(tracer.Tracer, "_rows", lambda *_: 10)

    def stop(progress: Progress) -> None:
        if progress.spp > 13:
            raise KeyboardInterrupt

    with Renderer(load("cornell-box"), SIZE, context=ctx, rays=4) as renderer:
        with pytest.raises(KeyboardInterrupt):
            renderer.render(spp=100, progress=stop)
        assert renderer.spp == 12
        np.testing.assert_array_equal(renderer.image(), rendered(ctx, load("cornell-box"), 12, SIZE))
        renderer.render(spp=SPP)
        np.testing.assert_array_equal(renderer.image(), picture(ctx, "cornell-box"))


@pytest.mark.parametrize("russian_roulette", [True, False])
def test_a_thousand_bounces(ctx, russian_roulette):
    """Paths in a closed room end by roulette, or after a thousand bounces; either way the picture is right."""
    scene = Scene(Camera((0.3, 0.2, 0.9), (-0.2, -0.1, -1.0)), {"glow": lambert(0.95, 1.0)}, rectangles=box("glow"))
    settings = {"bounces": 1000, "estimator": "bsdf", "russian_roulette": russian_roulette}
    image = rendered(ctx, scene, 256 if russian_roulette else 2, SIZE, **settings)
    assert_mean(image, 1 / (1 - 0.95), 0.05 if russian_roulette else 1e-4, rounding=5e-5)


def test_samples_past_what_float32_counts_are_not_taken_for_lost() -> None:
    """As a pixel may have in adaptive sampling; below that a single one that is lost is noticed."""
    drawn = np.array([100, 2**24, 2**25 + 217, 2**30 - 65])
    found = drawn.astype(np.float32)
    assert not are_fewer(found, drawn).any()
    assert are_fewer(found[:2] - 1, drawn[:2]).all()
