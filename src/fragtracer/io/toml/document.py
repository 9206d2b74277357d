# SPDX-License-Identifier: MIT
"""The tables of a scene file, as a TOML parser returns them, to a :class:`Scene` and back."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fragtracer.io.toml.environments import environment, plain_environment
from fragtracer.io.toml.media import plain_medium, read_medium
from fragtracer.io.toml.meshes import plain_meshes, read_meshes
from fragtracer.io.toml.tables import build, join, plain, show, suggest
from fragtracer.io.toml.textures import TEXTURES, SceneImages, plain_texture, texture
from fragtracer.scene import LIGHTS, SHAPES, Ambient, Camera, Fog, Material, RenderSettings, Scene
from fragtracer.scene.reflectance import DIELECTRIC_F0

_TABLES = {"camera": Camera, "render": RenderSettings, "ambient": Ambient, "fog": Fog}
_ARRAYS = {name.removesuffix("s"): cls for name, cls in (LIGHTS | SHAPES).items()}
_KEYS = ("description", *_TABLES, "environment", "material", "medium", "mesh", *_ARRAYS)


def from_document(document: Mapping[str, Any], name: str, folder: Path, mistakes: list[str]) -> Scene | None:
    """Make a scene.

    Parameters
    ----------
    document
        The tables of the file by their names in the file.
    name
        The name that the scene gets.
    folder
        What the paths in the file are relative to.
    mistakes
        Takes "path: sentence" for each mistake.

    Returns
    -------
    Scene or None
        None if there is a mistake.
    """
    images = SceneImages(folder)
    values = {key: _section(key, value, images, mistakes) for key, value in document.items() if key != "mesh"}
    values["mesh"], found = read_meshes(document.get("mesh", []), folder, mistakes)
    mistakes += _missing_materials(document, found)
    if mistakes:
        return None
    values["material"] = {**found, **values.get("material", {})}
    plurals = {"material": "materials", "medium": "media", "mesh": "meshes", **{key: f"{key}s" for key in _ARRAYS}}
    return _scene({plurals.get(key, key): value for key, value in values.items()} | {"name": name}, mistakes)


def _section(key: str, value: Any, images: SceneImages, mistakes: list[str]) -> Any:
    if key in _ARRAYS:
        return _array(_ARRAYS[key], value, key, mistakes)
    if key in _TABLES and isinstance(value, Mapping):
        return build(_TABLES[key], value, key, mistakes)
    if key == "material" and isinstance(value, Mapping):
        return {name: _material(table, join(key, name), images, mistakes) for name, table in value.items()}
    if key == "medium" and isinstance(value, Mapping):
        return {name: read_medium(item, join(key, name), images.folder, mistakes) for name, item in value.items()}
    if key == "environment" and isinstance(value, Mapping):
        return environment(value, images.folder, mistakes)
    if key == "description" and isinstance(value, str):
        return value
    mistakes.append(f"{join('', key)}: {_misplaced(key, value)}")
    return None


def _misplaced(key: str, value: Any) -> str:
    if key not in _KEYS:
        return f"there is no such key; {suggest(key, _KEYS)}"
    if key == "description":
        return f"must be a text in quotes, got {show(value)}"
    header = f"[{key}.NAME]" if key in ("material", "medium") else f"[{key}]"
    return f"must be a table, written {header}, got {show(value)}"


def _array(cls: type, value: Any, path: str, mistakes: list[str]) -> list[Any]:
    if not isinstance(value, list):
        mistakes.append(f"{path}: must be an array of tables, each opened by [[{path}]], got {show(value)}")
        return []
    return [build(cls, table, f"{path}[{index}]", mistakes) for index, table in enumerate(value)]


def _material(table: Any, path: str, images: SceneImages, mistakes: list[str]) -> Material | None:
    if not isinstance(table, Mapping):
        mistakes.append(f"{path}: a material is a table with a name, written [material.NAME], got {show(table)}")
        return None
    values, f0 = dict(table), table.get("f0")
    if isinstance(f0, str):
        if f0 not in DIELECTRIC_F0:
            names = ", ".join(show(name) for name in DIELECTRIC_F0)
            mistakes.append(f"{path}.f0: must be a number, three numbers [r, g, b] or one of {names}, got {show(f0)}")
        values["f0"] = DIELECTRIC_F0.get(f0, 0.04)
    for key in table:
        if key in TEXTURES:
            values[key] = texture(key, table[key], join(path, key), images, mistakes)
    return build(Material, values, path, mistakes)


def _missing_materials(document: Mapping[str, Any], found: Mapping[str, Material]) -> Iterator[str]:
    materials = document.get("material", {})
    materials = {**materials, **found} if isinstance(materials, Mapping) else materials
    for key in (*(name.removesuffix("s") for name in SHAPES), "mesh"):
        shapes = document.get(key)
        for index, shape in enumerate(shapes if isinstance(shapes, list) else []):
            name = shape.get("material") if isinstance(shape, Mapping) else None
            if isinstance(name, str) and isinstance(materials, Mapping) and name not in materials:
                yield f"{key}[{index}].material: {_no_material(name, list(materials))}"


def _no_material(name: str, materials: list[str]) -> str:
    if not materials:
        return f"there is no material {show(name)}; write a table [{join('material', name)}]"
    return f"there is no material {show(name)}; {suggest(name, materials)}"


def _scene(values: dict[str, Any], mistakes: list[str]) -> Scene | None:
    try:
        scene = Scene(**values)
    except ValidationError as error:
        mistakes += [str(detail["ctx"]["error"]) for detail in error.errors(include_url=False)]
        return None
    is_lit = any(scene.ambient.radiance) or scene.environment is not None
    if is_lit or scene.meshes or any(getattr(scene, f"{key}s") for key in _ARRAYS):
        return scene
    mistakes.append("there is nothing to see: add a shape, a light, an environment or an ambient radiance")
    return None


def to_document(scene: Scene, folder: Path) -> dict[str, Any]:
    """The tables of a scene file in ``folder``, without default values."""
    document: dict[str, Any] = {"description": scene.description} if scene.description else {}
    document |= {key: table for key in _TABLES if (item := getattr(scene, key)) is not None and (table := plain(item))}
    if scene.environment is not None:
        document["environment"] = plain_environment(scene.environment, folder)
    meshes, found = plain_meshes(scene, folder)
    own = {name: item for name, item in scene.materials.items() if found.get(name) != item}
    if own:
        document["material"] = {name: _plain_material(item, folder) for name, item in own.items()}
    if scene.media:
        document["medium"] = {name: plain_medium(item, folder) for name, item in scene.media.items()}
    arrays = {"mesh": meshes, **{key: [plain(item) for item in getattr(scene, f"{key}s")] for key in _ARRAYS}}
    return document | {key: items for key, items in arrays.items() if items}


def _plain_material(material: Material, folder: Path) -> dict[str, Any]:
    values = plain(material).items()
    return {key: plain_texture(key, item, folder) if key in TEXTURES else item for key, item in values}
