# SPDX-License-Identifier: MIT
"""Assembles a GLSL program from files: includes, feature defines and the way back from a driver's
line numbers to the file that a person edits."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fragtracer.errors import ShaderError
from fragtracer.resources import folder
from fragtracer.scene.content import content_digest

LANGUAGES = {
    "330 core": "#version 330 core\n",
    "330 core, images": "#version 330 core\n#extension GL_ARB_shader_image_load_store : require\n"
    "#extension GL_ARB_shading_language_420pack : require\n#define HAS_IMAGES\n",
    "300 es": "#version 300 es\n",
}
_PRECISION = (
    "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\nprecision highp sampler3D;\n"
    "precision highp usampler2D;\nprecision highp sampler2DArray;\n"
)

_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*(?://.*)?$')
_DEFINE = re.compile(r"^\s*#\s*define\s+(\w+)(?:\s+([^/\s][^/]*?))?\s*(?://.*)?$")
_IF_NOT_DEFINED = re.compile(r"^\s*#\s*ifndef\s+(\w+)")
_CONDITION = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b(.*?)(?://.*)?$")
_NAME = re.compile(r"\b[A-Za-z_]\w*\b")
# Mesa "0:3(11)", NVIDIA "0(3)", Apple, ANGLE and glslang "ERROR: 0:3:".
_DRIVER_LINE = re.compile(r"(?:(?<=ERROR: )|(?<=WARNING: )|^)\d+(?::(\d+)(?:\((\d+)\))?|\((\d+)\))", re.MULTILINE)


@dataclass(frozen=True)
class ShaderSource:
    """GLSL text ready for the driver; ``lines[i]`` is where line i + 1 of it came from.

    ``features`` are the defines that the source can be compiled with, and their defaults.
    """

    text: str
    lines: tuple[str, ...]
    features: Mapping[str, str]

    def translate(self, log: str) -> str:
        """A driver's log with its line numbers replaced by ``file:line``."""

        def place(match: re.Match[str]) -> str:
            number = int(match[1] or match[3])
            known = 1 <= number <= len(self.lines)
            return self.lines[number - 1] if known else match[0]

        return _DRIVER_LINE.sub(place, log)


def compose(
    program: str,
    defines: Mapping[str, int | str],
    root: Path,
    generated: Mapping[str, str] | None = None,
    language: str = "330 core",
    optional: Mapping[str, int | str] | None = None,
) -> ShaderSource:
    """Assemble ``program`` with everything it includes.

    A feature is declared in the file that tests it, by ``#ifndef NAME``, ``#define NAME default``, ``#endif``; a file
    that names the values of one declares them by ``#define NAME value``.

    Parameters
    ----------
    program
        Path of the top file, relative to ``root``.
    defines
        Values for some of the features: whole numbers, or names that the source declares.
    root
        The folder that includes are relative to.
    generated
        Text in the place of files, by their path.
    language
        One of :data:`LANGUAGES`.
    optional
        Values for those of the features that the program has, where ``defines`` gives none.

    Raises
    ------
    ShaderError
        On a missing or cyclic include, and on a define, a value of one or a name in a condition that nothing declares.
    """
    expanded = _expand(program, root, generated or {}, set(), ())
    directives = [(place, line) for place, line in expanded if "#" in line]
    features, constants = _declared([line for _, line in directives])
    defines = {name: value for name, value in (optional or {}).items() if name in features} | dict(defines)
    for name, value in defines.items():
        if name not in features:
            raise ShaderError(f"{program} has no feature {name}; it has {', '.join(sorted(features)) or 'none'}")
        if isinstance(value, str) and value not in constants:
            raise ShaderError(f"{program} declares no {value} that {name} could be")
    _check_conditions(directives)
    text = (LANGUAGES[language] + _PRECISION).splitlines()
    text += [f"#define {name} {value}" for name, value in defines.items()]
    places = [f"(header):{i + 1}" for i in range(len(text))]
    lines = (*places, *(place for place, _ in expanded))
    return ShaderSource("\n".join([*text, *(line for _, line in expanded)]) + "\n", lines, features)


def shaders_digest(root: Path | None = None) -> str:
    """Of all shader files below ``root``; left out, fragtracer's own."""
    root = root or folder("shaders")
    files = sorted(path for path in root.rglob("*") if path.suffix in (".glsl", ".frag", ".vert"))
    parts = (part for path in files for part in (path.relative_to(root).as_posix(), path.read_text("utf-8")))
    return content_digest(*parts)


def _declared(lines: Sequence[str]) -> tuple[dict[str, str], set[str]]:
    """The features with their defaults, and all other names that are defined."""
    features: dict[str, str] = {}
    constants: set[str] = set()
    for before, line in zip(["", *lines], lines, strict=False):
        if not (define := _DEFINE.match(line)):
            continue
        guard = _IF_NOT_DEFINED.match(before)
        if guard and guard[1] == define[1]:
            features[define[1]] = define[2] or ""
        else:
            constants.add(define[1])
    return features, constants


def _expand(
    path: str, root: Path, generated: Mapping[str, str], done: set[str], stack: tuple[str, ...]
) -> list[tuple[str, str]]:
    """The lines of ``path`` and, in their place, of what it includes, each file once."""
    if path in stack:
        raise ShaderError("cyclic include: " + " -> ".join([*stack[stack.index(path) :], path]))
    if path in done:
        return []
    done.add(path)
    lines: list[tuple[str, str]] = []
    for piece, include in _pieces(path, generated[path] if path in generated else _read(path, root, stack)):
        lines += piece
        if include:
            lines += _expand(include, root, generated, done, (*stack, path))
    return lines


@lru_cache(1024)
def _pieces(path: str, source: str) -> list[tuple[list[tuple[str, str]], str]]:
    """The lines of a file from one include to the next, each with its place, and the path of that include, or ""."""
    pieces: list[tuple[list[tuple[str, str]], str]] = [([], "")]
    for number, line in enumerate(source.splitlines(), 1):
        if "#" in line and (include := _INCLUDE.match(line)):
            pieces[-1] = pieces[-1][0], include[1]
            pieces.append(([], ""))
        else:
            pieces[-1][0].append((f"{path}:{number}", line))
    return pieces


def _read(path: str, root: Path, stack: tuple[str, ...]) -> str:
    try:
        return (root / path).read_text(encoding="utf-8")
    except OSError as error:
        origin = f" (included from {stack[-1]})" if stack else ""
        raise ShaderError(f"cannot read shader file {path}{origin}: {error.strerror}") from None


def _check_conditions(lines: Iterable[tuple[str, str]]) -> None:
    """A name in #if that is misspelt, or defined further down, counts as 0 and compiles without a word: refuse it."""
    known = {"defined", "HAS_IMAGES"}  # which is of the language
    for place, line in lines:
        if define := _DEFINE.match(line):
            known.add(define[1])
        elif (condition := _CONDITION.match(line)) and not _IF_NOT_DEFINED.match(line):
            for name in _NAME.findall(condition[1]):
                if name not in known:
                    raise ShaderError(f"{place}: unknown define {name} in a condition; nothing above defines it")
