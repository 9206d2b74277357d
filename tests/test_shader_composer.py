# SPDX-License-Identifier: MIT
"""shader_composer.py: includes, features, and the way back from a driver's line numbers."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl
import pytest
from rendering import drawn

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


FEATURES = """
#define CURVE_STRAIGHT 0
#define CURVE_BENT 1  // to the left
#ifndef CURVE
#define CURVE CURVE_STRAIGHT
#endif
#ifndef HAS_LENS
#define HAS_LENS 0  // none by default
#endif
#ifndef FILE_GLSL
#define LENGTH 3.5
#endif
"""


def test_features_are_what_files_declare(tmp_path: Path) -> None:
    """By their defaults, in whatever file; a guard of something else declares none."""
    inner = "  #  ifndef HAS_ROOF  // or else\n# define HAS_ROOF 1\n#endif"
    files = {"main.glsl": '#include "a.glsl"\n#include "b.glsl"', "a.glsl": FEATURES, "b.glsl": inner}
    assert composed(tmp_path, files).features == {"CURVE": "CURVE_STRAIGHT", "HAS_LENS": "0", "HAS_ROOF": "1"}


def test_features_have_the_values_given(tmp_path: Path) -> None:
    """Before the text, so that its defaults give way; numbers, or names of constants."""
    source = composed(tmp_path, {"main.glsl": FEATURES}, defines={"CURVE": "CURVE_BENT", "HAS_LENS": 1})
    lines = source.text.splitlines()
    assert lines[0] == "#version 330 core"
    assert lines.index("#define CURVE CURVE_BENT") < lines.index("#ifndef CURVE")
    assert "#define HAS_LENS 1" in lines
    assert source.features["CURVE"] == "CURVE_STRAIGHT"
    assert not [line for line in composed(tmp_path, {"main.glsl": FEATURES}).text.splitlines()[:6] if "define" in line]


def test_features_have_their_values_for_the_driver(ctx: moderngl.Context) -> None:
    """What is given takes the place of the default, and what is not leaves it."""
    main = (
        "layout(location = 0) out vec4 color;\nvoid main() {{ color = vec4(CURVE == {0}, HAS_LENS == {1}, 0, 0); }}\n"
    )
    for defines, values in (({}, (0, 0)), ({"CURVE": "CURVE_BENT"}, (1, 0)), ({"CURVE": 1, "HAS_LENS": 2}, (1, 2))):
        generated = {"main.frag": FEATURES + main.format(*values)}
        program = FullscreenProgram(ctx, SHADERS, "main.frag", defines, generated)
        assert drawn(ctx, program)[:2] == [1.0, 1.0]
        program.release()


@pytest.mark.parametrize(
    ("defines", "message"),
    [
        ({"HAS_LENS": 1, "HAS_LENSE": 1}, "main.glsl has no feature HAS_LENSE; it has CURVE, HAS_LENS$"),
        ({"CURVE_BENT": 1}, "main.glsl has no feature CURVE_BENT"),
        ({"FILE_GLSL": 1}, "main.glsl has no feature FILE_GLSL"),
        ({"CURVE": "CURVE_BEND"}, "main.glsl declares no CURVE_BEND that CURVE could be"),
        ({"CURVE": "1"}, "main.glsl declares no 1 that CURVE could be"),
    ],
)
def test_a_feature_or_value_that_nobody_declares_is_refused(
    tmp_path: Path, defines: dict[str, int | str], message: str
) -> None:
    with pytest.raises(ShaderError, match=f"^{message}"):
        composed(tmp_path, {"main.glsl": FEATURES}, defines=defines)


def test_a_program_without_features_says_so(tmp_path: Path) -> None:
    with pytest.raises(ShaderError, match=r"^main\.glsl has no feature HAS_LENS; it has none$"):
        composed(tmp_path, {"main.glsl": ""}, defines={"HAS_LENS": 1})


@pytest.mark.parametrize(
    "line",
    ["#if HAS_LENSE", "#ifdef HAS_LENSE", "  #  elif 1 && HAS_LENSE == 2", "#if defined(HAS_LENS) && HAS_LENSE"],
)
def test_unknown_name_in_a_condition_is_refused(tmp_path: Path, line: str) -> None:
    files = {"main.glsl": f'{FEATURES}\n#include "a.glsl"', "a.glsl": f"\n{line}\n#endif"}
    with pytest.raises(ShaderError, match=r"^a\.glsl:2: unknown define HAS_LENSE in a condition"):
        composed(tmp_path, files)


def test_a_name_in_a_condition_before_it_is_defined_is_refused(tmp_path: Path) -> None:
    """It would count as 0 there; where the file that declares it was included before, all is well."""
    condition = "#if HAS_LENS && CURVE != CURVE_BENT  // unless NOBODY_KNOWS\n#endif"
    files = {"main.glsl": '#include "a.glsl"\n#include "b.glsl"', "a.glsl": condition, "b.glsl": FEATURES}
    with pytest.raises(ShaderError, match=r"^a\.glsl:1: unknown define HAS_LENS in a condition; nothing above"):
        composed(tmp_path, files)
    composed(tmp_path, files | {"main.glsl": '#include "b.glsl"\n#include "a.glsl"'})
    composed(tmp_path, files | {"a.glsl": f'#include "b.glsl"\n{condition}'})


def test_path_tracer_has_few_features() -> None:
    """Each one doubles the programs there are; what can be a uniform, or compiled in by specialise.py, is none."""
    features = compose("pathtracer.frag", {}, SHADERS).features
    print(f"{len(features)} features:", *(f"  {name} {value}" for name, value in sorted(features.items())), sep="\n")
    assert len(features) <= 25


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


@pytest.mark.parametrize("name", ["main.frag", "main.vert"])
def test_error_of_this_driver_has_its_place(ctx: moderngl.Context, name: str) -> None:
    result = "gl_Position" if name == "main.vert" else "color"
    generated = {
        "main.frag": "out vec4 color;\n\nvoid main() { color = vec4(0.0); }",
        "main.vert": "\n\n\nvoid main() { gl_Position = vec4(0.0); }",
        "inner.glsl": "// A function.\n\nfloat inner() {\n    return nonsense;\n}",
    }
    generated[name] = f'out vec4 color;\n#include "inner.glsl"\nvoid main() {{ {result} = vec4(inner()); }}'
    with pytest.raises(ShaderError, match=rf"the driver rejects {name}:[\s\S]*inner\.glsl:4\b.*nonsense"):
        FullscreenProgram(ctx, SHADERS, "main.frag", generated=generated, vertex="main.vert")


PROGRAMS = sorted(
    path.relative_to(SHADERS).as_posix() for path in SHADERS.rglob("*") if path.suffix in (".frag", ".vert")
)


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_line_has_its_place(program: str) -> None:
    source = compose(program, {}, SHADERS)
    lines = source.text.splitlines()
    assert len(lines) == len(source.lines)
    files = {path.relative_to(SHADERS).as_posix(): path.read_text() for path in SHADERS.rglob("*.*")}
    texts = {name: text.splitlines() for name, text in files.items()}
    for line, place in zip(lines, source.lines, strict=True):
        name, number = place.split(":")
        if name != "(header)":
            assert texts[name][int(number) - 1] == line
