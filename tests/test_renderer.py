# SPDX-License-Identifier: MIT
"""The renderer: the same picture however the work is cut, what it counts, and when it stops."""

import time
from dataclasses import replace

import numpy as np
import pytest
from agreement import ROUNDING, assert_mean
from rendering import Image, Planter, rendered
from scene_builders import box, lambert, rectangle

import fragtracer
from fragtracer.errors import DeviceError
from fragtracer.gpu import tracer
from fragtracer.gpu.context import is_software
from fragtracer.gpu.film import Film
from fragtracer.packing import pack
from fragtracer.renderer import Progress, Renderer, render
from fragtracer.scene import Ambient, Camera, Light, Material, RenderSettings, Scene, Sphere
from fragtracer.scene_file import load

SIZE = (32, 24)
SPP = 24
# Spheres, a plane, ambient light and gloss in the one; rectangles, an area light and many bounces in the other.
SCENES = ("three-spheres-ambient", "cornell-box")


def picture(ctx, name: str, **settings) -> Image:
    return rendered(ctx, load(name), SPP, SIZE, **settings)


# The same picture, bit for bit.


@pytest.mark.parametrize("sampler", ["texture", "hash"])
@pytest.mark.parametrize("name", SCENES)
def test_same_seed_same_picture(ctx, name, sampler):
    image = picture(ctx, name, sampler=sampler)
    np.testing.assert_array_equal(picture(ctx, name, sampler=sampler), image)
    other = picture(ctx, name, sampler=sampler, seed=1)
    assert (other != image).any(-1).mean() > 0.5
    assert other.mean() == pytest.approx(image.mean(), rel=0.1)


@pytest.mark.parametrize("name", SCENES)
def test_cut_into_passes(ctx, name):
    image = picture(ctx, name)
    for rays in (1, 3, 8):
        np.testing.assert_array_equal(picture(ctx, name, rays=rays), image)
    with Renderer(load(name), SIZE, context=ctx) as renderer:
        for _ in range(SPP):
            renderer.sample(1)
        assert renderer.spp == SPP
        np.testing.assert_array_equal(renderer.image(), image)


@pytest.mark.parametrize("name", SCENES)
def test_cut_into_bands(ctx, monkeypatch, name):
    """As on a machine so slow that it draws a row at a time, or a few."""
    image = picture(ctx, name)
    for rows in (1, 7):
        monkeypatch.setattr(tracer.Tracer, "_rows", lambda *_, rows=rows: rows)
        np.testing.assert_array_equal(picture(ctx, name, rays=5), image)


def test_bands_keep_the_budget(ctx, monkeypatch):
    """A draw that took longer than its budget is followed by smaller ones."""
    bands = []
    with Renderer(load("three-spheres"), (64, 64), context=ctx) as renderer:
        renderer.sample(16)
        monkeypatch.setattr(tracer, "DRAW_BUDGET", 1e-6)
        monkeypatch.setattr(tracer, "_FIRST_BAND", 1)
        monkeypatch.setattr(tracer.Tracer.bands, "__defaults__", (1e-6,))
        renderer.sample(1, bands.append)
    assert len(bands) > 32
    assert bands[-1] == 17


@pytest.mark.parametrize("name", SCENES)
def test_compiled_in_or_not(ctx, name):
    """Bit for bit on the drivers known so far; one that folds constants with other rounding may let a path
    in a million go another way."""
    image, other = picture(ctx, name, baked=True), picture(ctx, name, baked=False)
    assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 1e-5
    assert (np.abs(other - image) > 1e-4 * np.abs(image)).mean() < 0.01


def test_stored_in_a_texture(ctx, monkeypatch):
    """A scene too large for the uniform block, and the same one as if the block were larger."""
    rng = np.random.default_rng(5)
    materials = {"ball": Material(albedo=(0.7, 0.4, 0.2), roughness=0.4), "lamp": lambert(0.0, 2.0)}
    balls = [Sphere(rng.uniform(-1, 1, 3), 0.06, "lamp" if i % 50 == 0 else "ball") for i in range(600)]
    scene = Scene(Camera((0.0, 0.0, 4.0)), materials, spheres=balls, ambient=Ambient(0.3))
    images = []
    for most in (1024, 1 << 16):
        monkeypatch.setattr("fragtracer.packing._MAX_UNIFORM_TEXELS", most)
        images.append(rendered(ctx, scene, 4, SIZE, bounces=3))
    assert images[0].mean() > 0.1
    np.testing.assert_array_equal(*images)
    small = load("three-spheres-ambient")
    inside = rendered(ctx, small, 8, SIZE, baked=False)
    monkeypatch.setattr("fragtracer.packing._MAX_UNIFORM_TEXELS", 0)
    np.testing.assert_array_equal(rendered(ctx, small, 8, SIZE, baked=False), inside)


def test_paths_that_wait_for_their_neighbours(ctx):
    """Without regeneration a pixel's paths begin together; they are the same paths."""
    image = picture(ctx, "cornell-box")
    with Renderer(load("cornell-box"), SIZE, context=ctx, defines={"PATH_REGENERATION": 0}) as renderer:
        renderer.sample(SPP)
        np.testing.assert_allclose(renderer.image(), image, rtol=1e-4, atol=1e-6)


# Several renderers, and one that begins again.


def test_several_on_one_context(ctx):
    images = [picture(ctx, name) for name in SCENES]
    renderers = [Renderer(load(name), SIZE, context=ctx) for name in SCENES]
    for _ in range(SPP // 8):
        for renderer in renderers:
            renderer.sample(8)
    for renderer, image in zip(renderers, images, strict=True):
        np.testing.assert_array_equal(renderer.image(), image)
        renderer.close()


def test_several_on_contexts_of_their_own(ctx):
    """They take turns, and do not mind that one of them is closed or that another context is current."""
    images = [picture(ctx, name) for name in SCENES]
    renderers = [Renderer(load(name), SIZE) for name in SCENES]
    for _ in range(SPP // 8):
        for renderer in renderers:
            renderer.sample(8)
    np.testing.assert_array_equal(renderers[0].image(), images[0])
    renderers[0].close()
    with ctx:
        np.testing.assert_array_equal(picture(ctx, SCENES[0]), images[0])
        np.testing.assert_array_equal(renderers[1].image(), images[1])
    renderers[1].close()


def test_reset_forgets(ctx, monkeypatch):
    monkeypatch.setattr(tracer.Tracer, "_rows", lambda *_: 7)  # all of it, not the last band alone
    with Renderer(load("cornell-box"), SIZE, context=ctx, rays=5) as renderer:
        renderer.sample(7)
        renderer.reset()
        assert renderer.spp == 0
        assert not renderer.image().any()
        renderer.sample(SPP)
        np.testing.assert_array_equal(renderer.image(), picture(ctx, "cornell-box"))
        renderer.reset(seed=9)
        renderer.sample(SPP)
        np.testing.assert_array_equal(renderer.image(), picture(ctx, "cornell-box", seed=9))
        with pytest.raises(ValueError, match="size"):
            renderer.reset(width=10)


@pytest.fixture
def compiled(monkeypatch):
    """Grows by one for each program that is compiled."""
    programs = []

    class Counted(tracer.FullscreenProgram):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            programs.append(self)

    monkeypatch.setattr(tracer, "FullscreenProgram", Counted)
    return programs


def test_edited_values_do_not_compile(ctx, compiled):
    """Colours, places, lights, the camera and the seed are uniforms; other kinds of things are not."""
    scene = load("three-spheres-ambient")
    sphere = replace(scene.spheres[0], center=(-1.0, 0.6, 0.1))
    edited = replace(
        scene,
        materials=scene.materials
        | {"matte": lambert((0.1, 0.9, 0.3)), "gold": Material(metal="copper", roughness=0.2)},
        spheres=[sphere, *scene.spheres[1:]],
        lights=[replace(scene.lights[0], radius=0.5)],
        camera=replace(scene.camera, fov_degrees=50.0),
        ambient=Ambient(0.9),
    )
    with Renderer(scene, SIZE, context=ctx, baked=False) as renderer:
        before = len(compiled)
        renderer.sample(4)
        renderer.reset(edited, seed=3, bounces=4, light_samples=2)
        renderer.sample(SPP)
        assert len(compiled) == before
        image = renderer.image()
        renderer.reset(replace(edited, spheres=[*edited.spheres, sphere]))
        assert len(compiled) == before + 1
    fresh = rendered(ctx, edited, SPP, SIZE, seed=3, bounces=4, light_samples=2, baked=False)
    np.testing.assert_array_equal(image, fresh)


def test_edited_values_show_where_they_are_compiled_in(ctx, compiled):
    scene = load("furnace")
    edited = replace(scene, materials={"furnace": lambert(0.5, 0.3)})
    with Renderer(scene, SIZE, context=ctx, baked=True, estimator="bsdf") as renderer:
        renderer.sample(4)
        renderer.reset(edited, russian_roulette=False)
        renderer.sample(4)
        assert len(compiled) == 2
        np.testing.assert_allclose(renderer.image(), 0.6, rtol=ROUNDING)


# Samples that are no numbers.

NAN, INF = "uintBitsToFloat(0x7fc00000u)", "uintBitsToFloat(0x7f800000u)"


@pytest.mark.parametrize("value", [NAN, INF, f"-{INF}"], ids=["nan", "inf", "-inf"])
@pytest.mark.parametrize("channel", ["vec3({0})", "vec3(0.0, {0}, 0.0)"], ids=["all", "one"])
def test_samples_that_are_not_finite_are_counted(ctx, monkeypatch, tmp_path, value, channel):
    """One in four is spoilt here: counted, left out, and the mean of the others is untouched."""
    sample = f"(index % 4u == 1u ? path.radiance + {channel.format(value)} : path.radiance)"
    Planter(monkeypatch, tmp_path)("pathtracer.frag", "film_add(film, path.radiance);", f"film_add(film, {sample});")
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
    Planter(monkeypatch, tmp_path)("pathtracer.frag", "film_add(film, path.radiance);", f"film_add(film, vec3({NAN}));")
    with Renderer(Scene(Camera(), ambient=Ambient(1.0)), SIZE, context=ctx) as renderer:
        renderer.sample(8)
        assert not renderer.image().any()
        assert np.isinf(renderer.standard_error()).all()
        assert renderer.non_finite_samples() == SIZE[0] * SIZE[1] * 8


# Limits.


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
    with Renderer(load("cornell-box"), SIZE, context=ctx, rays=2) as renderer:
        start = time.perf_counter()
        renderer.render(seconds=0.3)
        assert 0.3 <= time.perf_counter() - start < 10
        assert renderer.spp > 2
        assert renderer.spp % 2 == 0
        done = renderer.spp
        renderer.render(seconds=0.0)
        assert renderer.spp == done + 2  # at least a pass


def test_error_is_small_enough(ctx):
    with Renderer(load("cornell-box"), SIZE, context=ctx) as renderer:
        heard: list[Progress] = []
        renderer.render(until=0.05, progress=heard.append)
        assert renderer.relative_error() <= 0.05
        assert 16 < renderer.spp < 10_000
        assert heard[-1].spp == renderer.spp
        assert any(progress.relative_error is not None for progress in heard)
        renderer.reset()
        renderer.render(until=0.0, spp=40)
        assert renderer.spp == 40


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


# From the outside.


def test_render_in_one_call():
    scene = Scene(
        Camera(), {"lamp": lambert(0.0, 3.0)}, rectangles=[rectangle((0, 0, 0), (9, 0, 0), (0, 9, 0), "lamp")]
    )
    image = fragtracer.render(scene, size=(8, 6), spp=2)
    assert image.shape == (6, 8, 3)
    assert image.dtype == np.float32
    assert image.flags.c_contiguous
    np.testing.assert_array_equal(image, 3)
    assert render(replace(scene, render=replace(scene.render, width=5, height=4, spp=1))).shape == (4, 5, 3)


def test_settings_are_checked():
    with pytest.raises(ValueError, match="bounces"):
        render(Scene(), (8, 8), bounces=-1)
    with pytest.raises(ValueError, match="bounce"):
        render(Scene(), (8, 8), bounce=1)


def test_metadata_say_what_made_the_image(ctx):
    scene = Scene(Camera(), lights=[Light((0.0, 1.0, 0.0), power=1.0)], name="lamp")
    with Renderer(scene, SIZE, context=ctx, bounces=3, sampler="hash") as renderer:
        renderer.sample(5)
        metadata = renderer.metadata()
    assert metadata["scene"] == "lamp"
    assert (metadata["spp"], metadata["bounces"], metadata["sampler"]) == ("5", "3", "hash")
    assert metadata["software"] == f"fragtracer {fragtracer.__version__}"
    assert metadata["gl_renderer"]
    assert all(isinstance(value, str) for value in metadata.values())


def test_speed_is_by_the_clock_of_the_timer(ctx):
    """Where a GPU has a clock of its own, what the driver and Python take is not the GPU's slowness."""

    class Clock:
        """Every draw takes 10 ms."""

        seconds = 0.0

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.seconds += 0.01

    settings = RenderSettings()
    drawn = tracer.Tracer(ctx, pack(load("mirror"), settings, 64, 16))
    film = Film(ctx, 64, 16)
    drawn.timer = Clock()
    for _ in drawn.bands(film, 1):
        pass
    assert drawn.pixel_samples_per_second == pytest.approx(64 * 16 / 0.01)
    drawn.release()
    film.release()
