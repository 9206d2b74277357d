# SPDX-License-Identifier: MIT
"""Coats in Mitsuba: their values against numpy, their densities, and what becomes of them, of sheen and of films,
without our plugins."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.translate import scene_tree, to_mitsuba
from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene import Geometry, Image, Material, Scene, Texture

from .test_bsdf import (
    GEOMETRIES,
    MULTIPLE,
    direction,
    evaluate,
    follow_the_density,
    g,
    load,
    random_directions,
    sample,
    seen_from,
    weighed_by_density,
)
from .test_meshes import CORNERS, QUAD, TRIANGLES, UVS, scene_of

F0, IOR = 0.06, (1 + np.sqrt(0.06)) / (1 - np.sqrt(0.06))
UP = np.array([0.0, 0.0, 1.0])


def passed(cosine, weight, alpha, geometry):
    """What the coat passes at a cosine."""
    width = 0.95 * alpha if geometry == "smith-height-correlated" else alpha
    return 1 - weight * (F0 + (max(1 - width, F0) - F0) * (1 - np.maximum(cosine, 0)) ** 5)


def under_coat(base, wo, wi, weight, alpha, geometry, normal=UP):
    """The f·cos (3, n) of a ``base`` with a coat, all that about its ``normal``, towards ``wi`` (3, n), in float64."""
    wo, wi = np.asarray(wo, np.float64).reshape(3, 1), np.asarray(wi, np.float64)
    co, ci = normal @ wo, normal @ wi
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=0)
    tangential = np.linalg.norm(h - (normal @ h) * normal[:, None], axis=0)
    d = alpha**2 / (np.pi * (tangential**2 + alpha**2 * (normal @ h) ** 2) ** 2)
    fresnel = F0 + (1 - F0) * (1 - (wo * h).sum(axis=0)) ** 5
    above = (co > 0) & (ci > 0)
    known = "smith" if geometry == MULTIPLE else geometry
    lobe = fresnel * d * g(np.where(above, co, 1), np.where(above, ci, 1), alpha, known) / (4 * np.where(above, co, 1))
    both = passed(co, weight, alpha, geometry) * passed(ci, weight, alpha, geometry)
    return both * base + np.where(above, weight * lobe, 0)


def coated(mi, coat=0.8, coat_alpha=0.2, **base):
    return load(mi, coat=coat, coat_alpha=coat_alpha, coat_f0=F0, **base)


@pytest.mark.parametrize("geometry", [*GEOMETRIES, MULTIPLE])
@pytest.mark.parametrize("alpha", [0.02, 0.4, 1.0])
def test_values(mi, alpha, geometry):
    """Of samples, and of directions all around; over a mirror the base is Lambert's."""
    for base in ({"albedo": 0.7, "f0": 0.04}, {"alpha_u": 0.6, "alpha_v": 0.2}, {"albedo": 0.7, "alpha": 0.0}):
        ours, bare = coated(mi, 0.8, alpha, geometry=geometry, **base), load(mi, geometry=geometry, **base)
        for angle in (10, 60, 85):
            viewer = direction(mi, angle, 20)
            drawn, around = sample(mi, ours, viewer, 2000)[0].wo.numpy(), random_directions(mi, 2000, 1).numpy()
            wi = np.concatenate([drawn, around], axis=1)
            wi = wi[:, wi[2] > 0.01]
            found, below = (evaluate(mi, bsdf, viewer, mi.Vector3f(wi)) for bsdf in (ours, bare))
            expected = under_coat(below, viewer, wi, 0.8, alpha, geometry)
            np.testing.assert_allclose(found, expected, rtol=5e-4, atol=1e-6)


CHI2_CASES = [
    # weight and alpha of the coat, base, viewer's angle
    (1.0, 0.15, {"albedo": 0.8, "f0": 0.04, "alpha": 0.6}, 30),
    (0.5, 0.5, {"f0": 0.9, "alpha": 0.1}, 75),
    (1.0, 0.3, {"albedo": 0.5, "alpha": 0.0, "geometry": "karis"}, 130),
    (1.0, 0.4, {"f0": 0.0, "f90": 0.0}, 60),
]


@pytest.mark.parametrize(("weight", "alpha", "base", "angle"), CHI2_CASES)
def test_samples_follow_the_density(mi, weight, alpha, base, angle):
    bsdf = coated(mi, weight, alpha, **base)
    follow_the_density(mi, bsdf, seen_from(mi, direction(mi, angle, 30)), len(CHI2_CASES))


@pytest.mark.parametrize("alpha", [1e-4, 0.3])
@pytest.mark.parametrize("angle", [20, 80, 150])
def test_weight_is_value_over_density(mi, alpha, angle):
    weighed_by_density(mi, coated(mi, 0.7, alpha, albedo=0.6, f0=0.3), direction(mi, angle, 200))


def test_a_mirror_is_seen_through_the_coat(mi):
    bsdf, viewer = coated(mi, 0.8, 0.3, f0=0.6, alpha=0.0), direction(mi, 60, 30)
    bs, weight = sample(mi, bsdf, viewer)
    delta = bs.sampled_type.numpy() == int(mi.BSDFFlags.DeltaReflection)
    glossy = bs.sampled_type.numpy() == int(mi.BSDFFlags.GlossyReflection)
    assert (delta | glossy).all()
    assert delta.mean() == pytest.approx(bs.pdf.numpy()[delta][0], abs=0.01)
    mirrored = (0.6 + 0.4 * 0.5**5) * passed(0.5, 0.8, 0.3, "smith") ** 2
    np.testing.assert_allclose((weight * bs.pdf).numpy()[0, delta], mirrored, rtol=1e-5)
    for lobe in (delta, glossy):
        index = bs.sampled_component.numpy()[lobe][0]
        assert mi.has_flag(bsdf.flags(int(index)), mi.BSDFFlags(int(bs.sampled_type.numpy()[lobe][0])))


@pytest.mark.parametrize(("albedo", "f0"), [(0.0, 1.0), (1.0, 0.04)])
@pytest.mark.parametrize("alpha", [1e-4, 0.1, 0.4, 1.0])
def test_no_energy_is_made(mi, albedo, f0, alpha):
    for angle in (1, 60, 80, 89):
        red = sample(mi, coated(mi, 1.0, alpha, albedo=albedo, f0=f0), direction(mi, angle), 50_000)[1].numpy()[0]
        assert red.mean() < 1 + 4 * red.std() / np.sqrt(red.size)


def test_scalar_variant_gives_the_same_numbers(mi):
    base = {"albedo": 0.5, "f0": 0.2}
    expected = evaluate(mi, coated(mi, **base), direction(mi, 40), direction(mi, 20, 100)).ravel()
    with mitsuba_variant("scalar_rgb"):
        bsdf, si = coated(mi, **base), seen_from(mi, direction(mi, 40))
        np.testing.assert_allclose(bsdf.eval(mi.BSDFContext(), si, direction(mi, 20, 100)), expected, rtol=1e-5)
        for choice in (0.05, 0.7):
            bs, weight = bsdf.sample(mi.BSDFContext(), si, choice, mi.Point2f(0.4, 0.6))
            again = bsdf.eval(mi.BSDFContext(), si, bs.wo)
            np.testing.assert_allclose(np.array(weight) * bs.pdf, np.array(again), rtol=1e-5)


def grey(level):
    return Texture(Image(np.full((1, 1, 3), level), "linear"), channel="g")


LACQUER = Material(albedo=(0.8, 0.4, 0.2), roughness=0.6, coat=0.9, coat_roughness=0.8, coat_ior=IOR)
LEAN = np.array([0.5, -0.4, 1.0])
BUMPS = Texture(Image((0.5 + 0.5 * LEAN / 1.2)[None, None], "linear"))
BUMPY = replace(LACQUER, normal_texture=BUMPS)


def on_quad(mi, material, geometry=QUAD):
    """Its plugin, where it is seen from above, and the scene, which is to outlive that."""
    world = mi.load_dict(to_mitsuba(scene_of(material, geometry)))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(0.3, -0.2, 9), mi.Vector3f(0, 0, -1)))
    return world.shapes()[0].bsdf(), si, world


@pytest.mark.parametrize("degrees", [10, 70, 160])
def test_textures_multiply_the_coat(mi, degrees):
    """As the plugin of uniform materials has it."""
    textured, si, _world = on_quad(mi, replace(LACQUER, coat_texture=grey(0.5), coat_roughness_texture=grey(0.25)))
    uniform, *_ = on_quad(mi, replace(LACQUER, coat=0.45, coat_roughness=0.2))
    si.wi, light = direction(mi, degrees, 50), random_directions(mi, 2000, 7)
    found, expected = (bsdf.eval(mi.BSDFContext(), si, light).numpy() for bsdf in (textured, uniform))
    assert ("Surface" in str(textured), "Surface" in str(uniform)) == (True, False)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("lean", [0.0, 1.5])
@pytest.mark.parametrize(
    "material",
    [
        BUMPY,
        replace(LACQUER, coat_normal_texture=BUMPS),
        replace(BUMPY, coat_normal_texture=BUMPS, coat_normal_scale=-0.5),
    ],
    ids=["the base", "the coat", "each"],
)
def test_normal_maps_bend_base_and_coat_apart(mi, material, lean):
    """Also where the surface has vertex normals, which those of a coat without a map are."""
    normal = np.array([lean, 0.0, 1.0]) / np.hypot(lean, 1)
    geometry = Geometry(CORNERS, TRIANGLES, uvs=UVS, normals=[normal] * 4)
    ours, si, _world = on_quad(mi, material, geometry)
    maps_of_coat = {"normal_texture": material.coat_normal_texture, "normal_scale": material.coat_normal_scale}
    others = replace(material, coat=0.0), replace(LACQUER, coat=0.0, **maps_of_coat)
    bare, like_coat = (on_quad(mi, other, geometry)[0] for other in others)
    light = random_directions(mi, 4000, 3)
    wi = light.numpy()
    for viewer in (direction(mi, 5), direction(mi, 65, 60), direction(mi, 65, 180)):
        si.wi = viewer
        wo = viewer.numpy().ravel()
        bent, of_coat = (bsdf._frame(si, True)[0].n.numpy().ravel() for bsdf in (ours, like_coat))
        assert bent @ of_coat < 0.9
        fade = np.minimum(1, wi[2] / np.maximum((of_coat @ wi) * of_coat[2], 1e-9))
        fade = np.where((wi[2] > 0) & (of_coat @ wi > 0) & (of_coat @ wo > 0), fade + fade**2 - fade**3, 0)
        base = np.where(of_coat @ wi > 0, bare.eval(mi.BSDFContext(), si, light).numpy(), 0)
        coat, whole = (under_coat(b, wo, wi, 0.9, 0.64, "smith", of_coat) for b in (0 * base, base))
        found = ours.eval(mi.BSDFContext(), si, light).numpy()
        np.testing.assert_allclose(found, whole + (fade - 1) * coat, rtol=5e-4, atol=1e-6)
        below = (bent @ wi < 0) & (of_coat @ wi > 0) & (wi[2] > 0)
        assert below.any() or material.normal_texture is None
        assert (found[0, below] > 0).all()


@pytest.mark.parametrize("degrees", [0, 50])
def test_samples_follow_the_density_where_a_normal_map_bends_the_base(mi, degrees):
    """Some directions are below the horizon of one of them alone."""
    bsdf, si, _world = on_quad(mi, replace(BUMPY, coat_texture=grey(0.9)))
    si.wi = direction(mi, degrees, 30)
    follow_the_density(mi, bsdf, si, 2)


def test_what_mitsuba_is_given(tmp_path):
    """A uniform coat, one with textures, and none where there is no light to scatter."""
    matt = Material(specular=0.0, coat=0.5, coat_roughness=0.3, coat_ior=IOR)
    textured = replace(matt, coat_texture=grey(0.5), coat_roughness_texture=grey(0.25))
    for material, kind, width in (
        (matt, "fragtracer_cooktorrance", {"coat_alpha": pytest.approx(0.09)}),
        (textured, "fragtracer_surface", {"coat_roughness": 0.3}),
        (replace(matt, anisotropy=0.5, roughness=0.5), "fragtracer_cooktorrance", {"alpha_v": 0.25}),
    ):
        scene = scene_of(material)
        tree = scene_tree(scene, tmp_path)[scene_tree(scene, tmp_path)["mesh_0_0_0"]["bsdf"]["id"]]
        expected = {"type": kind, "coat": 0.5, "coat_f0": pytest.approx(F0), **width}
        assert {key: tree[key] for key in expected} == expected
        assert ("coat_texture" in tree, "coat_roughness_texture" in tree) == (material is textured,) * 2
    for bare in (replace(textured, coat=0.0), replace(textured, unlit=True)):
        tree = scene_tree(Scene(materials={"m": bare}), tmp_path)["material_0"]
        assert tree["bsdf"]["type"] == "diffuse"


def test_a_part_of_a_blend_may_have_a_coat(mi):
    materials = {"red": replace(LACQUER, blend="matt"), "matt": Material(albedo=0.3, specular=0.0)}
    tree = to_mitsuba(Scene(materials=materials))["material_0"]
    assert (tree["bsdf_0"]["coat"], tree["bsdf_1"]["type"]) == (0.9, "twosided")
    blend, coat = mi.load_dict(tree), mi.load_dict(tree["bsdf_0"])
    viewer, light = direction(mi, 40), random_directions(mi, 1000, 5)
    matt = 0.3 / np.pi * np.maximum(light.numpy()[2], 0)
    np.testing.assert_allclose(
        evaluate(mi, blend, viewer, light), 0.5 * evaluate(mi, coat, viewer, light) + 0.5 * matt, rtol=1e-5, atol=1e-7
    )


@pytest.mark.parametrize(
    ("material", "kind"),
    [
        (Material(specular=0.0), "diffuse"),
        (Material(metal="gold"), "roughconductor"),
        (Material(roughness=0.0), "plastic"),
    ],
)
@pytest.mark.parametrize("layer", ["coat", "sheen", "film"])
def test_mitsubas_own_materials_are_without_layers(tmp_path, material, kind, layer):
    layers = {
        "coat": {"coat": 0.5, "coat_texture": grey(0.5)},
        "sheen": {"sheen_color": 0.5, "sheen_color_texture": grey(0.5)},
        "film": {"iridescence": 0.5, "iridescence_texture": grey(0.5)},
    }
    lacquered = replace(material, **layers[layer])
    notes = export_mitsuba(Scene(materials={"m": material, "lacquered": lacquered}), tmp_path)
    tree = scene_tree(Scene(materials={"m": material, "lacquered": lacquered}), tmp_path, plugins=False)
    assert tree["material_0"] == tree["material_1"]
    assert tree["material_0"]["bsdf"]["type"] == kind
    assert [f"without its {layer}" in note for note in notes[:2]] == [False, True]
    assert notes[1].startswith(f"lacquered: {kind}, nearly the same: ")
    assert export_mitsuba(Scene(materials={"m": lacquered}), tmp_path, plugin=True)[0].endswith(", the same")
