# SPDX-License-Identifier: MIT
"""The renderer from the outside: several of them, one that begins again, what compiles, and what it says of itself."""

import math
import re
from dataclasses import replace
from functools import partial

import moderngl
import numpy as np
import pytest
from agreement import ROUNDING
from mesh_shapes import ball, mesh_scene, smooth
from pydantic import ValidationError
from rendering import list_at_most, rendered
from scene_builders import everything, lambert, rectangle
from small_pictures import SCENES, SIZE, SPP, picture
from textured_scenes import mesh, texture

import fragtracer
from fragtracer.arguments import checked_first_sample, checked_size
from fragtracer.errors import DeviceError, FragtracerError
from fragtracer.gpu import tracer
from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.context import create_context
from fragtracer.gpu.film import Film
from fragtracer.gpu.tracer import Tracer
from fragtracer.io.toml import load
from fragtracer.light_tracing.tracer import LightTracer
from fragtracer.packing import pack
from fragtracer.renderer import Renderer, expected_spp, render
from fragtracer.scene import (
    Ambient,
    Camera,
    Density,
    Disk,
    Environment,
    Geometry,
    Light,
    Material,
    Medium,
    Panorama,
    RenderSettings,
    Scene,
    Sphere,
)


@pytest.mark.parametrize(
    ("spp", "seconds", "expected"), [(None, 60, 16384), (64, 60, 64), (None, 0, 1), (None, math.inf, 2**24)]
)
def test_a_time_stands_for_samples(spp, seconds, expected):
    assert expected_spp(RenderSettings(width=160, height=96), spp, seconds) == expected


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
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            programs.append(self)

    monkeypatch.setattr(tracer, "FullscreenProgram", Counted)
    return programs


def test_edited_values_do_not_compile(ctx, compiled):
    """Colours, places, lights, the camera and the seed are data; other kinds of things are not."""
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
    with Renderer(scene, SIZE, context=ctx, specialised=False) as renderer:
        before = len(compiled)
        renderer.sample(4)
        renderer.reset(edited, seed=3, bounces=4, light_samples=2)
        renderer.sample(SPP)
        assert len(compiled) == before
        image = renderer.image()
        renderer.reset(replace(edited, disks=[Disk((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), 0.5, "matte")]))
        assert len(compiled) == before
        renderer.reset(replace(edited, lights=[*edited.lights, Light((0.0, 2.0, 0.0), power=5.0)]))
        assert len(compiled) == before + 1  # the first point
    fresh = rendered(ctx, edited, SPP, SIZE, seed=3, bounces=4, light_samples=2, specialised=False)
    np.testing.assert_array_equal(image, fresh)


def edits_of(scene: Scene) -> dict[str, Scene]:
    """Each kind of thing added, removed and changed, and enough shapes added that another storage holds them."""
    fields = ("spheres", "planes", "rectangles", "disks", "triangles", "lights", "spot_lights", "directional_lights")
    found = {}
    for field in fields:
        items = getattr(scene, field)
        found[f"{field} added"] = replace(scene, **{field: [*items, *items]})
        if field not in ("spot_lights", "directional_lights", "lights"):
            left = [item for item in items if item.material == "lamp"]
            found[f"{field} removed"] = replace(scene, **{field: left})
        found[f"{field} in another order"] = replace(scene, **{field: items[::-1]})
    for material in ("matte", "gold", "lamp"):
        color = {"metal": "copper"} if material == "gold" else {"albedo": (0.1, 0.8, 0.3)}
        other = replace(scene.materials[material], roughness=0.7, **color)
        found[f"{material} changed"] = replace(scene, materials=scene.materials | {material: other})
    more = {f"other {i}": replace(scene.materials["gold"], roughness=0.1 * i) for i in range(1, 9)}
    balls = [Sphere((0.3 * i - 1.5, 0.1, 1.0), 0.1, name) for i, name in enumerate(more)]
    found["materials added"] = replace(scene, materials=scene.materials | more, spheres=[*scene.spheres, *balls])
    shines = replace(scene.materials["gold"], emission=0.5)
    found["a shape begins to shine"] = replace(scene, materials=scene.materials | {"gold": shines})
    culled = replace(scene.materials["matte"], double_sided=False)
    found["a material loses its back"] = replace(scene, materials=scene.materials | {"matte": culled})
    crowd = [Sphere((0.1 * (i % 20) - 1, 0.1 * (i // 20), -1.0), 0.04, "gold") for i in range(200)]
    found["many shapes"] = replace(scene, spheres=[*scene.spheres, *crowd])
    lamps = [Light((0.1 * i, 3.0, 0.0), power=0.1) for i in range(40)]
    found["many lights"] = replace(scene, lights=[*scene.lights, *lamps])
    return found


@pytest.mark.parametrize("most_listed", [0, 64], ids=["bvh", "list"])
def test_no_edit_compiles(ctx, compiled, monkeypatch, most_listed):
    """Unless it brings a kind of thing that there was none of; and each has the picture of a renderer of its own."""
    list_at_most(monkeypatch, most_listed)
    scene = everything()
    settings = {"bounces": 2, "specialised": False}
    with Renderer(scene, (16, 12), context=ctx, **settings) as renderer:
        renderer.sample(1)
        assert len(compiled) == 1
        for name, edited in edits_of(scene).items():
            renderer.reset(edited)
            renderer.sample(4)
            assert len(compiled) == 1, name
            image = renderer.image()
            assert image.any()
            if name in ("many shapes", "many lights", "materials added", "disks removed", "spheres added"):
                np.testing.assert_array_equal(image, rendered(ctx, edited, 4, (16, 12), **settings))
                compiled[1:] = []
        without = {
            "a textured mesh": {
                "meshes": mesh_scene(smooth(ball())).meshes,
                "materials": scene.materials | {"mesh": lambert(0.5)},
            },
            "no spot": {"spot_lights": ()},
        }
        for number, changed in enumerate(without.values(), start=2):
            renderer.reset(replace(scene, **changed))
            assert len(compiled) == number
        renderer.reset(scene)
        assert len(compiled) == 3  # the first program was kept


def contents(seed: int) -> Scene:
    """Arrays of all kinds, of the same sizes with each ``seed``."""
    rng = np.random.default_rng(seed)
    points, triangles = ball(12, 6)
    uvs, colors = rng.random((len(points), 2)), rng.random((len(points), 3))
    normals = (0.5 + 0.4 * rng.random((4, 4, 3))).astype(np.float32)
    mapped = Material(
        albedo_texture=texture(rng.integers(0, 256, (4, 4, 3), np.uint8)), normal_texture=texture(normals)
    )
    smoke = Medium(extinction=3.0, albedo=0.8, density=Density(rng.random((3, 4, 5))), bounds=((-1,) * 3, (1,) * 3))
    return Scene(
        Camera((0.0, 1.0, 4.0), (0.0, 0.3, 0.0), fov_degrees=40.0),
        {"mapped": mapped, "cloud": Material(model="null", interior="smoke")},
        spheres=[Sphere((0.9, 0.4, 0.0), 0.5, "cloud")],
        media={"smoke": smoke},
        meshes=[mesh(Geometry((0.6 + 0.1 * seed) * points, triangles, uvs=uvs, colors=colors), "mapped")],
        environment=Environment(image=Panorama(rng.random((8, 16, 3), np.float32))),
    )


def test_what_is_new_is_seen_where_all_is_as_large_as_before(ctx):
    """Images, normals, vertices, densities and the environment: each has the picture of a renderer of its own."""
    settings = {"bounces": 3, "specialised": False, "adaptive": "off"}
    first, second = (contents(seed) for seed in range(2))
    images = []
    with Renderer(first, SIZE, context=ctx, **settings) as renderer:
        for scene in (second, first):
            renderer.reset(scene)
            renderer.sample(4)
            images.append(renderer.image())
    assert (images[0] != images[1]).mean() > 0.9
    with Renderer(second, SIZE, context=ctx, **settings) as fresh:
        fresh.sample(4)
        np.testing.assert_array_equal(images[0], fresh.image())


def test_edited_values_show_where_they_are_compiled_in(ctx, compiled):
    scene = load("furnace")
    edited = replace(scene, materials={"furnace": lambert(0.5, 0.3)})
    with Renderer(scene, SIZE, context=ctx, specialised=True, estimator="bsdf") as renderer:
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


def no_room(*_arguments, **_options):
    raise DeviceError("there is no room")


def no_memory(*_arguments, **_options):
    raise MemoryError


def ctrl_c(*_arguments, **_options):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("others", "load_light", "error"),
    [
        ({"bounces": -1}, no_room, ValidationError),
        ({"light_tracing": "on"}, no_room, DeviceError),
        ({"light_tracing": "on"}, no_memory, MemoryError),
        ({"light_tracing": "on"}, ctrl_c, KeyboardInterrupt),
    ],
    ids=["settings", "the GPU", "the processor", "the user"],
)
def test_a_reset_that_fails_begins_anew_with_what_there_was(ctx, monkeypatch, others, load_light, error):
    """Settings that are none, a scene of which there is no room for a part, and one that was given up."""
    image = picture(ctx, SCENES[0])
    with Renderer(load(SCENES[0]), SIZE, context=ctx) as renderer:
        origin = renderer.origin()
        renderer.sample(3)
        with monkeypatch.context() as patched:
            patched.setattr(LightTracer, "load", load_light)
            with pytest.raises(error):
                renderer.reset(load("three-spheres"), **others)
        assert renderer.origin() == origin
        renderer.sample(SPP - renderer.spp)
        np.testing.assert_array_equal(renderer.image(), image)


def test_nothing_is_left_of_a_renderer_that_cannot_be_made(monkeypatch):
    """Neither its context nor, in one that others use, what it holds there."""
    made = create_context()
    monkeypatch.setattr("fragtracer.renderer.create_context", lambda: made)
    monkeypatch.setattr(Tracer, "load", no_room)
    with pytest.raises(DeviceError, match="no room"):
        Renderer(load("furnace"), SIZE)
    assert isinstance(made.mglo, moderngl.mgl.InvalidObject)


def test_a_renderer_that_cannot_be_made_leaves_the_context_of_others(ctx, monkeypatch):
    released = []
    with monkeypatch.context() as patched:
        for kind in (Accumulation, Tracer):
            release = kind.release
            patched.setattr(kind, "release", lambda self, r=release: released.append(type(self)) or r(self))
        patched.setattr(Renderer, "_load_light", no_room)
        with pytest.raises(DeviceError, match="no room"):
            Renderer(load("furnace"), SIZE, context=ctx)
    assert released == [Tracer, Accumulation]
    picture(ctx, SCENES[0])


def test_settings_are_checked():
    with pytest.raises(ValueError, match="bounces"):
        render(Scene(), (8, 8), bounces=-1)
    with pytest.raises(ValueError, match="bounce"):
        render(Scene(), (8, 8), bounce=1)


@pytest.mark.parametrize("size", [(8.5, 8), (8, 8, 8), 8, "8x8", (0, 8), (8, 20000), None])
def test_a_size_is_two_whole_numbers(size):
    mend = re.escape(f"size = {size!r}: give width and height in pixels, each from 1 to 16384, as (640, 480)")
    with pytest.raises(FragtracerError, match=mend):
        checked_size(size)
    assert checked_size((np.int64(8), np.int32(9))) == (8, 9)


@pytest.mark.parametrize("number", [-2, 1, 2.0, 2**32])
def test_a_first_sample_has_an_even_number(number):
    with pytest.raises(FragtracerError, match=f"^first_sample = {number}: give an even number from 0 to "):
        checked_first_sample(number)
    assert checked_first_sample(np.int64(4)) == 4


def test_a_name_is_no_scene(ctx, tmp_path):
    furnace = Renderer(load("furnace"), SIZE, context=ctx)
    export = partial(fragtracer.export_html, path=tmp_path / "a.html")
    for function in (
        fragtracer.render,
        fragtracer.Renderer,
        fragtracer.show,
        export,
        partial(fragtracer.save, path="a.toml"),
        furnace.reset,
    ):
        with pytest.raises(FragtracerError, match=r"^'furnace' is no scene; give one, as ft\.load\('furnace'\)$"):
            function("furnace")
    furnace.close()
    with pytest.raises(FragtracerError, match=r"^until is a limit of Renderer\.render: with ft\.Renderer\(scene\)"):
        render(load("furnace"), SIZE, until=0.1)


def test_a_renderer_that_refuses_goes_on_until_it_is_closed(ctx):
    with Renderer(load("furnace"), SIZE, context=ctx) as renderer:
        assert renderer.relative_error() == renderer.worst_error() == np.inf
        for spp in (64.5, -1, "64"):
            for sample in (renderer.sample, renderer.render):
                with pytest.raises(FragtracerError, match=f"^spp = {spp!r}: give a whole number of samples per pixel$"):
                    sample(spp)
        with pytest.raises(FragtracerError, match=r"^there is no matte 'foo'; there are object and material$"):
            renderer.matte_names("foo")
        renderer.render(np.int64(2))
        assert renderer.spp == 2
        assert renderer.relative_error() < np.inf
    renderer.close()
    names = ("spp", "pass_spp", "can_go_on", "draw_seconds", "gpu_clock", "gpu_bytes", "driver", "context_info")
    asked = [partial(getattr, renderer, name) for name in names]
    methods = (renderer.image, renderer.sample, renderer.render, renderer.reset, renderer.metadata, renderer.origin)
    for use in (*methods, *asked):
        with pytest.raises(FragtracerError, match=r"^this renderer is closed; make another one$"):
            use()


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
    drawn = tracer.Tracer(ctx, pack(load("mirror"), settings, 64, 16), tracer.TracerProgram())
    film = Film(ctx, 64, 16)
    drawn.timer = Clock()
    for _ in drawn.bands(film, 1):
        pass
    assert drawn.pixel_samples_per_second == pytest.approx(64 * 16 / 0.01)
    drawn.release()
    film.release()
