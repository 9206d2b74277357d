# SPDX-License-Identifier: MIT
"""What is read of Mitsuba's scene files."""

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.errors import SceneError
from fragtracer.io import files_of
from fragtracer.io.images import write_image
from fragtracer.io.mitsuba import instantiated
from fragtracer.io.toml import is_mitsuba, load
from fragtracer.scene import SHAPES
from fragtracer.scene.environment import lookup
from fragtracer.scene.texture import linear_pixels

from .data import shared
from .mitsuba_files import GGX, SENSOR, bitmap, both, gray, images, material, notes, placed, read, torus, written

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
RNG = np.random.default_rng(7)


@pytest.mark.parametrize(
    ("bsdf", "fields"),
    [
        (gray("0.25, 0.5, 1.5"), {"albedo": (0.25, 0.5, 1.0), "specular": 0.0}),
        ('<bsdf type="conductor"/>', {"metallic": 1.0, "albedo": (1.0, 1.0, 1.0), "roughness": 0.0}),
        (
            f'<bsdf type="roughconductor">{GGX}<spectrum name="eta" value="2"/><spectrum name="k" value="3"/></bsdf>',
            {"model": "conductor", "eta": (2.0,) * 3, "k": (3.0,) * 3, "roughness": 0.1**0.5},
        ),
        (
            f'<bsdf type="roughdielectric">{GGX}<float name="alpha_u" value="0.25"/><float name="alpha_v" '
            'value="0.04"/><float name="int_ior" value="1.3"/><float name="ext_ior" value="1"/></bsdf>',
            {"model": "dielectric", "roughness": 0.2, "anisotropy": (0.21 / 0.96) ** 0.5, "ior": 1.3},
        ),
        (
            '<bsdf type="thindielectric"><float name="int_ior" value="1.4"/><float name="ext_ior" value="1"/>'
            '<rgb name="specular_transmittance" value="0.5, 0.6, 0.7"/></bsdf>',
            {"model": "thin-dielectric", "ior": 1.4, "transmittance": (0.5, 0.6, 0.7)},
        ),
        (
            f'<bsdf type="roughplastic">{GGX}<float name="alpha" value="0.25"/>'
            '<float name="ext_ior" value="1"/></bsdf>',
            {"model": "rough-plastic", "roughness": 0.5, "ior": 1.49, "nonlinear": False},
        ),
        ('<bsdf type="null"/>', {"model": "null"}),
        (f'<bsdf type="mask"><float name="opacity" value="0.25"/>{gray("0.5")}</bsdf>', {"opacity": 0.25}),
    ],
    ids=["diffuse", "mirror", "conductor", "roughdielectric", "thindielectric", "roughplastic", "null", "mask"],
)
def test_bsdf(tmp_path: Path, bsdf: str, fields: dict[str, Any]) -> None:
    found = material(tmp_path, bsdf)
    for name, value in fields.items():
        value = pytest.approx(value, rel=1e-6) if not isinstance(value, (str, bool)) else value
        assert getattr(found, name) == value, name


def test_sides(tmp_path: Path) -> None:
    """An opaque BSDF without ``twosided`` is black from behind; glass has no such back."""
    bsdfs = [
        gray("0.5"),
        both(gray("0.5")),
        '<bsdf type="dielectric"/>',
        both(f'<bsdf type="mask">{gray("0.5")}</bsdf>'),
    ]
    assert [material(tmp_path, bsdf).black_back for bsdf in bsdfs] == [True, False, False, False]
    blend = f'<bsdf type="blendbsdf">{both(gray("0.5"))}<bsdf type="conductor"/></bsdf>'
    scene = read(tmp_path, f'<shape type="disk">{blend}</shape>')
    (own,) = (m for m in scene.materials.values() if m.blend is not None)
    assert (own.black_back, scene.materials[own.blend].black_back) == (False, True)


def test_a_light_without_a_bsdf_is_black(tmp_path: Path) -> None:
    lamp = '<emitter type="area"><rgb name="radiance" value="1, 2, 3"/></emitter>'
    scene = read(tmp_path, f'<shape type="sphere">{lamp}</shape><shape type="disk"/>')
    lit, other = (scene.materials[shape.material] for shape in (*scene.spheres, *scene.disks))
    assert (lit.albedo, lit.emission) == ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert other.albedo == (0.5, 0.5, 0.5)


def test_a_width_in_a_texture_is_a_roughness(tmp_path: Path) -> None:
    images(tmp_path)
    bsdf = f'<bsdf type="roughconductor">{GGX}{bitmap("alpha", "grey.png", raw=True)}</bsdf>'
    scene = read(tmp_path, f'<shape type="rectangle">{both(bsdf)}</shape>')
    (found,) = scene.materials.values()
    expected = np.asarray(PIL.Image.open(tmp_path / "grey.png")) / 255
    np.testing.assert_allclose(linear_pixels(found.roughness_texture.image)[..., 0] ** 2, expected, atol=1e-6)
    assert not any(getattr(scene, kind) for kind in SHAPES), "it needs texture coordinates"


@pytest.mark.parametrize(
    "mapping", ["", '<transform name="to_uv"><scale x="2" y="-1"/></transform>'], ids=["", "mapped"]
)
def test_bumps_are_those_of_mitsuba(tmp_path: Path, mapping: str) -> None:
    """The normal map of a rectangle of 2 x 1 m, against the normals of a diffuse surface in Mitsuba."""
    import mitsuba as mi

    from fragtracer.reference.variant import mitsuba_variant

    u, v = np.meshgrid(*[2 * np.pi * (np.arange(256) + 0.5) / 256] * 2)
    heights = 0.05 * (2 + np.sin(u) * np.cos(2 * v) + np.cos(u))
    write_image(tmp_path / "heights.exr", np.repeat(heights[..., None], 3, axis=2))
    texture = bitmap("", "heights.exr", mapping, raw=True)
    bsdf = f'<bsdf type="bumpmap">{texture}<float name="scale" value="1.5"/>{gray("0.5")}</bsdf>'
    body = f'<shape type="rectangle">{placed("<scale x=%s1%s y=%s0.5%s/>".replace("%s", chr(34)))}{bsdf}</shape>'
    (found,) = read(tmp_path, body).materials.values()
    map_ = found.normal_texture
    assert (map_.wrap_u, map_.scale[0]) == ("repeat", 2.0 if mapping else 1.0)
    normals = 2 * linear_pixels(map_.image)[..., :3] - 1
    rows, columns, _ = normals.shape
    directions = np.eye(3) * 0.3 + (0.0, 0.0, 0.9)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ours, theirs = [], []
    with mitsuba_variant("scalar_rgb"):
        scene = mi.load_file(str(tmp_path / "scene.xml"))
        for x, y in RNG.uniform(0, 1, (20, 2)):
            si = scene.ray_intersect(mi.Ray3f([2 * x - 1, y - 0.5, 1.0], [0.0, 0.0, -1.0]))
            values = [np.array(si.bsdf().eval(mi.BSDFContext(), si, wo))[0] for wo in directions.tolist()]
            theirs.append(np.linalg.solve(directions, np.pi / 0.5 * np.array(values)))
            s, t = (2 * x, -y) if mapping else (x, y)
            ours.append(normals[int(t % 1 * rows), int(s % 1 * columns)] * (1, -1, 1))  # the bitangent is against v
    np.testing.assert_allclose(ours, theirs, atol=0.03)
    assert (np.std(theirs, axis=0)[:2] > 0.1).all()


def test_colors_of_vertices(tmp_path: Path) -> None:
    """Where a material asks for them."""
    header = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {name}\n" for name in "xyzrgb")
    rows = "0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n"
    text = f"{header}element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n"
    (tmp_path / "colors.ply").write_text(text)
    colored = '<texture type="mesh_attribute" name="reflectance"><string name="name" value="vertex_color"/></texture>'
    shape = '<shape type="ply"><string name="filename" value="colors.ply"/>{}</shape>'
    body = shape.format(f'<bsdf type="diffuse">{colored}</bsdf>') + shape.format(gray("0.5"))
    one, other = (mesh.parts[0].geometry.colors for mesh in read(tmp_path, body).meshes)
    np.testing.assert_allclose(one, np.eye(3))
    assert other is None


@pytest.mark.parametrize(
    ("keys", "degrees"),
    [
        ('<float name="fov" value="40"/>', 40 * 36 / 48),
        ('<float name="fov" value="40"/><string name="fov_axis" value="y"/>', 40),
        ('<float name="fov" value="40"/><string name="fov_axis" value="smaller"/>', 40),
        ('<string name="focal_length" value="35mm"/>', None),
        ("", None),
    ],
    ids=["x", "y", "smaller", "35 mm", "50 mm"],
)
def test_field_of_view(tmp_path: Path, keys: str, degrees: float | None) -> None:
    """By Mitsuba's own projection: the highest point of the picture is at half of the angle."""
    import mitsuba as mi

    from fragtracer.reference.variant import mitsuba_variant

    head = SENSOR.replace('<float name="fov" value="45"/>', keys)
    scene = read(tmp_path, '<shape type="sphere"/>', head)
    with mitsuba_variant("scalar_rgb"):
        sensor = mi.load_file(str(tmp_path / "scene.xml")).sensors()[0]
        middle, top = (np.array(sensor.sample_ray(0, 0, [0.5, y], [0, 0])[0].d) for y in (0.5, 0.0))
    expected = 2 * np.degrees(np.arccos(min(1.0, float(middle @ top))))
    assert scene.camera.fov_degrees == pytest.approx(expected, abs=1e-2)
    if degrees is not None and "axis" in keys:
        assert scene.camera.fov_degrees == pytest.approx(degrees)


def test_camera_and_settings(tmp_path: Path) -> None:
    lens = '<float name="aperture_radius" value="0.2"/><float name="focus_distance" value="5"/>'
    head = SENSOR.replace("perspective", "thinlens").replace("<transform", f"{lens}<transform", 1)
    head += (
        '<integrator type="path"><integer name="max_depth" value="9"/><integer name="rr_depth" value="3"/></integrator>'
    )
    scene = read(tmp_path, '<shape type="sphere"/>', head)
    camera, settings = scene.camera, scene.render
    assert camera.position == pytest.approx((0.5, 3, 7))
    ahead, expected = np.subtract(camera.target, camera.position), np.subtract((0, 0.2, 0), (0.5, 3, 7))
    np.testing.assert_allclose(np.cross(ahead, expected), 0, atol=1e-9)
    assert (camera.aperture_radius, camera.focus_distance) == (0.2, 5.0)
    assert (settings.width, settings.height, settings.spp, settings.pixel_filter) == (48, 36, 32, "box")
    assert (settings.bounces, settings.russian_roulette_depth) == (8, 3)
    hidden = '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>'
    dark = read(tmp_path, '<emitter type="constant"/>', hidden + SENSOR)
    assert not dark.environment.visible
    assert dark.render.bounces == 1000, "only roulette ends them"


@pytest.mark.parametrize(
    "steps",
    ['<rotate y="1" angle="70"/>', '<rotate x="1" angle="50"/><rotate y="1" angle="20"/>', '<scale x="-1"/>'],
    ids=["about y", "about x and y", "mirrored"],
)
def test_a_map_is_turned_as_in_mitsuba(tmp_path: Path, steps: str) -> None:
    """But for half of a row, by which Mitsuba's rows are farther from the equator."""
    import mitsuba as mi

    from fragtracer.reference.variant import mitsuba_variant

    images(tmp_path)
    keys = '<string name="filename" value="sky.exr"/><float name="scale" value="1.5"/>'
    scene = read(tmp_path, f'<emitter type="envmap">{keys}{placed(steps)}</emitter>')
    environment = scene.environment
    directions = RNG.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ours = environment.strength * lookup(environment.pixels, directions @ environment.rotation)
    with mitsuba_variant("scalar_rgb"):
        (emitter,) = mi.load_file(str(tmp_path / "scene.xml")).emitters()
        si = mi.SurfaceInteraction3f()
        theirs = []
        for wi in (-directions).tolist():
            si.wi = wi
            theirs.append(np.array(emitter.eval(si)))
    np.testing.assert_allclose(ours, theirs, rtol=0.02)


def test_a_sun_is_as_strong_as_mitsubas(tmp_path: Path) -> None:
    """What it gives to a surface that faces it, against Mitsuba's own samples of it."""
    import mitsuba as mi

    from fragtracer.reference.variant import mitsuba_variant

    turn = placed('<rotate x="1" angle="-90"/>')
    sky = f'<emitter type="sunsky"><vector name="sun_direction" x="0.3" y="1" z="0.5"/>{{}}{turn}</emitter>'
    scene = read(tmp_path, sky.format("") + '<shape type="sphere"/>')
    (sun,) = scene.lights
    direction = np.array(sun.position) / np.linalg.norm(sun.position)
    np.testing.assert_allclose(direction, np.array((0.3, 1, 0.5)) / np.linalg.norm((0.3, 1, 0.5)), rtol=1e-3)
    ours = np.pi * (sun.radius / np.linalg.norm(sun.position)) ** 2 * np.array(sun.radiance)
    path = written(tmp_path, sky.format('<float name="sky_scale" value="0"/>') + '<shape type="sphere"/>')
    with mitsuba_variant("scalar_rgb"):
        (emitter,) = mi.load_file(str(path)).emitters()
        at = mi.SurfaceInteraction3f()
        at.p = [0.0, 5.0, 0.0]
        samples = [np.array(emitter.sample_direction(at, RNG.random(2).tolist())[1]) for _ in range(500)]
    np.testing.assert_allclose(ours, np.mean(samples, axis=0), rtol=0.01)
    assert scene.environment.image.pixels.min() >= 0 < scene.environment.image.pixels[:100].min()


GLASS = """<shape type="sphere"><float name="radius" value="{}"/>{}<bsdf type="dielectric" id="{}">
<float name="int_ior" value="{}"/><float name="ext_ior" value="{}"/></bsdf></shape>"""


def test_dielectrics_are_interfaces(tmp_path: Path) -> None:
    """Where one is between two others, or solids overlap."""
    alone = read(tmp_path, GLASS.format(1, "", "glass", 1.5, 1)).materials["glass"]
    assert (alone.ior, alone.exterior_ior) == (1.5, None)
    nested = GLASS.format(1, "", "water", 1.33, 1.5) + GLASS.format(2, "", "glass", 1.5, 1)
    indices = {name: (m.ior, m.exterior_ior) for name, m in read(tmp_path, nested).materials.items()}
    assert indices == {"water": pytest.approx((1.33, 1.5)), "glass": (1.5, 1.0)}
    overlapping = GLASS.format(1, "", "one", 1.5, 1) + GLASS.format(2, "", "other", 1.4, 1)
    found = read(tmp_path, overlapping).materials.values()
    assert {m.exterior_ior for m in found} == {1.0}


def test_media_within_each_other(tmp_path: Path) -> None:
    """What has a medium is a solid; smaller ones have a higher priority, since Mitsuba has none."""
    milk = '<medium type="homogeneous" id="milk"><float name="sigma_t" value="1"/></medium>'
    inside = '<ref id="milk" name="interior"/>'
    body = milk + GLASS.format(1, inside, "inner", 1.5, 1) + GLASS.format(2, inside, "outer", 1.4, 1)
    scene = read(tmp_path, body)
    assert {name: m.priority for name, m in scene.materials.items()} == {"outer": 0, "inner": 1}
    assert not any(m.exterior_ior for m in scene.materials.values())


def test_an_included_file(tmp_path: Path) -> None:
    """Its files are looked for beside the scene, as Mitsuba does, and then beside itself; messages name it."""
    (tmp_path / "part").mkdir()
    torus(tmp_path / "part" / "ring.obj", 4, 3)
    part = tmp_path / "part" / "ring.xml"
    ring = '<scene version="3.0.0">\n<shape type="obj"><string name="filename" value="{}.obj"/></shape></scene>'
    part.write_text(ring.format("ring"))
    include = '<include filename="part/ring.xml"/>'
    (mesh,) = read(tmp_path, include).meshes
    assert len(mesh.parts[0].geometry.triangles) == 24
    assert files_of(tmp_path / "scene.xml") == (tmp_path / "scene.xml", part, tmp_path / "part" / "ring.obj")
    part.write_text(ring.format("bell"))
    with pytest.raises(SceneError, match=rf'{part}:2: <shape type="obj">: filename: there is no file .*bell.obj'):
        load(written(tmp_path, include))


def test_serialized_meshes(tmp_path: Path) -> None:
    """Two of one file, the second with normals and texture coordinates, as Mitsuba's exporters write them."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    normals, uvs = np.tile(np.float32([0, 0, 1]), (3, 1)), corners[:, :2]
    data, offsets = b"", []
    for size, flags, more in ((1, 0x1000, b""), (2, 0x1003, normals.tobytes() + uvs.tobytes())):
        offsets.append(len(data))
        body = struct.pack("<I", flags) + b"name\0" + struct.pack("<QQ", 3, 1) + (size * corners).tobytes() + more
        data += struct.pack("<HH", 0x041C, 4) + zlib.compress(body + np.arange(3, dtype=np.uint32).tobytes())
    data += struct.pack("<2QI", *offsets, 2)
    (tmp_path / "two.serialized").write_bytes(data)
    shape = '<shape type="serialized"><string name="filename" value="two.serialized"/>{}</shape>'
    scene = read(tmp_path, shape.format("") + shape.format('<integer name="shape_index" value="1"/>'))
    first, second = (mesh.parts[0].geometry for mesh in scene.meshes)
    np.testing.assert_array_equal(first.positions, corners)
    np.testing.assert_array_equal(second.positions, 2 * corners)
    np.testing.assert_array_equal(second.triangles, [[0, 1, 2]])
    np.testing.assert_array_equal(second.normals, normals)
    np.testing.assert_array_equal(np.asarray(second.uvs)[:, :2], uvs)
    assert first.uvs is None


def test_shapes_have_names_of_their_own(tmp_path: Path) -> None:
    """By which layers and the viewer tell them apart, of ids or files; what an older version has besides is said."""
    torus(tmp_path / "ring.obj", 4, 3)
    ring = '<shape type="obj"{}><string name="filename" value="ring.obj"/></shape>'
    scene = read(tmp_path, ring.format("") * 2 + ring.format(' id="mine"'))
    assert [mesh.name for mesh in scene.meshes] == ["ring", "ring 2", "mine"]
    assert len({mesh.parts[0].geometry for mesh in scene.meshes}) == 1
    angle = '<float name="max_smooth_angle" value="30"/>'
    assert "max_smooth_angle of <shape" in notes(tmp_path, ring.format("").replace("</shape>", f"{angle}</shape>"))


def test_holes_in_bytes_stay_bytes(tmp_path: Path) -> None:
    """A leaf of two images takes the memory of one with alpha."""
    images(tmp_path)
    leaf = f'<bsdf type="diffuse">{bitmap("reflectance", "color.png")}</bsdf>'
    body = f'<shape type="rectangle"><bsdf type="mask">{bitmap("opacity", "holes.png", raw=True)}{leaf}</bsdf></shape>'
    (found,) = read(tmp_path, body).materials.values()
    image = found.albedo_texture.image
    assert (image.pixels.shape, image.pixels.dtype, image.color_space) == ((8, 16, 4), np.uint8, "srgb")
    color, holes = (np.asarray(PIL.Image.open(tmp_path / name)) for name in ("color.png", "holes.png"))
    np.testing.assert_array_equal(image.pixels[..., :3], color)
    np.testing.assert_array_equal(image.pixels[::2, ::2, 3], holes)


def test_a_file_of_an_older_version(tmp_path: Path) -> None:
    """Its names are those of today, and a film that Mitsuba no longer has is no matter."""
    import mitsuba as mi

    from fragtracer.reference.variant import mitsuba_variant

    film = '<film type="ldrfilm"><integer name="width" value="64"/><float name="gamma" value="2.2"/></film>'
    turn = '<transform name="toWorld"><lookat origin="0, 0, 9" target="0, 0, 0" up="0, 1, 0"/></transform>'
    paths = '<integrator type="path"><integer name="maxDepth" value="7"/></integrator>'
    path = tmp_path / "scene.xml"
    sensor = f'<sensor type="perspective">{turn}{film}</sensor>'
    path.write_text(f'<scene version="0.6.0">{paths}{sensor}<shape type="sphere"/></scene>')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load(path)
    assert (scene.camera.position, scene.render.width, scene.render.bounces) == ((0.0, 0.0, 9.0), 64, 6)
    with mitsuba_variant("scalar_rgb"):
        assert len(instantiated(mi, path).shapes()) == 1


@pytest.mark.parametrize("file", ["cornell-box", "furnace"])
def test_files_of_others(file: str) -> None:
    path = shared("mitsuba", f"{file}.xml")
    assert is_mitsuba(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load(path)
    counts = {"cornell-box": (6, 2), "furnace": (2, 0)}[file]
    assert (len(scene.rectangles), len(scene.meshes)) == counts
    assert scene.render.bounces == 9
