# SPDX-License-Identifier: MIT
"""gpu/specialise.py: constants in the place of uniforms, loops and records, line by line."""

import re
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from rendering import drawn, rendered
from scene_builders import lambert, stare

from fragtracer.errors import ShaderError
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import Level, Specialisation, specialise
from fragtracer.io.toml import bundled, load
from fragtracer.packing import PackedScene, pack
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.scene import PLAIN, Ambient, Camera, Disk, Light, Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.shader_composer import compose

SHADERS = folder("shaders")
RARE = ("u_has_sphere_grid", "u_has_globes", "u_has_panes", "u_without_iridescence")
CONSTANTS: dict[str, tuple[str, Any]] = {
    "u_int": ("int", -3),
    "u_large": ("int", 2**31 - 1),
    "u_uint": ("uint", 2**32 - 1),
    "u_float": ("float", 0.1),
    "u_whole": ("float", 2),
    "u_tiny": ("float", 1e-30),
    "u_vec2": ("vec2", (0.25, 1 / 3)),
    "u_vec3": ("vec3", (1.0, -2.0, 3e5)),
    "u_vec4": ("vec4", [1, 2, 3, 4]),
    "u_mat4": ("mat4", tuple(i / 7 for i in range(16))),
}


def test_constants_take_the_place_of_uniforms(ctx: moderngl.Context) -> None:
    """With the values that the uniforms would have had, in every type; the others stay uniforms."""
    declared = "".join(f"uniform {kind} {name};  // of the scene\n" for name, (kind, _) in CONSTANTS.items())
    declared += "".join(f"uniform {kind} twin_{name[2:]};\n" for name, (kind, _) in CONSTANTS.items())
    checks = "".join(f"    if ({name} == twin_{name[2:]}) count += 1.0;\n" for name in CONSTANTS)
    main = f"void main() {{\n    float count = 0.0;\n{checks}    out_count = vec4(count);\n}}\n"
    text = f"{declared}out vec4 out_count;\n{main}"
    values = {name: value for name, (_, value) in CONSTANTS.items()}
    generated, text_pass = {"main.frag": text}, Specialisation(values).apply
    program = FullscreenProgram(ctx, SHADERS, "main.frag", generated=generated, text_pass=text_pass)
    program.set({f"twin_{name[2:]}": tuple(v) if isinstance(v, list) else v for name, v in values.items()})
    program.set({"u_float": 1.0})  # a tracer sets all that the source declares: it changes nothing now
    with pytest.raises(ShaderError, match="no uniform u_flaot"):
        program.set({"u_flaot": 1.0})
    count = drawn(ctx, program)[0]
    program.release()
    assert count == len(CONSTANTS)


def test_only_the_named_uniforms_are_frozen() -> None:
    text = "uniform highp float u_a;  // said\nuniform float u_b;\nfloat u_a_local = 1.0;\nuniform uint u_c;"
    assert Specialisation({"u_a": 0.5, "u_c": 2**31}).apply(text).splitlines() == [
        "const float u_a = float(0.5);  // said",
        "uniform float u_b;",
        "float u_a_local = 1.0;",
        "const uint u_c = uint(2147483648u);",
    ]


def packed_as(scene: Scene, most_listed: int = 64) -> PackedScene:
    return pack(scene, scene.render, 64, 48, most_listed)


@pytest.mark.parametrize("name", bundled())
def test_lines_stay_where_they_are(name: str) -> None:
    """A driver's line numbers are those of the files, whatever is compiled in."""
    packed = packed_as(load(name))
    text = compose("pathtracer.frag", {}, SHADERS).text
    for level in Level:
        changed = specialise(packed, level).apply(text)
        assert len(changed.splitlines()) == len(text.splitlines()), level
    little = specialise(packed, Level.NOTHING).apply(text)
    pairs = zip(little.splitlines(), text.splitlines(), strict=True)
    assert [line for line, before in pairs if line != before] == [
        f"const int {name} = int({packed.flags[name]});{comment}"
        for name, comment in re.findall(rf"^uniform int ({'|'.join(RARE)});(.*)$", text, re.MULTILINE)
    ]


def test_every_place_that_it_looks_for_is_there() -> None:
    """The pass knows shader files by their text: each loop of the short list, each load of records, and shape_texel."""
    scene = load("three-spheres")
    text = compose("pathtracer.frag", {"HAS_SPOT_LIGHT": 1}, SHADERS).text
    packed = packed_as(replace(scene, lights=(*scene.lights, Light((0.0, 9.0, 0.0), power=1.0))))
    changed = specialise(packed, Level.VIEW).apply(text)
    assert len(re.findall(r"\bfor \(int i = 0; i < u_\w+_count; i\+\+\) hit_\w+\(", text)) == 3
    assert not re.search(r"\bfor \(int i = 0; i < u_\w+_count; i\+\+\) hit_\w+\(", changed)
    assert changed.count("hit_sphere(hit, ray, sphere_of(") == len(scene.spheres) + 1  # and the lamp
    assert changed.count("hit_plane(hit, ray, plane_of(") == len(scene.planes)
    for noun in ("material", "light_choice", "point_light"):
        loader = re.compile(rf"_load\(int index\) \{{\n(?:    .*\n)?    return {noun}_of\((.*)\);\n")
        assert "scene_texel" in loader.search(text)[1]
        assert "scene_texel" not in loader.search(changed)[1]
    assert "texel_read(u_shapes" in text
    assert "texel_read(u_shapes" not in changed
    assert "texel_read(u_shapes" in specialise(packed_as(scene, 0), Level.VIEW).apply(text)  # with a BVH


def crowd(count: int) -> Scene:
    """Spheres, rectangles, disks and triangles around and near the camera, ``count`` of each kind of record, of sizes
    from a hundredth to three metres."""
    rng = np.random.default_rng(3)
    places, sizes = rng.uniform(-4, 4, (2 * count, 3)), 10 ** rng.uniform(-2, 0.5, 2 * count)
    materials = {name: lambert(albedo) for name, albedo in (("dark", 0.2), ("light", 0.8))}
    names = rng.choice(list(materials), 2 * count)
    flats = [(p, s * random_frame(rng), name) for p, s, name in zip(places[count:], sizes[count:], names, strict=False)]
    return Scene(
        Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), fov_degrees=60.0),
        materials,
        spheres=[Sphere(tuple(p), s / 2, name) for p, s, name in zip(places[:count], sizes, names, strict=False)],
        rectangles=[Rectangle(tuple(p), tuple(m[0]), tuple(m[1]), name) for p, m, name in flats[::3]],
        disks=[Disk(tuple(p), tuple(m[2]), float(np.linalg.norm(m[0])), name) for p, m, name in flats[1::3]],
        triangles=[Triangle((tuple(p), tuple(p + m[0]), tuple(p + m[1])), name) for p, m, name in flats[2::3]],
        ambient=Ambient((1.0, 0.9, 0.8)),
        lights=[Light((0.0, 9.0, 0.0), power=1000.0)],
    )


def random_frame(rng: np.random.Generator) -> np.ndarray:
    """Three orthogonal unit vectors, the rows."""
    return np.linalg.qr(rng.normal(size=(3, 3)))[0].T


def test_long_lists_stand_in_a_tree_of_balls(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each shape once, and what the balls leave out no ray meets: the picture has the same bits."""
    scene = crowd(30)
    specialisation = specialise(packed_as(scene), Level.VIEW, skips_branches=True)
    text = specialisation.apply(compose("pathtracer.frag", {}, SHADERS).text)
    calls = re.findall(r"\{ hit_(?:sphere|flat)\(hit, ray, .*?\)\), (\d+), ignored\);", text)
    assert sorted(map(int, calls)) == list(range(60))
    assert text.count("if (ray_meets_ball(ray, ") > 60
    pictures = []
    for skips in (False, True):
        monkeypatch.setattr("fragtracer.gpu.tracer.skips_branches", lambda _, skips=skips: skips)
        with Renderer(scene, (64, 48), ctx, bounces=3, **PLAIN) as renderer:
            renderer.sample(16)
            pictures.append(renderer.image())
    assert pictures[0].std() > 0.1
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("count", [1, 3])
def test_the_root_of_the_bvh_is_compiled_in(count: int) -> None:
    """If it is a node: the BVH of a single shape has none."""
    ball = Sphere((0.0, 0.0, 0.0), 1.0, "ball")
    spheres = [replace(ball, center=(3.0 * i, 0.0, 0.0)) for i in range(count)]
    scene = Scene(Camera(), {"ball": lambert(0.5)}, spheres=spheres, lights=[Light((0.0, 3.0, 0.0), power=1.0)])
    text = specialise(packed_as(scene, 0), Level.SCENE).apply(compose("pathtracer.frag", {}, SHADERS).text)
    assert ("    return bvh_root_of(shape_texel(" in text) == (count == 1)
    assert ("    return bvh_root_of((uvec4(" in text) == (count == 3)


def test_levels_hold_more_and_more() -> None:
    packed = packed_as(load("three-spheres"))
    names = [set(specialise(packed, level).constants) for level in Level]
    assert names[0] == set(RARE)
    assert names[1] == set(packed.flags)
    assert names[2] == {*packed.flags, *packed.uniforms} - {"u_seed"}
    assert names[3] == {*packed.all_uniforms} - {"u_seed"}
    assert "u_bounces" not in specialise(packed, Level.VIEW, ["u_bounces"]).constants
    assert names[3] - set(specialise(packed, Level.VIEW, ["u_bounces"]).constants) == {"u_bounces"}


def test_equal_scenes_share_a_program_and_others_do_not() -> None:
    """By values, not by identity: an edit that is taken back finds its program again."""
    ball = Sphere((0.0, 0.0, 0.0), 1.0, "ball")
    scene = Scene(Camera(), {"ball": lambert(0.5)}, spheres=[ball], lights=[Light((0.0, 3.0, 0.0), power=1.0)])
    edits = {
        "again": scene,
        "place": replace(scene, spheres=[replace(ball, center=(0.1, 0.0, 0.0))]),
        "colour": replace(scene, materials={"ball": lambert(0.6)}),
        "light": replace(scene, lights=[Light((0.0, 3.0, 0.0), power=2.0)]),
        "camera": replace(scene, camera=Camera((0.0, 0.1, 4.0))),
    }
    keys = {
        level: {name: specialise(packed_as(s), level).key for name, s in edits.items()}
        for level in (Level.SCENE, Level.VIEW, Level.KINDS)
    }
    first = {level: specialise(packed_as(scene), level).key for level in keys}
    same = {level: {name for name in edits if keys[level][name] == first[level]} for level in keys}
    assert same[Level.VIEW] == {"again"}
    assert same[Level.KINDS] == set(edits)
    assert "again" in same[Level.SCENE]
    assert not {"colour", "light", "place"} & same[Level.SCENE]
    seeded = pack(scene, replace(scene.render, seed=7), 64, 48, 64)
    assert specialise(seeded, Level.VIEW).key == first[Level.VIEW]
    assert np.isfinite(hash(first[Level.VIEW]))


def test_numbers_beside_minus_one_are_kept(ctx: moderngl.Context) -> None:
    """The number 0 of a material, in the record of a sphere, where that of a rectangle has a coordinate of -1."""
    materials = {"first": lambert(0.5), "second": lambert(0.0, 1.0)}
    wall = Rectangle((-1.0, -1.0, -0.5), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "second")
    view = stare((0.0, 0.0, 0.0), (0.0, 0.0, 3.0))
    scene = Scene(view, materials, rectangles=[wall], ambient=Ambient(1.0))
    ball, floor = Sphere((0.0, 0.0, 0.0), 0.7, "first"), Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), "first")
    for kind in ({"spheres": [ball]}, {"planes": [floor]}):
        np.testing.assert_allclose(rendered(ctx, replace(scene, **kind), 64, (8, 8), bounces=1), 0.5, rtol=0.2)
