# SPDX-License-Identifier: MIT
"""The renderer from the outside: several of them, one that begins again, what compiles, and what it says of itself."""

from dataclasses import replace

import numpy as np
import pytest
from agreement import ROUNDING
from rendering import rendered
from scene_builders import lambert, rectangle
from small_pictures import SCENES, SIZE, SPP, picture

import fragtracer
from fragtracer.gpu import tracer
from fragtracer.gpu.film import Film
from fragtracer.io.toml import load
from fragtracer.packing import pack
from fragtracer.renderer import Renderer, render
from fragtracer.scene import Ambient, Camera, Light, Material, RenderSettings, Scene


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
