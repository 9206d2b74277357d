# SPDX-License-Identifier: MIT
"""Leaves out of a program what it does not use: a pass over the text of a shader.

Mesa's compiler inlines the functions that others call, and optimises them, before it drops those that nothing calls.
Of a program of fragtracer these are about half (docs/performance.md).
"""

import re
from collections.abc import Iterator
from functools import lru_cache

_DIRECTIVE = re.compile(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif|define|undef)\b\s*(.*?)\s*(?://.*)?$")
_DEFINED = re.compile(r"\bdefined\s*(?:\(\s*(\w+)\s*\)|(\w+))")
_NAME = re.compile(r"[A-Za-z_]\w*")
_LOGIC = re.compile(r"(?:\d+|and|or|not|[<>=!]=|[<>()]|\s)+")
# What means something else in Python: a negation that is compared, and comparisons of comparisons.
_COMPARED = re.compile(r"!(?!=)\s*(?:\w+|\([^()]*\))\s*[<>=!]|(?:[<>=!]=|[<>](?!=))[^&|()<>=!]*[<>=!]")
_FUNCTION = re.compile(r"^(?:(?:lowp|mediump|highp) )?\w+ (\w+)\([^;{}]*\)\s*\{", re.MULTILINE)
_BRACE = re.compile(r"//.*|[{}]")
_LONG_OR_BRACES = re.compile(r"\\$|[{}]")  # a directive that goes on in the next line, or a macro that opens a block


def reachable(text: str) -> str:
    """``text`` without the functions that ``main`` does not reach, and without what its conditions leave out.

    Every line stays where it is, so that a driver's messages name the same ones. Where anything is not understood, as a
    condition whose names the driver alone knows, the text is left as it is.
    """
    try:
        return _of_reached("\n".join(_chosen(text.split("\n")))) if "/*" not in text else text
    except _NotUnderstoodError:
        return text


class _NotUnderstoodError(Exception):
    """The text is of some other form than that of our shaders."""


def _of_reached(text: str) -> str:
    """The text without functions that are not reached; there are no conditions in it any more."""
    functions = list(_functions(text))
    ends = [0, *(end for _, _, end in functions)]
    between = [text[end:begin] for end, (_, begin, _) in zip(ends, functions, strict=False)]
    named_by: dict[str, set[str]] = {}
    for name, begin, end in functions:
        named_by.setdefault(name, set()).update(_names(text[begin:end]))
    reached = {"main"} & named_by.keys()
    new = reached | _names("".join([*between, text[ends[-1] :]])) & named_by.keys()
    while new:
        reached |= new
        new = {other for name in new for other in named_by[name] if other in named_by} - reached
    pieces = []
    for before, (name, begin, end) in zip(between, functions, strict=True):
        body = text[begin:end]
        pieces += [before, body if name in reached else "\n" * body.count("\n")]
    return "".join([*pieces, text[ends[-1] :]])


def _chosen(lines: list[str]) -> Iterator[str]:
    """The lines that the preprocessor lets pass, those of its conditions and the others empty."""
    macros: dict[str, str] = {}
    values: dict[str, bool] = {}  # of conditions, most of which occur often

    def value(condition: str) -> bool:
        if condition not in values:
            values[condition] = _value(condition, macros)
        return values[condition]

    open_conditions: list[tuple[bool, bool]] = []  # whether lines pass here, and whether a branch has been taken yet
    passes = True
    for line in lines:
        if "#" not in line or not (found := _DIRECTIVE.match(line)):
            yield line if passes else ""
            continue
        kind, rest = found.groups()
        is_unmatched = kind in ("elif", "else", "endif") and not open_conditions
        if kind == "undef" or is_unmatched or _LONG_OR_BRACES.search(line):
            raise _NotUnderstoodError
        if kind == "define":
            name = _NAME.match(rest)
            if passes and name:
                macros[name[0]] = rest[name.end() :].strip()
            yield line if passes else ""
            continue
        if kind in ("if", "ifdef", "ifndef"):
            is_met = passes and (value(rest) if kind == "if" else (rest in macros) == (kind == "ifdef"))
            open_conditions.append((passes, is_met or not passes))
            passes = is_met
        elif kind == "endif":
            passes, _ = open_conditions.pop()
        else:
            outside, is_taken = open_conditions.pop()
            passes = outside and not is_taken and (kind == "else" or value(rest))
            open_conditions.append((outside, is_taken or passes))
        yield ""
    if open_conditions:
        raise _NotUnderstoodError


def _value(condition: str, macros: dict[str, str]) -> bool:
    """Whether a condition holds: whole numbers, names of them, comparisons and logic."""
    text = _DEFINED.sub(lambda found: str(int((found[1] or found[2]) in macros)), condition)
    for _ in range(len(macros) + 1):
        if not (names := set(_NAME.findall(text))):
            break
        if not names <= macros.keys():
            raise _NotUnderstoodError
        text = _NAME.sub(lambda found: macros[found[0]] or "0", text)
    if _COMPARED.search(text):
        raise _NotUnderstoodError
    text = re.sub(r"!(?!=)", " not ", text.replace("&&", " and ").replace("||", " or "))
    if not _LOGIC.fullmatch(text):
        raise _NotUnderstoodError
    try:
        return bool(eval(text, {"__builtins__": {}}))  # of numbers and operators alone
    except (SyntaxError, TypeError):
        raise _NotUnderstoodError from None


def _functions(text: str) -> Iterator[tuple[str, int, int]]:
    """The name of each function, and where it begins and ends."""
    end = 0
    for found in _FUNCTION.finditer(text):
        if found.start() < end:
            continue  # within the one before
        depth = 1
        for mark in _BRACE.finditer(text, found.end()):
            depth += {"{": 1, "}": -1}.get(mark[0], 0)
            if depth == 0:
                break
        else:
            raise _NotUnderstoodError
        end = mark.end()
        yield found[1], found.start(), end


@lru_cache(4096)
def _names(text: str) -> frozenset[str]:
    return frozenset(_NAME.findall(text))
