# SPDX-License-Identifier: MIT
"""Compiles what a scene holds into its program: a pass over the text of a shader, of which nothing else knows.

A software renderer reads every uniform for each of its lanes, and llvmpipe of older versions of Mesa executes both
sides of every branch, so that constants are worth a factor of 2 to 6 there (docs/performance.md, "What limits us"). On
an NVIDIA H200 they are worth 1.2 to 3.7, and programs with them take less time to compile.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from fragtracer.bvh import NONE, build
from fragtracer.packing import PackedScene
from fragtracer.packing.lights import LIGHT_RECORDS
from fragtracer.packing.records import Words
from fragtracer.packing.shapes import LISTED, balls_of

# With more shapes than these a BVH is faster than testing all of them (docs/performance.md, "What limits us" and "On a
# GPU"). How long browsers take to compile longer programs for a GPU was not measured.
# A grid is faster with fewer spheres, but where their list is a tree of balls.
MOST_LISTED = {"default": 64, "page": 8, "grid": 31}
# More shapes of a kind than these stand in a tree of balls, which a driver that skips branches is faster with.
_MOST_IN_A_ROW = 16
_BALL_GROWTH = 1e-3  # by which balls are larger, for the sake of rounding
# With more records than these a texture is read faster than a value chosen by comparisons.
_MOST_SELECTED = 8

# What of a scene is another in each pose of its meshes, and where lights are.
OF_POSES = ("bvh_root", "u_bvh_stack", "u_mesh_light_count", *LIGHT_RECORDS)

# Flags of what hardly any scene has, and much of a program is for, which takes time to compile and to run.
_RARE = ("u_has_sphere_grid", "u_has_globes", "u_has_panes", "u_without_iridescence")

_UNIFORM = re.compile(r"^uniform\s+(?:highp\s+)?(\w+)\s+(\w+)\s*;")
_LOOP = re.compile(
    r"^(\s*)for \(int i = 0; i < (u_\w+_count); i\+\+\) (\w+)\((.*?)\b(\w+)_load\(first \+ i\), first \+ i(.*)\);$"
)
_LOAD = re.compile(r"^(\w+) (\w+)_load\(int index\) \{$")
_RETURN = re.compile(r"^    return (\w+)_of\((.*)\);$")
# How lines begin that the patterns above match.
_CHANGES = re.compile(
    r"^(?:uniform |\w+ \w+_load\(|    return \w+_(?:of|read)\(| *for \(int i = 0; i < u_).*$", re.MULTILINE
)


class Level(Enum):
    """How much of a scene is compiled in: nothing but :data:`_RARE`; which kinds of things there are; all values but
    those that change while the camera moves; all values."""

    NOTHING = 0
    KINDS = 1
    SCENE = 2
    VIEW = 3


@dataclass(frozen=True, eq=False)
class Specialisation:
    """The constants of a program, equal to another with the same."""

    constants: Mapping[str, object]
    listed: Words | None = None  # the short list of shapes
    tables: Mapping[str, Words] | None = None  # records by the noun of their functions, few of each
    skips_branches: bool = False  # whether the driver does: of a process, and so no part of the key

    @property
    def key(self) -> tuple[object, ...]:
        """What decides over the program."""
        tables = tuple((name, words.tobytes()) for name, words in (self.tables or {}).items())
        return tuple(sorted(self.constants.items())), b"" if self.listed is None else self.listed.tobytes(), tables

    def apply(self, text: str) -> str:
        """The text of a program with the constants in it, line by line."""
        load = ""

        def changed(match: re.Match[str]) -> str:
            nonlocal load
            line = match[0]
            if found := _LOAD.match(line):
                load = found[2]
            return self._line(line, load)

        return _CHANGES.sub(changed, text)

    def _line(self, line: str, load: str) -> str:
        if line.startswith("uniform") and (uniform := _UNIFORM.match(line)) and uniform[2] in self.constants:
            return _constant(uniform[1], uniform[2], self.constants[uniform[2]]) + line[uniform.end() :]
        if self.listed is not None and (loop := _LOOP.match(line)):
            return self._unrolled(loop, self.listed)
        if self.tables is not None and (end := _RETURN.match(line)) and end[1] == load and load in self.tables:
            return f"    return {load}_of({_selected(self.tables[load], 'index')});"
        if self.listed is not None and self._selects_shapes and line.startswith("    return texel_read(u_shapes,"):
            return f"    return {self._shape_texel(self.listed)};"
        return line

    def _unrolled(self, loop: re.Match[str], listed: Words) -> str:
        indent, counter, call, before, noun, after = loop.groups()
        count = int(str(self.constants[counter]))
        start = sum(int(str(self.constants[name])) for name in _LIST[: _LIST.index(counter)])
        texels, records = LISTED[noun], listed[start : start + count]
        calls = [
            f"{call}({before}{noun}_of({', '.join(map(_texel, record[:texels]))}), {start + i}{after});"
            for i, record in enumerate(records)
        ]
        is_long = self.skips_branches and noun != "plane" and count > _MOST_IN_A_ROW
        return indent + (_in_tree(calls, records) if is_long else " ".join(calls))

    @property
    def _selects_shapes(self) -> bool:
        assert self.listed is not None
        is_all = self.constants.get("u_bvh_root") == -1 and self.constants.get("u_has_sphere_grid") == 0
        return is_all and 0 < len(self.listed) <= _MOST_SELECTED

    def _shape_texel(self, listed: Words) -> str:
        """The result of shape_texel() where the short list is all there is."""
        first, second, third, fourth = (_chain(listed[:, i], "record") for i in range(4))
        return f"texel == 0 ? {first} : texel == 1 ? {second} : texel == 2 ? {third} : {fourth}"


_LIST = [f"u_{noun}_count" for noun in LISTED]


def specialise(
    packed: PackedScene, level: Level, kept: Sequence[str] = (), skips_branches: bool = False
) -> Specialisation:
    """What of ``packed`` is compiled in at a level; what is named in ``kept``, uniforms, records of a scene or
    "bvh_root", is not. If the driver ``skips_branches`` (:func:`.skips_branches`), long lists of shapes stand below
    conditions."""
    if level is Level.NOTHING:
        return Specialisation({name: packed.flags[name] for name in _RARE})
    if level is Level.KINDS:
        return Specialisation(dict(packed.flags))
    constants = {**packed.uniforms, **packed.flags, **(packed.movable if level is Level.VIEW else {})}
    constants = {name: value for name, value in constants.items() if name not in kept and name != "u_seed"}
    few = {name: words for name, words in packed.scene_records.items() if 0 < len(words) <= _MOST_SELECTED}
    tables = {_noun(name): words for name, words in few.items() if name not in kept}
    tables |= {name: words for name, words in packed.bvh_root.items() if name not in kept}
    return Specialisation(constants, packed.listed, tables, skips_branches)


def _noun(name: str) -> str:
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()


def _in_tree(calls: Sequence[str], records: Words) -> str:
    """The ``calls`` for ``records`` of finite shapes as a BVH in the text of the program: each of its nodes and leaves
    is a condition that the ray comes through a ball around it."""
    balls = balls_of(records)
    centers, radii = balls[:, :3], balls[:, 3:]
    tree = build(np.concatenate([centers - radii, -(centers + radii)], axis=1).T.astype(np.float32))

    def below(child: int) -> tuple[list[int], str]:
        """The shapes below a child of the BVH, and their calls."""
        if child < 0:
            return [~child], _in_ball(balls[[~child]], calls[~child])
        parts = [below(int(c)) for c in tree.children[child] if c != NONE]
        members = [i for some, _ in parts for i in some]
        text = " ".join(text for _, text in parts)
        return members, _in_ball(balls[members], text) if child > 0 else text

    return below(0)[1]


def _in_ball(balls: NDArray[np.float64], text: str) -> str:
    """``text``, on the condition that the ray comes through a ball around ``balls`` (n, 4)."""
    low, high = balls[:, :3] - balls[:, 3:], balls[:, :3] + balls[:, 3:]
    center = ((low.min(axis=0) + high.max(axis=0)) / 2).astype(np.float32)
    radius = (np.linalg.norm(balls[:, :3] - center, axis=1) + balls[:, 3]).max() * (1 + _BALL_GROWTH)
    ball = f"vec3({', '.join(map(_number, center))}), {_number(radius)}"
    return f"if (ray_meets_ball(ray, hit.distance, {ball})) {{ {text} }}"


def _constant(kind: str, name: str, value: object) -> str:
    numbers = [value] if isinstance(value, int | float | np.number) else list(value)  # type: ignore[call-overload]
    suffix = "u" if kind == "uint" else ""
    return f"const {kind} {name} = {kind}({', '.join(f'{_number(n)}{suffix}' for n in numbers)});"


def _number(value: object) -> str:
    return repr(value.item() if isinstance(value, np.generic) else value)


def _texel(words: Words) -> str:
    return f"uvec4({', '.join(f'{int(word)}u' for word in words)})"


def _selected(words: Words, index: str) -> str:
    """The texels of the record ``index``, an expression for each."""
    return ", ".join(_chain(words[:, i], index) for i in range(words.shape[1]))


def _chain(texels: Words, index: str) -> str:
    """One of the texels (n, 4) by comparisons."""
    choices = "".join(f"{index} == {i} ? {_texel(texel)} : " for i, texel in enumerate(texels[:-1]))
    return f"({choices}{_texel(texels[-1])})"
