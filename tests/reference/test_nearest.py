# SPDX-License-Identifier: MIT
"""The nearest materials of Mitsuba's own: what they are made of, and what is said of them."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.io.images import read_image
from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.materials import exact_bsdf
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.plugins import register
from fragtracer.reference.textures import TextureFolder
from fragtracer.reference.translate import scene_tree
from fragtracer.scene import Geometry, Image, Material, Mesh, Part, Scene, Texture
from fragtracer.scene.texture import srgb_to_linear

from .test_bsdf import direction, sample

CORNERS = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]
COLORS = np.array([[0.2, 0.4, 0.6, 0.3], [0.4, 0.6, 0.8, 0.7], [1.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
PIXELS = np.array([[[255, 128, 0, 51], [255, 255, 255, 204]]], np.uint8)  # of alpha 0.2 and 0.8
PICTURE = Texture(Image(PIXELS))
BASE = (0.5, 0.6, 0.7)


def quad(colors: Any = None) -> Geometry:
    return Geometry(CORNERS, [[0, 1, 2], [0, 2, 3]], uvs=[[0, 1], [1, 1], [1, 0], [0, 0]], colors=colors)


def nearest(folder: Path, material: Material, colors: Any = None, **others: Material) -> tuple[Any, Any, str]:
    """What it is on a mesh with vertices of these ``colors``: its tree, what emits there, and its note."""
    scene = Scene(materials={"m": material, **others}, meshes=[Mesh([Part(quad(colors), "m")])])
    tree = scene_tree(scene, folder, plugins=False)
    shape = tree["mesh_0_0_0"]
    return tree[shape["bsdf"]["id"]], shape.get("emitter"), export_mitsuba(scene, folder)[0].removeprefix("m: ")


def vertices(folder: Path, *names: str) -> NDArray[np.float32]:
    """Columns of the mesh, (4, n)."""
    header, data = (folder / "mesh_0_0_0.ply").read_bytes().split(b"end_header\n", 1)
    found = [line.split()[2].decode() for line in header.splitlines() if line.startswith(b"property float")]
    table = np.frombuffer(data, "<f4", 4 * len(found)).reshape(4, -1)
    return table[:, [found.index(name) for name in names]]


def pixels(tree: Any) -> NDArray[np.float64]:
    """What a bitmap without sRGB encoding shows, (h, w, 3)."""
    assert tree["raw"]
    image = read_image(tree["filename"])
    return image / 255 if image.dtype == np.uint8 else image


@pytest.mark.parametrize(("roughness", "text"), [(0.0, "the same"), (1.0, "nearly the same: Lambert's model in place")])
def test_eon_has_no_specular_lobe(tmp_path: Path, roughness: float, text: str) -> None:
    clay = Material(model="eon", albedo=BASE, roughness=roughness)
    tree, _, note = nearest(tmp_path, clay)
    assert tree["bsdf"] == {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(BASE)}}
    assert note.startswith(f"diffuse, {text}")
    painted = Material(model="eon", albedo=BASE, roughness=roughness, albedo_texture=PICTURE)
    tree, _, note = nearest(tmp_path, painted)
    assert (tree["bsdf"]["type"], tree["bsdf"]["reflectance"]["type"]) == ("diffuse", "bitmap")
    assert note.startswith(f"diffuse, {text}")


@pytest.mark.parametrize("specular", [0.0, 1.0])
def test_what_transmits_diffusely_is_blended_with_what_does_nothing_else(
    mi: Any, tmp_path: Path, specular: float
) -> None:
    """It transmits as much as by our plugin, to 5 %, from either side."""
    register()
    shown = {"diffuse_transmission": 0.6, "diffuse_transmission_color": (0.9, 0.5, 0.1)}
    leaf = Material(albedo=BASE, specular=specular, **shown)
    tree, _, note = nearest(tmp_path, leaf)
    bare, _, _ = nearest(tmp_path, replace(leaf, diffuse_transmission=0.0))
    assert (tree["type"], tree["weight"], tree["bsdf_0"]) == ("blendbsdf", 0.6, bare)
    assert "a specular lobe weaker by the share that is transmitted" in note
    exact = exact_bsdf(leaf, "smith", MeshAttributes(), TextureFolder(tmp_path))
    for viewer in (direction(mi, 40), direction(mi, 140)):
        passed = []
        for bsdf in map(mi.load_dict, (tree, exact)):
            bs, weight = sample(mi, bsdf, viewer)
            passed.append((weight.numpy() * ((bs.wo.z * viewer.z).numpy() < 0)).mean(axis=1))
        np.testing.assert_allclose(*passed, rtol=0.05)


def test_textures_of_diffuse_transmission(tmp_path: Path) -> None:
    factor, color = replace(PICTURE, channel="a"), PICTURE
    maps = {"diffuse_transmission_texture": factor, "diffuse_transmission_color_texture": color}
    tree, _, _ = nearest(tmp_path, Material(specular=0.0, diffuse_transmission=0.5, **maps))
    np.testing.assert_allclose(pixels(tree["weight"])[0, :, 0], [0.1, 0.4], atol=0.005)
    shown = read_image(tree["bsdf_1"]["base_color"]["filename"])
    np.testing.assert_allclose(shown, srgb_to_linear(PIXELS[..., :3] / 255), atol=1e-3)


def test_colors_of_vertices_multiply_the_albedo(tmp_path: Path) -> None:
    tree, _, note = nearest(tmp_path, Material(albedo=BASE, metallic=1.0), COLORS)
    assert tree["bsdf"]["base_color"] == {"type": "mesh_attribute", "name": "vertex_color"}
    np.testing.assert_allclose(vertices(tmp_path, *"rgb"), COLORS[:, :3] * BASE, rtol=1e-6)
    assert "colours of vertices" not in note
    _, _, note = nearest(tmp_path, Material(albedo=BASE, albedo_texture=PICTURE), COLORS)
    assert "without the colours of vertices" in note


def test_each_part_of_a_blend_has_its_own_colors_of_vertices(tmp_path: Path) -> None:
    metal = Material(metal="gold")
    tree, _, _ = nearest(tmp_path, Material(albedo=BASE, metallic=1.0, blend="metal"), COLORS, metal=metal)
    assert tree["bsdf_0"]["bsdf"]["base_color"]["name"] == "vertex_color"
    assert tree["bsdf_1"]["bsdf"]["base_color"]["name"] == "vertex_blended"
    np.testing.assert_allclose(vertices(tmp_path, *"rgb"), COLORS[:, :3] * BASE, rtol=1e-6)
    blended = vertices(tmp_path, "blended_x", "blended_y", "blended_z")
    np.testing.assert_allclose(blended, COLORS[:, :3] * metal.base_color, rtol=1e-6)


def test_alpha_of_vertices(tmp_path: Path) -> None:
    """Times the opacity, or thresholded; where there is a texture, that has the alpha."""
    for mode, expected in (("blend", 0.8 * COLORS[:, 3]), ("mask", 0.8 * COLORS[:, 3] >= 0.5)):
        tree, _, _ = nearest(tmp_path, Material(opacity=0.8, alpha_mode=mode), COLORS)
        assert tree["opacity"] == {"type": "mesh_attribute", "name": "vertex_alpha"}
        np.testing.assert_allclose(vertices(tmp_path, "alpha_x")[:, 0], expected, rtol=1e-6)
    tree, _, note = nearest(tmp_path, Material(alpha_mode="blend", albedo_texture=PICTURE), COLORS)
    assert tree["opacity"]["type"] == "bitmap"
    assert "without the alpha of vertices" in note


def test_vertices_are_opened(mi: Any, tmp_path: Path) -> None:
    """Mitsuba finds the colours of both parts of a blend, and the alpha, where they are looked up."""
    white = Material(albedo=1.0, specular=0.0)
    nearest(tmp_path, Material(albedo=BASE, specular=0.0, blend="white"), COLORS, white=white)
    world = mi.load_file(str(tmp_path / "scene.xml"))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(0.9999, 0.9999, 5), mi.Vector3f(0, 0, -1)))
    for name, expected in (("vertex_color", BASE), ("vertex_blended", (1.0, 1.0, 1.0))):
        assert si.shape.eval_attribute_3(name, si).numpy().ravel() == pytest.approx(expected, abs=1e-3)
    nearest(tmp_path, Material(opacity=0.6, alpha_mode="blend"), COLORS)
    world = mi.load_file(str(tmp_path / "scene.xml"))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(0.9999, 0.9999, 5), mi.Vector3f(0, 0, -1)))
    assert si.bsdf().eval_null_transmission(si).numpy().ravel() == pytest.approx([0.4] * 3, abs=1e-3)


@pytest.mark.parametrize(("mode", "factor"), [("opaque", 1.0), ("blend", 0.2), ("mask", 0.0)])
def test_an_unlit_surface_emits_by_its_opacity(tmp_path: Path, mode: Any, factor: float) -> None:
    _, emitter, _ = nearest(tmp_path, Material(albedo=BASE, unlit=True, opacity=0.2, alpha_mode=mode))
    assert emitter["radiance"]["value"] == pytest.approx(np.multiply(BASE, factor))


@pytest.mark.parametrize(
    ("mode", "alpha"), [("opaque", [1.0, 1.0]), ("blend", [0.9 * 0.2, 0.9 * 0.8]), ("mask", [0.0, 1.0])]
)
def test_an_unlit_surface_emits_by_the_alpha_of_its_texture(tmp_path: Path, mode: Any, alpha: list[float]) -> None:
    material = Material(albedo=BASE, unlit=True, opacity=0.9, alpha_mode=mode, albedo_texture=PICTURE)
    _, emitter, _ = nearest(tmp_path, material)
    expected = srgb_to_linear(PIXELS[..., :3] / 255) * BASE * np.array(alpha)[:, None]
    np.testing.assert_allclose(pixels(emitter["radiance"]), expected, rtol=1e-5)


def test_what_an_unlit_surface_loses_of_vertices_is_said(tmp_path: Path) -> None:
    note = nearest(tmp_path, Material(unlit=True, alpha_mode="blend"), COLORS)[2]
    assert "without the colours of vertices; emits through their alpha" in note
    assert "vertices" not in nearest(tmp_path, Material(unlit=True, alpha_mode="blend"))[2]


@pytest.mark.parametrize(("opacity", "expected"), [(0.6, 1.0), (0.5, 1.0), (0.2, 0.0)])
def test_a_mask_is_thresholded(tmp_path: Path, opacity: float, expected: float) -> None:
    tree, _, note = nearest(tmp_path, Material(opacity=opacity, alpha_mode="mask"))
    assert (tree["type"], tree["opacity"]) == ("mask", expected)
    assert "edges" not in note


@pytest.mark.parametrize(
    ("opacity", "cutoff", "expected"), [(1.0, 0.5, [0, 1]), (0.6, 0.5, [0, 0]), (1.0, 0.1, [1, 1])]
)
def test_the_alpha_of_a_texture_is_thresholded(
    tmp_path: Path, opacity: float, cutoff: float, expected: list[int]
) -> None:
    material = Material(opacity=opacity, alpha_mode="mask", alpha_cutoff=cutoff, albedo_texture=PICTURE)
    tree, _, note = nearest(tmp_path, material)
    assert tree["opacity"]["filter_type"] == "nearest"
    np.testing.assert_array_equal(pixels(tree["opacity"])[0, :, 0], expected)
    assert "edges of holes by unfiltered opacity" in note


@pytest.mark.parametrize("scale", [0.0, 0.3, -1.0, 4.0, -5.0])
def test_normals_are_scaled_in_the_image(tmp_path: Path, scale: float) -> None:
    """Those that Mitsuba filters between texels, too."""
    texels = np.array([[[255, 30, 140], [20, 200, 250]]], np.uint8)
    normals = Texture(Image(texels, "linear"))
    tree, _, _ = nearest(tmp_path, Material(normal_texture=normals, normal_scale=scale))
    shown = pixels(tree["bsdf"]["normalmap"])
    assert (shown.min() >= 0) & (shown.max() <= 1)
    for share in (0.0, 0.4, 1.0):
        given, found = (
            2 * np.average(image[0], axis=0, weights=[1 - share, share]) - 1 for image in (texels / 255, shown)
        )
        expected = given * (scale, scale, 1)
        np.testing.assert_allclose(found / np.linalg.norm(found), expected / np.linalg.norm(expected), atol=1e-6)


BACK = "back faces are black, not passed"


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        (Material(specular=0.0, double_sided=False), f"diffuse, nearly the same: {BACK}"),
        (Material(specular=0.0, albedo_texture=PICTURE), "diffuse, the same"),
        (Material(specular=0.0, black_back=True), "diffuse, the same"),
        (Material(model="plastic", double_sided=False), f"plastic, the same but for textures and colours.*; {BACK}"),
        (Material(metal="gold", double_sided=False), f"roughconductor, nearly the same: .*; {BACK}"),
        (Material(roughness=0.0, double_sided=False), f"plastic, nearly the same: .*; {BACK}"),
        (Material(albedo_texture=PICTURE, double_sided=False), f"principled, nearly the same: .*; {BACK}"),
        (Material(unlit=True, double_sided=False), f"area, nearly the same: .*; {BACK}"),
        (Material(model="plastic", unlit=True), "area, nearly the same: emits from its front only, sampled as a light"),
        (
            Material(model="dielectric", abbe_number=30.0, roughness=0.3),
            "roughdielectric, the same but.*; without dispersion",
        ),
        (Material(model="dielectric"), "roughdielectric, the same but for textures and normals of vertices"),
        (Material(anisotropy=0.5, metal="gold", albedo_texture=PICTURE), "principled, .*; facets of one width"),
    ],
)
def test_notes_are_of_what_the_tree_has(tmp_path: Path, material: Material, expected: str) -> None:
    tree, _, note = nearest(tmp_path, material)
    assert re.fullmatch(expected, note)
    if material.black_back or not material.double_sided:
        assert tree["type"] != "twosided"


WHITE = Texture(Image(np.full((1, 1, 3), 255, np.uint8)))


def test_the_base_is_as_bright_with_a_texture_or_colours_of_vertices(tmp_path: Path) -> None:
    """``principled`` loses next to nothing of it: a lower albedo stands for what our interface reflects."""
    material = Material(albedo=BASE, f0=(0.04, 0.08, 0.3))
    expected = nearest(tmp_path, material)[0]["bsdf"]["base_color"]["value"]
    assert (np.array(expected) < np.multiply(BASE, (0.9, 0.82, 0.5))).all()
    textured = nearest(tmp_path, replace(material, albedo_texture=WHITE))[0]["bsdf"]["base_color"]
    np.testing.assert_allclose(pixels(textured)[0, 0], expected, rtol=1e-3)
    nearest(tmp_path, material, np.ones((4, 3)))
    np.testing.assert_allclose(vertices(tmp_path, "r", "g", "b")[0], expected, rtol=1e-5)


def test_of_what_is_a_metal_in_part_the_base_alone_is_darker(tmp_path: Path) -> None:
    material = Material(albedo=BASE, metallic=0.25)
    base = nearest(tmp_path, material)[0]["bsdf"]["bsdf_0"]["base_color"]["value"]
    in_part = 0.75 * np.array(base) + 0.25 * np.array(BASE)
    others: Any
    for others, expected, is_told in (
        ({}, in_part, False),
        ({"metallic": 1.0}, BASE, False),
        ({"metallic_texture": WHITE}, BASE, True),
    ):
        tree, _, note = nearest(tmp_path, replace(material, albedo_texture=WHITE, **others))
        np.testing.assert_allclose(pixels(tree["bsdf"]["base_color"])[0, 0], expected, rtol=1e-3)
        assert ("a base 20 % brighter" in note) == is_told


def test_notes_are_of_all_meshes(tmp_path: Path) -> None:
    meshes = [Mesh([Part(quad(colors), "m")]) for colors in (COLORS, None)]
    for found, text in (
        (Material(albedo_texture=PICTURE), "without the colours"),
        (Material(), "plastic and principled"),
    ):
        scene = Scene(materials={"m": replace(found, roughness=0.0)}, meshes=meshes)
        assert text in export_mitsuba(scene, tmp_path)[0]


def test_notes_of_materials_that_nothing_has(tmp_path: Path) -> None:
    assert export_mitsuba(Scene(materials={"m": Material(model="eon")}), tmp_path)[0].startswith("m: diffuse")
