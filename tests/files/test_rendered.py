# SPDX-License-Identifier: MIT
"""A picture on a square looks the same from every format: none is upside down, mirrored or in other colours."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
from rendering import ESTIMATORS, rendered

from fragtracer import Ambient, Camera, Environment, Scene, load, load_mesh

from .data import Gltf

# Red, green, blue and grey, from the upper left to the lower right; sRGB 188 is 0.5 in linear light.
PICTURE = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [188, 188, 188]]], np.uint8)
LINEAR = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0.502886, 0.502886, 0.502886]]])
CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]


def obj(folder: Path) -> Path:
    (folder / "x.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd p.png\n")
    points = "".join(f"v {x} {y} 0\nvt {(x + 1) / 2} {(y + 1) / 2}\n" for x, y in CORNERS)
    (folder / "x.obj").write_text(f"mtllib x.mtl\n{points}usemtl a\nf 1/1 2/2 3/3 4/4\n")
    return folder / "x.obj"


def ply(folder: Path) -> Path:
    header = "ply\nformat ascii 1.0\ncomment TextureFile p.png\nelement vertex 4\n"
    header += "".join(f"property float {name}\n" for name in "xyzst")
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    points = "".join(f"{x} {y} 0 {(x + 1) / 2} {(y + 1) / 2}\n" for x, y in CORNERS)
    (folder / "x.ply").write_text(f"{header}{points}4 0 1 2 3\n")
    return folder / "x.ply"


def colored_ply(folder: Path) -> Path:
    """A square for each texel, its colour on its vertices."""
    header = "ply\nformat ascii 1.0\nelement vertex 16\n" + "".join(f"property float {name}\n" for name in "xyz")
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    points, faces = "", ""
    for index, (row, column) in enumerate(np.ndindex(2, 2)):
        red, green, blue = PICTURE[row, column]
        points += "".join(
            f"{column - 1 + (x + 1) / 2} {-row + (y + 1) / 2} 0 {red} {green} {blue}\n" for x, y in CORNERS
        )
        faces += f"4 {4 * index} {4 * index + 1} {4 * index + 2} {4 * index + 3}\n"
    (folder / "x.ply").write_text(header + points + faces)
    return folder / "x.ply"


def gltf(folder: Path, scale: float = 2) -> Path:
    made = Gltf(images=[{"uri": "p.png"}], textures=[{"source": 0}])
    made.content["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    position = made.array([(x / 2, y / 2, 0) for x, y in CORNERS])
    uv = made.array([((x + 1) / 2, (1 - y) / 2) for x, y in CORNERS])
    primitive = {"attributes": {"POSITION": position, "TEXCOORD_0": uv}, "material": 0, "mode": 6}
    made.content |= {"meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0, "scale": [scale, 2, 2]}]}
    return made.write(folder / "x.glb")


def mirrored_gltf(folder: Path) -> Path:
    """One side of it is seen; a node that mirrors turns the triangles with it (glTF 2.0, section 3.7.4)."""
    return gltf(folder, -2)


@pytest.mark.parametrize("write", [obj, ply, colored_ply, gltf, mirrored_gltf])
def test_the_picture_is_the_same(ctx, tmp_path: Path, write) -> None:
    PIL.Image.fromarray(PICTURE).save(tmp_path / "p.png")
    mesh, materials = load_mesh(write(tmp_path))
    unlit = {}
    for name, material in materials.items():
        texture = material.albedo_texture
        near = None if texture is None else replace(texture, filter="nearest")
        unlit[name] = replace(material, unlit=True, albedo_texture=near)
    camera = Camera((0, 0, 4), (0, 0, 0), fov_degrees=2 * np.degrees(np.arctan(0.25)))
    image = rendered(ctx, Scene(camera, unlit, meshes=[mesh]), 16, (16, 16), bounces=0, shared=True)
    shown = LINEAR[:, ::-1] if write is mirrored_gltf else LINEAR
    expected = shown.repeat(8, axis=0).repeat(8, axis=1)
    inside = np.ix_([1, 2, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14], [1, 2, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14])
    np.testing.assert_allclose(image[inside], expected[inside], atol=1e-4)


@pytest.mark.parametrize(("kind", "irradiance"), [("directional", 1), ("point", 0.5), ("spot", 0.125)])
@pytest.mark.parametrize("scale", [1e-4, 1e5])
def test_light_of_gltf_arrives(ctx, tmp_path: Path, kind: str, irradiance: float, scale: float) -> None:
    """2 lx at 60 degrees of incidence, or 2 cd at a distance of 2 m, or a quarter of that 60 degrees off the axis of a
    spot light: radiance is albedo / pi times the irradiance, at any scale and distance from the origin."""
    intensity = 2.0 if kind == "directional" else 2 * scale**2
    lights = [{"type": kind, "intensity": intensity, "color": [1, 0.5, 0.25], "spot": {"outerConeAngle": np.pi / 2}}]
    made = Gltf(
        extensions={"KHR_lights_punctual": {"lights": lights}},
        cameras=[{"type": "perspective", "perspective": {"yfov": 5e-4}}],
        materials=[
            {
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0},
                "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
            }
        ],
    )
    position = made.array(np.column_stack([np.array(CORNERS) * scale, np.zeros(4)]))
    light = {"rotation": [0.5, 0, 0, np.sqrt(0.75)], "extensions": {"KHR_lights_punctual": {"light": 0}}}
    made.content |= {
        "meshes": [{"primitives": [{"attributes": {"POSITION": position}, "material": 0, "mode": 6}]}],
        "nodes": [
            {"translation": [1e3 * scale, 0, 0], "children": [1, 2, 3]},
            {"mesh": 0},
            {"camera": 0, "translation": [0, 0, 3 * scale]},
            {"translation": [0, 0, 2 * scale], **light},
        ],
    }
    image = rendered(ctx, load(made.write(tmp_path / "x.glb")), 64, (4, 4), bounces=1, shared=True)
    np.testing.assert_allclose(
        image, np.full((4, 4, 3), np.multiply((1, 0.5, 0.25), irradiance * 0.5 / np.pi)), rtol=1e-3
    )


@pytest.mark.parametrize(("is_textured", "thickness"), [(False, 1), (True, 0)])
@pytest.mark.filterwarnings("ignore:.*is not closed:UserWarning")
def test_glass_is_there_by_its_alpha(ctx, tmp_path: Path, is_textured: bool, thickness: float) -> None:
    """Grey glass in front of the sky. A pane reflects 2 F / (1 + F) of the light and passes the rest times its colour.
    The surface of a solid reflects F, and within the radiance is less by the square of the index of refraction."""
    alpha = 51 / 255
    PIL.Image.new("RGBA", (1, 1), (255, 255, 255, 51)).save(tmp_path / "p.png")
    surface: dict[str, Any] = {"metallicFactor": 0, "roughnessFactor": 0}
    surface["baseColorFactor"] = [0.5, 0.5, 0.5, 1 if is_textured else alpha]
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": thickness},
    }
    texture = {"baseColorTexture": {"index": 0}} if is_textured else {}
    made = Gltf(images=[{"uri": "p.png"}], textures=[{"source": 0}])
    made.content["materials"] = [
        {"pbrMetallicRoughness": surface | texture, "alphaMode": "BLEND", "extensions": extensions}
    ]
    attributes = {
        "POSITION": made.array([(x, y, 0) for x, y in CORNERS]),
        "TEXCOORD_0": made.array([(0, 0)] * 4),
    }
    made.content["meshes"] = [{"primitives": [{"attributes": attributes, "material": 0, "mode": 6}]}]
    made.content["nodes"] = [{"mesh": 0}]
    mesh, materials = load_mesh(made.write(tmp_path / "x.glb"))
    camera = Camera((0, 0, 4), (0, 0, 0), fov_degrees=1)
    scene = Scene(camera, materials, meshes=[mesh], environment=Environment(radiance=(1, 1, 1)))
    image = rendered(ctx, scene, 4096, (4, 4), bounces=4, shared=True)
    reflected, within = (0.04, 1 / 1.5**2) if thickness else (0.08 / 1.04, 1)
    expected = 1 - alpha + alpha * (reflected + 0.5 * (1 - reflected) * within)
    assert image.mean() == pytest.approx(expected, abs=4 * np.sqrt(alpha * (1 - alpha) / (4096 * 16)))


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("is_double", [True, False])
def test_both_sides_of_double_sided_surfaces_emit(ctx, tmp_path: Path, is_double: bool, estimator: str) -> None:
    """A lamp between two walls, seen from either side, and the light on the walls; with both estimators together it is
    compiled in."""
    glowing = {"emissiveFactor": [1, 0.5, 0.25], "doubleSided": is_double}
    plain = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}, "doubleSided": True}
    black = {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}}
    matt = {"extensions": {"KHR_materials_specular": {"specularFactor": 0}}}
    made = Gltf(materials=[glowing | black | matt, plain | matt])
    position = made.array(np.column_stack([CORNERS, np.zeros(4)]))
    made.content |= {
        "meshes": [{"primitives": [{"attributes": {"POSITION": position}, "material": m, "mode": 6}]} for m in (0, 1)],
        "nodes": [{"mesh": 0}, *({"mesh": 1, "translation": [0, 0, z]} for z in (-1, 1))],
    }
    scene = replace(load(made.write(tmp_path / "x.glb")), lights=(), ambient=Ambient())

    def seen(start: float, end: float) -> np.ndarray:
        camera = Camera((0.0, 0.0, start), (0.0, 0.0, end), fov_degrees=1.0)
        settings: dict[str, Any] = {"bounces": 1, "estimator": estimator, "shared": estimator != "mis"}
        return rendered(ctx, replace(scene, camera=camera), 1024, (4, 4), **settings).mean(axis=(0, 1))

    # Of a square over the centre of another, both of side 2 and 1 apart (Howell, A Catalog of Radiation Heat Transfer
    # Configuration Factors, B-3, four times).
    factor = 4 / (2 * np.pi) * 2 * np.sqrt(0.5) * np.arctan(np.sqrt(0.5))
    glow = np.array([1, 0.5, 0.25])
    np.testing.assert_allclose(seen(0.5, 0), glow, rtol=1e-6)
    wall = 0.5 * factor * glow
    np.testing.assert_allclose(seen(0.5, 1), wall, rtol=0.02)
    # Back-face culling shows the other wall through a single-sided one.
    np.testing.assert_allclose(seen(-0.5, 0), glow if is_double else wall, rtol=0.02)
    np.testing.assert_allclose(seen(-0.5, -1), is_double * wall, rtol=0.02)
