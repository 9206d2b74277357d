# SPDX-License-Identifier: MIT
"""shader_composer.py: includes, defines, constants, and the way back from a driver's line numbers."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.errors import ShaderError
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.resources import folder
from fragtracer.shader_composer import ShaderSource, compose

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


@pytest.mark.parametrize("program", ["pathtracer.frag", "display/display.frag", "fullscreen.vert"])
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
