# SPDX-License-Identifier: MIT
"""Light tracing brings to each pixel just the light that the path tracer leaves out for it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agreement import assert_agree
from mesh_shapes import ball, geometry, smooth
from numpy.typing import NDArray
from rendering import assert_same, batches, rendered
from scene_builders import lambert, rectangle
from shaders.test_camera import through

from fragtracer.errors import FilmError
from fragtracer.films import SavedFilm, merge, most_bytes
from fragtracer.io.toml import load
from fragtracer.light_tracing import sums
from fragtracer.packing.targets import Targets, targets_of
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Environment,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    Scene,
    Sky,
    Sphere,
    SpotLight,
    Texture,
    Triangle,
)

Pictures = NDArray[np.float64]

SIZE = (24, 16)
LENS = Camera((0.3, 1.6, 4.0), (0.0, 0.4, 0.0), fov_degrees=40.0, aperture_radius=0.1)
FLOOR = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")
LAMP = Light((-1.0, 3.5, 1.0), 2.4, power=200.0)  # large, so that paths meet it often
MATERIALS = {
    "floor": lambert((0.6, 0.5, 0.4)),
    "gold": Material(metal="gold", roughness=0.4),
    "mirror": Material(metal="silver", roughness=0.0),
    "lamp": lambert(0.0, 4.0),
}


def spheres() -> Scene:
    """Metal, a mirror and plastic, whose base both throws and receives light, through a lens."""
    materials = {**MATERIALS, "plastic": Material(albedo=(0.7, 0.2, 0.1), roughness=0.3, specular=1.0)}
    balls = [Sphere((-0.9, 0.4, 0.0), 0.4, "gold"), Sphere((0.0, 0.4, -0.4), 0.4, "mirror")]
    return Scene(
        LENS, materials, planes=[FLOOR], spheres=[*balls, Sphere((0.9, 0.4, 0.0), 0.4, "plastic")], lights=[LAMP]
    )


def glass() -> Scene:
    """Nested, coloured, dispersing and rough glass, a pane, and plastic under a coat."""
    materials = {
        **MATERIALS,
        "water": Material(
            model="dielectric", ior=1.33, priority=1, attenuation_color=(0.5, 0.7, 0.9), attenuation_distance=0.5
        ),
        "crown": Material(model="dielectric", ior=1.52, priority=2, abbe_number=30.0),
        "frosted": Material(model="dielectric", ior=1.5, roughness=0.4),
        "pane": Material(model="thin-dielectric", ior=1.5),
        "floor": Material(model="plastic", albedo=(0.6, 0.5, 0.4)),
    }
    balls = [Sphere((-0.9, 0.5, 0.0), 0.45, "water"), Sphere((-0.9, 0.5, 0.0), 0.2, "crown")]
    balls += [Sphere((0.2, 0.45, -0.3), 0.4, "frosted"), Sphere((1.0, 0.4, 0.2), 0.3, "crown")]
    pane = rectangle((0.4, 0.6, 0.8), (0.8, 0.0, 0.0), (0.0, 1.0, 0.0), "pane")
    slab = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 6.0), (6.0, 0.0, 0.0), "floor")
    return Scene(replace(LENS, aperture_radius=0.0), materials, rectangles=[pane, slab], spheres=balls, lights=[LAMP])


def mirrors() -> Scene:
    """The floor under a golden ball, above all in mirrors: a sphere, a polished wall, both sides of flat ones; and one
    more mirror than are asked for photons."""
    materials = {
        **MATERIALS,
        "mirror": Material(metal="copper", roughness=0.0),
        "polished": Material(albedo=(0.3, 0.3, 0.4), roughness=0.0, specular=1.0),
    }
    return Scene(
        Camera((0.3, 0.9, 3.6), (0.1, 0.5, 0.0), fov_degrees=40.0, aperture_radius=0.05),
        materials,
        planes=[FLOOR, Plane((0.0, 0.0, -1.6), (0.0, 0.0, 1.0), "polished")],
        spheres=[Sphere((0.1, 0.3, 1.0), 0.3, "gold"), Sphere((0.9, 0.6, 0.0), 0.6, "mirror")],
        rectangles=[
            rectangle((-0.7, 0.6, -0.2), (1.2, 0.0, -0.3), (0.0, 1.2, 0.0), "mirror"),
            rectangle((1.8, 0.9, 0.4), (0.0, 0.0, 0.3), (0.0, 0.3, 0.0), "mirror"),
        ],
        disks=[Disk((-1.2, 0.5, 0.5), (-1.0, 0.2, -1.0), 0.5, "mirror")],
        lights=[Light((0.6, 2.2, 2.2), 1.2, power=200.0)],
    )


def rough_mirror() -> Scene:
    """A small ball, as rough as what is narrow may be, high above a floor on which a mirror throws light."""
    materials = {**MATERIALS, "rough": Material(metal="silver", roughness=0.54)}
    mirror = rectangle((-2.5, 1.5, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0), "mirror")
    return Scene(
        Camera((0.0, 4.0, 5.0), (0.0, 2.5, 0.0), fov_degrees=4.0),
        materials,
        planes=[FLOOR],
        rectangles=[mirror],
        spheres=[Sphere((0.0, 2.5, 0.0), 0.15, "rough")],
        lights=[Light((3.0, 2.5, 0.0), 2.2, power=200.0)],
    )


def shapes() -> Scene:
    """Flat mirrors of all kinds, lit by all kinds of lights."""
    triangle = Triangle(((0.5, 0.1, -0.8), (1.5, 0.1, -0.8), (1.2, 1.2, -1.0)), "mirror")
    return Scene(
        LENS,
        MATERIALS,
        planes=[FLOOR],
        rectangles=[
            rectangle((-0.6, 0.6, -0.9), (0.9, 0.0, 0.2), (0.0, 1.0, 0.0), "gold"),
            rectangle((-1.2, 0.5, 0.4), (0.0, 0.0, -0.8), (-0.1, 0.8, 0.0), "gold"),
            rectangle((0.0, 3.0, 0.5), (2.5, 0.0, 0.0), (0.0, 0.0, 2.5), "lamp"),
        ],
        disks=[Disk((1.2, 0.5, 0.3), (-1.0, 0.3, 0.2), 0.4, "mirror")],
        triangles=[triangle],
        lights=[LAMP],
        spot_lights=[SpotLight((0.0, 2.5, 2.0), (0.0, -1.0, -1.0), 30.0)],
        directional_lights=[DirectionalLight((0.5, -1.0, -0.6), 2.0)],
    )


def meshes() -> Scene:
    """Copies that are turned, stretched and mirrored, with normals of their own; a sheet half there, one that glows; a
    floor that is a mesh, too, so that there is nothing else."""
    balls = smooth(ball(12, 6))
    corners = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 1.0, 0.0], [-0.5, 1.0, 0.0]])
    quad = (corners, np.array([[0, 1, 2], [0, 2, 3]]))
    materials = {**MATERIALS, "sieve": Material(metal="silver", roughness=0.3, opacity=0.6, alpha_mode="blend")}
    copies = (
        Placement((-0.8, 0.4, 0.0), scale=(0.4, 0.3, 0.4)),
        Placement((0.7, 0.35, -0.3), (0.0, 30.0, 20.0), (-0.3, 0.35, 0.4)),
    )
    return Scene(
        LENS,
        materials,
        meshes=(
            Mesh((Part(balls, "gold"),), copies),
            Mesh((Part(geometry(quad), "sieve"),), (Placement((0.1, 0.0, -1.0), (-10.0, 0.0, 0.0)),)),
            Mesh((Part(geometry(quad), "lamp"),), (Placement((0.0, 2.5, 0.0), (90.0, 0.0, 0.0), (6.0, 6.0, 1.0)),)),
            Mesh((Part(geometry(quad), "floor"),), (Placement((0.0, 0.0, 8.0), (-90.0, 0.0, 0.0), (16.0, 16.0, 1.0)),)),
        ),
    )


def sunlit() -> Scene:
    """Under a sun, and a sky whose light is not traced."""
    sky = Environment(
        sky=Sky(sun_elevation_degrees=40.0, sun_azimuth_degrees=60.0, sun_radius_degrees=15.0), strength=0.1
    )
    balls = [Sphere((-0.5, 0.5, 0.0), 0.5, "gold"), Sphere((0.7, 0.4, 0.2), 0.4, "gold")]
    return Scene(LENS, MATERIALS, planes=[FLOOR], spheres=balls, environment=sky)


def windows() -> Scene:
    """Gold behind panes: one from which light is traced on, an infinite one, from which none is, and partly both."""
    materials = {**MATERIALS, "pane": Material(model="thin-dielectric", ior=1.8, transmittance=(0.5, 0.7, 0.9))}
    return Scene(
        LENS,
        materials,
        planes=[FLOOR, Plane((-1.6, 0.0, 0.0), (1.0, 0.0, 0.2), "pane")],
        rectangles=[
            rectangle((1.0, 1.8, 0.6), (2.0, 0.0, 0.0), (0.0, 0.3, 2.0), "pane"),
            rectangle((-2.4, 1.6, 1.1), (0.0, 0.6, 0.0), (0.3, 0.0, 0.3), "pane"),
        ],
        spheres=[Sphere((-0.5, 0.5, 0.0), 0.5, "gold"), Sphere((0.7, 0.4, 0.2), 0.4, "gold")],
        lights=[Light((-3.0, 2.0, 1.5), power=100.0), Light((1.3, 3.4, 1.0), 0.8, power=200.0)],
    )


def filters() -> Scene:
    """What seems to reflect nothing: a colour filter before silver, and plastic that a texture makes of black metal."""
    no_metal = Texture(Image(np.zeros((1, 1, 3), np.uint8)))
    materials = {
        **MATERIALS,
        "filter": Material(model="thin-dielectric", ior=1.0, transmittance=(1.0, 0.3, 0.3)),
        "plastic": Material(albedo=0.0, metallic=1.0, metallic_texture=no_metal, roughness=0.3, f0=0.5),
    }
    return Scene(
        LENS,
        materials,
        planes=[FLOOR],
        rectangles=[rectangle((-1.0, 0.95, 0.2), (2.0, 0.0, 0.0), (0.0, 0.0, 2.0), "filter")],
        spheres=[Sphere((-0.8, 0.4, 0.0), 0.4, "mirror")],
        meshes=(Mesh((Part(smooth(ball(12, 6)), "plastic"),), (Placement((0.7, 0.4, 0.2), scale=(0.4, 0.4, 0.4)),)),),
        lights=[LAMP],
    )


def bulb() -> Scene:
    """Gold by a pane that glows, in a veil that photons pass twice."""
    materials = {
        **MATERIALS,
        "bulb": Material(model="thin-dielectric", ior=1.5, emission=5.0),
        "veil": Material(albedo=0.0, specular=0.0, opacity=0.3, alpha_mode="blend"),
    }
    balls = [Sphere((-0.6, 0.6, 0.0), 0.5, "bulb"), Sphere((0.5, 0.5, 0.0), 0.4, "gold")]
    balls.append(Sphere((0.5, 0.5, 0.0), 0.48, "veil"))
    return Scene(LENS, materials, planes=[FLOOR], spheres=balls, lights=[LAMP])


def lacquer() -> Scene:
    """Coats that throw light and receive it, narrow ones and wide ones, over bases of either kind; and sheen."""
    materials = {
        **MATERIALS,
        "floor": Material(albedo=(0.6, 0.5, 0.4), specular=0.0, coat=1.0, coat_ior=2.0, coat_roughness=0.3),
        "paint": Material(albedo=(0.7, 0.2, 0.1), roughness=0.8, coat=1.0, coat_ior=3.0, coat_roughness=0.4),
        "satin": Material(metal="copper", roughness=0.4, coat=0.8, coat_ior=2.0, coat_roughness=0.8, sheen_color=0.6),
        "velvet": Material(metal="copper", roughness=0.3, sheen_color=(0.8, 0.3, 0.2), sheen_roughness=0.6),
        "mirror": Material(metal="silver", roughness=0.0, coat=1.0, coat_ior=3.0, coat_roughness=0.5),
    }
    balls = [Sphere((-0.9, 0.4, 0.0), 0.4, "paint"), Sphere((0.9, 0.4, 0.0), 0.4, "satin")]
    balls += [Sphere((0.0, 0.6, -0.4), 0.6, "mirror"), Sphere((0.0, 0.3, 0.6), 0.3, "velvet")]
    return Scene(LENS, materials, planes=[FLOOR], spheres=balls, lights=[LAMP])


def grounds() -> Scene:
    """A ball among walls of all kinds that are two kilometres wide, on a globe."""
    corners = np.array([[2.0, -900.0, -400.0], [2.0, -900.0, 1400.0], [2.0, 900.0, 1400.0], [2.0, 900.0, -400.0]])
    wall = Part(geometry((corners, np.array([[0, 1, 2], [0, 2, 3]]))), "satin")
    materials = {**MATERIALS, "satin": Material(albedo=0.5, roughness=0.5, specular=1.0)}
    return Scene(
        replace(LENS, aperture_radius=0.0),
        materials,
        rectangles=[rectangle((600.0, 200.0, -1.5), (2000.0, 0.0, 0.0), (0.0, 2000.0, 0.0), "satin")],
        disks=[Disk((-2.5, 300.0, -500.0), (1.0, 0.0, 0.0), 1000.0, "satin")],
        spheres=[Sphere((0.0, -800.0, -600.0), 1000.0, "satin"), Sphere((0.2, 0.5, 0.0), 0.5, "mirror")],
        meshes=[Mesh((wall,))],
        lights=[LAMP],
    )


def leaning_pane() -> Scene:
    """Before a mirror, with normals that are bent towards the floor."""
    corners = np.array([[-0.3, 0.0, -0.6], [-0.3, 0.0, 0.6], [-0.3, 0.8, 0.6], [-0.3, 0.8, -0.6]])
    pane = Geometry(corners, [[0, 2, 1], [0, 3, 2]], np.tile([0.26, 0.97, 0.0], (4, 1)))
    return Scene(
        Camera((1.4, 1.6, 2.0), (0.5, 0.0, 0.0), fov_degrees=25.0),
        {**MATERIALS, "pane": Material(model="thin-dielectric", ior=1.5)},
        planes=[FLOOR],
        rectangles=[rectangle((-1.0, 0.6, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 1.2), "mirror")],
        meshes=(Mesh((Part(pane, "pane"),)),),
        lights=[Light((3.0, 4.0, 0.0), 1.6, power=200.0)],
    )


def light_of(ctx: Any, scene: Scene, spp: int, seeds: int, **settings: Any) -> tuple[Pictures, Pictures]:
    """The light that is left to light tracing, as the path tracer finds it and as photons bring it, (seeds, height,
    width, 3): pictures of the same paths, from which those are taken that leave that light out."""
    settings = {"bounces": 5, "adaptive": "off", "guiding": "off", "rays": 64} | settings
    found = []
    with (
        Renderer(scene, SIZE, context=ctx, light_tracing="off", **settings) as whole,
        Renderer(scene, SIZE, context=ctx, light_tracing="on", **settings) as parted,
    ):
        for seed in range(seeds):
            for renderer in (whole, parted):
                renderer.reset(seed=seed)
                renderer.sample(spp)
            images = [whole.image(), parted.image()]
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(parted, "_light", None)  # leaves what its paths have found
                found.append([*images, parted.image()])
    by_all, by_both, rest = np.swapaxes(np.array(found, np.float64), 0, 1)
    return by_all - rest, by_both - rest


@pytest.mark.parametrize(
    ("make", "spp", "resolution"),
    [
        *((spheres, 1536, 0.05), (mirrors, 512, 0.05), (rough_mirror, 4096, 0.05), (glass, 3072, 0.06)),
        *((shapes, 640, 0.05), (meshes, 1280, 0.05), (sunlit, 1280, 0.1), (windows, 3072, 0.1), (filters, 512, 0.1)),
        *((bulb, 1024, 0.1), (leaning_pane, 1024, 0.1), (lacquer, 1024, 0.1), (grounds, 256, 0.1)),
    ],
)
def test_photons_bring_what_paths_leave_out(ctx: Any, make: Callable[[], Scene], spp: int, resolution: float) -> None:
    """From all kinds of shapes, lights and narrow surfaces."""
    by_paths, by_photons = light_of(ctx, make(), spp, 4)
    assert_agree(by_photons, by_paths, resolution, (2, 3))


@pytest.mark.parametrize(("estimator", "pixel_filter", "spp"), [("nee", "tent", 4096), ("bsdf", "gaussian", 1536)])
def test_estimators_and_filters(ctx: Any, estimator: str, pixel_filter: str, spp: int) -> None:
    """Each estimator finds, and leaves out, what the others do, in pixels of any kind."""
    by_paths, by_photons = light_of(ctx, spheres(), spp, 4, estimator=estimator, pixel_filter=pixel_filter)
    assert_agree(by_photons, by_paths, 0.05, (2, 3))


def test_a_mirror_shows_the_floor_a_lamp_behind_it(ctx: Any) -> None:
    """Light of a point over a perfect mirror, which no path meets: that of the lamp's mirror image."""
    mirror = Material(albedo=1.0, metallic=1.0, roughness=0.0)
    lamp, image = np.array([0.5, 1.0, 0.0]), np.array([-2.5, 1.0, 0.0])
    scene = Scene(
        Camera((0.2, 2.0, 2.0), (0.2, 0.0, 0.0), fov_degrees=15.0),
        {"floor": lambert(0.5), "mirror": mirror},
        planes=[FLOOR],
        rectangles=[rectangle((-1.0, 2.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 4.0), "mirror")],
        lights=[Light(tuple(lamp), power=100.0)],
    )
    settings = {"bounces": 2, "light_samples": 1}
    images = [batches(ctx, scene, 64, range(12), SIZE, light_tracing=choice, **settings) for choice in ("on", "off")]
    fine = 16
    width, height = fine * SIZE[0], fine * SIZE[1]
    ndc = 2 * (np.stack(np.meshgrid(np.arange(width), np.arange(height)[::-1]), -1).reshape(-1, 2) + 0.5)
    to_floor = through(scene.camera, SIZE, ndc / (width, height) - 1)
    places = np.asarray(scene.camera.position) - 2.0 / to_floor[:, 1:2] * to_floor
    to_image = image - places
    squared = np.square(to_image).sum(axis=1)
    radiance = 0.5 / np.pi * 100.0 / (4 * np.pi) * to_image[:, 1] / squared**1.5
    expected = radiance.reshape(SIZE[1], fine, SIZE[0], fine).mean(axis=(1, 3))[..., None].repeat(3, axis=-1)
    assert_agree(images[0].astype(np.float64) - images[1], np.stack([expected] * 2), 0.01)


def test_same_seed_same_bits(ctx: Any) -> None:
    """However passes are cut; other photons for another seed."""
    scene = load("three-spheres")
    one, other = (rendered(ctx, scene, 64, (48, 32), light_tracing="on", rays=rays) for rays in (1, 16))
    np.testing.assert_array_equal(one, other)
    settings = {"adaptive": "off", "guiding": "off", "light_tracing": "on"}
    with Renderer(scene, (48, 32), context=ctx, seed=4, **settings) as renderer:
        renderer.sample(64)
        renderer.reset(seed=0)
        renderer.sample(64)
        np.testing.assert_array_equal(renderer.image(), one)
        renderer.reset(seed=5)
        renderer.sample(64)
        assert (renderer.image() != one).mean() > 0.5


def test_standard_error_is_true(ctx: Any) -> None:
    """Within a fifth of the scatter of pictures."""
    said, pictures = [], []
    with Renderer(load("three-spheres"), (64, 36), context=ctx, light_tracing="on", adaptive="off") as renderer:
        for seed in range(24):
            renderer.reset(seed=seed)
            renderer.sample(64)
            said.append(renderer.standard_error())
            pictures.append(renderer.image().astype(np.float64))
    scatter = np.std(pictures, axis=0, ddof=1)
    assert np.mean(said) / scatter.mean() == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("software", [True, False])
def test_a_picture_goes_on_with_the_same_bits(
    ctx: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, software: bool
) -> None:
    """Whether the process or the GPU adds photons up."""
    monkeypatch.setattr(sums, "is_software", lambda _: software)
    scene, film = load("three-spheres"), tmp_path / "film.npz"
    settings = {"light_tracing": "on", "adaptive": "off", "rays": 16}
    with Renderer(scene, (64, 48), context=ctx, **settings) as renderer:
        renderer.sample(128)
        renderer.save(film)
        assert sum(values.nbytes for values in SavedFilm.read(film).arrays.values()) <= most_bytes(renderer.settings)
        renderer.sample(256)
        whole = renderer.image()
    with Renderer(scene, (64, 48), context=ctx, **settings) as renderer:
        renderer.resume(film)
        renderer.sample(256)
        np.testing.assert_array_equal(renderer.image(), whole)
    with pytest.raises(FilmError, match="light tracing"):
        merge({"one": SavedFilm.read(film), "two": SavedFilm.read(film)})
    with (
        Renderer(scene, (64, 48), context=ctx, **{**settings, "light_tracing": "off"}) as renderer,
        pytest.raises(FilmError, match="light_tracing"),
    ):
        renderer.resume(film)


def test_targets_stay_while_the_camera_moves(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    listed = []

    def targets(*arguments: Any) -> Targets:
        listed.append(arguments)
        return targets_of(*arguments)

    monkeypatch.setattr("fragtracer.light_tracing.picture.targets_of", targets)
    scene, settings = meshes(), {"light_tracing": "on", "guiding": "off"}
    moved = replace(scene, camera=replace(scene.camera, position=(0.4, 1.6, 4.0)))
    other = replace(moved, materials={**moved.materials, "gold": MATERIALS["floor"]})
    images = []
    with Renderer(scene, (16, 12), context=ctx, moves=True, **settings) as renderer:
        for shown, count in ((scene, 1), (moved, 1), (other, 2), (moved, 3)):
            renderer.reset(shown)
            renderer.sample(4)
            images.append(renderer.image())
            assert len(listed) == count
    np.testing.assert_array_equal(images[1], images[3])
    assert (images[1] != images[2]).any()


def test_a_scene_without_such_surfaces_traces_no_photons(ctx: Any) -> None:
    scene = Scene(LENS, MATERIALS, planes=[replace(FLOOR, material="gold")], lights=[LAMP])
    on, off = (rendered(ctx, scene, 64, SIZE, light_tracing=choice) for choice in ("on", "off"))
    assert_same(ctx, on, off)


def test_a_scene_of_nothing_but_light_is_rendered(ctx: Any) -> None:
    scene = Scene(LENS, MATERIALS, environment=Environment(radiance=1.0))
    np.testing.assert_allclose(rendered(ctx, scene, 4, SIZE, light_tracing="on", guiding="on"), 1.0)
