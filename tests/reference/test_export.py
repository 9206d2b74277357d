# SPDX-License-Identifier: MIT
"""Exported scenes: Mitsuba opens them, and they are the scene they came from."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from fragtracer.errors import OutputError
from fragtracer.io.toml import load
from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.materials import exact_bsdf
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.nearest import nearest_bsdf
from fragtracer.reference.render import render_reference
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import (
    Ambient,
    Camera,
    Density,
    DirectionalLight,
    Disk,
    Geometry,
    Image,
    Light,
    Material,
    Medium,
    Mesh,
    Part,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    SpotLight,
    Texture,
    Triangle,
)

from .test_bsdf import direction, sample

FALLOFF = "intensity falls linearly in the angle"
MATERIALS = {
    "floor": Material(albedo=(0.5, 0.4, 0.3), specular=0.0),
    "gold -- worn": Material(metal="gold", roughness=0.4),
    "mirror": Material(metal="silver", roughness=0.0),
    "lacquer": Material(albedo=(0.6, 0.1, 0.1), roughness=0.3),
    "glazed": Material(albedo=0.6, roughness=0.0, ior=1.8, specular=0.5),
    "mixed": Material(albedo=(0.2, 0.4, 0.6), roughness=0.5, metallic=0.5),
    "tinted": Material(albedo=0.3, roughness=0.5, f0=(0.1, 0.05, 0.02)),
    "airy": Material(albedo=0.3, ior=1.0),
    "lamp": Material(albedo=0.0, specular=0.0, emission=4.0),
    "frosted": Material(model="rough-thin-dielectric", roughness=0.4, transmittance=(0.5, 0.9, 0.6)),
}
SCENE = Scene(
    Camera((0.0, 2.0, 9.0), (0.0, 0.5, 0.0), aperture_radius=0.01),
    MATERIALS,
    spheres=[Sphere((1.1 * i - 3.3, 0.5, 0.0), 0.5, name) for i, name in enumerate(list(MATERIALS)[1:8])],
    planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
    rectangles=[Rectangle((-1.0, 4.0, -1.0), (2.0, 0.0, 0.0), (0.0, 0.0, 2.0), "lamp")],
    triangles=[Triangle(((-4.0, 0.0, -2.0), (4.0, 0.0, -2.0), (0.0, 3.0, -2.0)), "floor")],
    lights=[Light((-3.0, 4.0, 3.0), 0.4, power=(200.0, 180.0, 160.0)), Light((3.0, 3.0, 3.0), power=50.0)],
    ambient=Ambient((0.2, 0.2, 0.3)),
    render=RenderSettings(width=48, height=24, bounces=3),
)


def load_and_render(mi, folder, spp=256):
    return np.array(mi.render(mi.load_file(str(folder / "scene.xml")), spp=spp, seed=11))


def test_with_the_plugin_it_is_the_same_scene(mi, tmp_path):
    notes = export_mitsuba(SCENE, tmp_path, plugin=True)
    expected = render_reference(SCENE, spp=1024)[0]
    image = load_and_render(mi, tmp_path, 1024)
    assert image.shape == expected.shape == (24, 48, 3)
    assert image.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=0.01)
    assert np.median(np.abs(image - expected) / expected) < 0.03
    assert notes[0] == "floor: diffuse, the same"
    assert notes[1] == "gold -- worn: fragtracer_cooktorrance, the same"
    assert notes[9].startswith("frosted: fragtracer_rough_pane, the same")


def test_without_it_the_nearest_materials_look_alike(mi, tmp_path):
    notes = export_mitsuba(SCENE, tmp_path / "new" / "folder")
    expected = render_reference(SCENE, spp=1024)[0]
    image = load_and_render(mi, tmp_path / "new" / "folder", 1024)
    assert image.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=0.05)
    assert len(notes) == len(MATERIALS) + 1
    assert notes[1].startswith("gold -- worn: roughconductor, nearly the same")
    assert notes[5].startswith("mixed: principled and roughconductor")
    assert notes[9].startswith("frosted: principledthin, nearly the same")


def lit_scene(light):
    """A disk and a floor under a spot light and a directional light."""
    return Scene(
        Camera((0.0, 4.0, 4.0), (0.0, 0.0, 0.0)),
        {"matt": Material(albedo=0.5, specular=0.0), "lamp": MATERIALS["lamp"]},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matt")],
        disks=[
            Disk((1.0, 0.5, 0.0), (0.0, 1.0, 1.0), 0.5, "matt"),
            Disk((-2.0, 1.0, 0.0), (1.0, -1.0, 0.0), 0.3, "lamp"),
        ],
        spot_lights=[light],
        directional_lights=[DirectionalLight((1.0, -3.0, 0.0), (0.1, 0.2, 0.3))],
        render=RenderSettings(width=48, height=24, bounces=2),
    )


@pytest.mark.parametrize(
    ("inner", "outer", "power"), [(30.0, 45.0, "+0.2 %"), (0.0, 45.0, "+2.1 %"), (0.0, 90.0, "+9.0 %")]
)
@pytest.mark.parametrize("plugin", [True, False])
def test_disks_spot_and_directional_lights_are_exported(mi, tmp_path, plugin, inner, outer, power):
    scene = lit_scene(SpotLight((0.5, 3.0, 0.0), (0.0, -2.0, 0.0), 50.0, inner, outer))
    notes = export_mitsuba(scene, tmp_path, plugin)
    expected = render_reference(scene, spp=1024)[0]
    image = load_and_render(mi, tmp_path, 1024)
    off = 0.0 if plugin else float(power.split()[0]) / 100
    assert image.mean() == pytest.approx(expected.mean(), rel=0.01 + off)
    spot = "fragtracer_spot, the same" if plugin else f"spot, nearly the same: {FALLOFF}, power {power}"
    assert notes[2] == f"spot_light_0: {spot}"
    assert f"<!-- {notes[2]} -->" in (tmp_path / "scene.xml").read_text()


@pytest.mark.parametrize(
    ("radius", "brightness", "kind"),
    [(0.1, {"power": 1e6}, "point"), (0.1, {"radiance": 1e6}, "point"), (2.0, {"power": 1e6}, "sphere")],
)
def test_a_far_lamp_is_as_bright(mi, tmp_path, radius, brightness, kind):
    """Of a small one Mitsuba rounds the solid angle, to 1.4 times as much here."""
    lamp = Light((0.0, 200.0, -275.0), radius, **brightness)
    scene = replace(lit_scene(SpotLight((0.5, 3.0, 0.0), (0.0, -2.0, 0.0), 50.0)), spot_lights=[], lights=[lamp])
    notes = export_mitsuba(scene, tmp_path)
    expected = render_reference(scene, spp=256)[0]
    assert load_and_render(mi, tmp_path).mean() == pytest.approx(expected.mean(), rel=0.01)
    assert any(note.startswith("light_0: point, nearly the same: no width") for note in notes) == (kind == "point")


def leaf_scene():
    """Meshes with all that a mesh can bring."""
    rng = np.random.default_rng(3)
    corners = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]])
    quad = Geometry(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.2, 0, 1], (4, 1)), [[0, 1], [1, 1], [1, 0], [0, 0]])
    colored = Geometry(corners, [[0, 1, 2], [0, 2, 3]], colors=rng.random((4, 4)))
    picture = Texture(Image(rng.integers(0, 256, (8, 8, 4), np.uint8)))
    bumps = Texture(Image(np.array([[[0.6, 0.5, 0.9]]]), "linear"))
    materials = {
        "leaf": Material(albedo=(0.9, 0.8, 0.7), albedo_texture=picture, alpha_mode="mask"),
        "bumpy": Material(metal="gold", normal_texture=bumps, roughness=0.9, roughness_texture=picture),
        "veil": Material(opacity=0.5, alpha_mode="blend", double_sided=False),
        "screen": Material(albedo=0.0, specular=0.0, emission=(1.0, 2.0, 3.0), emission_texture=picture),
    }
    meshes = [
        Mesh([Part(colored if name == "veil" else quad, name)], [Placement((2.2 * i - 3.3, 0.0, 0.0))])
        for i, name in enumerate(materials)
    ]
    sky, settings = Ambient(0.5), RenderSettings(width=48, height=24, bounces=3)
    return Scene(Camera((0.0, 1.0, 9.0), (0.0, 1.0, 0.0)), materials, meshes=meshes, ambient=sky, render=settings)


@pytest.mark.parametrize(("plugin", "tolerance"), [(True, 0.01), (False, 0.1)])
def test_meshes_and_textures_are_written_beside_the_scene(mi, tmp_path, plugin, tolerance):
    notes = export_mitsuba(leaf_scene(), tmp_path, plugin)
    expected = render_reference(leaf_scene(), spp=1024)[0]
    image = load_and_render(mi, tmp_path, 1024)
    assert image.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=tolerance)
    assert {path.suffix for path in tmp_path.glob("[mt]*_*")} == {".ply", ".png", ".exr"}
    if plugin:
        assert {note.split(": ")[1] for note in notes[:4]} == {"fragtracer_surface, the same"}
    assert str(tmp_path) not in (tmp_path / "scene.xml").read_text()


def seen_on_bumps(mi, folder, material, uvs=((0, 1), (1, 1), (1, 0), (0, 0))):
    """The notes of a square of the material, exported, and by ``seen(x, y)`` what it reflects of light from there."""
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    quad = Geometry(corners, [[0, 1, 2], [0, 2, 3]], [[0, 0, 1]] * 4, uvs)
    notes = export_mitsuba(Scene(materials={"m": material}, meshes=[Mesh([Part(quad, "m")])]), folder)
    world = mi.load_file(str(folder / "scene.xml"))
    si = world.ray_intersect(mi.Ray3f(mi.Point3f(0, 0, 5), mi.Vector3f(0, 0, -1)))

    def seen(x, y):
        light = si.to_local(mi.Vector3f(x, y, 0.8))
        return world.shapes()[0].bsdf().eval(mi.BSDFContext(), si, light).numpy().sum()

    return notes, seen


@pytest.mark.parametrize("mirrored", [False, True])
def test_mitsubas_own_normal_map_leans_as_its_note_says(mi, tmp_path, mirrored):
    """Red along u; green up the image, and down where the image is mirrored."""
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * [-1 if mirrored else 1, 1]
    bumps = Texture(Image(np.array([[[0.7, 0.8, 0.9]]]), "linear"))
    notes, seen = seen_on_bumps(mi, tmp_path, Material(normal_texture=bumps), uvs)
    assert "green is inverted where the image is mirrored" in notes[0]
    sign = -1 if mirrored else 1
    assert seen(0.6 * sign, 0) > 1.5 * seen(-0.6 * sign, 0)
    assert seen(0, 0.6 * sign) > 1.5 * seen(0, -0.6 * sign)


@pytest.mark.parametrize(("scale", "normal"), [(0.5, (0.2, 0.3, 0.8)), (-2.0, (-0.8, -1.2, 0.8))])
def test_mitsubas_own_normal_map_is_scaled(mi, tmp_path, scale, normal):
    """It leans as the ``normal`` itself does."""
    bumps, leaning = (
        Texture(Image(np.array([[0.5 + 0.5 * np.array(vector)]]), "linear"))
        for vector in ((0.4, 0.6, 0.8), np.divide(normal, np.linalg.norm(normal)))
    )
    _, found = seen_on_bumps(mi, tmp_path, Material(normal_texture=bumps, normal_scale=scale))
    _, expected = seen_on_bumps(mi, tmp_path / "expected", Material(normal_texture=leaning))
    assert expected(0.0, 0.0) > 0
    for x, y in ((0.0, 0.0), (0.6, 0.0), (0.0, 0.6), (-0.3, -0.4)):
        assert found(x, y) == pytest.approx(expected(x, y), rel=1e-4)


@pytest.mark.parametrize("name", [*list(MATERIALS)[1:8], "frosted"])
def test_each_nearest_material_reflects_nearly_as_much(mi, tmp_path, name):
    material, attributes, textures = MATERIALS[name], MeshAttributes(), TextureFolder(tmp_path)
    shares = []
    for tree in (exact_bsdf(material, "smith", attributes, textures), nearest_bsdf(material, attributes, textures)):
        _, weight = sample(mi, mi.load_dict(tree), direction(mi, 45))
        shares.append(weight.numpy().mean(axis=1))
    assert shares[1] == pytest.approx(shares[0], rel=0.15)


def test_the_file_says_what_each_material_became(tmp_path):
    export_mitsuba(SCENE, tmp_path)
    text = (tmp_path / "scene.xml").read_text()
    assert "<!-- gold - - worn: roughconductor, nearly the same" in text
    assert {e.tag for e in ET.fromstring(text)} == {"integrator", "sensor", "bsdf", "shape", "emitter"}
    assert str(tmp_path) not in text


def test_other_geometry_terms_are_named(tmp_path):
    scene = Scene(materials={"metal": Material(metal="iron")}, render=RenderSettings(geometry="karis"))
    assert "in place of karis" in export_mitsuba(scene, tmp_path)[0]


@pytest.mark.parametrize("name", ["glass", "wax"])
def test_media_have_finite_radiance(mi, tmp_path, name):
    """Where a colour is not extinguished, and far from lights that are spheres."""
    scene = load(name)
    export_mitsuba(replace(scene, render=replace(scene.render, width=64, height=36)), tmp_path)
    picture = np.array(mi.render(mi.load_file(str(tmp_path / "scene.xml")), spp=64, seed=1))
    assert np.isfinite(picture).all()
    assert picture.mean() > 0.05


def test_a_grid_of_densities_is_written_beside_the_scene(mi, tmp_path):
    smoke = Medium(extinction=3.0, density=Density([[[0.0, 2.0]]]), bounds=((-1.0,) * 3, (1.0,) * 3))
    scene = Scene(
        Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), fov_degrees=25.0),
        {"cloud": Material(model="null", interior="smoke")},
        media={"smoke": smoke},
        spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "cloud")],
        ambient=Ambient(1.0),
        render=RenderSettings(width=16, height=16),
    )
    export_mitsuba(scene, tmp_path, plugin=True)
    expected = render_reference(scene, spp=1024)[0]
    assert 0.2 < expected.min() < 0.8
    assert load_and_render(mi, tmp_path, 1024).mean() == pytest.approx(expected.mean(), rel=0.01)


def test_the_plugin_needs_no_fragtracer(mi, tmp_path):
    export_mitsuba(SCENE, tmp_path, plugin=True)
    code = (
        "import sys; sys.modules['fragtracer'] = None; import mitsuba as mi; mi.set_variant('scalar_rgb');"
        "import fragtracer_plugins; fragtracer_plugins.register(); mi.load_file('scene.xml')"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=r"file: cannot write the Mitsuba scene: File exists$"):
        export_mitsuba(SCENE, tmp_path / "file")
