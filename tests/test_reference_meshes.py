# SPDX-License-Identifier: MIT
"""Meshes, textures and alpha agree with Mitsuba, each on its own in a small image.

Intersection, light sampling and texture filtering are Mitsuba's own; shading normals, normal maps and alpha
are those of our plugin (reference/plugins/surface.py).
"""

import io
from collections.abc import Callable
from pathlib import Path
from zlib import crc32

import numpy as np
import PIL.Image
import pytest
from agreement import assert_proved
from files.data import Gltf
from mesh_shapes import ball, field, geometry, grid, smooth
from rendering import in_long_passes

from fragtracer.apps.compare.rendering import render_ours, render_reference
from fragtracer.io.toml import load
from fragtracer.scene import (
    Ambient,
    Camera,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    RenderSettings,
    Scene,
    Sphere,
    Texture,
)

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
pytestmark = pytest.mark.slow

MATT = Material(albedo=0.5, specular=0.0)
NO_OTHER_LIGHT = {"lights": [], "ambient": Ambient(0.0)}
HERE = Placement((0.0, 0.7, 0.0), scale=(0.7, 0.7, 0.7))


SHEET = geometry(([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)], [(0, 1, 2), (0, 2, 3)]))
TURNED = [Placement((0.0, 0.8, 0.0), (0.0, 60.0, 20.0), (0.5, 0.5, 0.5))]


def scene(material, shape, places=(HERE,), **changes):
    """A mesh on a floor, under a spherical light and ambient light."""
    parts = {
        "camera": Camera((0.0, 1.6, 4.2), (0.0, 0.6, 0.0), fov_degrees=30.0),
        "materials": {"m": material, "floor": MATT},
        "planes": [Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
        "meshes": [Mesh([Part(shape, "m")], list(places))],
        "lights": [Light((-2.0, 4.0, 3.0), 0.6, power=300.0)],
        "ambient": Ambient(0.2),
        "render": RenderSettings(bounces=4),
    }
    return Scene(**(parts | changes))


def globe(columns=32, rows=16):
    """A sphere with normals, a seam, and an image around it."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij")
    theta, phi = np.pi * v, 2 * np.pi * u
    points = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    uvs = np.stack([u, v], -1).reshape(-1, 2)
    triangles = grid(columns, rows)[:, ::-1]
    a, b, c = points[triangles].swapaxes(0, 1)
    proper = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9
    return Geometry(points, triangles[proper], normals=points, uvs=uvs)


def flat(shape):
    return Geometry(shape.positions, shape.triangles, uvs=shape.uvs)


ROWS, COLUMNS = np.mgrid[0:32, 0:64]
WAVE = np.sin(COLUMNS / 64 * 2 * np.pi * 5)
CHECKER = (ROWS // 8 + COLUMNS // 8) % 2
PICTURE = Image(np.where(CHECKER[..., None], [220, 80, 40], [240, 230, 210]).astype(np.uint8))
ALPHA = np.clip(127 + 120 * WAVE, 0, 255)[..., None].astype(np.uint8)
ALPHA_PICTURE = Texture(Image(np.concatenate([PICTURE.pixels, ALPHA], axis=2)))
NUMBERS = Image((40 + 200 * CHECKER).astype(np.uint8), "linear")
BUMPS = Image(np.stack([0.5 + 0.35 * WAVE, np.full(WAVE.shape, 0.6), np.ones(WAVE.shape)], -1), "linear")

STEEP = Image(np.stack([0.5 + 0.5 * WAVE, np.full(WAVE.shape, 0.5), np.full(WAVE.shape, 0.55)], -1), "linear")

PLASTIC = Material(albedo=(0.7, 0.3, 0.2), roughness=0.3)
PICTURED = Material(
    albedo=0.9,
    roughness=0.9,
    metallic=0.6,
    albedo_texture=Texture(PICTURE, "mirror", "clamp", scale=(1.5, 0.8), rotation=0.3),
    roughness_texture=Texture(NUMBERS),
    metallic_texture=Texture(NUMBERS, filter="nearest", offset=(0.1, 0.2)),
)
CROWD = [
    Placement((x, 0.5, z), (30 * x, 20.0, 10 * z), (0.5, 0.4 if x < 0.5 else -0.4, 0.3))
    for x in (-1.0, 0.0, 1.0)
    for z in (-0.6, 0.6)
]

# Enough triangles that the mesh is packed once, in its own space, and instanced.
TERRACES = [
    Placement((0.0, 0.2, 1.0), (10.0, 30.0, 0.0), (1.2, 1.5, 0.7)),
    Placement((0.3, 0.6, 0.0), (15.0, 0.0, 5.0), (-1.2, 1.0, 0.6)),
    Placement((-0.2, 1.1, -1.0), (40.0, -40.0, 0.0), (1.0, 2.0, 1.0)),
]


def hills():
    """70k triangles with normals and an image on them."""
    shape = smooth(field(187))
    return Geometry(shape.positions, shape.triangles, shape.normals, uvs=shape.positions[:, ::2])


CASES: dict[str, Callable[[], Scene]] = {
    "flat triangles": lambda: scene(MATT, flat(globe(12, 6))),
    "smooth normals": lambda: scene(MATT, globe(12, 6)),
    "smooth plastic": lambda: scene(PLASTIC, globe(12, 6)),
    "a texture on everything": lambda: scene(PICTURED, globe()),
    "a normal map": lambda: scene(Material(normal_texture=Texture(BUMPS), normal_scale=0.5), globe()),
    "a normal map far too steep": lambda: scene(
        Material(albedo=0.9, specular=0.0, normal_texture=Texture(STEEP, rotation=0.5)), globe(12, 6)
    ),
    "an emissive texture": lambda: scene(
        Material(albedo=0.2, specular=0.0, emission=(3.0, 2.0, 1.0), emission_texture=Texture(PICTURE)),
        globe(),
        **NO_OTHER_LIGHT,
    ),
    "unlit plastic": lambda: scene(
        Material(model="plastic", albedo=0.9, nonlinear=False, unlit=True, albedo_texture=Texture(PICTURE)),
        globe(),
        CROWD[::5],
    ),
    "textures without coordinates": lambda: scene(
        Material(albedo_texture=Texture(PICTURE), emission=0.5, emission_texture=Texture(PICTURE)),
        Geometry(globe().positions, globe().triangles, globe().normals),
        CROWD[::5],
        spheres=[Sphere((0.0, 0.2, 0.5), 0.7, "m")],
    ),
    "a coat and its base with normal maps of their own": lambda: scene(
        Material(
            albedo=(0.7, 0.2, 0.1),
            coat=1.0,
            coat_ior=2.5,
            coat_roughness=0.9,
            normal_texture=Texture(BUMPS),
            coat_texture=Texture(NUMBERS),
            coat_roughness_texture=Texture(PICTURE, channel="g"),
            coat_normal_texture=Texture(BUMPS, scale=(2.0, 2.0), rotation=0.7),
            coat_normal_scale=-0.7,
        ),
        globe(),
    ),
    "sheen": lambda: scene(
        Material(
            albedo=(0.7, 0.2, 0.1),
            roughness=0.4,
            normal_texture=Texture(BUMPS),
            sheen_color=(0.9, 0.8, 0.5),
            sheen_roughness=0.8,
            sheen_color_texture=Texture(PICTURE),
            sheen_roughness_texture=ALPHA_PICTURE,
        ),
        globe(),
    ),
    "a thin film": lambda: scene(
        Material(
            albedo=(0.7, 0.2, 0.1),
            roughness=0.4,
            metallic=0.5,
            normal_texture=Texture(BUMPS),
            iridescence=0.9,
            iridescence_ior=1.6,
            iridescence_texture=Texture(PICTURE),
            iridescence_thickness_texture=ALPHA_PICTURE,
        ),
        globe(),
    ),
    "diffuse transmission": lambda: scene(
        Material(
            albedo=(0.3, 0.6, 0.2),
            roughness=0.5,
            metallic=0.8,
            metallic_texture=Texture(PICTURE, channel="r"),
            normal_texture=Texture(BUMPS),
            normal_scale=0.5,
            diffuse_transmission=0.9,
            diffuse_transmission_color=(0.9, 0.7, 0.4),
            diffuse_transmission_texture=ALPHA_PICTURE,
            diffuse_transmission_color_texture=Texture(PICTURE),
        ),
        globe(),
        lights=[Light((-1.0, 3.0, -3.0), 0.6, power=300.0)],
    ),
    "an alpha mask": lambda: scene(Material(albedo=0.9, albedo_texture=ALPHA_PICTURE, alpha_mode="mask"), globe()),
    "an alpha blend": lambda: scene(
        Material(albedo=0.9, albedo_texture=ALPHA_PICTURE, alpha_mode="blend", opacity=0.8), globe()
    ),
    "an emitter with an alpha blend": lambda: scene(
        Material(
            specular=0.0,
            emission=3.0,
            emission_texture=Texture(PICTURE),
            albedo_texture=ALPHA_PICTURE,
            alpha_mode="blend",
            opacity=0.8,
        ),
        globe(),
        **NO_OTHER_LIGHT,
    ),
    "culled back faces": lambda: scene(Material(double_sided=False), geometry((ball()[0], ball()[1][::2]))),
    "coincident emitters that face opposite ways": lambda: scene(
        Material(albedo=0.5, specular=0.0, emission=(2.0, 1.0, 0.5), double_sided=False),
        SHEET,
        meshes=[Mesh([Part(SHEET, "m"), Part(geometry((SHEET.positions, SHEET.triangles[:, ::-1])), "m")], TURNED)],
        **NO_OTHER_LIGHT,
    ),
    "instances, some mirrored": lambda: scene(PLASTIC, globe(), CROWD),
    "instances of 70k triangles": lambda: scene(
        Material(albedo_texture=Texture(PICTURE), normal_texture=Texture(BUMPS), normal_scale=0.5), hills(), TERRACES
    ),
}

SIZE, BATCHES, SPP = (40, 30), 16, 512
OTHER_SPP = {  # where the noise would hide a difference of 1 %, or fewer show it
    "a texture on everything": 1024,
    "an emitter with an alpha blend": 1024,
    "instances of 70k triangles": 256,
}
LEVEL = 0.01 / len(CASES)


@pytest.mark.parametrize("name", CASES)
def test_a_mesh_agrees_with_the_reference(ctx, name):
    assert_agreement(ctx, CASES[name](), OTHER_SPP.get(name, SPP), name, LEVEL)


def textured_gltf(folder: Path) -> Path:
    """A node with a mesh that another node mirrors, textures of colour and of roughness, a metal, and a camera."""
    shape = globe(12, 6)
    gltf = Gltf(samplers=[{"wrapS": 33648, "wrapT": 33071, "magFilter": 9729}])
    gltf.content["images"] = [
        {"bufferView": gltf.view(_png(pixels)), "mimeType": "image/png"}
        for pixels in (PICTURE.pixels, np.repeat(NUMBERS.pixels, 3, -1))
    ]
    gltf.content["textures"] = [{"source": i, "sampler": 0} for i in range(2)]
    maps = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    gltf.content["materials"] = [
        {"pbrMetallicRoughness": maps | {"metallicFactor": 0.5}, "doubleSided": True},
        {"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.7, 0.3, 1.0], "roughnessFactor": 0.4}},
    ]
    names = {"POSITION": shape.positions, "NORMAL": shape.normals, "TEXCOORD_0": shape.uvs}
    attributes = {name: gltf.array(values) for name, values in names.items()}
    halves = np.array_split(shape.triangles.ravel(), [len(shape.triangles) // 2 * 3])
    gltf.content["meshes"] = [
        {
            "primitives": [
                {"attributes": attributes, "indices": gltf.array(half, "<u2"), "material": i}
                for i, half in enumerate(halves)
            ]
        }
    ]
    gltf.content["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]
    gltf.content["nodes"] = [
        {"children": [1, 2], "translation": [0, 0.2, 0]},
        {"mesh": 0, "translation": [-0.8, 0, 0], "rotation": [0, 0.6, 0, 0.8]},
        {"mesh": 0, "translation": [0.9, 0, -0.3], "scale": [-0.6, 0.8, 0.6]},
        {"camera": 0, "translation": [0, 0.5, 5]},
    ]
    gltf.content["scenes"] = [{"nodes": [0, 3]}]
    return gltf.write(folder / "textured.glb")


def polygons_obj(folder: Path) -> Path:
    """Quads and a pentagon by indices that count from the end, smooth normals, and two materials of a library."""
    (folder / "a.mtl").write_text("newmtl red\nKd 0.7 0.2 0.1\nNs 60\nnewmtl grey\nKd 0.5 0.5 0.5\nillum 1\n")
    shape, lines = globe(12, 6), ["mtllib a.mtl", "usemtl red"]
    for kind, values in (("v", shape.positions), ("vt", shape.uvs), ("vn", shape.normals)):
        lines += [f"{kind} {' '.join(f'{x:.6f}' for x in row)}" for row in values]
    count = len(shape.positions)
    for column in range(12):
        for row in range(6):
            first = column * 7 + row - count
            lines.append("f " + " ".join(f"{i}/{i}/{i}" for i in (first, first + 1, first + 8, first + 7)))
    lines += ["usemtl grey", *(f"v {x} -1.2 {z}" for x, z in ((-2, -2), (-2, 2), (0, 2.5), (2, 2), (2, -2)))]
    lines.append("f -5 -4 -3 -2 -1")
    (folder / "polygons.obj").write_text("\n".join(lines) + "\n")
    return folder / "polygons.obj"


def colored_ply(folder: Path) -> Path:
    """Binary, its numbers the other way round; quads, normals and colours of vertices."""
    shape = globe(12, 6)
    table = np.zeros(len(shape.positions), [("p", ">f4", 3), ("n", ">f4", 3), ("c", "u1", 3)])
    table["p"], table["n"] = shape.positions, shape.normals
    table["c"] = np.random.default_rng(0).integers(60, 256, table["c"].shape)
    first = (7 * np.arange(12)[:, None] + np.arange(6)).ravel()
    faces = np.zeros(len(first), [("count", "u1"), ("corners", ">i4", 4)])
    faces["count"], faces["corners"] = 4, np.stack([first, first + 1, first + 8, first + 7], 1)
    names = [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    names += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head = ["ply", "format binary_big_endian 1.0", f"element vertex {len(table)}", *names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    (folder / "colored.ply").write_bytes("\n".join(head).encode() + table.tobytes() + faces.tobytes())
    return folder / "colored.ply"


def _png(pixels) -> bytes:
    file = io.BytesIO()
    PIL.Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


MODELS = (textured_gltf, polygons_obj, colored_ply)


@pytest.mark.parametrize("write", MODELS)
def test_a_model_agrees_with_the_reference(ctx, tmp_path, write):
    assert_agreement(ctx, load(write(tmp_path)), SPP // 2, write.__name__, 0.01 / len(MODELS))


def assert_agreement(ctx, scene, spp, name, level):
    seed = crc32(name.encode())
    reference = render_reference(scene, SIZE, spp, BATCHES, seed, is_timed=False)
    ours = render_ours(in_long_passes(scene), SIZE, spp, BATCHES, seed, context=ctx)
    assert_proved(ours, reference, level)
