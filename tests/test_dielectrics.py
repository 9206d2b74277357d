# SPDX-License-Identifier: MIT
"""Light through dielectrics, in closed form."""

import re
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from agreement import ROUNDING, assert_agree, assert_mean
from rendering import ESTIMATORS, batches, rendered
from scene_builders import lambert, stare

from fragtracer.errors import SceneError
from fragtracer.io.toml import parse
from fragtracer.resources import folder
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Disk,
    Environment,
    Geometry,
    Image,
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
    Texture,
    Triangle,
)

COLOR = (0.9, 0.5, 0.1)
OTHER = (0.3, 0.8, 0.6)
GLASS = Material(model="dielectric", roughness=0.0)
PATHS = {"bounces": 500, "russian_roulette": False}


def tinted(color: Any, priority: int = 0, ior: float = 1.0, distance: float = 1.0) -> Material:
    return Material(
        model="dielectric",
        roughness=0.0,
        ior=ior,
        attenuation_color=color,
        attenuation_distance=distance,
        priority=priority,
    )


def powers(*factors: tuple[Any, float]) -> Any:
    return np.prod([np.power(color, distance) for color, distance in factors], axis=0)


@pytest.mark.parametrize("spheres", [1, 2])
def test_smooth_glass_vanishes_in_a_white_furnace(ctx, spheres):
    """Exactly, in every path; a bubble in it, too, and the camera may be inside of both."""
    shapes = [Sphere((0.0, 0.0, 0.0), 1.0, "glass"), Sphere((0.2, 0.1, 0.0), 0.6, "air")][:spheres]
    materials = {"glass": GLASS, "air": Material(model="dielectric", roughness=0.0, ior=1.0, priority=1)}
    for z in (3.0, 0.8, 0.1):
        view = Camera((0.1, 0.0, z), (0.1, 0.1, -1.0), fov_degrees=40.0)
        scene = Scene(view, materials, spheres=shapes, ambient=Ambient((0.5, 1.0, 4.0)))
        image = rendered(ctx, scene, 16, shared=True, **PATHS)
        inside = 0 if z == 3.0 or (z == 0.1 and spheres == 2) else 1  # radiance in glass is n² of that in air
        expected = np.multiply((0.5, 1.0, 4.0), 2.25**inside)
        np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=3 * ROUNDING)


def test_rough_glass_loses_what_its_facets_scatter_again(ctx):
    """Single scattering loses light, more of it the rougher the surface, and never makes any."""
    means = []
    for roughness in (0.1, 0.4, 0.7, 1.0):
        glass = Material(model="dielectric", roughness=roughness)
        view = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=30.0)
        scene = Scene(view, {"glass": glass}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "glass")], ambient=Ambient(1.0))
        means.append(float(rendered(ctx, scene, 256, **PATHS).mean()))
    assert means == sorted(means, reverse=True)
    assert means[0] == pytest.approx(1, abs=2e-3)
    assert means[-1] < 0.95


def test_light_samples_pass_rough_glass(ctx):
    """Ambient light arrives from both sides."""
    glass = Material(model="dielectric", roughness=1.0)
    view = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=30.0)
    scene = Scene(view, {"glass": glass}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "glass")], ambient=Ambient(1.0))
    expected = rendered(ctx, scene, 256, bounces=3).mean((0, 1), dtype=np.float64)
    assert_mean(rendered(ctx, scene, 4096, bounces=3, estimator="nee"), expected, 0.05)


def test_roulette_knows_what_refraction_does_to_radiance(ctx):
    """Glass is 1 / n² as bright on its way in, which is no reason to end a path, and neither is anything else where
    nothing is lost: each path of a furnace brings the same."""
    view = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0)
    glass = Material(model="dielectric", roughness=0.0, ior=2.0)
    scene = Scene(view, {"glass": glass}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "glass")], ambient=Ambient(1.0))
    image = rendered(ctx, scene, 64, (64, 64), bounces=500, russian_roulette_depth=1)
    np.testing.assert_allclose(image, 1.0, rtol=1e-3)


def test_absorption_is_beers_law(ctx):
    """Through the middle of a sphere whose index is that of air, but for where rays start: 1e-6 of the largest
    coordinate off a surface. And of glass, where what goes to and fro between the two walls is a geometric series."""
    sphere, camera = Sphere((0.0, 0.0, 0.0), 0.7, "tint"), stare((0.0, 0.0, 0.0), (0.0, 0.0, 3.0))
    scene = Scene(camera, {"tint": tinted(COLOR, distance=0.5)}, spheres=[sphere], ambient=Ambient(1.0))
    image = rendered(ctx, scene, 4, **PATHS)
    np.testing.assert_allclose(image, np.broadcast_to(powers((COLOR, 2.8)), image.shape), rtol=2e-4)
    scene = Scene(camera, {"tint": tinted(COLOR, ior=2.0)}, spheres=[sphere], ambient=Ambient(1.0))
    once, f = powers((COLOR, 1.4)), 1 / 9
    expected = f + (1 - f) ** 2 * once * (1 + f * once) / (1 - (f * once) ** 2)
    assert_mean(rendered(ctx, scene, 4096, **PATHS), expected, 0.005)


def test_the_dielectric_of_higher_priority_is_there_where_two_overlap(ctx):
    """Whichever is written first; and the camera knows what it is in."""
    spheres = [Sphere((0.0, 0.0, -0.5), 1.0, "a"), Sphere((0.0, 0.0, 0.5), 1.0, "b")]  # of z: -1.5 to 0.5, -0.5 to 1.5
    for a, b, expected in ((1, 2, powers((COLOR, 1.0), (OTHER, 2.0))), (2, 1, powers((COLOR, 2.0), (OTHER, 1.0)))):
        for order in (1, -1):
            materials = {"a": tinted(COLOR, a), "b": tinted(OTHER, b)}
            for z, seen in ((3.0, expected), (-1.0, powers((COLOR, 0.5)))):
                camera = stare((0.0, 0.0, -4.0), (0.0, 0.0, z))
                scene = Scene(camera, materials, spheres=spheres[::order], ambient=Ambient(1.0))
                image = rendered(ctx, scene, 4, bounces=1, shared=True)
                np.testing.assert_allclose(image, np.broadcast_to(seen, image.shape), rtol=2e-4)


@pytest.mark.parametrize("roughness", [0.0, 0.4])
def test_interfaces_are_what_solids_within_each_other_are(ctx, roughness):
    """Water with a bubble in a ball of glass: by priorities, and by the indices on both sides of each surface."""
    glass, water, air = (replace(GLASS, roughness=roughness, ior=ior) for ior in (1.5, 1.33, 1.0))
    solids = {"glass": glass, "water": replace(water, priority=1), "air": replace(air, priority=2)}
    outside = {"glass": 1.0, "water": 1.5, "air": 1.33}
    interfaces = {name: replace(solids[name], priority=0, exterior_ior=ior) for name, ior in outside.items()}
    balls = [Sphere((0.0, 0.0, 0.0), radius, name) for name, radius in (("glass", 1.0), ("water", 0.8), ("air", 0.4))]
    scene = Scene(
        Camera((0.0, 0.5, 4.0), (0.0, 0.0, 0.0), fov_degrees=35.0),
        solids | {"floor": lambert(0.5)},
        spheres=balls,
        planes=[Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0), "floor")],
        lights=[Light((2.0, 3.0, 1.0), 1.0, radiance=(8.0, 8.0, 8.0))],
        ambient=Ambient((0.3, 0.4, 0.5)),
    )
    one, other = (
        rendered(ctx, replace(scene, materials=scene.materials | made), 64, (16, 12), bounces=12)
        for made in ({}, interfaces)
    )
    np.testing.assert_allclose(np.median(np.abs(other / one - 1)), 0, atol=1e-5)
    np.testing.assert_allclose(other.mean((0, 1)), one.mean((0, 1)), rtol=1e-3)
    alone = replace(scene, spheres=balls[:1])
    one, other = (
        rendered(ctx, replace(alone, materials=alone.materials | made), 16, (16, 12)) for made in ({}, interfaces)
    )
    np.testing.assert_array_equal(other, one)


def test_an_interface_need_not_be_closed(ctx):
    """In a white furnace of which a sheet of glass is one wall nothing is lost, whatever the path is inside of."""
    sheet = replace(GLASS, ior=1.5, exterior_ior=1.33)
    white = Environment(radiance=1.0)
    box = Rectangle((-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "sheet")
    seen = {}
    for z in (3.0, -3.0):
        camera = Camera((0.2, 0.1, z), (0.0, 0.0, 0.0), fov_degrees=20.0)
        seen[z] = rendered(ctx, Scene(camera, {"sheet": sheet}, rectangles=[box], environment=white), 256, (8, 8))
    # Radiance is greater in the denser of the two by the square of the ratio of the indices.
    ratio = (1.33 / 1.5) ** 2
    f = ((1.5 - 1.33) / (1.5 + 1.33)) ** 2
    np.testing.assert_allclose(seen[3.0].mean(), f + (1 - f) * ratio, rtol=2e-3)
    np.testing.assert_allclose(seen[-3.0].mean(), f + (1 - f) / ratio, rtol=2e-3)


def test_panes_pass_light_one_by_one(ctx):
    """What two of them pass is the product of both, and no bounce; what they reflect comes back after some."""
    panes = [Rectangle((-1.0, -1.0, z), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "pane") for z in (0.0, -1.0)]
    pane = Material(model="thin-dielectric", ior=2.0, transmittance=OTHER)
    scene = Scene(stare((0.0, 0.0, 0.0), (0.0, 0.0, 3.0)), {"pane": pane}, rectangles=panes, ambient=Ambient(1.0))
    reflected = 2 / 9 / (1 + 1 / 9)
    passed = (1 - reflected) * np.array(OTHER)
    assert_mean(rendered(ctx, scene, 1024, bounces=0), passed**2, 0.01)
    everything = reflected + passed**2 * (1 + reflected) / (1 - reflected**2)
    assert_mean(rendered(ctx, scene, 1024, **PATHS), everything, 0.01)


PANES = [Disk((0.0, y, 0.0), (0.0, 1.0, 0.0), 1e4, "pane") for y in (1.0, 1.5)]
MATT = Scene(
    stare((0.0, 0.0, 0.0), (0.1, 0.6, 0.0)),
    {
        "floor": lambert(0.5),
        "glow": lambert(0.0, 1.0),
        "pane": Material(model="thin-dielectric", ior=1.5, transmittance=OTHER),
    },
    planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
)


def pane_transmittance(cosine: Any) -> Any:
    """Of light that meets a pane of MATT, (..., 1), at angles of this cosine, (...)."""
    inside = np.sqrt(1 - (1 - cosine**2) / 1.5**2)
    across = (cosine - 1.5 * inside) / (cosine + 1.5 * inside)
    along = (1.5 * cosine - inside) / (1.5 * cosine + inside)
    fresnel = (across**2 + along**2) / 2
    return (1 - 2 * fresnel / (1 + fresnel))[..., None] * np.array(OTHER)


SLANTED = (0.6, -0.8, 0.0)
DELTA_LIGHTS = {
    "directional": {"directional_lights": (DirectionalLight(SLANTED, (1.0, 1.0, 1.0)),)},
    "spot": {"spot_lights": (SpotLight((-750.0, 1000.0, 0.0), SLANTED, (1e6, 1e6, 1e6), 10.0, 20.0),)},
    "point": {"lights": (Light((-750.0, 1000.0, 0.0), power=1e7),)},
}


@pytest.mark.parametrize(("kind", "estimator"), [*zip(DELTA_LIGHTS, ESTIMATORS, strict=True)])
def test_lights_without_extent_shine_through_panes(ctx, kind, estimator):
    """From afar at 36.9 degrees, through two of a colour; also where there is smoke between them, and beside light
    tracing, which leaves that light alone."""
    scene = replace(MATT, **DELTA_LIGHTS[kind])
    smoke = {"smoke": Material(model="null", interior="smoke")}
    smoky = {"media": {"smoke": Medium(extinction=COLOR)}, "spheres": [Sphere((-0.94, 1.25, 0.0), 0.2, "smoke")]}
    settings = {"bounces": 1, "estimator": estimator, "light_tracing": "on" if estimator == "mis" else "off"}
    for bare in [scene, replace(scene, materials=scene.materials | smoke, **smoky)][: 1 + (kind == "spot")]:
        without, behind = (rendered(ctx, s, 4, **settings) for s in (bare, replace(bare, disks=PANES)))
        np.testing.assert_allclose(behind, without * pane_transmittance(np.array(0.8)) ** 2, rtol=2e-3)
        assert without.min() > 0.01


def polygon(radius: float, y: float, corners: int = 24) -> Geometry:
    """A regular one as large as a disk of that radius, horizontal, its front below."""
    turns = 2 * np.pi * np.arange(corners) / corners
    radius *= np.sqrt(turns[1] / np.sin(turns[1]))
    rim = np.stack([radius * np.cos(turns), np.full(corners, y), radius * np.sin(turns)], axis=1)
    return Geometry(rim, [(0, i, i + 1) for i in range(1, corners - 1)])


# Of radiance 1, above the origin, with the half angle of the cone that they fill, and estimators beside "mis".
WIDE_LIGHTS = {
    "ambient": ({"ambient": Ambient(1.0)}, 90.0, ["bsdf"]),
    "environment": ({"environment": Environment(radiance=1.0)}, 90.0, ["nee"]),
    "sphere": ({"spheres": [Sphere((0.0, 4.0, 0.0), 2.0, "glow")]}, 30.0, ["bsdf"]),
    "disk": ({"disks": [Disk((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), np.sqrt(27.0), "glow")]}, 60.0, ["nee", "bsdf"]),
    "mesh": ({"meshes": [Mesh((Part(polygon(3.0, 3.0), "glow"),))]}, 45.0, ["nee"]),
}


@pytest.mark.parametrize("kind", WIDE_LIGHTS)
def test_lights_of_extent_shine_through_panes(ctx, kind):
    """Each estimator counts them once: that of lights passes both panes, and paths are weighed against it."""
    lights, half_angle, estimators = WIDE_LIGHTS[kind]
    scene = replace(MATT, **lights | {"disks": [*PANES, *lights.get("disks", [])]})
    angles = np.radians(half_angle) * (np.arange(4096) + 0.5) / 4096
    weights = 0.5 * np.sin(2 * angles)[:, None] * np.radians(half_angle) / 4096
    expected = (weights * pane_transmittance(np.cos(angles)) ** 2).sum(axis=0)
    for estimator in (*estimators, "mis"):
        assert_mean(rendered(ctx, scene, 256, bounces=1, estimator=estimator), expected, 0.01, 2 * ROUNDING)


def test_light_passes_a_pane_by_its_shading_normal(ctx):
    """As paths do that meet it."""
    corners = [(-9.0, 1.0, 9.0), (9.0, 1.0, 9.0), (9.0, 1.0, -9.0), (-9.0, 1.0, -9.0)]
    normals = np.tile((0.0, 0.6, 0.8), (4, 1))
    pane = Mesh((Part(Geometry(corners, [(0, 1, 2), (0, 2, 3)], normals=normals), "pane"),))
    lamp = Disk((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), 2.0, "glow")
    scene = replace(MATT, meshes=[pane], disks=[lamp])
    images = {name: batches(ctx, scene, 256, range(4), (16, 16), bounces=1, estimator=name) for name in ("nee", "bsdf")}
    assert_agree(images["nee"], images["bsdf"], 0.01, (1, 1))


@pytest.mark.parametrize("model", ["thin-dielectric", "dielectric"])
def test_a_texture_colours_what_passes(ctx, model):
    """And the colour of a vertex; a solid without contrast is a filter in the way, and no bounce."""
    corners = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
    colors = np.full((4, 3), 0.5)
    quad = Geometry(corners, [(0, 1, 2), (0, 2, 3)], uvs=np.zeros((4, 2)), colors=colors)
    texture = Texture(Image(np.float32([[OTHER]]), "linear"))
    smooth = {"roughness": 0.0, "ior": 1.0} if model == "dielectric" else {"ior": 2.0}
    pane = Material(model=model, transmittance=COLOR, transmittance_texture=texture, **smooth)
    camera = stare((0.1, 0.0, 0.0), (0.1, 0.0, 3.0))
    scene = Scene(camera, {"pane": pane}, meshes=[Mesh((Part(quad, "pane"),))], ambient=Ambient(1.0))
    passed = 0.5 * np.multiply(COLOR, OTHER) * (1 - (0 if model == "dielectric" else 2 / 9 / (1 + 1 / 9)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it is not closed
        assert_mean(rendered(ctx, scene, 1024, bounces=0), passed, 0.01)


def test_light_within_a_dielectric_is_absorbed_on_its_way(ctx):
    """From a lamp to a surface, and on to the camera, all of them inside."""
    target = (0.0, 0.0, 0.0)
    scene = Scene(
        stare(target, (0.0, 1.0, 0.0)),
        {"tint": tinted(COLOR), "matt": lambert(0.5)},
        spheres=[Sphere(target, 5.0, "tint")],
        rectangles=[Rectangle((-1.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0), "matt")],
        lights=[Light((2.0, 2.0, 0.0), power=4 * np.pi)],
    )
    image = rendered(ctx, scene, 4, bounces=1)
    expected = 0.5 / np.pi * np.sqrt(0.5) / 8 * powers((COLOR, 1 + np.sqrt(8)))
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=1e-4)


def prism(index: float, **glass: Any) -> tuple[Scene, float]:
    """A ray that passes it symmetrically, deviated by 2 asin(n sin(A / 2)) - A to a lamp a hundredth of a radian wide;
    and what passes."""
    apex = np.radians(50.0)
    half = apex / 2
    left, right, top = (
        np.array(p) for p in ((-np.sin(half), -np.cos(half)), (np.sin(half), -np.cos(half)), (0.0, 0.0))
    )
    corners = [np.append(p, z) for z in (-1.0, 1.0) for p in (left, right, top)]
    faces = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    turned = np.arcsin(index * np.sin(half)) - half  # of the ray before and after, from the horizontal
    height = -0.5 * np.cos(half)
    enters = np.array([-0.5 * np.sin(half), height, 0.0])
    eye = enters - 2 * np.array([np.cos(turned), np.sin(turned), 0.0])
    across = np.array([np.cos(turned), -np.sin(turned), 0.0])
    place = enters * (-1, 1, 1) + 3 * across
    up = np.array([np.sin(turned), np.cos(turned), 0.0])
    edge_u, edge_v = np.array([0.0, 0.0, 0.03]), 0.03 * up
    scene = Scene(
        stare(tuple(enters), tuple(eye)),
        {"glass": Material(model="dielectric", roughness=0.0, **{"ior": index} | glass), "lamp": lambert(0.0, 1.0)},
        triangles=[Triangle(tuple(tuple(corners[i]) for i in face), "glass") for face in faces],
        rectangles=[Rectangle(tuple(place - (edge_u + edge_v) / 2), tuple(edge_u), tuple(edge_v), "lamp")],
    )
    cos_i, cos_t = np.cos(turned + half), np.cos(half)
    s, p = (cos_i - index * cos_t) / (cos_i + index * cos_t), (index * cos_i - cos_t) / (index * cos_i + cos_t)
    return scene, float((1 - (s**2 + p**2) / 2) ** 2)


@pytest.mark.parametrize("ior", [1.5, 2.0])
def test_a_prism_deviates_light_by_snells_law(ctx, ior):
    scene, passed = prism(ior)
    assert_mean(rendered(ctx, scene, 4096, bounces=2), passed, 0.01)


def dispersion_of_bands():
    """(n - n_d) V / (n_d - 1) by Cauchy's formula through the Fraunhofer lines d, F and C."""
    d, f, c = 587.56, 486.13, 656.27
    return (np.array([611.4, 549.1, 464.3]) ** -2.0 - d**-2) / (f**-2 - c**-2)


def test_bands_are_of_cauchys_formula():
    text = (folder("shaders") / "integrator/interior.glsl").read_text()
    (numbers,) = re.findall(r"const vec3 DISPERSION_OF_BANDS = vec3\((.*)\);", text)
    np.testing.assert_allclose([float(x) for x in numbers.split(",")], dispersion_of_bands(), atol=5e-5)


@pytest.mark.parametrize("band", [0, 1, 2])
def test_a_prism_parts_colours(ctx, band):
    """Each as bright as without dispersion."""
    ior = 1.5 + 0.5 / 12.0 * dispersion_of_bands()[band]
    scene, passed = prism(ior, ior=1.5, abbe_number=12.0)
    image = rendered(ctx, scene, 4096, bounces=2)
    assert not np.delete(image, band, axis=2).any()
    assert_mean(np.repeat(image[..., band : band + 1], 3, axis=2), passed, 0.02)


def test_dispersion_favours_no_colour(ctx):
    """Glass vanishes in a white furnace."""
    glass = Material(model="dielectric", roughness=0.0, abbe_number=15.0)
    view = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=20.0)
    scene = Scene(view, {"glass": glass}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "glass")], ambient=Ambient(1.0))
    assert_mean(rendered(ctx, scene, 1024, **PATHS), 1.0, 0.01)


def test_a_surface_of_water_without_an_end_refracts(ctx):
    """A plane whose back is under water, with the camera there: what lies beyond the critical angle is mirrored."""
    for degrees, expected in ((30.0, None), (60.0, 0.0)):
        tilt = np.radians(degrees)
        eye = (np.sin(tilt), -np.cos(tilt), 0.0)
        water = Material(model="dielectric", roughness=0.0, ior=1.33)
        scene = Scene(
            stare((0.0, 0.0, 0.0), eye),
            {"water": water, "black": lambert(0.0)},
            planes=[
                Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "water"),
                Plane((0.0, -2.0, 0.0), (0.0, 1.0, 0.0), "black"),
            ],
            ambient=Ambient(1.0),
        )
        image = rendered(ctx, scene, 1024, bounces=4)
        if expected is not None:
            assert not image.any()
        else:
            sine = 1.33 * np.sin(tilt)
            one, two = tilt, np.arcsin(sine)
            s, p = np.sin(one - two) / np.sin(one + two), np.tan(one - two) / np.tan(one + two)
            assert_mean(image, 1.33**2 * (1 - (s**2 + p**2) / 2), 0.01)


@pytest.mark.parametrize("ior", [1.3, 1.5, 2.0])
def test_white_plastic_reflects_everything(ctx, ior):
    """Light that the coat reflects back to a white base is scattered again, until all has left."""
    plastic = Material(model="plastic", albedo=1.0, ior=ior)
    view = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=30.0)
    scene = Scene(view, {"plastic": plastic}, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "plastic")], ambient=Ambient(1.0))
    assert_mean(rendered(ctx, scene, 256, shared=True, **PATHS), 1.0, 0.002)


SPHERES = """
[[sphere]]
center = [0, 0, 0]
radius = 1
material = "glass"
[[sphere]]
center = [0, 0, 1.5]
radius = 1
material = "water"
[material.water]
model = "dielectric"
"""
MISTAKES = {
    "exterior_ior = 1.3\npriority = 1": "material.glass: exterior_ior makes an interface, which has nothing within; "
    "leave priority or it out",
    "exterior_ior = 1.3\nattenuation_color = 0.5": "material.glass: exterior_ior makes an interface, which has nothing "
    "within; leave attenuation_color or it out",
    "ior = 0": "material.glass.ior: must be at least 1, got 0",
    "unlit = true": "material.glass: unlit shows the albedo, which means nothing to model = 'dielectric'",
    "metallic = 1": "material.glass: metallic means nothing to model = 'dielectric'; leave it out; its keys are "
    "roughness, anisotropy, anisotropy_rotation_degrees, ior, exterior_ior, transmittance, attenuation_color, "
    "attenuation_distance, abbe_number, priority, interior",
    "attenuation_color = 0": "material.glass.attenuation_color: must be greater than 0",
    "attenuation_distance = 0": "material.glass.attenuation_distance: must be greater",
    "": "material.water.priority: shapes of 'glass' and 'water' may overlap, and both have the priority 0; give the "
    "one that fills what is common to both a higher priority",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_are_named(text):
    with pytest.raises(SceneError) as raised:
        parse(f'{SPHERES}[material.glass]\nmodel = "dielectric"\n{text}', "x.toml")
    assert f"x.toml: {MISTAKES[text]}" in str(raised.value)
