# SPDX-License-Identifier: MIT
"""gpu/branches.py: functions without what constants keep from running."""

import re

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu.branches import Branches, NotUnderstoodError
from fragtracer.gpu.reachable import reachable

CONSTANTS = """\
#define NONE 0
#define SOME 1
const int u_count = int(0);
const int u_root = int(-1);
const uint u_kind = 3u;
const uint KINDS = 6u;
bool has_kind(int kind) { return (KINDS >> uint(kind) & 1u) == 0u; }
bool is_odd(int number) { return (number & 1) != 0; }
bool is_some(vec3 v, int kind) { return SOME == 1 && is_odd(kind) && v.x >= 0.0; }
bool is_none(vec3 v) {
    return NONE == 1 && u_count == 0 && v.x > 0.0;
}
bool is_on(bool on) { return NONE == 1 && on; }
bool is_over(float x) { return NONE == 1; }
bool is_over(vec3 x) { return SOME == 1; }
float changes(inout float x) { x += 64.0; return x; }
"""
# Statements, and what is left of them.
BRANCHES = [
    ("if (is_none(v)) return 1.0;\nreturn 2.0;", ";\nreturn 2.0;"),
    ("if (!is_none(v)) return 1.0;\nreturn 2.0;", "return 1.0;\n"),
    ("if (!is_none(v)) { x += 1.0; return x; }\nx = 3.0;\nreturn x;", "{ x += 1.0; return x; }\n\n"),
    ("if (v.x > 0.0 && is_none(v)) x = 1.0; else x = 2.0;\nreturn x;", "x = 2.0;\nreturn x;"),
    ("if (NONE == 1) x = 1.0;\nelse if (u_count > 0) x = 2.0;\nelse x = 3.0;\nreturn x;", "x = 3.0;\nreturn x;"),
    (
        "if (v.x > 0.0) x = 1.0;\nelse if (u_count > 0) x = 2.0;\nreturn x;",
        "if (v.x > 0.0) x = 1.0;\nelse ;\nreturn x;",
    ),
    (
        "if (v.x > 0.0) if (SOME == 1) x = 1.0; else x = 2.0; else x = 3.0;\nreturn x;",
        "if (v.x > 0.0) x = 1.0; else x = 3.0;\nreturn x;",
    ),
    ("if (u_root < 0 || v.x > 0.0) return 4.0;\nreturn 5.0;", "return 4.0;\n"),
    ("if (is_some(v, 3)) return 6.0;\nreturn 7.0;", "if (is_some(v, 3)) return 6.0;\nreturn 7.0;"),
    ("if (is_some(v, 2 - 2)) return 6.0;\nreturn 7.0;", "if (is_some(v, 2 - 2)) return 6.0;\nreturn 7.0;"),
    ("if (is_some(v, SOME - SOME)) return 6.0;\nreturn 7.0;", "if (is_some(v, SOME - SOME)) return 6.0;\nreturn 7.0;"),
    ("if (is_on(v.x > 0.0 || SOME == 1)) return 6.0;\nreturn 7.0;", ";\nreturn 7.0;"),
    ("if (is_some(v, NONE)) return 6.0;\nreturn 7.0;", ";\nreturn 7.0;"),
    (
        "if (changes(x) > 0.0 && NONE == 1) x += 1.0;\nreturn x;",
        "if (changes(x) > 0.0 && NONE == 1) x += 1.0;\nreturn x;",
    ),
    ("if (NONE == 1 && changes(x) > 0.0) x += 1.0;\nreturn x;", ";\nreturn x;"),
    ("if (is_none(vec3(changes(x)))) x += 1.0;\nreturn x;", "if (is_none(vec3(changes(x)))) x += 1.0;\nreturn x;"),
    ("if (is_over(x) || is_over(v)) x += 1.0;\nreturn x;", "if (is_over(x) || is_over(v)) x += 1.0;\nreturn x;"),
    (
        "for (int i = 0; i < 2; i++) if (SOME == 1) return x;\nreturn 8.0;",
        "for (int i = 0; i < 2; i++) return x;\nreturn 8.0;",
    ),
    ("for (int i = 0; i < 2; i++) if (NONE == 1) x = 9.0;\nreturn x;", "for (int i = 0; i < 2; i++) ;\nreturn x;"),
    (
        "while (x < 9.0) {\n    if (!(NONE == 1)) break;\n    x = 10.0;\n}\nreturn x;",
        "while (x < 9.0) {\n    break;\n    \n}\nreturn x;",
    ),
    ("do { x += 1.0; } while (x < 9.0);\nreturn x;", "do { x += 1.0; } while (x < 9.0);\nreturn x;"),
    (
        "return is_none(v) ? 1.0 : max(v.x > 0.0 ? x : 2.0, SOME == 1 ? 3.0 : 4.0);",
        "return ( max(v.x > 0.0 ? x : 2.0, ( 3.0 ) ));",
    ),
    ("x += v.x > 0.0 ? NONE == 1 ? 1.0 : 2.0 : 3.0;\nreturn x;", "x += v.x > 0.0 ? ( 2.0 ): 3.0;\nreturn x;"),
    (
        "bool b = v.x == 1.0 == (NONE == 1);\nreturn b ? 1.0 : 2.0;",
        "bool b = v.x == 1.0 == (NONE == 1);\nreturn b ? 1.0 : 2.0;",
    ),
    (
        "if (!(v.x > 0.0) == (SOME == 1)) return 1.0;\nreturn 2.0;",
        "if (!(v.x > 0.0) == (SOME == 1)) return 1.0;\nreturn 2.0;",
    ),
    ("if (u_kind == 3u && (KINDS & 1u) == 0u) { return 1.0; } else { return 2.0; }\nreturn 3.0;", "{ return 1.0; }\n"),
]


def test_what_constants_rule_out_is_left_out() -> None:
    """And nothing else: operands that may change something stay, and so does what is not understood."""
    text = _program()
    left = reachable(text)
    assert left.count("\n") == text.count("\n")
    found = re.findall(
        r"^float f\d+\(vec3 v, float x\) \{\n(.*?)\n\}\n(?=float f|out )", left, re.DOTALL | re.MULTILINE
    )
    assert [_words(body) for body in found] == [_words(expected) for _, expected in BRANCHES]


def test_functions_return_what_they_did(ctx: moderngl.Context) -> None:
    before = _values(ctx, _program())
    np.testing.assert_array_equal(_values(ctx, reachable(_program())), before)
    assert (before > 0.0).all()
    assert (before[0] != before[1]).any()


@pytest.mark.parametrize(
    "body", ["switch (1) { default: return x; }", "if (x > 0.0) return x", "if (x > 0.0 { return x; }"]
)
def test_other_forms_are_not_understood(body: str) -> None:
    function = f"float f(float x) {{ {body} }}"
    with pytest.raises(NotUnderstoodError):
        Branches("\n" + CONSTANTS + function).taken(function)


def _program() -> str:
    """Column i of its picture has the values of function i, for a negative number in the first row, and a positive."""
    bodies = "".join(f"float f{i}(vec3 v, float x) {{\n{body}\n}}\n" for i, (body, _) in enumerate(BRANCHES))
    calls = "".join(f"    if (i == {i}) value = f{i}(v, 1.0);\n" for i in range(len(BRANCHES)))
    return (
        f"#version 330 core\n{CONSTANTS}{bodies}out vec4 color;\nvoid main() {{\n    int i = int(gl_FragCoord.x);\n"
        f"    vec3 v = vec3(gl_FragCoord.y - 1.0);\n    float value = 0.0;\n{calls}    color = vec4(value);\n}}\n"
    )


def _values(ctx: moderngl.Context, text: str) -> NDArray[np.float32]:
    corners = "vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;"
    vertices = f"#version 330 core\nvoid main() {{ {corners} gl_Position = vec4(corner, 0.0, 1.0); }}\n"
    program = ctx.program(vertex_shader=vertices, fragment_shader=text)
    array = ctx.vertex_array(program, [])
    target = ctx.texture((len(BRANCHES), 2), 1, dtype="f4")
    framebuffer = ctx.framebuffer([target])
    with ctx.scope(framebuffer):
        array.render(moderngl.TRIANGLES, vertices=3)
    values = np.frombuffer(target.read(), np.float32).reshape(2, -1)
    for resource in (framebuffer, target, array, program):
        resource.release()
    return values


def _words(text: str) -> str:
    return " ".join(text.split())
