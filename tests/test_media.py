# SPDX-License-Identifier: MIT
"""Light through media, in closed form."""

import struct
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from agreement import ROUNDING, assert_agree, assert_mean
from mesh_shapes import ball, geometry
from rendering import ESTIMATORS, batches, rendered
from scene_builders import lambert, stare

from fragtracer.errors import SceneError
from fragtracer.io.toml import dump, files_behind, load, parse, save
from fragtracer.io.volumes import write_volume
from fragtracer.packing import pack
from fragtracer.scene import (
    Ambient,
    Camera,
    Density,
    DirectionalLight,
    Fog,
    Geometry,
    Light,
    Material,
    Medium,
    Mesh,
    Part,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
)

EXTINCTION = (0.3, 1.0, 2.5)
PATHS = {"bounces": 1000, "russian_roulette": False}
CLOUD = Material(model="null", interior="cloud")


def slab(thickness: float, half: float, material: str) -> list[Rectangle]:
    """A flat box below y = 0, its fronts outside; the last two are its top and bottom."""
    x, y, z = (2 * half, 0.0, 0.0), (0.0, thickness, 0.0), (0.0, 0.0, 2 * half)
    low, high = (-half, -thickness, -half), (half, 0.0, half)

    def back(edge: Any) -> Any:
        return tuple(-e for e in edge)

    faces = [(low, z, y), (low, y, x), (high, back(y), back(z)), (high, back(x), back(y)), (high, back(z), back(x))]
    return [Rectangle(corner, u, v, material) for corner, u, v in (*faces, (low, x, z))]


def cloud_scene(medium: Medium, **contents: Any) -> Scene:
    """A ball of a medium, radius 0.7, looked at through its middle."""
    camera = contents.pop("camera", stare((0.0, 0.0, 0.0), (0.0, 0.0, 3.0)))
    sphere = Sphere((0.0, 0.0, 0.0), 0.7, "cloud")
    return Scene(
        camera, {"cloud": CLOUD} | contents.pop("materials", {}), {"cloud": medium}, spheres=[sphere], **contents
    )


@pytest.mark.parametrize("albedo", [0.0, 0.8])
def test_light_passes_a_medium_by_beers_law(ctx, albedo):
    """Exactly what only absorbs, but for where rays start; what scatters in the mean."""
    scene = cloud_scene(Medium(extinction=EXTINCTION, albedo=albedo), ambient=Ambient(1.0))
    image = rendered(ctx, scene, 4 if albedo == 0 else 4096, bounces=0)
    expected = np.exp(-1.4 * np.array(EXTINCTION))
    if albedo == 0:
        np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=2e-4)
    else:
        assert_mean(image, expected, 0.01, rounding=2e-4)


@pytest.mark.parametrize("g", [-0.5, 0.8])
def test_a_medium_that_absorbs_nothing_disappears_in_a_furnace(ctx, g):
    """Every path of a grey one, and coloured ones in the mean; also seen from within."""
    for z, extinction in ((3.0 if g < 0 else 0.2, 3.0), (3.0 if g > 0 else 0.2, EXTINCTION)):
        camera = Camera((0.1, 0.0, z), (0.0, 0.0, -1.0), fov_degrees=20.0)
        medium = Medium(extinction=extinction, albedo=1.0, g=g)
        image = rendered(ctx, cloud_scene(medium, camera=camera, ambient=Ambient((0.5, 1.0, 4.0))), 64, **PATHS)
        if extinction == 3.0:
            np.testing.assert_allclose(image, np.broadcast_to((0.5, 1.0, 4.0), image.shape), rtol=3 * ROUNDING)
        else:
            assert_mean(image, (0.5, 1.0, 4.0), 0.01)


def test_white_wax_disappears_in_a_furnace(ctx):
    """A random walk under a surface that loses nothing: in the mean, what radiance was divided by comes back."""
    wax = Material(model="dielectric", roughness=0.0, ior=1.3, interior="cloud")
    camera = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0)
    medium = Medium(mean_free_path=(0.2, 0.4, 0.8), albedo=1.0, g=0.3)
    scene = cloud_scene(medium, camera=camera, materials={"cloud": wax}, ambient=Ambient(1.0))
    assert_mean(rendered(ctx, scene, 128, bounces=5000, russian_roulette=False), 1.0, 0.01)


@pytest.mark.parametrize("g", [0.0, 0.6])
def test_single_scattering_in_a_slab(ctx, g):
    """E ϖ p(θ) (1 - exp(-τ (1 + 1/µ))) / (1 + 1/µ) of a beam that comes in under the cosine µ, seen from straight
    above (Chandrasekhar 1960, "Radiative transfer")."""
    direction, depth = np.array([0.6, -0.8, 0.0]), 0.9
    medium = Medium(extinction=EXTINCTION, albedo=(0.9, 0.5, 0.2), g=g)
    scene = Scene(
        stare((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        {"cloud": CLOUD},
        {"cloud": medium},
        rectangles=slab(depth, 50.0, "cloud"),
        directional_lights=[DirectionalLight(tuple(direction), (1.0, 2.0, 3.0))],
    )
    cosine = direction @ (0.0, 1.0, 0.0)
    phase = (1 - g**2) / (1 + g**2 - 2 * g * cosine) ** 1.5 / (4 * np.pi)
    ways = 1 + 1 / 0.8
    opacity = 1 - np.exp(-np.array(EXTINCTION) * depth * ways)
    expected = np.array([1.0, 2.0, 3.0]) * (0.9, 0.5, 0.2) * phase * opacity / ways
    assert_mean(rendered(ctx, scene, 2048, bounces=1), expected, 0.005, rounding=1e-4)


@pytest.mark.parametrize("light_samples", [1, 2])
def test_single_scattering_of_lamps_in_fog(ctx, light_samples):
    """Of two lamps and a spot beside the way, by quadrature along it: σs p(θ) exp(-σt (t + r)) I / r²."""
    medium = Medium(extinction=(0.2, 0.4, 0.8), albedo=(0.9, 0.5, 0.2), g=0.4)
    lamps = [Light((0.6, 0.2, 1.0), power=4 * np.pi), Light((-2.0, 1.0, -2.0), power=8 * np.pi)]
    spot = SpotLight((0.0, 3.0, -1.0), (0.0, -1.0, 0.2), 3.0, inner_degrees=10.0, outer_degrees=25.0)
    wall = Rectangle((-9.0, -9.0, -3.0), (18.0, 0.0, 0.0), (0.0, 18.0, 0.0), "black")
    scene = Scene(
        stare((0.0, 0.0, -3.0), (0.0, 0.0, 3.0)),
        {"black": lambert(0.0)},
        {"fog": medium},
        Fog("fog"),
        rectangles=[wall],
        lights=lamps,
        spot_lights=[spot],
    )
    t = (np.arange(20000) + 0.5) * (6.0 / 20000)
    place = np.array([0.0, 0.0, 3.0]) - t[:, None] * (0.0, 0.0, 1.0)
    expected = np.zeros(3)
    axis = np.array(spot.direction) / np.linalg.norm(spot.direction)
    inner, outer = np.cos(np.radians((10.0, 25.0)))
    for light in (*lamps, spot):
        away = place - light.position
        r = np.linalg.norm(away, axis=1)
        cosine = away[:, 2] / r  # of the angle from straight on, as light goes to the camera along +z
        phase = (1 - 0.4**2) / (1 + 0.4**2 - 0.8 * cosine) ** 1.5 / (4 * np.pi)
        falloff = 1.0 if light is not spot else np.clip((away @ axis / r - outer) / (inner - outer), 0, 1) ** 2
        intensity = spot.intensity[0] if light is spot else light.power[0] / (4 * np.pi)
        passed = np.exp(-np.outer(t + r, medium.sigma_t))
        expected += (passed * (phase * falloff * intensity / r**2)[:, None]).sum(0) * (6.0 / 20000)
    expected *= np.array(medium.sigma_t) * medium.single_albedo
    image = rendered(ctx, scene, 1024, bounces=1, light_samples=light_samples)
    assert_mean(image, expected, 0.005, rounding=1e-4)


def test_paths_that_end_in_fog_leave_the_lens_to_the_next(ctx):
    """What a lamp's choice by the way needs is none of their random numbers: blur is that of fog that only absorbs."""
    camera = Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), fov_degrees=40.0, aperture_radius=0.5, focus_distance=1.5)
    images = [
        batches(
            ctx,
            Scene(
                camera,
                {"lamp": lambert(0.0, 5.0)},
                {"fog": Medium(extinction=0.2, albedo=albedo)},
                Fog("fog"),
                spheres=[Sphere((0.0, 0.0, 0.0), 0.5, "lamp")],
                lights=[Light((0.0, 0.2, 3.0), power=0.5)],
            ),
            768,
            range(8),
            size=(12, 12),
            bounces=0,
        )
        for albedo in (0.5, 0.0)
    ]
    assert_agree(*images, 0.02, (2, 2))


def test_light_is_dimmed_on_its_way_through_fog(ctx):
    """From a lamp to a surface and on to the camera, over the boundaries of another medium and of a pocket of none."""
    target = (0.0, 0.0, 0.0)
    scene = Scene(
        stare(target, (0.0, 1.0, 0.0)),
        {"matt": lambert(0.5), "cloud": CLOUD, "pocket": Material(model="null", priority=1)},
        {"fog": Medium(extinction=(0.2, 0.4, 0.1), albedo=0.0), "cloud": Medium(extinction=EXTINCTION, albedo=0.0)},
        Fog("fog"),
        spheres=[Sphere((1.0, 1.0, 0.0), 0.5, "cloud"), Sphere((1.0, 1.0, 0.0), 0.2, "pocket")],
        rectangles=[Rectangle((-1.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0), "matt")],
        lights=[Light((2.0, 2.0, 0.0), power=4 * np.pi)],
    )
    image = rendered(ctx, scene, 4, bounces=1)
    fog, cloud = np.array((0.2, 0.4, 0.1)), np.array(EXTINCTION)
    ways = np.exp(-fog * (1 + np.sqrt(8) - 1.0) - cloud * 0.6)
    expected = 0.5 / np.pi * np.sqrt(0.5) / 8 * ways
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=2e-4)


def test_boundaries_of_media_have_no_index(ctx):
    """Glass within one of four that a path has been in at once reflects what it does in air; what it passes is lost."""
    around = [Sphere((0.0, 0.0, 3.0), radius, "haze") for radius in (0.9, 0.8, 0.7)]
    scene = Scene(
        stare((0.0, 0.0, 1.0), (0.0, 0.0, 5.0)),
        {
            "glass": Material(model="dielectric", roughness=0.0, ior=2.0, transmittance=0.0, priority=-1),
            "haze": Material(model="null", interior="haze"),
        },
        {"haze": Medium(extinction=1e-6)},
        spheres=[*around, Sphere((0.0, 0.0, 0.0), 2.5, "haze"), Sphere((0.0, 0.0, 0.0), 1.0, "glass")],
        ambient=Ambient(1.0),
    )
    assert_mean(rendered(ctx, scene, 512, bounces=1), 1 / 9, 0.02)


def lit_cloud() -> Scene:
    """A cloud behind the boundary of another, lamps in and around it, and a floor."""
    medium = Medium(extinction=(1.0, 2.0, 4.0), albedo=(0.9, 0.8, 0.7), g=0.4)
    return Scene(
        Camera((0.0, 0.5, 4.0), (0.0, 0.0, 0.0), fov_degrees=40.0),
        {
            "cloud": CLOUD,
            "halo": Material(model="null", interior="halo", priority=-1),
            "lamp": lambert(0.0, (6.0, 5.0, 4.0)),
            "matt": lambert(0.5),
        },
        {"cloud": medium, "halo": Medium(extinction=0.2, albedo=0.5)},
        spheres=[
            Sphere((0.0, 0.0, 0.0), 0.7, "cloud"),
            Sphere((0.0, 0.0, 0.0), 1.2, "halo"),
            Sphere((0.9, 0.9, 0.5), 0.4, "lamp"),
        ],
        rectangles=[Rectangle((-2.0, -0.5, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0), "matt")],
        ambient=Ambient(0.2),
    )


def test_estimators_agree(ctx):
    """Light that is sampled from a point of a medium, or met from there, over boundaries that are none."""
    size = (12, 8)
    images = {
        name: batches(ctx, lit_cloud(), 3072, range(4), size=size, estimator=name, bounces=6) for name in ESTIMATORS
    }
    for name in ("nee", "bsdf"):
        assert_agree(images[name], images["mis"], 0.02, (2, 2))


def test_guided_paths_pass_media(ctx):
    size = (16, 12)
    images = [batches(ctx, lit_cloud(), 1024, range(4), size=size, guiding=guiding) for guiding in ("on", "off")]
    assert_agree(*images, 0.02, (2, 2))


def test_roulette_ends_paths_in_media_without_bias(ctx):
    medium = Medium(extinction=EXTINCTION, albedo=(0.9, 0.7, 0.5))
    scene = cloud_scene(medium, ambient=Ambient(1.0))
    settings = [{"russian_roulette": False}, {"russian_roulette_depth": 1}]
    images = [batches(ctx, scene, 1024, range(4), size=(16, 16), bounces=64, **s) for s in settings]
    assert_agree(*images, 0.01, (1, 1))


def test_a_boundary_in_glass_bends_no_light(ctx):
    """It has no index of refraction, whatever its priority; and glass within a cloud is as smooth as ever."""
    for boundary, glass in ((1, 0), (0, 1)):
        materials = {
            "glass": Material(model="dielectric", roughness=0.0, priority=glass),
            "cloud": Material(model="null", interior="cloud", priority=boundary),
        }
        spheres = [Sphere((0.0, 0.0, 0.0), 1.0, "glass"), Sphere((0.2, 0.1, 0.0), 1.6 - boundary, "cloud")]
        camera = Camera((0.1, 0.0, 4.0), (0.1, 0.1, -1.0), fov_degrees=20.0)
        white = {"cloud": Medium(extinction=1.0, albedo=1.0)}
        scene = Scene(camera, materials, white, spheres=spheres, ambient=Ambient((0.5, 1.0, 4.0)))
        image = rendered(ctx, scene, 32, **PATHS)
        np.testing.assert_allclose(image, np.broadcast_to((0.5, 1.0, 4.0), image.shape), rtol=10 * ROUNDING)


@pytest.mark.parametrize("kind", ["sphere", "coloured mesh"])
def test_the_boundary_of_nothing_is_invisible(ctx, kind):
    """On a floor in the sun, of which each sample is the same: it casts no shadow, and has no colour."""
    materials = {"floor": lambert(0.5), "nothing": Material(model="null")}
    points, triangles = ball()
    red = Geometry(0.4 * points + (0.0, 0.5, 0.0), triangles, colors=np.tile((1.0, 0.0, 0.0), (len(points), 1)))
    shape: dict[str, Any] = {"meshes": [Mesh((Part(red, "nothing"),))]}
    if kind == "sphere":
        shape = {"spheres": [Sphere((0.0, 0.5, 0.0), 0.4, "nothing")]}
    floor, sun = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor"), DirectionalLight((0.0, -1.0, 0.0), 1.0)
    camera = Camera((0.0, 2.0, 0.5), (0.0, 0.0, 0.0), fov_degrees=30.0)
    scene = Scene(camera, materials, planes=[floor], directional_lights=[sun], **shape)
    np.testing.assert_allclose(rendered(ctx, scene, 4, bounces=1), 0.5 / np.pi, rtol=10 * ROUNDING)


def lumps() -> tuple[Medium, float]:
    """A grid that varies, in a cube around the origin; and the mean of its densities along z at the middle."""
    values = np.random.default_rng(1).random((8, 2, 2)) * 2
    medium = Medium(extinction=EXTINCTION, albedo=0.8, density=Density(values), bounds=((-0.3,) * 3, (0.3,) * 3))
    return medium, float(values.mean())


def test_light_passes_a_grid_by_beers_law(ctx):
    """In the mean, as far as it lies in the box: by delta tracking of paths, and by ratio tracking towards a lamp."""
    medium, mean = lumps()
    expected = np.exp(-0.6 * mean * np.array(EXTINCTION))
    scene = cloud_scene(medium, ambient=Ambient(1.0))
    assert_mean(rendered(ctx, scene, 2048, bounces=0), expected, 0.01)
    wall = Rectangle((-1.0, -1.0, -1.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "matt")
    view = stare((0.0, 0.0, -1.0), (0.0, 3.0, 0.0))
    lamp = [Light((0.0, 0.0, 1.0), power=4 * np.pi)]
    lit = cloud_scene(medium, camera=view, materials={"matt": lambert(0.5)}, rectangles=[wall], lights=lamp)
    assert_mean(rendered(ctx, lit, 512, bounces=1), 0.5 / np.pi / 4 * expected, 0.01, rounding=1e-4)


def test_paths_that_are_worth_nothing_stay_finite(ctx):
    """Those that a black lamp has scattered, in a grid of many steps."""
    medium = replace(lumps()[0], extinction=(20.0, 40.0, 80.0))
    lamp = {"lamp": lambert(0.0, 1.0), "cloud": CLOUD}
    wall = Rectangle((-1.0, -1.0, -0.5), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "lamp")
    camera = stare((0.0, 0.0, -0.5), (0.0, 2.0, 0.35))  # past the grid
    image = rendered(ctx, cloud_scene(medium, materials=lamp, rectangles=[wall], camera=camera), 64, bounces=4)
    np.testing.assert_allclose(image, np.ones_like(image), rtol=ROUNDING)


def test_a_grid_of_one_density_is_a_medium_without(ctx):
    """Also as the fog, which then ends at the box, and lets light from afar pass."""
    size, camera = (16, 16), Camera((0.1, 0.2, 2.5), (0.0, 0.0, 0.0), fov_degrees=20.0)
    corner = 0.7 / np.sqrt(3)
    low, high = (-corner, -2 * corner, -corner), (corner, 0.0, corner)
    same = Medium(extinction=EXTINCTION, albedo=0.8, g=0.5)
    gridded = Medium(
        extinction=(0.15, 0.5, 1.25), albedo=0.8, g=0.5, density=Density(np.full((2, 3, 1), 2)), bounds=(low, high)
    )
    scenes = [
        Scene(
            camera,
            {"cloud": CLOUD},
            {"cloud": same},
            rectangles=slab(2 * corner, corner, "cloud"),
            ambient=Ambient(1.0),
        ),
        Scene(camera, {}, {"fog": gridded}, Fog("fog"), ambient=Ambient(1.0)),
    ]
    assert_agree(*(batches(ctx, s, 1024, range(4), size=size, bounces=8) for s in scenes), 0.01, (2, 2))


def test_scenes_without_media_have_no_code_for_them():
    packed = pack(load("glass"), load("glass").render, 8, 8)
    assert packed.features["HAS_MEDIA"] == 0
    assert not len(packed.scene_records["Medium"])


BALL = '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "ball"\n[material.ball]\nmodel = "null"\n'
MISTAKES = {
    "g": ("[medium.a]\ng = 1", "medium.a.g: must be less than 1, got 1"),
    "g below": ("[medium.a]\ng = -1.5", "medium.a.g: must be greater than -1, got -1.5"),
    "negative extinction": (
        "[medium.a]\nextinction = [1, -2, 1]",
        "medium.a.extinction[1]: must be at least 0, got -2",
    ),
    "albedo": ("[medium.a]\nalbedo = 1.5", "medium.a.albedo: must be at most 1, got 1.5"),
    "no way": ("[medium.a]\nmean_free_path = 0", "medium.a.mean_free_path: must be greater than 0, got 0; a large"),
    "twice": ("[medium.a]\nextinction = 1\nmean_free_path = 1", "extinction and mean_free_path both say"),
    "one of two": ("[medium.a]\nscattering = 1", "medium.a.scattering: must come with absorption, got 1; 0 is none"),
    "both albedos": ("[medium.a]\nscattering = 1\nabsorption = 1\nalbedo = 1", "leave albedo out"),
    "no box": ('[medium.a]\ndensity = "a.npy"', "medium.a.density: a.npy: cannot read this grid: No such file"),
    "no grid": ("[medium.a]\nbounds = [[0, 0, 0], [1, 1, 1]]", "medium.a.bounds: must come with density"),
    "no suffix": ('[medium.a]\ndensity = "a.vdb"', "a.vdb: cannot read this grid: a grid ends in .npy or .vol"),
    "no file": (
        "[medium.a]\ndensity = 3",
        "medium.a.density: must be the name of a .npy or .vol file in quotes, got 3",
    ),
    "box": ("[medium.a]\nbounds = 3", "medium.a.bounds: must be two points [[x, y, z], [x, y, z]], got 3"),
    "a key": ("[medium.a]\nsigma_t = 1", "medium.a.sigma_t: there is no such key; "),
    "a table": ("medium = 3", "medium: must be a table, written [medium.NAME], got 3"),
    "no medium": (
        BALL + 'interior = "smoke"\n[medium.a]',
        "material.ball.interior: there is no medium 'smoke'; the media",
    ),
    "no fog": ('[fog]\nmedium = "smoke"', "fog.medium: there is no medium 'smoke'; the media are: none is defined"),
    "fog of nothing": ("[fog]", "fog.medium: is missing; give a text in quotes"),
    "interior of paint": (
        '[material.m]\ninterior = "a"\n[medium.a]',
        "interior means nothing to model = 'metallic-roughness'",
    ),
    "both inside": (
        '[material.m]\nmodel = "dielectric"\nattenuation_color = 0.5\ninterior = "a"\n[medium.a]',
        "attenuation_color and interior both say what is inside; give one",
    ),
    "same priority": (
        f'{BALL}interior = "a"\n[medium.a]\n[material.glass]\nmodel = "dielectric"\n'
        '[[sphere]]\ncenter = [0, 0, 0]\nradius = 0.5\nmaterial = "glass"',
        "material.glass.priority: shapes of",
    ),
}


@pytest.mark.parametrize(("text", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_named(text, message):
    with pytest.raises(SceneError) as raised:
        parse(text, "x.toml")
    assert str(raised.value).startswith("x.toml: ")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def volume(*header: int, values: int = 8) -> bytes:
    return struct.pack("<3sB5i6f", b"VOL", 3, *header, *[0.0] * 6) + np.arange(values, dtype="<f4").tobytes()


GRIDS = {
    "rank": (np.ones((2, 2)), "a grid of densities is (z, y, x) numbers, of rank 3, got (2, 2)"),
    "nan": (np.full((2, 2, 2), np.nan), "densities must be finite; 8 are not, which numpy.nan_to_num would mend"),
    "negative": (np.full((2, 2, 2), -1.0), "densities must not be negative, the least is -1"),
    "words": (np.full((2, 2, 2), "a"), "densities are numbers, got <U1"),
    "empty": (np.ones((2, 0, 2)), "a grid of densities is (z, y, x) numbers, of rank 3, got (2, 0, 2)"),
    "no header": (b"VO", "it does not open with the header of a volume"),
    "channels": (volume(1, 2, 2, 2, 3), "version 3, encoding 1, 3 channels; only version 3 of one float32 is read"),
    "short": (volume(1, 2, 2, 3, 1), "its header says 2 x 2 x 3 voxels, more than it has"),
}


@pytest.mark.parametrize(("content", "message"), GRIDS.values(), ids=GRIDS)
def test_grids_that_cannot_be_read(tmp_path, content, message):
    file = tmp_path / ("grid.vol" if isinstance(content, bytes) else "grid.npy")
    file.write_bytes(content) if isinstance(content, bytes) else np.save(file, content)
    text = f'[medium.a]\ndensity = "{file.name}"\nbounds = [[0, 0, 0], [1, 1, 1]]'
    with pytest.raises(SceneError) as raised:
        parse(text, tmp_path / "x.toml")
    assert str(raised.value) == f"{tmp_path / 'x.toml'}: medium.a.density: {file}: cannot read this grid: {message}"


def test_grids_survive_the_trip(tmp_path):
    """Of both kinds of file, and one that was made in Python."""
    values = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    write_volume(tmp_path / "a.vol", values[..., None])
    np.save(tmp_path / "a.npy", values)
    for name in ("a.vol", "a.npy"):
        text = f'[ambient]\nradiance = 1\n[medium.a]\ndensity = "{name}"\nbounds = [[0, 0, 0], [1, 1, 1]]'
        scene = parse(text, tmp_path / "x.toml")
        np.testing.assert_array_equal(scene.media["a"].density.values, values)
        assert parse(dump(scene, tmp_path), tmp_path / "x.toml") == scene
        assert files_behind(scene) == {tmp_path / name}
    made = replace(scene, media={"a": replace(scene.media["a"], density=Density(values))}, name="y")
    save(made, tmp_path / "y.toml")
    assert load(tmp_path / "y.toml") == made


def test_coefficients():
    """Each way to say them gives the same medium."""
    media = [
        Medium(extinction=(1.0, 2.0, 4.0), albedo=(0.5, 0.25, 1.0)),
        Medium(mean_free_path=(1.0, 0.5, 0.25), albedo=(0.5, 0.25, 1.0)),
        Medium(scattering=(0.5, 0.5, 4.0), absorption=(0.5, 1.5, 0.0)),
    ]
    for medium in media:
        assert medium.sigma_t == (1.0, 2.0, 4.0)
        assert medium.single_albedo == (0.5, 0.25, 1.0)
    assert Medium(scattering=0.0, absorption=0.0).single_albedo == (0.0, 0.0, 0.0)


def test_media_survive_the_trip():
    scene = lit_cloud()
    assert parse(dump(scene), "scene.toml") == scene
    foggy = parse('[ambient]\nradiance = 1\n[medium.a]\n[fog]\nmedium = "a"', "scene.toml")
    assert foggy.fog == Fog("a")
    assert foggy.media == {"a": Medium()}
    assert parse(dump(foggy), "scene.toml") == foggy


def test_light_from_afar_does_not_arrive_in_fog():
    scene = Scene(media={"fog": Medium()}, fog=Fog("fog"), directional_lights=[DirectionalLight((0.0, -1.0, 0.0), 1.0)])
    with pytest.warns(UserWarning, match="no light from infinitely far away"):
        pack(scene, scene.render, 8, 8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lit = Scene(media=scene.media, fog=scene.fog, lights=[Light((0.0, 1.0, 0.0), power=1.0)])
        pack(lit, lit.render, 8, 8)


def test_an_open_mesh_with_a_medium_gets_a_warning():
    points, triangles = ball(8, 4)
    mesh = Mesh((Part(geometry((points, triangles[1:])), "cloud"),))
    scene = Scene(materials={"cloud": CLOUD}, media={"cloud": Medium()}, meshes=[mesh], ambient=Ambient(1.0))
    with pytest.warns(UserWarning, match=r"of the boundary 'cloud' is not closed: where a ray gets in"):
        pack(scene, scene.render, 8, 8)
