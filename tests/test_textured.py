# SPDX-License-Identifier: MIT
"""Textured meshes against closed forms: what is seen of an image, its alpha, its normals and its light."""

import itertools
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from rendering import ESTIMATORS, batches, rendered
from scene_builders import lambert
from scipy import stats
from textured_scenes import facing, mesh, quad, texture, under_sheets

from fragtracer.scene import Camera, Light, Material, Rectangle, Scene, Sphere

Floats = NDArray[np.floating]
ALPHA = 1e-3  # of a test as a whole


@pytest.mark.parametrize(("specialised", "estimator"), [(False, "nee"), (True, "bsdf"), (True, "mis")])
def test_an_image_in_a_furnace_is_seen_texel_by_texel(ctx: moderngl.Context, estimator: str, specialised: bool) -> None:
    """Lambert under the same radiance from everywhere reflects its albedo: here that of each pixel's own texel."""
    pixels = np.random.default_rng(1).integers(0, 256, (8, 8, 3), np.uint8)
    material = Material(albedo=1.0, specular=0.0, albedo_texture=texture(pixels, "srgb"))
    image = batches(ctx, facing({"m": material}, mesh(quad(), "m")), 16, [0], (8, 8), specialised, estimator=estimator)[
        0
    ]
    values = pixels / 255
    expected = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(image, expected, atol=2e-5)


def test_colours_of_vertices_multiply(ctx: moderngl.Context) -> None:
    geometry = quad(colors=[(0.5, 0.25, 1.0)] * 4)
    material = Material(albedo=0.5, specular=0.0)
    image = rendered(ctx, facing({"m": material}, mesh(geometry, "m")), 4, (4, 4))
    np.testing.assert_allclose(image, np.broadcast_to((0.25, 0.125, 0.5), (4, 4, 3)), rtol=1e-5)


@pytest.mark.parametrize("coat_roughness", [0.0, 0.5])
def test_a_normal_map_leaves_the_reflection_of_the_coat_alone(ctx: moderngl.Context, coat_roughness: float) -> None:
    """At 70° to a black base, whose own normal has its back to what the coat reflects, or to the viewer."""
    view = Camera((np.sin(np.radians(70)), 0.0, np.cos(np.radians(70))), (0.0, 0.0, 0.0), fov_degrees=20.0)
    images = []
    for lean in (0.0, 0.7, -0.7):
        bent = np.array([lean, 0.0, np.sqrt(1 - lean**2)], np.float32)
        lacquer = Material(albedo=0.0, specular=0.0, coat=1.0, coat_roughness=coat_roughness)
        bumpy = replace(lacquer, normal_texture=texture(0.5 + 0.5 * np.tile(bent, (2, 2, 1)), "linear"))
        scene = replace(facing({"m": bumpy}, mesh(quad(), "m")), camera=view)
        images.append(rendered(ctx, scene, 16, (8, 8), bounces=1))
    assert images[0].mean() > 0.05
    for image in images[1:]:
        np.testing.assert_allclose(image, images[0], rtol=1e-3)


PLAIN = {
    "dielectric": Material(model="dielectric", roughness=0.0, transmittance=(0.9, 0.5, 0.3)),
    "plastic": Material(model="plastic", albedo=(0.2, 0.5, 0.3)),
    "conductor": Material(model="conductor", metal="gold", roughness=0.3),
    "metallic-roughness": Material(albedo=(0.2, 0.5, 0.3), metallic=0.5, roughness=0.4, emission=(0.1, 0.2, 0.3)),
}


def test_textures_of_one_material_change_no_other(ctx: moderngl.Context) -> None:
    """Of those without, everything is constant, whether others have textures or not."""
    alone = facing(PLAIN | {"mapped": lambert(0.5)}, mesh(quad((-1, -1, -9)), "mapped"))
    centers = [(x, y, 0.0) for y in (0.5, -0.5) for x in (-0.5, 0.5)]
    alone = replace(alone, spheres=[Sphere(center, 0.3, name) for center, name in zip(centers, PLAIN, strict=True)])
    mapped = replace(lambert(0.5), albedo_texture=texture(np.full((2, 2, 3), 255, np.uint8)))
    beside = replace(alone, materials={**alone.materials, "mapped": mapped})
    image, expected = (rendered(ctx, scene, 64, (32, 32)) for scene in (beside, alone))
    for rows, columns in itertools.product((slice(0, 16), slice(16, 32)), repeat=2):
        assert expected[rows, columns].std() > 0.01
    np.testing.assert_allclose(image, expected, rtol=1e-3, atol=1e-5)


def proportion_agrees(image: Floats, expected: float, spp: int, tests: int) -> bool:
    """Whether a mean of zeros and ones is that of ``expected`` (binomial, Šidák over ``tests``)."""
    count = round(float(image[..., 0].sum(dtype=np.float64)) * spp)
    return stats.binomtest(count, image.shape[0] * image.shape[1] * spp, expected).pvalue > 1 - (1 - ALPHA) ** (
        1 / tests
    )


@pytest.mark.parametrize(("sheets", "sampler"), [(1, "texture"), (2, "hash"), (5, "texture"), (5, "hash")])
def test_a_stack_of_sheets_dims_what_is_behind(ctx: moderngl.Context, sheets: int, sampler: str) -> None:
    """Black sheets of opacity a before radiance 1: (1 - a)^k."""
    black = Material(albedo=0.0, specular=0.0, opacity=0.3, alpha_mode="blend")
    stack = [mesh(quad((-1, -1, -0.1 * i)), "black") for i in range(sheets)]
    image = rendered(ctx, facing({"black": black}, *stack), 256, (16, 16), sampler=sampler)
    assert proportion_agrees(image, 0.7**sheets, 256, 4)


def test_the_sheets_are_met_independently_at_one_point(ctx: moderngl.Context) -> None:
    """Also where every ray is the same, and all that tells samples apart is their number."""
    black = Material(albedo=0.0, specular=0.0, opacity=0.5, alpha_mode="blend")
    stack = [mesh(quad((-1, -1, -0.1 * i)), "black") for i in range(3)]
    scene = facing({"black": black}, *stack)
    scene = replace(scene, camera=replace(scene.camera, fov_degrees=1e-5))
    assert proportion_agrees(rendered(ctx, scene, 4096, (4, 4)), 0.125, 4096, 1)


def test_opacity_of_texture_and_vertices(ctx: moderngl.Context) -> None:
    material = Material(
        albedo=0.0,
        specular=0.0,
        opacity=0.8,
        alpha_mode="blend",
        albedo_texture=texture(np.full((1, 1, 4), 0.5, np.float32)),
    )
    geometry = quad(colors=[(1, 1, 1, 0.5)] * 4)
    image = rendered(ctx, facing({"m": material}, mesh(geometry, "m")), 256, (16, 16))
    assert proportion_agrees(image, 1 - 0.8 * 0.5 * 0.5, 256, 1)


def test_mask_cuts_out(ctx: moderngl.Context) -> None:
    alpha = np.array([[0.2, 0.6], [0.5, 0.4]], np.float32)
    pixels = np.concatenate([np.zeros((2, 2, 3), np.float32), alpha[..., None]], axis=2)
    material = Material(specular=0.0, alpha_mode="mask", alpha_cutoff=0.5, albedo_texture=texture(pixels))
    image = rendered(ctx, facing({"m": material}, mesh(quad(), "m")), 16, (2, 2))
    np.testing.assert_allclose(image[..., 0], alpha < 0.5, atol=1e-6)


def test_shapes_of_one_side_are_there_for_rays_from_the_front(ctx: moderngl.Context) -> None:
    black = Material(albedo=0.0, specular=0.0, double_sided=False)
    for turned, expected in ((1.0, 0.0), (-1.0, 1.0)):
        wall = Rectangle((-turned, -1.0, 0.0), (2.0 * turned, 0.0, 0.0), (0.0, 2.0, 0.0), "black")
        image = rendered(ctx, facing({"black": black}, rectangles=(wall,)), 4, (4, 4))
        np.testing.assert_allclose(image, expected, atol=1e-6)


def test_spheres_are_there_in_part_too(ctx: moderngl.Context) -> None:
    """A ray meets the near and the far side: (1 - a)^2."""
    black = Material(albedo=0.0, specular=0.0, opacity=0.4, alpha_mode="blend")
    scene = facing({"black": black}, spheres=(Sphere((0.0, 0.0, 0.0), 2.0, "black"),))
    assert proportion_agrees(rendered(ctx, scene, 256, (16, 16)), 0.36, 256, 1)


@pytest.mark.parametrize("sheets", [1, 4])
def test_shadows_of_sheets(ctx: moderngl.Context, sheets: int) -> None:
    """A point light's irradiance times (1 - a)^k; every sample is all or nothing of the unoccluded radiance."""
    light = Light((5.0, 0.0, 5.0), power=100.0)
    clear, dimmed = (rendered(ctx, under_sheets(k, light), 512, (8, 8), bounces=1) for k in (0, sheets))
    assert proportion_agrees(dimmed / clear, 0.7**sheets, 512, 2)


def test_several_light_samples_meet_sheets_independently(ctx: moderngl.Context) -> None:
    """Otherwise the spread between pixels would be that of one sample."""
    light = Light((5.0, 0.0, 5.0), 0.01, power=100.0)
    settings = {"bounces": 1, "light_samples": 4, "sampler": "hash"}
    clear, dimmed = (rendered(ctx, under_sheets(k, light, 0.5), 64, (32, 32), **settings) for k in (0, 1))
    share = (dimmed / clear)[..., 0]
    assert abs(share.mean() - 0.5) < 4 * 0.5 / np.sqrt(64 * 4 * 1024)
    assert share.std() == pytest.approx(0.5 / np.sqrt(64 * 4), rel=0.15)


def means_agree(ctx: moderngl.Context, scene: Scene, **settings: Any) -> None:
    """Whether all estimators have the same mean, from independent batches (t tests, Šidák)."""
    seeds = range(8)
    means = [
        batches(ctx, scene, 512, seeds, (8, 8), estimator=e, **settings).mean(axis=(1, 2), dtype=np.float64)
        for e in ESTIMATORS
    ]
    assert np.mean(means) > 0
    for other in means[1:]:
        p = stats.ttest_ind(means[0], other, equal_var=False).pvalue
        assert np.min(p) > 1 - (1 - ALPHA) ** (1 / 6), (means[0].mean(axis=0), other.mean(axis=0))
    spread = np.std(means, axis=1).max() / np.mean(means)
    assert spread < 0.1  # else nothing would be seen


def test_all_estimators_see_the_same_through_sheets(ctx: moderngl.Context) -> None:
    scene = under_sheets(2, None, 0.4)
    lamp = mesh(quad((4, -2, 0), (0, 4, 0), (0, 0, 4)), "lamp")
    lamp = replace(lamp, parts=(replace(lamp.parts[0], geometry=quad((4, 2, 0), (0, -4, 0), (0, 0, 4))),))
    materials = {**scene.materials, "lamp": Material(albedo=0.0, specular=0.0, emission=3.0)}
    means_agree(ctx, replace(scene, materials=materials, meshes=(*scene.meshes, lamp)), bounces=1)


def lit_by(material: Material, **fields: Any) -> Scene:
    """A floor at z = 0 and a panel above its left side, seen past the panel."""
    panel = quad((-3, 2, 1.5), (2, 0, 0), (0, -4, 0))  # its front looks down
    materials = {"floor": Material(albedo=0.6, roughness=0.5), "panel": material}
    scene = facing(materials, mesh(quad(), "floor"), mesh(panel, "panel"), ambient=0.0, **fields)
    return replace(scene, camera=replace(scene.camera, target=(0.5, 0.0, 0.0), fov_degrees=0.1))


STRIPES = np.array([[[9.0, 0.0, 1.0], [0.0, 0.5, 2.0], [0.0, 3.0, 0.0]]], np.float32)


def test_all_estimators_see_the_same_light_of_an_emission_texture_that_is_there_in_part(ctx: moderngl.Context) -> None:
    alpha = np.concatenate([np.ones((1, 2, 3)), [[[0.2], [0.9]]]], axis=2).astype(np.float32)
    emission = {"emission": 1.0, "emission_texture": texture(STRIPES)}
    material = Material(albedo=0.0, specular=0.0, albedo_texture=texture(alpha), alpha_mode="blend", **emission)
    means_agree(ctx, lit_by(material), bounces=1)


def test_all_estimators_see_the_same_light_of_what_is_unlit(ctx: moderngl.Context) -> None:
    means_agree(ctx, lit_by(Material(albedo=(0.9, 0.5, 0.2), unlit=True)), bounces=1)


def test_a_texture_of_one_value_emits_as_without(ctx: moderngl.Context) -> None:
    plain = Material(albedo=0.0, specular=0.0, emission=(2.0, 1.0, 0.5))
    textured = replace(
        plain, emission=4.0, emission_texture=texture(np.full((2, 2, 3), (0.5, 0.25, 0.125), np.float32))
    )
    a, b = (rendered(ctx, lit_by(m), 64, (8, 8), bounces=1) for m in (plain, textured))
    np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)


def test_what_an_image_has_below_zero_gives_no_light(ctx: moderngl.Context) -> None:
    """Pictures of floats that were made smaller with a sharp filter have such texels."""
    plain = Material(albedo=0.0, specular=0.0, emission=2.0)
    a, b = (
        rendered(ctx, lit_by(replace(plain, emission_texture=texture([[[3.0], [least]]]))), 64, (8, 8), bounces=1)
        for least in (0.0, -1.0)
    )
    np.testing.assert_array_equal(a, b)
    assert a.min() > 0


def test_floats_above_one_make_a_mirror_rough(ctx: moderngl.Context) -> None:
    plain = Material(metal="gold", roughness=0.4)
    raised = replace(plain, roughness=0.004, roughness_texture=texture(np.full((1, 1, 1), 100, np.float32)))
    a, b = (
        rendered(
            ctx, facing({"m": m}, mesh(quad(), "m"), lights=[Light((0, 3, 3), 1.0, power=50.0)]), 64, (8, 8), bounces=1
        )
        for m in (plain, raised)
    )
    np.testing.assert_allclose(a, b, rtol=1e-3)


def test_what_is_unlit_is_seen_as_it_is(ctx: moderngl.Context) -> None:
    pixels = np.random.default_rng(2).random((4, 4, 3)).astype(np.float32)
    material = Material(albedo=(1.0, 0.5, 0.25), unlit=True, albedo_texture=texture(pixels))
    image = rendered(ctx, facing({"m": material}, mesh(quad(), "m")), 4, (4, 4))
    np.testing.assert_allclose(image, pixels * (1, 0.5, 0.25), rtol=1e-4)


def bumpy(x: float, y: float, scale: float = 1.0, **fields: Any) -> Material:
    """A normal map of one value that leans (x, y) to 1 along tangent and bitangent."""
    normal = np.array([x, y, 1.0]) / np.sqrt(x * x + y * y + 1)
    one = texture(((1 + normal) / 2).astype(np.float32).reshape(1, 1, 3))
    return Material(normal_texture=one, normal_scale=scale, specular=0.0, **fields)


@pytest.mark.parametrize("scale", [1.0, 0.5, -1.0])
@pytest.mark.parametrize(("x", "y"), [(0.3, 0.0), (0.0, 0.3), (-0.2, 0.25)])
def test_light_on_a_leaning_normal(ctx: moderngl.Context, x: float, y: float, scale: float) -> None:
    """A Lambert surface has the cosine with the normal that leans, less the shadow of the terminator."""
    scene = facing({"m": bumpy(x, y, scale, albedo=0.5)}, mesh(quad(), "m"), ambient=0.0)
    for place in ((0.0, 0.0, 50.0), (5.0, 0.0, 50.0), (0.0, 5.0, 50.0), (20.0, 20.0, 20.0)):
        lit = replace(scene, lights=(Light(place, power=1e5),), camera=replace(scene.camera, fov_degrees=1e-3))
        normal = np.array([scale * x, scale * y, 1.0])
        cosine = normal @ place / np.linalg.norm(normal) / np.linalg.norm(place)
        flat = place[2] / np.linalg.norm(place)
        # Chiang et al. 2019, equation 3: the shadow terminator's factor, below 1 where the normal leans to the light.
        g = min(1.0, flat / (cosine / np.linalg.norm(normal)))
        expected = 0.5 / np.pi * 1e5 / (4 * np.pi) / np.dot(place, place) * cosine * (g + g * g - g**3)
        found = rendered(ctx, lit, 4, (2, 2), bounces=1, shared=True)
        np.testing.assert_allclose(found, expected, rtol=1e-4)


WHITE = {
    "lambert": Material(albedo=1.0, specular=0.0),
    "metal": Material(albedo=1.0, metallic=1.0, roughness=0.4),
    "mirror": Material(albedo=1.0, metallic=1.0, roughness=0.0),
    "plastic": Material(albedo=1.0, roughness=0.7),
}


@pytest.mark.parametrize("name", WHITE)
@pytest.mark.parametrize("scale", [1.0, 8.0])
def test_normals_reflect_no_more_than_they_receive(ctx: moderngl.Context, name: str, scale: float) -> None:
    """In a white furnace a flat wall with a rough normal map has radiance 1 at most. Seen from the side, or of normals
    that lean far, a mirror loses what it reflects into the wall; otherwise little is lost."""
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(16, 16, 3)) * (0.3, 0.3, 0) + (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    bump = {"normal_texture": texture(((1 + normals) / 2).astype(np.float32)), "normal_scale": scale}
    materials = {other: replace(material, **bump) for other, material in WHITE.items()}  # all: one program
    scene = facing(materials, mesh(quad(), name))
    aside = replace(scene, camera=replace(scene.camera, position=(90.0, 0.0, 30.0)))
    front, side = (rendered(ctx, view, 256, (16, 16), sampler="hash", shared=True) for view in (scene, aside))
    for image in (front, side):
        assert image.mean() <= 1.0 + 1e-5
        assert image.max() <= 1.2
    assert front.mean() > (0.7 if scale == 1 else 0.05)
    assert WHITE[name].metallic or front.min() > 0.1


def test_occlusion_maps_are_for_shading_that_traces_no_rays(ctx: moderngl.Context) -> None:
    open_ = texture(np.full((1, 1, 3), (0.3, 0.0, 0.0), np.float32))
    plain = Material(albedo=0.5, specular=0.0)
    mapped = replace(plain, occlusion_texture=open_, occlusion_strength=0.5)
    for integrator, factor in (("path", 1.0), ("split-sum", 1 + 0.5 * (0.3 - 1))):
        a, b = (
            rendered(ctx, facing({"m": m}, mesh(quad(), "m")), 4, (4, 4), integrator=integrator)
            for m in (plain, mapped)
        )
        np.testing.assert_allclose(b, factor * a, rtol=1e-4)


def test_a_material_of_meshes_and_other_shapes_has_its_textures_on_meshes_alone(ctx: moderngl.Context) -> None:
    half = texture(np.full((1, 1, 3), 0.5, np.float32))
    material = Material(albedo=0.5, specular=0.0, albedo_texture=half)
    wall = Rectangle((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), "m")
    left = mesh(quad(edge_u=(1.0, 0.0, 0.0)), "m")
    image = rendered(ctx, facing({"m": material}, left, rectangles=(wall,)), 4, (4, 4))
    np.testing.assert_allclose(image[:, :2], 0.25, rtol=1e-4)
    np.testing.assert_allclose(image[:, 2:], 0.5, rtol=1e-4)
