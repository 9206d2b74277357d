# SPDX-License-Identifier: MIT
"""Meshes in Mitsuba: where they are, which way they face, and what their materials are at a point, against numpy."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.reference.render import render_reference
from fragtracer.reference.translate import scene_tree, to_mitsuba
from fragtracer.scene import (
    Ambient,
    Camera,
    Geometry,
    Image,
    Material,
    Mesh,
    Part,
    Placement,
    RenderSettings,
    Scene,
    Texture,
)

AHEAD = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), fov_degrees=20.0)
CORNERS = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]])
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
HERE = Placement()
QUAD = Geometry(CORNERS, TRIANGLES, uvs=UVS)
SPLIT = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)


def scene_of(material, geometry=QUAD, placement=HERE, camera=AHEAD, **rest):
    return Scene(camera, {"m": material}, meshes=[Mesh([Part(geometry, "m")], [placement])], **rest)


def picture(scene, size=(16, 16), spp=64, **settings):
    return render_reference(replace(scene, render=RenderSettings(**settings)), size, spp)[0]


def hit(mi, scene, x=0.0, y=0.0):
    world = mi.load_dict(to_mitsuba(scene))
    return world.ray_intersect(mi.Ray3f(mi.Point3f(x, y, 9), mi.Vector3f(0, 0, -1)))


def test_a_texture_is_upright(mi):
    glow = Material(albedo=0.0, specular=0.0, emission=1.0, emission_texture=Texture(Image(SPLIT), filter="nearest"))
    image = picture(scene_of(glow), bounces=0)
    np.testing.assert_allclose(image[[4, 4, 12, 12], [4, 12, 4, 12]], [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_the_front_stays_the_front(mi, mirror):
    glow = Material(albedo=0.0, specular=0.0, emission=1.0)
    placement = Placement((0.5, 0.0, 0.0), (0.0, 0.0, 30.0), (mirror, 0.5, 1.0))
    assert picture(scene_of(glow, placement=placement), bounces=0).max() == 1
    behind = Camera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0))
    assert picture(scene_of(glow, placement=placement, camera=behind), bounces=0).max() == 0


def test_parts_and_instances_are_where_their_matrices_say(mi):
    matrix = tuple(map(tuple, Placement((0.0, 0.0, 0.7)).matrix.tolist()))
    mesh = Mesh(
        [Part(QUAD, "m", matrix)], [Placement((0.0, 0.0, -1.0), scale=(1.0, 1.0, 2.0)), Placement((9.0, 0.0, 1.0))]
    )
    scene = Scene(AHEAD, {"m": Material()}, meshes=[mesh])
    assert hit(mi, scene).p.z.numpy() == pytest.approx(2 * 0.7 - 1, abs=1e-5)
    assert hit(mi, scene, x=9.0).p.z.numpy() == pytest.approx(1.7, abs=1e-5)


def test_an_empty_part_is_left_out(mi, tmp_path):
    empty = Geometry(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert not any(key.startswith("mesh") for key in scene_tree(scene_of(Material(), empty), tmp_path))


def lobes_at(mi, scene, x, y):
    """What our plugin takes the material to be at a point."""
    si = hit(mi, scene, x, y)
    world = mi.load_dict(to_mitsuba(scene))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(x, y, 9), mi.Vector3f(0, 0, -1)))
    return world.shapes()[0].bsdf()._lobes(si, True)


def test_textures_and_colors_multiply_the_material(mi):
    number = np.array([[[50, 100, 150]]], np.uint8)
    colors = np.array([[0.2, 0.4, 0.6, 1.0]] * 4)
    material = Material(
        albedo=(0.5, 0.6, 0.7),
        roughness=0.8,
        metallic=0.9,
        f0=(0.01, 0.05, 0.1),
        specular=0.5,
        albedo_texture=Texture(Image(SPLIT), filter="nearest", coordinates=1),
        roughness_texture=Texture(Image(number, "linear"), channel="g"),
        metallic_texture=Texture(Image(number, "linear"), channel="b"),
    )
    geometry = Geometry(CORNERS, TRIANGLES, uvs=UVS, uvs_1=np.full((4, 2), 0.75), colors=colors)
    lobes = lobes_at(mi, scene_of(material, geometry), -0.5, 0.5)
    albedo, metallic = np.multiply(material.albedo, colors[0, :3]), 0.9 * 150 / 255
    f0 = (1 - metallic) * 0.5 * np.array(material.f0) + metallic * albedo
    f90 = (1 - metallic) * 0.5 * np.minimum(1, 50 * np.array(material.f0)) + metallic
    np.testing.assert_allclose(lobes.albedo.numpy().ravel(), (1 - metallic) * albedo, rtol=1e-5)
    np.testing.assert_allclose(lobes.f0.numpy().ravel(), f0, rtol=1e-5)
    np.testing.assert_allclose(lobes.f90.numpy().ravel(), f90, rtol=1e-5)
    assert lobes.alpha.numpy() == pytest.approx((0.8 * 100 / 255) ** 2)


def test_a_white_texture_changes_nothing(mi):
    for plain in (Material(albedo=0.3, roughness=0.4, metallic=0.25, ior=1.3), Material(metal="copper")):
        lobes = lobes_at(mi, scene_of(replace(plain, albedo_texture=Texture(Image(SPLIT[1:, 1:])))), 0.5, 0.5)
        np.testing.assert_allclose(lobes.albedo.numpy().ravel(), plain.diffuse_albedo, rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose(lobes.f0.numpy().ravel(), plain.specular_f0, rtol=1e-5)
        np.testing.assert_allclose(lobes.f90.numpy().ravel(), plain.specular_f90, rtol=1e-5)


def frame_at(mi, scene, x=0.3, y=-0.2):
    world = mi.load_dict(to_mitsuba(scene))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(x, y, 9), mi.Vector3f(0, 0, -1)))
    return world.shapes()[0].bsdf()._frame(si, True)[0].n.numpy().ravel()


def test_shading_normals_are_interpolated_and_stand_on_the_surface_wherever_it_is(mi):
    normals = np.array([[-0.5, 0, 1], [0.5, 0, 1], [0.5, 0.3, 1], [-0.5, 0, 1]])
    geometry = Geometry(CORNERS, TRIANGLES, normals=normals * 3)
    placement = Placement((0.0, 0.0, 0.0), (20.0, -10.0, 0.0), (1.0, 2.0, 0.5))
    scene = scene_of(Material(), geometry, placement)
    world = mi.load_dict(to_mitsuba(scene))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(0.3, -0.2, 9), mi.Vector3f(0, 0, -1)))
    matrix = placement.matrix[:3, :3]
    x, y, _ = np.linalg.solve(matrix, si.p.numpy().ravel())
    weights = np.array([(1 - x) / 2, (x - y) / 2, (1 + y) / 2])  # of corners 0, 1 and 2
    units = normals[:3] / np.linalg.norm(normals[:3], axis=1, keepdims=True) @ np.linalg.inv(matrix)
    expected = weights @ (units / np.linalg.norm(units, axis=1, keepdims=True))
    found = world.shapes()[0].bsdf()._frame(si, True)[0].n.numpy().ravel()
    np.testing.assert_allclose(found, expected / np.linalg.norm(expected), atol=1e-5)


@pytest.mark.parametrize(("mirror", "flat"), [(1.0, 0.5), (-1.0, 0.5), (1.0, 0.0)])
def test_normals_follow_a_node_that_has_no_inverse_too(mi, mirror, flat):
    geometry = Geometry(CORNERS, TRIANGLES, normals=[[0.6, 0, 0.8]] * 4)
    part = Part(geometry, "m", np.diag([mirror, 1.0, flat, 1.0]))
    normal = frame_at(mi, Scene(AHEAD, {"m": Material()}, meshes=[Mesh([part])], ambient=Ambient(1.0)))
    np.testing.assert_allclose(normal, np.divide([mirror * flat * 0.6, 0, 0.8], np.hypot(flat * 0.6, 0.8)), atol=1e-6)


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_normal_map_has_the_frame_of_gltf(mi, given, mirrored):
    """Red leans along u, green against v, whichever way the image lies on the surface."""
    texel = np.array([[[0.5 + 0.5 * 0.4, 0.5 + 0.5 * 0.6, 1.0]]], np.float32)
    uvs = UVS * [-1, 1] if mirrored else UVS
    tangents = np.array([[-1.0 if mirrored else 1.0, 0, 0, -1.0 if mirrored else 1.0]] * 4) if given else None
    geometry = Geometry(CORNERS, TRIANGLES, uvs=uvs, tangents=tangents)
    material = Material(normal_texture=Texture(Image(texel, "linear")), normal_scale=0.5)
    expected = np.array([-0.2 if mirrored else 0.2, 0.3, 1.0])
    for placement, sign in ((Placement(), 1), (Placement(scale=(-1.0, 1.0, 1.0)), -1)):
        found = frame_at(mi, scene_of(material, geometry, placement))
        np.testing.assert_allclose(found, expected * (sign, 1, 1) / np.linalg.norm(expected), atol=1e-5)


def test_near_an_outline_the_shading_normal_is_bent_to_the_viewer(mi):
    leaning = Geometry(CORNERS, TRIANGLES, normals=[[0.995, 0.0, 0.1]] * 4)
    scene = scene_of(Material(), leaning, Placement(rotation_degrees=(0.0, 20.0, 0.0)))
    normal = frame_at(mi, scene)
    assert normal == pytest.approx([0.99995, 0, 0.01], abs=1e-3)


def test_light_fades_towards_the_surface_and_is_none_below(mi):
    """White light from all around on a plane whose normals lean by 60°, against a sum over directions."""
    leaning = np.array([np.sin(np.radians(60)), 0, 0.5])
    geometry = Geometry(CORNERS, TRIANGLES, normals=[leaning] * 4)
    scene = scene_of(Material(albedo=0.8, specular=0.0), geometry, ambient=Ambient(1.0))
    found = picture(scene, (8, 8), 16384, bounces=1).mean()
    z, phi = np.meshgrid((np.arange(1000) + 0.5) / 1000, (np.arange(1000) + 0.5) / 1000 * 2 * np.pi)
    sine = np.sqrt(1 - z**2)
    cosine = np.maximum(sine * np.cos(phi) * leaning[0] + z * leaning[2], 0)
    g = np.minimum(1, z / np.maximum(cosine * leaning[2], 1e-9))
    assert found == pytest.approx(0.8 * 2 * np.mean(cosine * (g + g**2 - g**3)), rel=0.002)


def seen_through(mi, material, geometry=QUAD, light=1.0, **settings):
    """What is seen in the middle of a sheet before a white sky: the share of rays that pass a black one."""
    return picture(scene_of(material, geometry, ambient=Ambient(light)), (8, 8), 256, **settings).mean(axis=(0, 1))


def test_alpha(mi):
    black = Material(albedo=0.0, specular=0.0, opacity=0.8)
    blend = replace(black, alpha_mode="blend")
    half = np.array([[[255, 255, 255, 102]]], np.uint8)
    colors = np.array([[1.0, 1.0, 1.0, 0.9]] * 4)
    colored = Geometry(CORNERS, TRIANGLES, uvs=UVS, colors=colors)
    through = {"albedo_texture": Texture(Image(half))}
    assert seen_through(mi, black) == pytest.approx(0)
    assert seen_through(mi, blend) == pytest.approx(0.2, abs=0.01)
    assert seen_through(mi, replace(blend, **through)) == pytest.approx(1 - 0.8 * 0.4, abs=0.01)
    alpha = 0.8 * 0.4 * 0.9
    assert seen_through(mi, replace(blend, **through), colored) == pytest.approx(1 - alpha, abs=0.01)
    above = replace(black, alpha_mode="mask", alpha_cutoff=alpha + 0.01, **through)
    assert seen_through(mi, above, colored) == pytest.approx(1)
    equal = Material(albedo=0.0, specular=0.0, alpha_mode="mask", alpha_cutoff=float(np.float32(0.9)))
    assert seen_through(mi, equal, colored) == pytest.approx(0)


def test_a_mask_is_cut_after_filtering(mi):
    """Between a texel of 0 and one of 1 the cut at 0.25 lies a quarter of the way, straight across."""
    pixels = np.array([[[255, 255, 255, 0], [255, 255, 255, 255]]], np.uint8)
    material = Material(
        albedo=0.0,
        specular=0.0,
        alpha_mode="mask",
        alpha_cutoff=0.25,
        albedo_texture=Texture(Image(pixels), wrap_u="clamp"),
    )
    # The picture is 2 tan(10°) · 5 = 1.763 wide, the cut at u = 0.25 + 0.25 / 2.
    share = 0.5 + (2 * 0.375 - 1) / (10 * np.tan(np.radians(10)))
    assert seen_through(mi, material) == pytest.approx(share, abs=0.005)


def test_what_has_one_side_is_not_there_from_behind(mi):
    sheet = Material(albedo=0.0, specular=0.0, double_sided=False)
    assert seen_through(mi, sheet) == pytest.approx(0)
    behind = scene_of(sheet, camera=Camera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), fov_degrees=20.0), ambient=Ambient(1.0))
    assert picture(behind).min() == pytest.approx(1)
    assert picture(behind, bounces=0).min() == pytest.approx(1)
