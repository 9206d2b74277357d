# SPDX-License-Identifier: MIT
"""Leaves out of functions what constant conditions keep from running: a pass over the text of a shader.

Mesa's compiler does so too, but where a condition is the value of a function it first inlines that, and everything that
is called under the condition. A scene has few of the features that the shaders have, and most of their text stands
under such conditions (docs/performance.md).
"""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from functools import lru_cache

# Patterns that begin with "\\n" are found several times as fast as those with "^".
_CONSTANT = re.compile(r"\n(?:#define (\w+)|const u?int (\w+) =) +(?:u?int\()?(-?\d+)u?\)?;? *$", re.MULTILINE)
_FUNCTION = re.compile(r"\n(?:(?:lowp|mediump|highp) )?\w+ (\w+)\([^;{}]*\)\s*\{")
_PREDICATE = re.compile(r"bool \w+\(([^(){}]*)\)\s*\{\s*return ([^;{}]*);\s*\}")
_SWITCH = re.compile(r"switch\b")
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
_CALL = re.compile(r"(?<![\w.])(\w+)\s*\(")
_OPENED = re.compile(r"(\w*)\s*\(")
_UNSIGNED = re.compile(r"(?<=\d)u\b")
_WHOLE = re.compile(r"(?:\d+|\(-\d+\)|and|or|not|>>|[<>=!]=|[<>()&|]|\s)+")
# What means something else in Python: a negation that is compared, and comparisons of comparisons.
_COMPARED = re.compile(r"!(?!=)\s*(?:\w+|\([^()]*\))\s*[<>=!]|(?:[<>=!]=|[<>](?!=))[^&|()<>=!]*[<>=!]")

_CONDITION = re.compile(r"\bif\b|\?")
_IF = re.compile(r"if\s*\(")
_ELSE = re.compile(r"\s*else\b")
_LOOP = re.compile(r"(?:for|while)\s*\(|do\b")
_JUMP = re.compile(r"(?:return|continue|break|discard)\b")
_BLACK = re.compile(r"\S+")
_SPACE = re.compile(r"\s*")
_BRACKET = re.compile(r"[()\[\]{}]")
_BRACE = re.compile(r"[{}]")
_BEFORE_CONDITION = re.compile(r"\breturn\b|(?<![=<>!])=(?!=)|[()\[\],{}?:]")
_BEHIND_OPERAND = re.compile(r"[()\[\],;?:]")

Value = Callable[[str], bool | None]  # of a condition: whether it holds always, or never; None if that depends


class NotUnderstoodError(Exception):
    """A text is of some other form than that of our shaders."""


def holds(condition: str) -> bool:
    """Whether a condition of whole numbers holds.

    Raises
    ------
    NotUnderstoodError
        If there is anything else in it.
    """
    found = _evaluated(condition)
    if found is None:
        raise NotUnderstoodError
    return found


@lru_cache(4096)
def _evaluated(condition: str) -> bool | None:
    if _COMPARED.search(condition.replace(">>", "&")):
        return None
    text = re.sub(r"!(?!=)", " not ", condition.replace("&&", " and ").replace("||", " or "))
    if not _WHOLE.fullmatch(text):
        return None
    try:
        return bool(eval(text, {"__builtins__": {}}))  # of numbers and operators alone
    except (SyntaxError, TypeError, ValueError):
        return None


class Branches:
    """What of functions its constants let run, in a text without comments.

    A condition is known if it is one of whole numbers, names of them, and functions that return such a condition. What
    is not known is left to the driver.

    ``functions`` are the name of each, and where it begins and ends in the text, of which the first line has none;
    ``between`` is the text before, between and behind them.

    Raises
    ------
    NotUnderstoodError
        Where there is a ``switch``, or brackets do not fit. Of all methods.
    """

    def __init__(self, text: str) -> None:
        if _SWITCH.search(text):
            raise NotUnderstoodError
        self.functions = list(_functions(text))
        begins, ends = [begin for _, begin, _ in self.functions], [end for _, _, end in self.functions]
        self.between = [text[end:begin] for end, begin in zip([0, *ends], [*begins, len(text)], strict=True)]
        constants = _CONSTANT.findall("".join(self.between))
        self._constants = {define or const: f"({number})" for define, const, number in constants}
        overloads = Counter(name for name, _, _ in self.functions)
        self._predicates: dict[str, tuple[list[str], str]] = {}
        for name, begin, end in self.functions:
            if overloads[name] == 1 and (found := _PREDICATE.fullmatch(text, begin, end)):
                self._predicates[name] = [each.split()[-1] for each in found[1].split(",") if each], found[2]
        self._values: dict[str, bool | None] = {}  # most conditions occur often

    def taken(self, function: str) -> str:
        """``function`` without branches that are never taken, and without what follows a jump. Every line stays where
        it is."""
        form = _forms(function)
        while form.condition is not None:
            form = form.by_value[self.value(form.condition)]
        if form.text is None:
            form = _forms(function)

            def value(condition: str) -> bool | None:
                nonlocal form
                form.condition = condition
                form = form.by_value[self.value(condition)]
                return self.value(condition)

            body = function.index("{") + 1
            form.text = function[:body] + _chosen(_block(function, body, value)[0], value)
        return form.text

    def value(self, condition: str) -> bool | None:
        """Whether a condition holds always, or never; None if that depends."""
        condition = condition.strip()
        if condition not in self._values:
            self._values[condition] = self._found(condition)
        return self._values[condition]

    def _found(self, condition: str) -> bool | None:
        for operator, decides in ("||", True), ("&&", False):
            if len(operands := _split(condition, operator)) > 1:
                return self._of_operands(operands, decides)
        negated = condition.removeprefix("!").lstrip()
        if negated != condition and _is_one(negated):
            value = self.value(negated)
            return None if value is None else not value
        if (opened := _OPENED.match(condition)) and _is_one(condition):
            inner = condition[opened.end() : -1]
            if not opened[1]:
                return self.value(inner)
            if opened[1] in self._predicates and not self._may_change(inner):
                return self._of_predicate(opened[1], _split(inner, ","))
        try:
            return holds(_UNSIGNED.sub("", _NAME.sub(lambda name: self._constants.get(name[0], name[0]), condition)))
        except NotUnderstoodError:
            return None

    def _of_predicate(self, name: str, arguments: list[str]) -> bool | None:
        parameters, returned = self._predicates[name]
        given = {name: f"({argument})" for name, argument in zip(parameters, arguments, strict=False)}
        return self.value(_NAME.sub(lambda name: given.get(name[0], name[0]), returned))

    def _of_operands(self, operands: list[str], decides: bool) -> bool | None:
        is_known = True
        for operand in operands:
            value = self.value(operand)
            if value is decides:
                return decides
            if value is None and self._may_change(operand):
                return None  # it runs before what decides
            is_known = is_known and value is not None
        return not decides if is_known else None

    def _may_change(self, operand: str) -> bool:
        """Whether to leave it out may change what a program does besides."""
        return any(name not in self._predicates for name in _CALL.findall(operand))


class _Form:
    """What is left of a function, by the values of its conditions in the order in which they are asked for: the next
    one and the forms with its values, or the text."""

    def __init__(self, text: str | None = None) -> None:
        self.condition: str | None = None
        self.by_value: defaultdict[bool | None, _Form] = defaultdict(_Form)
        self.text = text


@lru_cache(4096)
def _forms(function: str) -> _Form:
    """Those that programs have had so far: most of their functions differ in nothing else."""
    return _Form(None if _CONDITION.search(function) else function)


def _functions(text: str) -> Iterator[tuple[str, int, int]]:
    """The name of each function of a text without comments, and where it begins and ends."""
    end = 0
    for found in _FUNCTION.finditer(text):
        if found.start() >= end:
            end = _end(text, found.end(), "}")
            yield found[1], found.start() + 1, end


def _block(text: str, at: int, value_of: Value) -> tuple[str, int, bool]:
    """The block that begins before ``at`` as it runs, from there with its end; where it ends; and whether it jumps."""
    pieces: list[str] = []
    while True:
        space = _SPACE.match(text, at)
        assert space
        pieces.append(space[0])
        at = space.end()
        if text[at] == "}":
            return "".join([*pieces, "}"]), at + 1, False
        statement, at, jumps = _statement(text, at, value_of)
        pieces.append(statement)
        if jumps:
            end = _end(text, at, "}")
            return "".join([*pieces, _blank(text[at:end]), "}"]), end, True


def _statement(text: str, at: int, value_of: Value) -> tuple[str, int, bool]:
    """The statement at ``at`` as it runs, where it ends, and whether nothing behind it runs."""
    if text[at] == "{":
        body, end, jumps = _block(text, at + 1, value_of)
        return "{" + body, end, jumps
    if found := _IF.match(text, at):
        close = _end(text, found.end())
        value = value_of(text[found.end() : close - 1])
        body, end, jumps = _after(text, close, value_of)
        other, after, other_jumps = "", end, False
        if found := _ELSE.match(text, end):
            other, after, other_jumps = _after(text, found.end(), value_of)
            other = (found[0] if value is None else _blank(found[0])) + other
        if value is None:
            return text[at:close] + body + other, after, jumps and other_jumps
        if value:
            return _blank(text[at:close]) + body + _blank(text[end:after]), after, jumps
        return _blank(text[at:end]) + (other or ";"), after, other_jumps
    if found := _LOOP.match(text, at):
        start = _end(text, found.end()) if found[0].endswith("(") else found.end()
        body, end, _ = _after(text, start, value_of)
        return text[at:start] + body, end, False
    end = text.find(";", at) + 1
    if not end:
        raise NotUnderstoodError
    return text[at:end], end, bool(_JUMP.match(text, at))


def _after(text: str, at: int, value_of: Value) -> tuple[str, int, bool]:
    """:func:`_statement`, with the space before it."""
    space = _SPACE.match(text, at)
    assert space
    statement, end, jumps = _statement(text, space.end(), value_of)
    return space[0] + statement, end, jumps


def _chosen(text: str, value_of: Value) -> str:
    """Statements without what ``?:`` never chooses."""
    at = text.find("?")
    while at >= 0:
        begin = _begin_of_condition(text, at)
        value = value_of(text[begin:at])
        if value is not None:
            colon = _end_of_operand(text, at + 1)
            end = _end_of_operand(text, colon + 1)
            first, last = (at + 1, colon) if value else (colon + 1, end)
            taken = f"{_blank(text[begin:first])} ({text[first:last]}){_blank(text[last:end])}"
            text = text[:begin] + taken + text[end:]
            at = begin
        at = text.find("?", at + 1)
    return text


def _begin_of_condition(text: str, at: int) -> int:
    depth, begin = 0, text.rfind(";", 0, at) + 1
    for mark in reversed(list(_BEFORE_CONDITION.finditer(text, begin, at))):
        if mark[0] in ")]":
            depth += 1
        elif mark[0] in "([" and depth:
            depth -= 1
        elif not depth:
            return mark.end()
    return begin


def _end_of_operand(text: str, at: int) -> int:
    """Where an operand of ``?:`` ends that begins at ``at``."""
    depth = 0
    for mark in _BEHIND_OPERAND.finditer(text, at):
        if mark[0] in "([?":
            depth += 1
        elif depth and mark[0] in ")]:":
            depth -= 1
        elif not depth:
            return mark.start()
    raise NotUnderstoodError


def _end(text: str, at: int, closing: str = ")") -> int:
    """Behind the bracket ``closing``, the partner of one before ``at``."""
    depth = 1
    for mark in (_BRACE if closing == "}" else _BRACKET).finditer(text, at):
        depth += 1 if mark[0] in "([{" else -1
        if not depth and mark[0] == closing:
            return mark.end()
    raise NotUnderstoodError


def _is_one(operand: str) -> bool:
    """Whether it is one name, call, or pair of parentheses."""
    opened = _OPENED.match(operand)
    return _end(operand, opened.end()) == len(operand) if opened else operand.isidentifier()


def _split(condition: str, operator: str) -> list[str]:
    """The operands of ``operator``, but not those within brackets."""
    if operator not in condition:
        return [condition]
    operands, begin, depth = [], 0, 0
    for mark in re.finditer(r"[()\[\]]|" + re.escape(operator), condition):
        if mark[0] != operator:
            depth += 1 if mark[0] in "([" else -1
        elif not depth:
            operands.append(condition[begin : mark.start()])
            begin = mark.end()
    return [*operands, condition[begin:]]


def _blank(text: str) -> str:
    return _BLACK.sub("", text)
