# SPDX-License-Identifier: MIT
"""Scenes in Mitsuba: what is where, which way it faces, and radiances that are known in closed form."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fragtracer.errors import FragtracerError
from fragtracer.io.images import read_image
from fragtracer.reference.render import render_reference
from fragtracer.reference.translate import NEVER, scene_tree, to_mitsuba
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Environment,
    Fog,
    Geometry,
    Light,
    Material,
    Medium,
    Mesh,
    Part,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    Triangle,
)

from .test_bsdf import reflected_share

GLOW = {
    "glow": Material(albedo=0.0, specular=0.0, emission=(1.0, 2.0, 3.0)),
    "black": Material(albedo=0.0, specular=0.0),
}
AHEAD = Camera(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), fov_degrees=40.0)
SMALL = (32, 32)


def picture(scene, size=SMALL, spp=16, **settings):
    """One picture, float32 (h, w, 3)."""
    return render_reference(replace(scene, render=RenderSettings(**settings)), size, spp)[0]


def centroid(image):
    """Mean x and y of the light in a picture, from -1 at the left and bottom to 1 at the right and top."""
    weights = image.sum(axis=2) / image.sum()
    height, width = weights.shape
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = 1 - (np.arange(height) + 0.5) / height * 2
    return weights.sum(axis=0) @ x, weights.sum(axis=1) @ y


def test_x_is_to_the_right_and_y_is_up(mi):
    image = picture(Scene(AHEAD, GLOW, spheres=[Sphere((1.0, 0.5, 0.0), 0.2, "glow")]), spp=64)
    edge = 5 * np.tan(np.radians(20))
    assert centroid(image) == pytest.approx((1.0 / edge, 0.5 / edge), abs=0.02)
    assert image.max(axis=(0, 1)) == pytest.approx([1, 2, 3])


def test_the_field_of_view_is_vertical_and_up_is_up(mi):
    camera = Camera((3.0, 2.0, 1.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=60.0)
    point = np.array([-0.4, 0.5, 0.7])
    image = picture(Scene(camera, GLOW, spheres=[Sphere(tuple(point), 0.1, "glow")]), (64, 32), 64)
    ahead = -np.array([3.0, 2.0, 1.0]) / np.sqrt(14)
    right = np.cross(ahead, camera.up) / np.linalg.norm(np.cross(ahead, camera.up))
    p = point - camera.position
    y = p @ np.cross(right, ahead) / (p @ ahead * np.tan(np.radians(30)))
    x = p @ right / (p @ ahead * np.tan(np.radians(30))) / 2
    assert centroid(image) == pytest.approx((x, y), abs=0.01)


def test_camera_rays_are_precise_beside_a_large_plane(mi):
    camera = Camera((0.3, 0.02, 0.5), (0.1, 0.0, -0.2), fov_degrees=35.0)
    plane = Plane((0.0, 0.0, 0.0), (0.1, 1.0, 0.0), "black")
    scene = Scene(camera, GLOW, planes=[plane], render=RenderSettings(width=1920, height=1080))
    world = mi.load_dict(to_mitsuba(scene))
    u = np.random.default_rng(5).random((2, 1000), dtype="f4")
    ray, _ = world.sensors()[0].sample_ray(0.0, 0.5, mi.Point2f(u), mi.Point2f(0.5))
    ahead = np.subtract(camera.target, camera.position)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    frame = [v / np.linalg.norm(v) for v in (right, np.cross(right, ahead), ahead)]
    half = np.tan(np.radians(17.5))
    d = np.array([(2 * u[0] - 1) * half * 1920 / 1080, (1 - 2 * u[1]) * half, np.ones(1000)]).T @ np.array(frame)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    np.testing.assert_allclose(ray.d.numpy().T, d, atol=1e-6)
    hit = world.ray_intersect(ray)
    down = d @ plane.normal < -0.05
    distance = -(np.dot(camera.position, plane.normal)) / (d[down] @ plane.normal)
    np.testing.assert_allclose(hit.p.numpy().T[down], camera.position + distance[:, None] * d[down], atol=1e-5)


@pytest.mark.parametrize(
    ("height", "target"),
    [(2.0, (0.0, 2.0, 0.0)), (2.0, (0.0, 1.0, 0.0)), (2.0, (3.0, 2.9, 1.0)), (3000.0, (0.0, 3000.0, 3.0))],
)
def test_a_plane_reaches_its_horizon(mi, height, target):
    camera = Camera((0.0, height, 4.0), target, fov_degrees=50.0)
    scene = Scene(camera, GLOW, planes=[Plane((7.0, 0.0, 1.0), (0.0, 3.0, 0.0), "black")], ambient=Ambient(1.0))
    image = picture(scene, (16, 64), 256)
    ahead = np.subtract(target, camera.position)
    slope = ahead[1] / np.hypot(ahead[0], ahead[2])
    horizon = 32 * (1 + slope / np.tan(np.radians(25)))
    assert image[:, :, 0].sum(axis=0) == pytest.approx(np.full(16, horizon), abs=0.1)


QUAD = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0))


@pytest.mark.parametrize(
    "shape",
    [
        {"rectangles": [Rectangle(QUAD[0], (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "glow")]},
        {"triangles": [Triangle(QUAD[:3], "glow"), Triangle((QUAD[0], QUAD[2], QUAD[3]), "glow")]},
    ],
)
def test_flat_emitters_emit_from_their_front_only(mi, shape):
    front = picture(Scene(AHEAD, GLOW, **shape), bounces=0)
    behind = picture(Scene(Camera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0)), GLOW, **shape), bounces=0)
    assert front[16, 16] == pytest.approx([1, 2, 3])
    assert front.sum() == pytest.approx(6 * (32 / (5 * np.tan(np.radians(20)))) ** 2, rel=0.02)
    assert not behind.any()


def test_a_sphere_emits_from_its_outside_only(mi):
    inside = Scene(AHEAD, GLOW, spheres=[Sphere((0.0, 0.0, 5.0), 1.0, "glow")])
    assert not picture(inside, bounces=0).any()


def box(albedo, emission):
    """A closed cube of side 2 around the origin that faces inwards."""
    walls = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.roll(np.eye(3), axis + 1, axis=0)[0] * 2, np.roll(np.eye(3), axis + 1, axis=0)[1] * 2
            normal = np.cross(u, v) / 4
            corner = side * normal - u / 2 - v / 2
            edges = (u, v) if side < 0 else (v, u)
            walls.append(Rectangle(tuple(corner), tuple(edges[0]), tuple(edges[1]), "wall"))
    wall = Material(albedo=albedo, specular=0.0, emission=emission)
    return Scene(Camera((0.0, 0.0, 0.9), (0.1, 0.2, 0.0)), {"wall": wall}, rectangles=walls)


@pytest.mark.parametrize("russian_roulette", [True, False])
@pytest.mark.parametrize("bounces", [0, 1, 2, 7])
def test_furnace_counts_the_bounces(mi, bounces, russian_roulette):
    albedo = np.array([0.8, 0.5, 0.2])
    settings = {"russian_roulette": russian_roulette, "russian_roulette_depth": 2}
    image = picture(box(tuple(albedo), (1.0, 1.0, 1.0)), spp=256, bounces=bounces, **settings)
    expected = (1 - albedo ** (bounces + 1)) / (1 - albedo)
    assert image.mean(axis=(0, 1)) == pytest.approx(expected, rel=0.005)


def test_ambient_light_on_a_convex_body(mi):
    grey = {"grey": Material(albedo=0.6, specular=0.0)}
    scene = Scene(AHEAD, grey, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "grey")], ambient=Ambient((1.0, 0.5, 2.0)))
    image = picture(scene, spp=256, bounces=3)
    assert image[12:20, 12:20].mean(axis=(0, 1)) == pytest.approx([0.6, 0.3, 1.2], rel=0.01)
    assert image[0, 0] == pytest.approx([1, 0.5, 2])


@pytest.mark.parametrize("geometry", ["smith", "smith-height-correlated", "karis"])
@pytest.mark.parametrize("roughness", [0.01, 0.3, 1.0])
def test_metal_under_ambient_light(mi, roughness, geometry):
    silver = {"silver": Material(metal="silver", roughness=roughness)}
    floor = Plane((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), "silver")
    camera = Camera((np.sin(1.1), np.cos(1.1), 0.0), (0.0, 0.0, 0.0), fov_degrees=0.1)
    scene = Scene(camera, silver, planes=[floor], ambient=Ambient(1.0))
    image = picture(scene, (16, 16), 256, bounces=1, geometry=geometry)
    f0 = silver["silver"].specular_f0[0]
    expected = reflected_share(f0, roughness**2, geometry, np.degrees(1.1))
    assert image[:, :, 0].mean() == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("radius", [0.0, 0.05, 0.5, 1.5])
def test_the_power_of_a_light_does_not_depend_on_its_radius(mi, radius):
    floor = {"floor": Material(albedo=0.5, specular=0.0)}
    camera = Camera((3.0, 1.0, 0.0), (0.0, 0.0, 0.0), fov_degrees=0.2)
    light = Light((0.0, 2.0, 0.0), radius, power=(100.0, 50.0, 0.0))
    scene = Scene(camera, floor, planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")], lights=[light])
    expected = 0.5 / np.pi * 100 / (4 * np.pi * 2**2)
    image = picture(scene, (8, 8), 256, bounces=1)
    assert image.mean(axis=(0, 1)) == pytest.approx([expected, expected / 2, 0], rel=0.01)


def test_a_light_is_seen_and_absorbs(mi):
    scene = Scene(AHEAD, lights=[Light((0.0, 0.0, 0.0), 1.0, radiance=(3.0, 2.0, 1.0))], ambient=Ambient(5.0))
    assert picture(scene, bounces=4)[16, 16] == pytest.approx([3, 2, 1])


def blur_width(depth, aperture, focus):
    """Width in pixels of a narrow glowing strip at ``depth`` before a camera, by its bounds in the picture."""
    strip = Rectangle((-0.001, -5.0, -depth), (0.002, 0.0, 0.0), (0.0, 10.0, 0.0), "glow")
    camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -2.0), aperture_radius=aperture, focus_distance=focus)
    image = picture(Scene(camera, GLOW, rectangles=[strip]), (256, 64), 128)
    lit = np.flatnonzero(image.sum(axis=(0, 2)) > 0)
    return lit[-1] - lit[0] + 1


def test_thin_lens(mi):
    pixels_per_metre = 64 / (2 * np.tan(np.radians(20)))  # at a distance of 1 m
    assert blur_width(depth=2.0, aperture=0.3, focus=2.0) <= 2
    assert blur_width(depth=2.0, aperture=0.3, focus=None) <= 2
    expected = 2 * 0.3 * abs(4 - 2) / 4 / 2 * pixels_per_metre
    assert blur_width(depth=4.0, aperture=0.3, focus=2.0) == pytest.approx(expected, abs=2)


def test_settings(mi):
    settings = RenderSettings(bounces=7, russian_roulette_depth=3, pixel_filter="tent", width=20, height=10)
    tree = to_mitsuba(Scene(render=settings))
    assert (tree["integrator"]["max_depth"], tree["integrator"]["rr_depth"]) == (8, 3)
    assert tree["sensor"]["film"]["rfilter"]["type"] == "tent"
    assert tree["sensor"]["film"]["sample_border"]
    assert to_mitsuba(Scene(render=RenderSettings(russian_roulette=False)))["integrator"]["rr_depth"] == NEVER
    world = mi.load_dict(tree)
    assert list(world.sensors()[0].film().size()) == [20, 10]


@pytest.mark.parametrize("pixel_filter", ["box", "tent", "gaussian"])
def test_pixel_filters_keep_the_mean_and_blur_the_edge(mi, pixel_filter):
    half = Rectangle((0.0, -5.0, 0.0), (5.0, 0.0, 0.0), (0.0, 10.0, 0.0), "glow")
    row = picture(Scene(AHEAD, GLOW, rectangles=[half]), (16, 4), 1024, pixel_filter=pixel_filter)[1, :, 0]
    # The filter's share on the far side of the edge, seen from the two pixels on either side of it.
    share = {"box": (0, 0), "tent": (0, 1 / 8), "gaussian": (0.00135, 0.1587)}[pixel_filter]
    assert row[6:10] == pytest.approx([share[0], share[1], 1 - share[1], 1 - share[0]], abs=0.02)


def test_a_diffuse_material_is_mitsubas_own(mi):
    scene = Scene(
        materials={"matt": Material(specular=0.0), "plastic": Material()}, render=RenderSettings(geometry="karis")
    )
    tree = to_mitsuba(scene)
    assert tree["material_0"]["bsdf"]["type"] == "diffuse"
    assert (tree["material_1"]["type"], tree["material_1"]["geometry"]) == ("fragtracer_cooktorrance", "karis")


def test_blends(mi):
    """By our plugin, of whose parts one lies in another dielectric here; else by Mitsuba's own."""
    materials = {
        "red": Material(albedo=1.0, specular=0.0, blend="ice", blend_weight=0.3),
        "ice": Material(model="dielectric", ior=1.3, priority=1),
        "water": Material(model="dielectric", ior=1.33),
    }
    spheres = [Sphere((0.0, 0.0, 0.0), 1.0, "red"), Sphere((0.0, 0.0, 0.0), 2.0, "water")]
    scene = Scene(materials=materials, spheres=spheres)
    tree = to_mitsuba(scene)
    mi.load_dict(tree)
    of_water = tree["sphere_0"]["bsdf"]
    assert (tree["material_0"]["type"], of_water["type"], of_water["weight"]) == (*["fragtracer_blend"] * 2, 0.3)
    assert [tree["material_0"]["bsdf_1"]["ext_ior"], of_water["bsdf_1"]["ext_ior"]] == [1.0, 1.33]
    assert of_water["bsdf_0"]["bsdf"]["type"] == "diffuse"
    assert to_mitsuba(scene, plugins=False)["material_0"]["type"] == "blendbsdf"
    # Of the other part nothing but how it scatters counts.
    coated = {"red": materials["red"], "ice": Material(alpha_mode="blend", opacity=0.4, double_sided=False)}
    tree = to_mitsuba(Scene(materials=coated))
    assert tree["material_0"]["bsdf_1"] == to_mitsuba(Scene(materials={"ice": Material()}))["material_0"]
    veiled = {**materials, "red": replace(materials["red"], alpha_mode="blend")}
    with pytest.raises(FragtracerError, match="blend out"):
        to_mitsuba(replace(scene, materials=veiled))


def brushed(**values):
    return {"brushed": Material(model="conductor", metal="gold", roughness=0.5, anisotropy=0.6, **values)}


def test_anisotropic_facets_are_turned_as_ours(mi):
    """About the y axis, on spheres, in quarters of a turn; elsewhere Mitsuba's tangents are others."""
    sphere, wall = (
        Sphere((1.0, 2.0, 3.0), 0.5, "brushed"),
        Rectangle((0.0,) * 3, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "brushed"),
    )
    tree = to_mitsuba(Scene(materials=brushed(anisotropy_rotation_degrees=-90.0), spheres=[sphere]))
    facets = tree["material_0"]["bsdf"]
    assert (facets["alpha_u"], facets["alpha_v"]) == pytest.approx((0.25, 0.25 + 0.75 * 0.36))
    shape = mi.load_dict(tree).shapes()[0]
    si = shape.ray_intersect(mi.Ray3f([1, 2.3, 5], [0, 0, -1]))
    along = np.ravel(si.sh_frame.s)
    np.testing.assert_allclose(along / np.linalg.norm(along), (1, 0, 0), atol=1e-5)
    for refused in (
        Scene(materials=brushed(), rectangles=[wall]),
        Scene(materials=brushed(anisotropy_rotation_degrees=30.0)),
        Scene(materials={"worn": Material(anisotropy=0.5, alpha_mode="blend")}),
    ):
        with pytest.raises(FragtracerError, match=r"^material '(brushed|worn)': .*export-mitsuba .*--plugin"):
            to_mitsuba(refused)
        kind = "mask" if "worn" in refused.materials else "roughconductor"
        tree = to_mitsuba(refused, plugins=False)["material_0"]
        assert (tree if kind == "mask" else tree["bsdf"])["type"] == kind


def test_what_mitsubas_plastic_cannot_show(mi):
    """Its base has no colours of vertices. Without our plugins it has alpha, and an unlit one reflects nothing."""
    quad = Geometry([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colors=[[1.0, 0.5, 0.2]] * 3)
    plastic = Material(model="plastic", alpha_mode="blend", opacity=0.4, double_sided=False)
    for material in (replace(plastic, alpha_mode="opaque", double_sided=True), plastic):
        with pytest.raises(FragtracerError, match="colours of vertices"):
            to_mitsuba(Scene(materials={"m": material}, meshes=[Mesh([Part(quad, "m")])]))
    nearest = to_mitsuba(Scene(materials={"m": plastic, "flat": replace(plastic, unlit=True)}), plugins=False)
    assert [nearest["material_0"][key] for key in ("type", "opacity")] == ["mask", 0.4]
    assert nearest["material_0"]["bsdf"]["type"] == "plastic"
    assert nearest["material_1"]["bsdf"]["type"] == "diffuse"


def test_light_from_afar_does_not_pass_fog(mi):
    """But in colours that are not extinguished at all."""
    afar = {
        "directional_lights": [DirectionalLight((0.0, -1.0, 0.0), 1.0)],
        "environment": Environment(radiance=1.0, tint=(0.5, 1.0, 1.0)),
        "ambient": Ambient(1.0),
    }
    for extinction, kept in (((1.0, 2.0, 1.0), None), ((1.0, 0.0, 1.0), [0.0, 1.0, 0.0])):
        tree = to_mitsuba(Scene(media={"fog": Medium(extinction=extinction)}, fog=Fog("fog"), **afar))
        assert ("environment" in tree, "directional_light_0" in tree) == ((kept is not None),) * 2
        if kept:
            assert tree["directional_light_0"]["irradiance"]["value"] == kept
            np.testing.assert_allclose(read_image(tree["environment"]["filename"])[0, 0], np.multiply(kept, 2))
        else:
            assert "ambient" not in tree


def test_the_integrator_is_one_that_knows_what_rays_pass():
    glow, pane = Material(model="null", emission=1.0), Material(model="thin-dielectric")
    for materials, kind in (([glow], "volpath"), ([pane], "volpath"), ([Material(model="null")], "volpathmis")):
        named = {f"m{i}": material for i, material in enumerate(materials)}
        scene = Scene(materials=named, spheres=[Sphere((0.0, 0.0, 0.0), 1.0, name) for name in named])
        assert scene_tree(scene, Path())["integrator"]["type"] == kind
