# SPDX-License-Identifier: MIT
"""gpu/reachable.py: programs without what they do not use."""

from pathlib import Path

import moderngl
import numpy as np
import pytest
from rendering import drawn
from small_pictures import SCENES, picture

from fragtracer.errors import ShaderError
from fragtracer.gpu import program
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.reachable import reachable
from fragtracer.resources import folder

SHADERS = folder("shaders")

FIRST = "#if FEATURE >= A_FEW && !(FEATURE == 4) || defined(NEVER)"
PROGRAM = """\
#version 330 core
#define A_FEW 3
#define FEATURE A_FEW
#define twice(x) doubled(x)
const float unused_constant = 1.0;  // a constant { of no function
#if FEATURE >= A_FEW && !(FEATURE == 4) || defined(NEVER)
float doubled(float x) { return 2.0 * x; }
float overloaded(float x) {
    if (x > 0.0) {  // }
        return helper(x);
    }
    return x;
}
#elif FEATURE == A_FEW
float doubled(float x) { return 3.0 * x; }
#else
#if FEATURE == 3
float doubled(float x) { return 4.0 * x; }
#endif
#endif
#ifdef NEVER
float never() { return 0.0; }
#endif
highp vec4 overloaded(vec4 x,
                      float y) {
    return x;
}
float uncalled(float x) { return called_by_uncalled(x); }
float called_by_uncalled(float x) {
    return x;
}
void main() { out_color = overloaded(vec4(twice(1.0)), 0.0); }
"""


def test_what_main_reaches_is_left() -> None:
    """In conditions that hold, through macros, and each function of a name; lines stay, comments go."""
    lines = reachable(
        PROGRAM.replace("float overloaded", "float helper(float x) { return x; } float overloaded")
    ).split("\n")
    assert len(lines) == PROGRAM.count("\n") + 1
    for number, (before, after) in enumerate(zip(PROGRAM.split("\n"), lines, strict=True)):
        assert after.rstrip() in ("", before.partition("  //")[0]) or "helper" in after, number
    left = "\n".join(lines)
    assert [left.count(f"float {name}(") for name in ("doubled", "overloaded", "never", "uncalled")] == [1, 1, 0, 0]
    assert "2.0 * x" in left
    assert "highp vec4 overloaded(vec4 x,\n" in left
    assert "called_by_uncalled" not in left
    assert "unused_constant" in left
    assert [line for line in lines if line.startswith("#")] == PROGRAM.split("\n")[:4]


@pytest.mark.parametrize(
    "condition",
    [
        "#if __VERSION__ > 300",
        "#if FEATURE % 2 == 1",
        "#if FEATURE / 2 == 1",
        "#ifdef A\n#endif\n#undef FEATURE\n#if 1",
        "#if f(1)",
        "#if !FEATURE == 0",
        "#if 3 > FEATURE > 1",
        "#if FEATURE (3)",
        "#if (FEATURE == 3",
        "#endif\n#if 1",
        "#if 1\n#if 1",
        "#if 1\n#define LOOP for (;;) {",
        "#if 1\n#define TWO_LINES \\\n    1",
        "/* #if 0 */\n#if 1",
        "void open() {\n#if 1",
        "bool endless(int x) { return endless(x); }\nvoid f() { if (endless(1)) return; }\n#define twice f\n#if 1",
    ],
)
def test_what_is_not_understood_is_left_to_the_driver(condition: str) -> None:
    text = PROGRAM.replace(FIRST, condition)
    assert reachable(text) == text


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("FEATURE == 3 && FEATURE != 4", True),
        ("!(FEATURE < 3) && !NONE", True),
        ("NONE || FEATURE <= 2", False),
        ("defined(FEATURE) && defined NONE", True),
        ("(FEATURE > 3 || NONE) && FEATURE", False),
    ],
)
def test_conditions_hold_as_the_driver_says(ctx: moderngl.Context, condition: str, holds: bool) -> None:
    text = f"#define FEATURE 3\n#define NONE 0\nout vec4 color;\n #  if {condition}  // one\n"
    text += "float value() { return 1.0; }\n# else\nfloat value() { return 0.0; }\n#endif\n"
    text += "void main() { color = vec4(value()); }\n"
    assert ("return 1.0" in reachable(text)) == holds
    assert ("return 0.0" in reachable(text)) != holds
    compiled = FullscreenProgram(ctx, SHADERS, "main.frag", generated={"main.frag": text})
    assert drawn(ctx, compiled) == [float(holds)] * 4
    compiled.release()


@pytest.mark.parametrize("name", SCENES)
def test_pictures_have_the_same_bits(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    short = picture(ctx, name, light_tracing="on")
    texts = []
    monkeypatch.setattr(program, "reachable", lambda text: texts.append(text) or text)
    np.testing.assert_array_equal(picture(ctx, name, light_tracing="on"), short)
    of_tracer = max(texts, key=len)
    assert len(reachable(of_tracer)) < 0.7 * len(of_tracer)


def test_errors_name_their_lines(ctx: moderngl.Context, tmp_path: Path) -> None:
    (tmp_path / "main.frag").write_text(
        "out vec4 color;\n\nfloat unused() {\n    return 0.0;\n}\n#if 0\nfloat other();\n#endif\n"
        "float used() { return undeclared; }\nvoid main() { color = vec4(used()); }\n"
    )
    (tmp_path / "fullscreen.vert").write_text((SHADERS / "fullscreen.vert").read_text())
    with pytest.raises(ShaderError, match=r"main\.frag:9\b.*undeclared"):
        FullscreenProgram(ctx, tmp_path, "main.frag")


def test_functions_of_one_name_are_left_together(ctx: moderngl.Context) -> None:
    text = (
        "out vec4 color;\nfloat one() { return 1.0; }\nfloat one(float x) { return x; }\n"
        "float sum() {\n    return one() + one(2.0);\n}\nvoid main() { color = vec4(sum()); }\n"
    )
    compiled = FullscreenProgram(ctx, SHADERS, "main.frag", generated={"main.frag": text})
    assert drawn(ctx, compiled) == [3.0] * 4
    compiled.release()
