# SPDX-License-Identifier: MIT
"""Mitsuba's scene files: what is read of them, and that pictures are those of Mitsuba itself."""

import re
import shutil
import warnings
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import PIL.Image
import pytest
from command import status_of
from rendering import rendered

from fragtracer.apps.compare import compare_scene, run
from fragtracer.errors import FragtracerError, SceneError
from fragtracer.io import AnimationError, files_of
from fragtracer.io.images import write_image
from fragtracer.io.mitsuba import instantiated
from fragtracer.io.toml import is_mitsuba, load, save
from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.variant import find_llvm
from fragtracer.scene import SHAPES, Material, Scene
from fragtracer.scene.environment import lookup
from fragtracer.scene.texture import linear_pixels

from .data import shared

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
RNG = np.random.default_rng(7)
SENSOR = """<sensor type="perspective"><float name="fov" value="45"/>
<transform name="to_world"><lookat origin="0.5, 3, 7" target="0, 0.2, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="32"/></sampler></sensor>"""
PATHS = '<integrator type="volpath"><integer name="max_depth" value="6"/></integrator>'
WRONG = ["", "-1", "0", "nan", "1e30", "inf", "x", "1, 2", "true", "99999999999999999999", "$q", "../.."]
FILES = Path(__file__).parent / "mitsuba"
GGX = '<string name="distribution" value="ggx"/>'


def placed(*steps: str) -> str:
    return f'<transform name="to_world">{"".join(steps)}</transform>'


def bitmap(name: str, file: str, *more: str, raw: bool = False) -> str:
    text = f'<string name="filename" value="{file}"/><boolean name="raw" value="{str(raw).lower()}"/>'
    return f'<texture type="bitmap" name="{name}">{text}{"".join(more)}</texture>'


def gray(value: str) -> str:
    return f'<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>'


def both(bsdf: str) -> str:
    return f'<bsdf type="twosided">{bsdf}</bsdf>'


def written(folder: Path, body: str, head: str = PATHS + SENSOR) -> Path:
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0">\n{head}\n{body}\n</scene>')
    return path


def read(folder: Path, body: str, head: str = PATHS + SENSOR) -> Scene:
    """The scene, whose reader must not say that something is not as in Mitsuba."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load(written(folder, body, head))


def notes(folder: Path, body: str, head: str = PATHS + SENSOR) -> str:
    """What the reader says is not as in Mitsuba."""
    with pytest.warns(UserWarning, match="not as in Mitsuba") as found:
        load(written(folder, body, head))
    return str(found[0].message)


def material(folder: Path, bsdf: str) -> Material:
    (found,) = read(folder, f'<shape type="sphere">{bsdf}</shape>').materials.values()
    return found


def images(folder: Path) -> None:
    """Textures and a map, beside the scene."""
    PIL.Image.fromarray(RNG.integers(40, 255, (8, 16, 3), np.uint8)).save(folder / "color.png")
    PIL.Image.fromarray((255 * (RNG.random((4, 8)) > 0.4)).astype(np.uint8)).save(folder / "holes.png")
    PIL.Image.fromarray(RNG.integers(60, 200, (8, 8), np.uint8)).save(folder / "grey.png")
    rows, columns = np.meshgrid(np.linspace(0, np.pi, 128), np.linspace(0, 2 * np.pi, 256), indexing="ij")
    waves = [1 + 0.8 * np.sin(rows) * np.sin(columns + phase) for phase in (0.0, 2.0, 4.0)]
    write_image(folder / "sky.exr", np.stack(waves, -1))


def torus(path: Path, around: int = 48, across: int = 24) -> None:
    """A ring in the plane of x and z, with normals and texture coordinates."""
    u, v = (2 * np.pi * np.arange(n) / n for n in (around, across))
    u, v = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    normals = np.stack([np.cos(v) * np.cos(u), np.sin(v), np.cos(v) * np.sin(u)], -1)
    centers = np.stack([np.cos(u), np.zeros_like(u), np.sin(u)], -1)
    lines = [f"v {x} {y} {z}" for x, y, z in 0.35 * centers + 0.15 * normals]
    lines += [f"vt {x} {y}" for x, y in zip(u / 7, v / 7, strict=True)] + [f"vn {x} {y} {z}" for x, y, z in normals]
    first = np.arange(around * across).reshape(around, across) + 1
    corners = first, np.roll(first, -1, 1), np.roll(np.roll(first, -1, 0), -1, 1), np.roll(first, -1, 0)
    for a, b, c, d in zip(*(x.ravel().tolist() for x in corners), strict=True):
        lines += [f"f {p}/{p}/{p} {q}/{q}/{q} {r}/{r}/{r}" for p, q, r in ((a, b, c), (a, c, d))]
    path.write_text("\n".join(lines))


def scene_file(folder: Path, name: str) -> Path:
    """A scene, with all that it names.

    ``surfaces`` has a sphere of each BSDF, and rectangles with textures, seen from both sides; ``shapes`` has shapes of
    all kinds, mirrored, turned inside out and in instances, a medium, and lights.
    """
    images(folder)
    torus(folder / "ring.obj")
    return Path(shutil.copy(FILES / f"{name}.xml", folder / "scene.xml"))


def quietly(path: Path | str) -> Scene:
    """The scene, whatever is not as in Mitsuba."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["surfaces", "shapes"])
def test_pictures_are_those_of_mitsuba(tmp_path: Path, name: str) -> None:
    """Of the file itself."""
    if find_llvm() is None:
        pytest.skip("no LLVM of version 16 or newer on this machine: scalar_rgb is too slow")
    path = scene_file(tmp_path, name)
    comparison = compare_scene(quietly(path), (48, 36), 512, margin=0.02, file=path)
    verdict = comparison.verdict
    assert verdict.outcome == "agreement", (verdict.outcome, verdict.differing, verdict.image.pair.relative_difference)


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


BLUR = '<shape type="sphere"><bsdf type="{}">{}</bsdf></shape>'


NOTES = {
    "beckmann": (BLUR.format("roughconductor", ""), "line 6: Beckmann's facets of <bsdf type=.roughconductor.>, GGX's"),
    "bsdf": (BLUR.format("hair", ""), "line 6: <bsdf type=.hair.>, a diffuse grey"),
    "principled": (BLUR.format("principled", ""), "a metallic-roughness material in its place"),
    "key": (BLUR.format("diffuse", '<float name="shine" value="2"/>'), "shine of <bsdf"),
    "factor": (BLUR.format("plastic", '<float name="specular_reflectance" value="0.5"/>'), "specular_reflectance of"),
    "bumps": (BLUR.format("bumpmap", bitmap("", "grey.png") + gray("0.5")), "line 6: the bumps of a shape without"),
    "shape": ('<shape type="bsplinecurve"><string name="filename" value="x"/></shape>', "<shape type=.bsplinecurve.>"),
    "emitter": ('<emitter type="projector"/>', "line 6: <emitter type=.projector.>"),
    "sensor": (SENSOR, "another camera"),
    "spot": ('<emitter type="spot"/>', "the falloff of"),
}


@pytest.mark.parametrize(("body", "note"), NOTES.values(), ids=NOTES)
def test_what_is_not_as_in_mitsuba_is_said(tmp_path: Path, body: str, note: str) -> None:
    assert re.search(note, notes(tmp_path, body))


MISTAKES = {
    "no camera": ("", "", "there is no camera"),
    "no XML": ("<shape", SENSOR, "scene.xml: Parsing of XML file"),
    "no number": ('<shape type="sphere"><float name="radius" value="x"/></shape>', SENSOR, "could not parse floating"),
    "of another type": (
        '<shape type="sphere"><string name="radius" value="1"/></shape>',
        SENSOR,
        ':6: <shape type="sphere">: radius must be a number',
    ),
    "no file name": ('<shape type="obj"/>', SENSOR, ':6: <shape type="obj">: filename is missing'),
    "no file": ('<shape type="obj"><string name="filename" value="a.obj"/></shape>', SENSOR, "there is no file"),
    "instance of nothing": ('<shape type="instance"/>', SENSOR, "it names no <shape type="),
    "nothing to wrap": ('<shape type="sphere"><bsdf type="twosided"/></shape>', SENSOR, "it holds no other <bsdf>"),
    "two environments": (
        '<emitter type="constant"/><emitter type="constant"/>',
        SENSOR,
        "there is another environment",
    ),
    "negative light": (
        '<emitter type="constant"><float name="radiance" value="-1"/></emitter>',
        SENSOR,
        "radiance must be greater than or equal to 0",
    ),
    "another camera": ("", SENSOR.replace("perspective", "orthographic"), "use perspective or thinlens"),
    "mirrored": ("", SENSOR.replace("<lookat", '<scale x="-1"/><lookat'), "mirrors or flattens the picture"),
    "reference to nothing": ('<ref id="x"/>', SENSOR, 'unresolved reference to "x"'),
    "unknown metal": (
        BLUR.format("conductor", '<string name="material" value="Xy"/>'),
        SENSOR,
        r':6: <bsdf type="conductor">: failed to instantiate .*Xy.eta.spd": file does not exist',
    ),
}


@pytest.mark.parametrize(("body", "head", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes(tmp_path: Path, body: str, head: str, message: str) -> None:
    """One error names the file, the line, the plugin and what is wrong."""
    with pytest.raises(SceneError, match=message) as error:
        load(written(tmp_path, body, head))
    assert str(error.value).startswith(str(tmp_path / "scene.xml"))
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"other.xml: no such file"):
        load(tmp_path / "other.xml")
    with pytest.raises(AnimationError, match="no animations"):
        load(written(tmp_path, '<shape type="sphere"/>'), animation="Run")


def test_without_mitsuba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mitsuba", None)
    with pytest.raises(SceneError, match=r"pip install 'fragtracer\[reference\]'"):
        load(written(tmp_path, '<shape type="sphere"/>'))


@pytest.mark.parametrize("name", ["surfaces", "shapes"])
def test_saved_as_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The same scene comes back."""
    monkeypatch.chdir(tmp_path)
    scene = quietly(scene_file(tmp_path, name))
    save(scene, "saved.toml")
    again = load("saved.toml")
    for field in ("camera", "render", "materials", "media", "environment", "lights", "directional_lights", *SHAPES):
        assert getattr(again, field) == getattr(scene, field), field
    parts = ([part for mesh in one.meshes for part in mesh.parts] for one in (scene, again))
    assert len({tuple(part.geometry.digest for part in found) for found in parts}) == 1


def test_the_command_compares_with_the_file_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, asked = written(tmp_path, '<emitter type="constant"/><shape type="sphere"/>'), []

    def compared(*_: Any, **keywords: Any) -> None:
        asked.append(keywords["file"])
        raise FragtracerError("enough")

    monkeypatch.setattr(run, "compare_scene", compared)
    assert status_of(monkeypatch, "compare", path) == 2
    assert status_of(monkeypatch, "compare", "cornell-box") == 2
    assert asked == [path, None]
    assert status_of(monkeypatch, "compare", path, "--geometry", "karis") == 2
    assert "leave --geometry and --multiple-scattering out" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["cornell-box", "glass"])
def test_a_bundled_scene_comes_back(ctx: moderngl.Context, tmp_path: Path, name: str) -> None:
    """Written for Mitsuba, with its own plugins, and read again: the same picture, by the same random numbers."""
    scene = load(name)
    export_mitsuba(scene, tmp_path)
    one, other = (rendered(ctx, each, 16, (32, 24), shared=True) for each in (scene, quietly(tmp_path / "scene.xml")))
    np.testing.assert_allclose(other.mean((0, 1)), one.mean((0, 1)), rtol=1e-4)
    assert np.median(np.abs(other - one) / one.mean()) < 1e-5


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


def test_damaged_files(tmp_path: Path) -> None:
    """Whatever is changed in a file, it is read, or refused by an error of ours."""
    texts = [scene_file(tmp_path, name).read_text() for name in ("surfaces", "shapes")]
    torus(tmp_path / "ring.obj", 4, 3)
    outcomes = [_outcome(tmp_path / "scene.xml", _damaged(texts[i % 2])) for i in range(120)]
    assert set(outcomes) == {"read", "refused"}


def _damaged(text: str) -> str:
    """With another value, type or name in one place."""
    kind = RNG.choice(["value", "type", "name"])
    found = list(re.finditer(rf'\b{kind}="([^"]*)"', text))
    place, other = (found[i] for i in RNG.integers(len(found), size=2))
    value = str(RNG.choice(WRONG)) if kind == "value" else other[1]
    return text[: place.start(1)] + value + text[place.end(1) :]


def _outcome(path: Path, text: str) -> str:
    path.write_text(text)
    try:
        quietly(path)
    except FragtracerError:
        return "refused"
    return "read"
