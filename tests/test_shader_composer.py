# SPDX-License-Identifier: MIT
"""shader_composer.py: includes, defines, constants, the way back from a driver's line numbers, and that
every program it makes is valid in both languages."""

import functools
import itertools
import random
import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer import shader_composer as composer
from fragtracer.errors import ShaderError
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.packing import PackedScene, pack
from fragtracer.packing import meshes as mesh_packing
from fragtracer.resources import folder
from fragtracer.scene import (
    Ambient,
    Camera,
    Environment,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
    Texture,
    Triangle,
)
from fragtracer.scene_file import load
from fragtracer.shader_composer import LANGUAGES, ShaderSource, compose

SHADERS = folder("shaders")


def composed(root: Path, files: Mapping[str, str], **options: Any) -> ShaderSource:
    """The program ``main.glsl`` of ``files``, written to ``root``."""
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return compose("main.glsl", options.pop("defines", {}), root, **options)


def test_each_file_is_included_once(tmp_path: Path) -> None:
    files = {
        "main.glsl": '#include "a.glsl"\n#include "deep/b.glsl"  // again by way of a\nmain line',
        "a.glsl": 'line of a\n  # include "deep/b.glsl"\nline after b',
        "deep/b.glsl": "line of b",
    }
    text = composed(tmp_path, files).text
    assert text.splitlines()[-4:] == ["line of a", "line of b", "line after b", "main line"]
    assert text.count("line of b") == 1


def test_generated_text_is_included(tmp_path: Path) -> None:
    """And takes the place of a file."""
    files = {"main.glsl": '#include "made.glsl"', "made.glsl": "from the file"}
    source = composed(tmp_path, files, generated={"made.glsl": "first\nsecond"})
    assert source.text.splitlines()[-2:] == ["first", "second"]
    assert source.lines[-2:] == ("made.glsl:1", "made.glsl:2")


@pytest.mark.parametrize(
    ("files", "cycle"),
    [
        ({"main.glsl": '#include "main.glsl"'}, "main.glsl -> main.glsl"),
        (
            {"main.glsl": '#include "a.glsl"', "a.glsl": '\n#include "b.glsl"', "b.glsl": '#include "a.glsl"'},
            "a.glsl -> b.glsl -> a.glsl",
        ),
        (
            {"main.glsl": '#include "a.glsl"', "a.glsl": '#include "b.glsl"', "b.glsl": '#include "main.glsl"'},
            "main.glsl -> a.glsl -> b.glsl -> main.glsl",
        ),
    ],
)
def test_cycle_is_named_in_full(tmp_path: Path, files: dict[str, str], cycle: str) -> None:
    with pytest.raises(ShaderError, match=f": {re.escape(cycle)}$"):
        composed(tmp_path, files)


def test_missing_include_names_who_wants_it(tmp_path: Path) -> None:
    files = {"main.glsl": '#include "a.glsl"', "a.glsl": '#include "nowhere.glsl"'}
    with pytest.raises(ShaderError, match=r"nowhere\.glsl \(included from a\.glsl\)"):
        composed(tmp_path, files)
    with pytest.raises(ShaderError, match=r"absent\.glsl: "):
        compose("absent.glsl", {}, tmp_path)


def test_unknown_define_is_refused(tmp_path: Path) -> None:
    """Where it is set, before any file is read."""
    with pytest.raises(ShaderError, match="unknown shader define HAS_LENSE"):
        composed(tmp_path, {"main.glsl": ""}, defines={"HAS_LENS": 1, "HAS_LENSE": 1})


@pytest.mark.parametrize(
    "line", ["#if HAS_LENSE", "#ifdef HAS_LENSE", "  #  elif 1 && HAS_LENSE == 2", "#ifndef HAS_LENSE"]
)
def test_unknown_define_in_a_condition_is_refused(tmp_path: Path, line: str) -> None:
    files = {"main.glsl": '#include "a.glsl"', "a.glsl": f"\n{line}\n#endif"}
    with pytest.raises(ShaderError, match=r"^a\.glsl:2: unknown define HAS_LENSE in a condition"):
        composed(tmp_path, files)


def test_known_defines_have_values(tmp_path: Path) -> None:
    """Those given, and the defaults of the others; comments and defined() may stand in a condition."""
    body = "#if defined(HAS_LENS) && !HAS_AMBIENT  // unless NOBODY_KNOWS\n#endif"
    text = composed(tmp_path, {"main.glsl": body}, defines={"LIGHT_COUNT": 7}).text
    assert "#define LIGHT_COUNT 7\n" in text
    assert "#define HAS_AMBIENT 0\n" in text
    assert text.startswith("#version 330 core\n")


# A driver's answer to an error in the third line of the second file, in the words of each.
LOGS = {
    "Mesa": "0:{0}(11): error: `x' undeclared\n0:{0}(2): warning: `y' used uninitialized",
    "NVIDIA": '0({0}) : error C1503: undefined variable "x"\n0({0}) : warning C7050: "y" might be used',
    "Apple, ANGLE": "ERROR: 0:{0}: 'x' : undeclared identifier\nWARNING: 0:{0}: 'y' : no default precision",
}


@pytest.mark.parametrize("driver", LOGS)
def test_line_numbers_of_drivers(tmp_path: Path, driver: str) -> None:
    files = {"main.glsl": 'void main() {\n#include "inner.glsl"\n}', "inner.glsl": "// one\n\nwrong;\n"}
    source = composed(tmp_path, files)
    number = source.text.splitlines().index("wrong;") + 1
    log = LOGS[driver].format(number)
    translated = source.translate(log).splitlines()
    for before, after in zip(log.splitlines(), translated, strict=True):
        assert "inner.glsl:3" in after
        assert after.endswith(re.split(r"\d\)?\s?: ", before)[-1])
        assert str(number) not in after
    header = source.translate(LOGS[driver].format(1))
    assert header.count("(header):1") == 2


def test_lines_that_are_no_places_stay(tmp_path: Path) -> None:
    source = composed(tmp_path, {"main.glsl": "a"})
    log = "GLSL Compiler failed\nfragment_shader\n0:99999(1): error: beyond the end\nat 12:30 it was 0(3)"
    assert source.translate(log) == log


def test_error_of_this_driver_has_its_place(ctx: moderngl.Context) -> None:
    generated = {
        "main.frag": 'out vec4 color;\n#include "inner.glsl"\nvoid main() { color = vec4(inner()); }',
        "inner.glsl": "// A function.\n\nfloat inner() {\n    return nonsense;\n}",
    }
    with pytest.raises(ShaderError, match=r"the driver rejects main\.frag:[\s\S]*inner\.glsl:4\b.*nonsense"):
        FullscreenProgram(ctx, SHADERS, "main.frag", generated=generated)


@pytest.mark.parametrize("program", ["pathtracer.frag", "display.frag", "fullscreen.vert"])
def test_every_line_has_its_place(program: str) -> None:
    layout = {"generated/scene_layout.glsl": "// made\n// up"}
    source = compose(program, {}, SHADERS, layout)
    lines = source.text.splitlines()
    assert len(lines) == len(source.lines)
    files = {path.relative_to(SHADERS).as_posix(): path.read_text() for path in SHADERS.rglob("*.*")} | layout
    texts = {name: text.splitlines() for name, text in files.items()}
    for line, place in zip(lines, source.lines, strict=True):
        name, number = place.split(":")
        if name != "(header)":
            assert texts[name][int(number) - 1] == line


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
    program = FullscreenProgram(ctx, SHADERS, "main.frag", generated={"main.frag": text}, constants=values)
    with pytest.raises(ShaderError, match="no uniform u_float"):
        program.set({"u_float": 1.0})
    program.set({f"twin_{name[2:]}": tuple(v) if isinstance(v, list) else v for name, v in values.items()})
    outside = ctx.detect_framebuffer()
    target = ctx.texture((1, 1), 4, dtype="f4")
    framebuffer = ctx.framebuffer([target])
    framebuffer.use()
    program.draw()
    count = np.frombuffer(target.read(), np.float32)[0]
    outside.use()
    for resource in (framebuffer, target, program):
        resource.release()
    assert count == len(CONSTANTS)


def test_only_the_named_uniforms_are_frozen(tmp_path: Path) -> None:
    text = "uniform highp float u_a;  // said\nuniform float u_b;\nfloat u_a_local = 1.0;\nuniform uint u_c;"
    lines = composed(tmp_path, {"main.glsl": text}, constants={"u_a": 0.5, "u_c": 2**31}).text.splitlines()[-4:]
    assert lines == [
        "const float u_a = float(0.5);  // said",
        "uniform float u_b;",
        "float u_a_local = 1.0;",
        "const uint u_c = uint(2147483648u);",
    ]


# --- Every program that scenes ask for is valid in both languages.

MATERIALS = {
    "lambert": Material(specular=0.0),
    "plastic": Material(),
    "smooth plastic": Material(roughness=0.0),
    "metal": Material(metal="gold", roughness=0.4),
    "mirror": Material(metal="silver", roughness=0.0),
    "black": Material(albedo=0.0, specular=0.0),
}
IMAGE = Image(np.zeros((1, 1, 3), np.uint8))
BYTES = Texture(IMAGE)
FLOATS = Texture(Image(np.ones((1, 1, 3), np.float32), "linear"), coordinates=1)
MESH_MATERIALS = {
    "matte": Material(specular=0.0),
    "glowing": Material(emission=1.0),
    "one-sided": Material(double_sided=False),
    "mapped": Material(albedo_texture=Texture(IMAGE)),
    "mapped twice": Material(albedo_texture=Texture(IMAGE), roughness_texture=Texture(IMAGE, coordinates=1)),
    "bumpy": Material(normal_texture=Texture(IMAGE, coordinates=1)),
    "metal and roughness": Material(roughness_texture=BYTES, metallic_texture=BYTES),
    "maps": Material(metallic_texture=BYTES, occlusion_texture=BYTES),
    "picture": Material(albedo_texture=BYTES, normal_texture=FLOATS),
    "screen": Material(emission=1.0, emission_texture=FLOATS),
    "pane": Material(albedo_texture=BYTES, alpha_mode="blend", opacity=0.5),
    "unlit": Material(unlit=True),
}
SHAPES = {
    "spheres": lambda m: Sphere((0.0, 0.0, 0.0), 1.0, m),
    "planes": lambda m: Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0), m),
    "rectangles": lambda m: Rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), m),
    "triangles": lambda m: Triangle(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), m),
}
LIGHTS = [Light((0.0, 3.0, 0.0), power=1.0), Light((0.0, 4.0, 0.0), radius=0.5, power=1.0)]
ATTRIBUTES = {"normals": 3, "uvs": 2, "uvs_1": 2, "tangents": 4, "colors": 4}
CHOICES = {
    "geometry": ["smith", "schlick-beckmann", "karis"],
    "estimator": ["mis", "nee", "bsdf"],
    "sampler": ["texture", "hash"],
    "pixel_filter": ["box", "tent", "gaussian"],
    "integrator": ["path", "path", "split-sum"],
    "background": ["environment", "environment", "prefiltered", "irradiance", "black"],
}
SHOWS = ("display.frag", "display/picture.glsl", "display/tone.glsl")
# What the benchmark and the viewer switch, as no scene does.
SWITCHES = {
    "PATH_REGENERATION": [1, 1, 0],
    "COUNT_WORK": [0, 0, 1],
    "SINGLE_LIGHT_EVALUATION": [0, 0, 1],
    "SPLIT_SUM_STEP": [9, 9, 9, 1, 2, 3, 4, 5, 6, 7, 8],
    "AUXILIARY": [0, 0, 0, 0, 0, 1, 2, 3],
}


ENVIRONMENTS = [None, None, Environment(radiance=1.0), Environment(radiance=1.0, visible=False), Environment(sky=Sky())]


def random_program(rng: random.Random) -> tuple[PackedScene, dict[str, int]]:
    """A scene of a few features out of all there are, packed, and the values of the switches."""
    names = rng.sample(sorted(MATERIALS), rng.choice([1, 1, 2, 6]))
    materials = {name: MATERIALS[name] for name in names}
    kinds = rng.sample(sorted(SHAPES), rng.choice([0, 1, 1, 2, 3, 4]))
    shapes: dict[str, Any] = {
        kind: [SHAPES[kind](rng.choice(names)) for _ in range(rng.choice([1, 3]))] for kind in kinds
    }
    for kind in kinds:
        if kind != "planes" and rng.random() < 0.3:
            materials["lamp"] = Material(emission=1.0)
            shapes[kind].append(SHAPES[kind]("lamp"))
    if "rectangles" in shapes and rng.random() < 0.05:
        shapes["rectangles"] *= 300  # too many for a uniform block
    meshes = []
    if rng.random() < 0.5:
        shared = rng.random() < 0.3
        names = rng.sample(sorted(MESH_MATERIALS), 2)
        materials |= {name: MESH_MATERIALS[name] for name in names}
        attributes = rng.sample(sorted(ATTRIBUTES), rng.choice([0, 1, 2, 5]))
        geometry = Geometry(np.eye(3), [[0, 1, 2]], **{name: np.ones((3, ATTRIBUTES[name])) for name in attributes})
        places = (Placement(), Placement((2.0, 0.0, 0.0)))
        meshes = [Mesh((Part(geometry, name),), places) for name in names]
        mesh_packing.MOST_COPIED = 0 if shared else 10
        mesh_packing.pack_meshes.cache_clear()
    scene = Scene(
        meshes=meshes,
        camera=Camera(aperture_radius=rng.choice([0.0, 0.1])),
        materials=materials,
        lights=rng.sample(LIGHTS, rng.choice([0, 1, 1, 2])),
        ambient=Ambient(rng.choice([0.0, 1.0])),
        environment=rng.choice(ENVIRONMENTS),
        **shapes,
    )
    settings = RenderSettings(**{name: rng.choice(values) for name, values in CHOICES.items()})
    settings = replace(settings, multiple_scattering=settings.geometry == "smith" and rng.random() < 0.5)
    packed = pack(scene, settings, 64, 48, baked=rng.random() < 0.3)
    return packed, {name: rng.choice(values) for name, values in SWITCHES.items()}


def validate(tmp_path: Path, sources: Iterable[str], stage: str = "frag") -> None:
    """All at once: the program takes longer to start than to check."""
    program = shutil.which("glslangValidator")
    if program is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    paths = []
    for i, text in enumerate(sources):
        paths.append(tmp_path / f"{i}.{stage}")
        paths[-1].write_text(text)
    for batch in (paths[i : i + 50] for i in range(0, len(paths), 50)):
        done = subprocess.run([program, *batch], capture_output=True, text=True, check=False)
        wrong = [line for line in done.stdout.splitlines() if "ERROR" in line]
        assert done.returncode == 0, "\n".join(wrong[:20])


def tracer_source(packed: PackedScene, language: str, switches: Mapping[str, int] | None = None) -> str:
    generated = {"generated/scene_layout.glsl": packed.layout}
    defines = {**packed.defines, **(switches or {})}
    return compose("pathtracer.frag", defines, SHADERS, generated, packed.constants, language).text


@functools.cache
def covering_programs(candidates: int) -> list[tuple[PackedScene, dict[str, int]]]:
    """Those of nothing at all, and of random ones those with two features together that none before has."""
    rng = random.Random(1)
    seen: set[Any] = set()
    chosen = [(pack(Scene(), RenderSettings(), 64, 48, baked), {}) for baked in (False, True)]
    for _ in range(candidates):
        packed, switches = random_program(rng)
        # Counts beyond 3 and the number of texels change no code, only numbers in it.
        features = {k: min(v, 3) for k, v in {**packed.defines, **switches}.items() if k != "SCENE_TEXELS"}
        features["baked"] = len(packed.constants) > 0
        pairs = set(itertools.combinations(sorted(features.items()), 2))
        if not pairs <= seen:
            seen |= pairs
            chosen.append((packed, switches))
    return chosen


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_of_all_features_are_valid(tmp_path: Path, language: str) -> None:
    """Every two features that occur together in a thousand random scenes do so in one of these."""
    programs = covering_programs(1000)
    validate(tmp_path, (tracer_source(packed, language, switches) for packed, switches in programs))


@pytest.mark.parametrize("language", LANGUAGES)
def test_programs_of_the_bundled_scenes_are_valid(tmp_path: Path, language: str) -> None:
    scenes = [load(path.stem) for path in sorted(folder("scenes").glob("*.toml"))]
    assert len(scenes) >= 10
    packed = [pack(scene, scene.render, 64, 48, baked) for scene in scenes for baked in (False, True)]
    validate(tmp_path, (tracer_source(p, language) for p in packed))


@pytest.mark.parametrize("language", LANGUAGES)
def test_other_programs_are_valid(tmp_path: Path, language: str) -> None:
    """The one that shows the image, with every value of each of its features, those of maps, the vertex shader."""
    names = features_of(*SHOWS)
    settings = [dict.fromkeys(names, 1)]
    for name in names:
        choices = [v for c, v in composer.CONSTANTS.items() if c.startswith(f"{name.removesuffix('_CURVE')}_")]
        settings += [{name: value} for value in choices or (0, 1)]
    validate(tmp_path, (compose("display.frag", s, SHADERS, language=language).text for s in settings))
    maps = sorted(path.relative_to(SHADERS).as_posix() for path in SHADERS.glob("split_sum/*.frag"))
    assert maps
    validate(tmp_path, [compose(path, {}, SHADERS, language=language).text for path in maps])
    passes = [v for name, v in composer.CONSTANTS.items() if name.startswith("BLOOM_")]  # of any radius
    blooms = [
        {"BLOOM_PASS": kind, "HAS_HELD": flag, "HAS_OTHER": flag, "FILM_FITS": flag}
        for kind in passes
        for flag in (0, 1)
    ]
    validate(tmp_path, (compose("display_bloom.frag", s, SHADERS, language=language).text for s in blooms))
    validate(tmp_path, [compose("display_meter.frag", {}, SHADERS, language=language).text])
    validate(tmp_path, [compose("fullscreen.vert", {}, SHADERS, language=language).text], "vert")


def features_of(*files: str) -> list[str]:
    """The features that the conditions of files ask for."""
    text = "\n".join((SHADERS / name).read_text() for name in files)
    conditions = re.findall(r"^\s*#\s*(?:if|elif)(.*)", text, re.MULTILINE)
    return sorted(set(re.findall(r"\w+", " ".join(conditions))) & set(composer.FEATURES))


def test_every_feature_takes_part() -> None:
    """One that no test program ever changes would be one that nobody compiles."""
    values: dict[str, set[int]] = {name: set() for name in composer.FEATURES}
    for packed, switches in covering_programs(1000):
        for name, value in {**packed.defines, **switches}.items():
            values[name].add(value)
    never = {name for name, found in values.items() if len(found) < 2} - set(features_of(*SHOWS, "display_bloom.frag"))
    assert never == {"BLOOM_RADIUS", "RANDOM_TEXTURE_WIDTH", "RANDOM_TEXTURE_LAYERS", "MESH_STACK"}


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="glslangValidator is not installed")
def test_wrong_programs_are_found_out(tmp_path: Path) -> None:
    """What GLSL ES lacks, what is misspelt, and what only some drivers let pass."""
    for line in ("float x = 1;", "uniform samplerBuffer u_b;", "float x = sine(1.0);", "float x = 1.0f + 1;"):
        with pytest.raises(AssertionError, match="ERROR"):
            validate(tmp_path, [LANGUAGES["300 es"] + f"precision highp float;\n{line}\nvoid main() {{}}"])
