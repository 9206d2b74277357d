# SPDX-License-Identifier: MIT
"""Scene files with something wrong: every mistake is named with its place, its value and what is allowed."""

from pathlib import Path

import pytest
from scene_builders import RED, SPHERE

from fragtracer.errors import SceneError
from fragtracer.io.toml import load, parse

DISK = '[[disk]]\ncenter = [0, 1, 2]\nnormal = [0, 1, 0]\nradius = 1\nmaterial = "red"\n'
SPOT_LIGHT = "[[spot_light]]\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = 2\n"


def message_of(text: str) -> str:
    with pytest.raises(SceneError) as raised:
        parse(text, "scenes/x.toml")
    message = str(raised.value)
    assert all(line.startswith("scenes/x.toml: ") for line in message.splitlines())
    for leak in ("Input should", "pydantic", "validation error", "Value error", "<class", "sys."):
        assert leak not in message
    return message


# What a file holds, the path of the key, and the words that tell what is wrong and what is allowed.
MISTAKES = {
    "negative radius": (
        SPHERE.replace("radius = 1", "radius = -1") + RED,
        "sphere[0].radius: must be greater than 0, got -1",
    ),
    "third sphere": (2 * SPHERE + SPHERE.replace("= 1\n", "= 0\n") + RED, "sphere[2].radius: must be greater than 0"),
    "nan": (SPHERE.replace("radius = 1", "radius = nan") + RED, "sphere[0].radius: must be a finite number, got nan"),
    "inf": (SPHERE.replace("[0,", "[-inf,") + RED, "sphere[0].center[0]: must be a finite number, got -inf"),
    "missing key": (SPHERE.replace("radius = 1\n", "") + RED, "sphere[0].radius: is missing; give a number"),
    "missing material key": ("[[plane]]\nnormal = [0, 1, 0]\n", "plane[0].point: is missing; give three numbers"),
    "short vector": (
        SPHERE.replace("[0, 1, 2]", "[0, 1]") + RED,
        "sphere[0].center: must be three numbers [x, y, z], got [0, 1]",
    ),
    "long vector": (
        SPHERE.replace("[0, 1, 2]", "[0, 1, 2, 3]") + RED,
        "sphere[0].center: must be three numbers [x, y, z], got [0, 1, 2, 3]",
    ),
    "vector of words": (SPHERE.replace("[0,", '["a",') + RED, 'sphere[0].center[0]: must be a number, got "a"'),
    "word for a vector": (
        SPHERE.replace("[0, 1, 2]", '"abc"') + RED,
        'sphere[0].center: must be three numbers [x, y, z], got "abc"',
    ),
    "table for a vector": (
        SPHERE.replace("[0, 1, 2]", "{ x = 1 }") + RED,
        "sphere[0].center: must be three numbers [x, y, z], got a table",
    ),
    "true for a number": (SPHERE.replace("= 1\n", "= true\n") + RED, "sphere[0].radius: must be a number, got true"),
    "no such material": (
        SPHERE + '[material.rod]\n[material."pale blue"]\n',
        'sphere[0].material: there is no material "red"; did you mean rod? choose from rod, pale blue',
    ),
    "no material at all": (SPHERE, 'sphere[0].material: there is no material "red"; write a table [material.red]'),
    "colour out of range": (
        "[material.red]\nalbedo = [0, 1.5, 0]",
        "material.red.albedo[1]: must be at most 1, got 1.5",
    ),
    "grey out of range": ("[material.red]\nalbedo = 1.5", "material.red.albedo: must be at most 1, got 1.5"),
    "colour by name": (
        '[material.red]\nalbedo = "red"',
        'material.red.albedo: must be a number or three numbers [r, g, b], got "red"',
    ),
    "unknown metal": (
        '[material.m]\nmetal = "gould"',
        "material.m.metal: 'gould' is not known; choose from aluminium,",
    ),
    "unknown dielectric": (
        '[material.m]\nf0 = "watr"',
        'material.m.f0: must be a number, three numbers [r, g, b] or one of "water", "plastic"',
    ),
    "ior and f0": (
        "[material.m]\nf0 = 0.1\nior = 1.5",
        "material.m: ior and f0 both say how much is reflected; give one",
    ),
    "metal and albedo": (
        '[material.m]\nmetal = "gold"\nalbedo = 0.3',
        "material.m: metal = 'gold' already says what albedo is; leave albedo out",
    ),
    "a key of other programs": (
        "[material.m]\nBaseColor = 1",
        "material.m.BaseColor: there is no such key; did you mean albedo? choose from albedo, ",
    ),
    "a key that is a model": (
        "[material.m]\ntransmission = 1",
        'material.m.transmission: there is no such key; did you mean model = "dielectric"? choose from model, ',
    ),
    "a model of other programs": (
        '[material.m]\nmodel = "glass"',
        'material.m.model: must be one of "metallic-roughness", "eon", "dielectric", "thin-dielectric", '
        '"rough-thin-dielectric", "null", "conductor", "plastic", "rough-plastic", got "glass"; '
        'did you mean "dielectric"?',
    ),
    "thick coat": ("[material.m]\ncoat = 2", "material.m.coat: must be at most 1, got 2"),
    "coat of a thin index": ("[material.m]\ncoat_ior = 0.9", "material.m.coat_ior: must be at least 1, got 0.9"),
    "coat of a plastic": (
        '[material.m]\nmodel = "plastic"\ncoat = 0.5',
        "material.m: coat means nothing to model = 'plastic'; leave it out; its keys are albedo, ior, nonlinear (model",
    ),
    "bright sheen": ("[material.m]\nsheen_color = 1.5", "material.m.sheen_color: must be at most 1, got 1.5"),
    "rough sheen": ("[material.m]\nsheen_roughness = -1", "material.m.sheen_roughness: must be at least 0, got -1"),
    "thick film": (
        "[material.m]\niridescence_thickness = 2e6",
        "material.m.iridescence_thickness: must be at most 1000000",
    ),
    "film of nothing": (
        "[material.m]\niridescence_ior = 0.5",
        "material.m.iridescence_ior: must be at least 1, got 0.5",
    ),
    "film on clay": (
        '[material.m]\nmodel = "eon"\niridescence = 0.5',
        "material.m: iridescence means nothing to model = 'eon'; leave it out; its keys are albedo, roughness (model",
    ),
    "sheen of clay": (
        '[material.m]\nmodel = "eon"\nsheen_color = 0.5',
        "material.m: sheen_color means nothing to model = 'eon'; leave it out; its keys are albedo, roughness (model",
    ),
    "more transmission than there is": (
        "[material.m]\ndiffuse_transmission = 1.5",
        "material.m.diffuse_transmission: must be at most 1, got 1.5",
    ),
    "transmission of clay": (
        '[material.m]\nmodel = "eon"\ndiffuse_transmission = 0.5',
        "material.m: diffuse_transmission means nothing to model = 'eon'; leave it out; its keys are albedo, roughness",
    ),
    **{
        f"transmission and {key}": (
            f"[material.m]\ndiffuse_transmission = 0.5\n{key} = {value}",
            f"material.m: diffuse_transmission is not possible together with {named}; leave one of them out",
        )
        for key, value, named in (
            ("coat", "0.5", "coat"),
            ("sheen_color", "0.5", "sheen_color"),
            ("iridescence", "0.5", "iridescence"),
            ("unlit", "true", "unlit"),
            ("diffuse_factor", '"half-vector"', 'diffuse_factor = "half-vector"'),
        )
    },
    "quoted name": ('[material."a b"]\nior = 0', 'material."a b".ior: must be at least 1, got 0'),
    "material without a name": (
        "[material]\nalbedo = 1",
        "material.albedo: a material is a table with a name, written [m",
    ),
    "array of materials": (
        "[[material]]\nalbedo = 1",
        "material: must be a table, written [material.NAME], got an array",
    ),
    "two lights in one": (
        "[[light]]\nposition = [0, 1, 0]\npower = 1\nradiance = 2",
        "light[0]: give either power (watts) or radiance (W/m²/sr), and only one of them (power = 1, radiance = 2)",
    ),
    "a light without light": ("[[light]]\nposition = [0, 1, 0]", "light[0]: give either power (watts) or radiance"),
    "radiance of a point": (
        "[[light]]\nposition = [0, 1, 0]\nradiance = 2",
        "light[0]: a light of radius 0 has no surface to have a radiance; give its power instead (radiance = 2)",
    ),
    "negative power": ("[[light]]\nposition = [0, 1, 0]\npower = -2", "light[0].power: must be at least 0, got -2"),
    "spot light by power": (
        SPOT_LIGHT.replace("intensity", "power"),
        "spot_light[0].power: there is no such key; choose from",
    ),
    "spot light without intensity": (
        SPOT_LIGHT.replace("intensity = 2", ""),
        "spot_light[0].intensity: is missing; give a number or three numbers [r, g, b]",
    ),
    "spot light without direction": (
        SPOT_LIGHT.replace("-1", "0"),
        "spot_light[0].direction: must not have length zero, got [0, 0, 0]; [0, -1, 0] points down",
    ),
    "cone inside out": (
        SPOT_LIGHT + "inner_degrees = 40\nouter_degrees = 30",
        "spot_light[0].inner_degrees: must be less than outer_degrees, 30, got 40",
    ),
    "inner cone beyond the default": (
        SPOT_LIGHT + "inner_degrees = 50",
        "spot_light[0].inner_degrees: must be less than outer_degrees, 45, got 50",
    ),
    "narrow cone": (
        SPOT_LIGHT + "outer_degrees = 0.0005",
        "spot_light[0].outer_degrees: must be at least 0.001, got 0.0005",
    ),
    "radius without a radiance": (
        "[[light]]\nposition = [0, 1, 0]\npower = 2\nradius = 1e-170",
        "light[0]: the radius is so small that the radiance is no float32; radius 0 is a point light",
    ),
    "wide cone": (SPOT_LIGHT + "outer_degrees = 120", "spot_light[0].outer_degrees: must be at most 90, got 120"),
    "negative irradiance": (
        "[[directional_light]]\ndirection = [0, -1, 0]\nirradiance = [1, -1, 1]",
        "directional_light[0].irradiance[1]: must be at least 0, got -1",
    ),
    "directional light without direction": (
        "[[directional_light]]\ndirection = [0, 0, 0]\nirradiance = 1",
        "directional_light[0].direction: must not have length zero, got [0, 0, 0]; [0, -1, 0] points down",
    ),
    "positioned directional light": (
        "[[directional_light]]\nposition = [0, 9, 0]\ndirection = [0, -1, 0]\nirradiance = 1",
        "directional_light[0].position: there is no such key; choose from",
    ),
    "disk without normal": (
        DISK.replace("[0, 1, 0]", "[0, 0, 0]") + RED,
        "disk[0].normal: must not have length zero, got [0, 0, 0]; [0, 1, 0] faces up",
    ),
    "disk without radius": (
        DISK.replace("radius = 1\n", "") + RED,
        "disk[0].radius: is missing; give a number",
    ),
    "negative disk": (
        DISK.replace("radius = 1", "radius = -1") + RED,
        "disk[0].radius: must be greater than 0, got -1",
    ),
    "disk of no material": (DISK, 'disk[0].material: there is no material "red"; write a table [material.red]'),
    "one spot light": (
        "[spot_light]\nintensity = 1",
        "spot_light: must be an array of tables, each opened by [[spot_light]], got a table",
    ),
    "disc": ("[[disc]]", "disc: there is no such key; did you mean disk? choose from disk, "),
    "spotlight": ("[[spotlight]]", "spotlight: there is no such key; did you mean spot_light? choose from spot_light"),
    "zero normal": (
        '[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 0]\nmaterial = "red"' + RED,
        "plane[0].normal: must not have length zero, got [0, 0, 0]; [0, 1, 0] is a floor",
    ),
    "emissive plane": (
        '[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = "red"' + RED + "emission = 1",
        "plane[0].material: an infinite plane cannot emit light; use a rectangle",
    ),
    "slanted rectangle": (
        '[[rectangle]]\ncorner = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [1, 1, 0]\nmaterial = "red"' + RED,
        "rectangle[0]: edge_u and edge_v must be perpendicular; use two triangles",
    ),
    "short triangle": (
        '[[triangle]]\nvertices = [[0, 0, 0], [1, 0], [0, 1, 0]]\nmaterial = "red"' + RED,
        "triangle[0].vertices[1]: must be three numbers [x, y, z], got [1, 0]",
    ),
    "two vertices": (
        '[[triangle]]\nvertices = [[0, 0, 0], [1, 0, 0]]\nmaterial = "red"' + RED,
        "triangle[0].vertices: must be three points [[x, y, z], [x, y, z], [x, y, z]], got [[0, 0, 0], [1, 0, 0]]",
    ),
    "flat triangle": (
        '[[triangle]]\nvertices = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]\nmaterial = "red"' + RED,
        "triangle[0]: the three vertices lie on a line",
    ),
    "camera along up": (
        "[camera]\nposition = [0, 1, 0]\ntarget = [0, 0, 0]",
        "camera: the camera looks along its up vector; choose an up across the view, as [0, 0, 1]",
    ),
    "camera that looks nowhere": (
        "[camera]\nposition = [1, 2, 3]\ntarget = [1, 2, 3]",
        "camera: position and target are the same point; the camera must look somewhere (position = [1, 2, 3], target",
    ),
    "camera without up": ("[camera]\nup = [0, 0, 0]", "camera.up: must not have length zero, got [0, 0, 0]; [0, 1, 0]"),
    "wide camera": ("[camera]\nfov_degrees = 180", "camera.fov_degrees: must be less than 180, got 180"),
    "choice": (
        '[render]\ngeometry = "smiht"',
        'render.geometry: must be one of "smith", "smith-height-correlated", "schlick-beckmann", "karis", got "smiht"',
    ),
    "fraction of a bounce": ("[render]\nbounces = 1.5", "render.bounces: must be a whole number, got 1.5"),
    "one for true": ("[render]\nrussian_roulette = 1", "render.russian_roulette: must be true or false, got 1"),
    "large seed": ("[render]\nseed = 4294967296", "render.seed: must be less than 4294967296, got 4294967296"),
    "date": (
        "[ambient]\nradiance = 1979-05-27",
        "ambient.radiance: must be a number or three numbers [r, g, b], got 1979",
    ),
    "huge integer": (
        "[ambient]\nradiance = 1" + 400 * "0",
        'not a TOML file: integer number overflowed at line 2 column 12: "radiance = 1000',
    ),
    "huge hexadecimal": ("[render]\nspp = 0x" + 5000 * "f", "not a TOML file: integer number overflowed at line 2 col"),
    "huge float": ("[[light]]\nposition = [0, 1e39, 0]\npower = 1", "light[0].position[1]: must be at most 3.4e+38"),
    "unknown key": (
        "[camera]\npositon = [0, 0, 0]",
        "camera.positon: there is no such key; did you mean position? choose",
    ),
    "start of a key": (
        "[camera]\nfov = 30",
        "camera.fov: there is no such key; did you mean fov_degrees? choose from fov_d",
    ),
    "unknown section": ("[[spheres]]", "spheres: there is no such key; did you mean sphere? choose from sphere, "),
    "number for tables": ("sphere = 3", "sphere: must be an array of tables, each opened by [[sphere]], got 3"),
    "numbers for tables": ("sphere = [3]", "sphere[0]: must be a table, with a line for each of its keys, got 3"),
    "one table for many": (
        "[sphere]\nradius = 1",
        "sphere: must be an array of tables, each opened by [[sphere]], got a tab",
    ),
    "many tables for one": ("[[camera]]", "camera: must be a table, written [camera], got an array of tables"),
    "number for a table": ("render = 3", "render: must be a table, written [render], got 3"),
    "description": ("description = 3", "description: must be a text in quotes, got 3"),
    "empty": ("", "there is nothing to see: add a shape, a light, an environment or an ambient radiance"),
    "dark": ("[camera]\n[ambient]\nradiance = 0\n[material.red]", "there is nothing to see"),
    "syntax": (
        "[camera]\nup = [0,\n  0 1]",
        'not a TOML file: string values must be quoted, expected literal string at line 3 column 3: "0 1]"',
    ),
    "half a line": ("radius", 'not a TOML file: key with no value, expected `=` at line 1 column 7: "radius"'),
    "key given twice": ("[camera]\n[camera]", 'not a TOML file: duplicate key at line 2 column 2: "[camera]"'),
    "deep": ("x = " + 2000 * "[", "not a TOML file: cannot recurse further"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(name: str) -> None:
    text, expected = MISTAKES[name]
    assert f"scenes/x.toml: {expected}" in message_of(text)


def test_all_mistakes_are_listed_in_the_order_of_the_file() -> None:
    message = message_of(
        '[camera]\nfov_degrees = 0\nsize = 3\n[render]\nspp = 0\n[[sphere]]\ncenter = 3\nradius = -1\nmaterial = "red"'
    )
    paths = [line.split(": ")[1] for line in message.splitlines()]
    assert paths == [
        "camera.size",
        "camera.fov_degrees",
        "render.spp",
        "sphere[0].center",
        "sphere[0].radius",
        "sphere[0].material",
    ]


def test_a_long_list_of_mistakes_is_cut() -> None:
    lines = message_of(SPHERE.replace("radius = 1", "radius = -1") * 15 + RED).splitlines()
    assert len(lines) == 11
    assert lines[-1] == "scenes/x.toml: … and 5 more mistakes"


def test_long_values_are_cut() -> None:
    assert len(message_of(f'[camera]\nfov_degrees = "{1000 * "x"}"')) < 150


def test_a_broken_material_is_not_missing() -> None:
    assert message_of(SPHERE + "[material.red]\nroughness = 2").count("\n") == 0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("three-sphere", "three-sphere: no such file or bundled scene; did you mean three-spheres? choose from three-"),
        ("cornell.toml", "cornell.toml: no such file or bundled scene; did you mean cornell-box? choose from cornell-"),
        ("none/x.toml", "none/x.toml: no such file or bundled scene; choose from "),
        ("file/x.toml", "file/x.toml: no such file"),
        ("folder.toml", "folder.toml: cannot read: Is a directory"),
        ("binary.toml", "binary.toml: not UTF-8 text at byte 4; save the file as UTF-8"),
        ("file", "file: a scene file ends in .toml or .xml, which are Mitsuba's, a model in .obj, .ply"),
        (300 * "x", "cannot read: File name too long"),
        ("a\0.toml", "cannot read: embedded null byte"),
    ],
)
def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, message: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "binary.toml").write_bytes(b"a = \xff\xfe")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError) as raised:
        load(name)
    assert message in str(raised.value)


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(SceneError, match=r"x\.toml: cannot read: Permission denied"):
        load(tmp_path / "x.toml")
