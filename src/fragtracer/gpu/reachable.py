# SPDX-License-Identifier: MIT
"""Leaves out of a program what it does not use: a pass over the text of a shader.

Mesa's compiler inlines the functions that others call, and optimises them, before it drops those that nothing calls.
Of a program of fragtracer these are about half (docs/performance.md).
"""

import re
from collections.abc import Iterator
from functools import lru_cache

from fragtracer.gpu.branches import Branches, NotUnderstoodError, holds

_DIRECTIVE = re.compile(
    r"\n[ \t]*#[ \t]*(if|ifdef|ifndef|elif|else|endif|define|undef)\b[ \t]*(.*?)[ \t]*(?://.*)?$", re.MULTILINE
)
_DEFINED = re.compile(r"\bdefined\s*(?:\(\s*(\w+)\s*\)|(\w+))")
_NAME = re.compile(r"[A-Za-z_]\w*")
_COMMENT = re.compile(r"//.*")
_LONG_OR_BRACES = re.compile(r"\\$|[{}]")  # a directive that goes on in the next line, or a macro that opens a block


@lru_cache(16)
def reachable(text: str) -> str:
    """``text`` without the functions that ``main`` does not reach, and without what its conditions leave out.

    Every line stays where it is, so that a driver's messages name the same ones; comments go. Where anything is not
    understood, as a condition whose names the driver alone knows, the text is left as it is.
    """
    if "/*" in text:
        return text
    try:
        return _of_reached(_COMMENT.sub("", "".join(_chosen("\n" + text))))[1:]
    except (NotUnderstoodError, RecursionError):  # the latter where a function calls itself, which no driver takes
        return text


def _of_reached(text: str) -> str:
    """The text without functions that are not reached; there are no conditions of the preprocessor in it any more."""
    branches = Branches(text)
    named: dict[str, list[int]] = {}
    for i, (name, _, _) in enumerate(branches.functions):
        named.setdefault(name, []).append(i)
    reached: dict[int, str] = {}
    new = {"main"} | _names("".join(branches.between)) & named.keys()
    while new:
        for i in named.pop(new.pop(), ()):
            _, begin, end = branches.functions[i]
            reached[i] = branches.taken(text[begin:end])
            new |= _names(reached[i]) & named.keys()
    pieces = []
    for i, (before, (_, begin, end)) in enumerate(zip(branches.between, branches.functions, strict=False)):
        pieces += [before, reached[i] if i in reached else "\n" * text.count("\n", begin, end)]
    return "".join([*pieces, branches.between[-1]])


def _chosen(text: str) -> Iterator[str]:
    """Pieces of the text that the preprocessor lets pass, of the others and of conditions their ends of lines."""
    macros: dict[str, str] = {}
    values: dict[str, bool] = {}  # of conditions, most of which occur often

    def value(condition: str) -> bool:
        if condition not in values:
            values[condition] = _value(condition, macros)
        return values[condition]

    open_conditions: list[tuple[bool, bool]] = []  # whether text passes here, and whether a branch has been taken yet
    passes, at = True, 0
    for found in _DIRECTIVE.finditer(text):
        yield text[at : found.start()] if passes else "\n" * text.count("\n", at, found.start())
        at = found.end()
        kind, rest = found.groups()
        is_unmatched = kind in ("elif", "else", "endif") and not open_conditions
        if kind == "undef" or is_unmatched or _LONG_OR_BRACES.search(found[0]):
            raise NotUnderstoodError
        if kind == "define":
            name = _NAME.match(rest)
            if passes and name:
                macros[name[0]] = rest[name.end() :].strip()
            yield found[0] if passes else "\n"
            continue
        yield "\n"
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
    if open_conditions:
        raise NotUnderstoodError
    yield text[at:]


def _value(condition: str, macros: dict[str, str]) -> bool:
    """Whether a condition holds: whole numbers, names of them, comparisons and logic."""
    text = _DEFINED.sub(lambda found: str(int((found[1] or found[2]) in macros)), condition)
    for _ in range(len(macros) + 1):
        if not (names := set(_NAME.findall(text))):
            break
        if not names <= macros.keys():
            raise NotUnderstoodError
        text = _NAME.sub(lambda found: macros[found[0]] or "0", text)
    return holds(text)


@lru_cache(4096)
def _names(text: str) -> frozenset[str]:
    return frozenset(_NAME.findall(text))
