# SPDX-License-Identifier: MIT
"""One table of a scene file to one dataclass of the scene model, or a sentence for each mistake in it."""

import difflib
import json
import re
import types
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from fragtracer.scene import Gradient, Image, Panorama, Reflectance, Sky, Strength, Texture, Vector
from fragtracer.scene.fields import Point, Points, Scale
from fragtracer.scene.medium import Box, Density
from fragtracer.scene.mesh import AnimationName
from fragtracer.scene.texture import Pair

T = TypeVar("T")
_KINDS = {
    float: "a number",
    int: "a whole number",
    AnimationName: "a name in quotes or a number, from 0 on",
    bool: "true or false",
    str: "a text in quotes",
    Vector: "three numbers [x, y, z]",
    Point: "three numbers [x, y, z]",
    Reflectance: "a number or three numbers [r, g, b]",
    Strength: "a number or three numbers [r, g, b]",
    Scale: "a number or three numbers [x, y, z]",
    Pair: "two numbers [u, v]",
    Image: "an image file",
    Panorama: "an image file",
    Gradient: "a table [environment.gradient]",
    Sky: "a table [environment.sky]",
    Density: "a grid, the name of a .npy or .vol file",
    Box: "two points [[x, y, z], [x, y, z]]",
    Texture: 'the name of an image file or a table { file = "…" }',
    Points: "three points [[x, y, z], [x, y, z], [x, y, z]]",
}
_ITEMS = {
    "a number or three numbers [x, y, z]": "a number",
    "two numbers [u, v]": "a number",
    "three numbers [x, y, z]": "a number",
    "a number or three numbers [r, g, b]": "a number",
    "three points [[x, y, z], [x, y, z], [x, y, z]]": "three numbers [x, y, z]",
    "two points [[x, y, z], [x, y, z]]": "three numbers [x, y, z]",
}
# Names in other programs and formats, of keys and of their values.
_SYNONYMS = {
    **dict.fromkeys(("color", "colour", "base_color", "basecolor", "diffuse", "diffuse_color", "kd"), "albedo"),
    **dict.fromkeys(("metalness", "metallicness"), "metallic"),
    **dict.fromkeys(("emissive", "emissive_color", "ke"), "emission"),
    **dict.fromkeys(("transmission", "transmissive"), 'model = "dielectric"'),
    "glass": "dielectric",
}
_BARE_KEY = re.compile(r"[\w-]+")
_BOUNDS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}


def build(cls: type[T], table: Any, path: str, mistakes: list[str]) -> T | None:
    """Make a ``cls`` of the keys of ``table``.

    Parameters
    ----------
    cls
        A dataclass of :mod:`fragtracer.scene`.
    table
        What the file holds, a mapping if it is right.
    path
        Where it stands in the file, as "sphere[2]", for the messages; indices count from 0.
    mistakes
        Takes "path: sentence" for each mistake.

    Returns
    -------
    object or None
        None if there is a mistake.
    """
    if not isinstance(table, dict):
        mistakes.append(f"{path}: must be a table, with a line for each of its keys, got {show(table)}")
        return None
    try:
        return cls(**table)
    except ValidationError as error:
        names = [field.name for field in fields(cls)]  # type: ignore[arg-type]  # mypy does not see a dataclass
        known = {key: value for key, value in table.items() if key in names}
        if known == table:
            details = error.errors(include_url=False)
            mistakes += dict.fromkeys(_sentence(cls, table, path, detail) for detail in details)
        else:
            unknown = (key for key in table if key not in names)
            mistakes += [f"{join(path, key)}: there is no such key; {suggest(key, names)}" for key in unknown]
            build(cls, known, path, mistakes)
        return None


def plain(item: Any) -> dict[str, Any]:
    """The fields of a dataclass that differ from their default, by name: the inverse of :func:`build`."""
    values = {field.name: (getattr(item, field.name), field.default) for field in fields(item)}
    return {name: value for name, (value, default) in values.items() if default is MISSING or value != default}


def suggest(name: str, allowed: Iterable[str]) -> str:
    """The allowed names, the most similar to ``name`` first, and what was probably meant."""
    likeness = {known: difflib.SequenceMatcher(None, name, known).ratio() for known in allowed}
    synonym = _SYNONYMS.get(name.lower(), "")
    if (key := synonym.partition(" ")[0]) in likeness:
        likeness[key] = 2.0
    ranked = sorted(likeness, key=likeness.__getitem__, reverse=True)
    is_likely = ranked and (likeness[ranked[0]] >= 0.6 or ranked[0].startswith(name))
    guess = f"did you mean {synonym if key in likeness else ranked[0]}? " if is_likely else ""
    return f"{guess}choose from {', '.join(ranked)}"


def join(path: str, key: str) -> str:
    """The path of ``key`` in the table at ``path``, quoted as TOML wants it."""
    name = key if _BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)
    return f"{path}.{name}" if path else name


def show(value: Any) -> str:
    """A value in TOML notation, truncated to one short line."""
    match value:
        case Mapping():
            return "a table"
        case [Mapping(), *_]:
            return "an array of tables"
        case bool() | str():
            text = json.dumps(value, ensure_ascii=False)
        case list():
            text = f"[{', '.join(show(item) for item in value[:5])}{', …' if len(value) > 5 else ''}]"
        case _:
            text = str(value)
    return text if len(text) <= 60 else text[:59] + "…"


def _sentence(cls: type, table: Mapping[str, Any], path: str, detail: ErrorDetails) -> str:
    if not detail["loc"]:
        return _whole_table(table, path, str(detail["ctx"]["error"]))
    name = str(detail["loc"][0])
    path, value, expected = join(path, name), table.get(name), _expected(cls, name)
    if name not in table:
        return f"{path}: is missing; give {expected}"
    for index in map(int, detail["loc"][1:]):
        if isinstance(value, list) and index < len(value):
            path, value, expected = f"{path}[{index}]", value[index], _ITEMS[expected]
    if detail["type"] == "finite_number":
        expected = "a finite number"
    for key, limit in detail.get("ctx", {}).items():
        expected = f"{_BOUNDS[key]} {limit:.15g}" if key in _BOUNDS else expected
    meant = _SYNONYMS.get(value.lower(), "") if isinstance(value, str) else ""
    hint = f"; did you mean {show(meant)}?" if meant and show(meant) in expected else ""
    return f"{path}: must be {expected}, got {show(value)}{hint}"


def _expected(cls: type, name: str) -> str:
    annotation = {field.name: field.type for field in fields(cls)}[name]
    if get_origin(annotation) in (Union, types.UnionType):
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is Literal:
        return f"one of {', '.join(map(show, get_args(annotation)))}"
    if annotation not in _KINDS and get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    return _KINDS[annotation]


def _whole_table(table: Mapping[str, Any], path: str, text: str) -> str:
    """The message of a check of a whole dataclass: at the field with whose name ``text`` begins, or at the table."""
    name, _, rest = text.partition(" ")
    if name in table and rest.startswith("must "):
        head, semicolon, advice = rest.partition(";")
        return f"{join(path, name)}: {head}, got {show(table[name])}{semicolon}{advice}"
    if name in table and rest.startswith("'"):
        return f"{join(path, name)}: {rest}"
    given = [f"{key} = {show(value)}" for key, value in table.items() if re.search(rf"\b{re.escape(key)}\b", text)]
    return f"{path}: {text}" + (f" ({', '.join(given)})" if given else "")
