# SPDX-License-Identifier: MIT
"""``[[mesh]]`` tables of a scene file: model files and their instances."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from fragtracer.errors import OutputError, SceneError
from fragtracer.io import AnimationError, Model, open_gltf, qualified, read_model
from fragtracer.io.model import stem
from fragtracer.io.toml.tables import build, join, plain, show, suggest
from fragtracer.io.toml.textures import relative
from fragtracer.scene import Material, Mesh, Placement, Pose, Scene

_PLACEMENT = tuple(item.name for item in fields(Placement))
_POSE = tuple(item.name for item in fields(Pose))
_TEXTS = ("file", "name", "material")
KEYS = (*_TEXTS, *_POSE, *_PLACEMENT, "instance")


@dataclass
class Models:
    """The models of one scene, their materials qualified by the name of the file, as "box/wood".

    Files of the same name in other folders are numbered: "box-2/wood".
    """

    _prefixes: dict[str, Path] = field(default_factory=dict)

    def get(self, file: str | Path, pose: Pose | None = None) -> Model:
        """The model in ``file``. Raises SceneError if it cannot be read, AnimationError if it has no such ``pose``."""
        path = Path(os.path.abspath(file))
        number, prefix = 1, stem(path)
        while self._prefixes.setdefault(prefix, path) != path:
            number += 1
            prefix = f"{stem(path)}-{number}"
        return qualified(read_model(path, pose), prefix)


def read_meshes(value: Any, folder: Path, mistakes: list[str]) -> tuple[list[Mesh], dict[str, Material]]:
    """Make the meshes of a scene file.

    Parameters
    ----------
    value
        What the file holds under "mesh".
    folder
        What the paths in the file are relative to.
    mistakes
        Takes "path: sentence" for each mistake.

    Returns
    -------
    meshes : list
        Those without a mistake.
    materials : dict
        Those of the model files.
    """
    if not isinstance(value, list):
        mistakes.append(f"mesh: must be an array of tables, each opened by [[mesh]], got {show(value)}")
        return [], {}
    models, meshes, materials = Models(), [], {}
    for index, table in enumerate(value):
        found = _mesh(table, f"mesh[{index}]", folder, models, mistakes)
        if found is not None:
            meshes.append(found[0])
            materials.update(found[1])
    return meshes, materials


def pose_tables(tables: list[Any], scene: Path, animation: str | None, time: float | None) -> None:
    """Have the tables of those models that have the ``animation`` ask for it at ``time``; where it is left out, those
    that ask for one already. ``scene`` is the file that they are of.

    Raises
    ------
    AnimationError
        If there is none.
    """
    named = [table for table in tables if isinstance(table, dict) and isinstance(table.get("file"), str)]
    chosen, problems = [], []
    for table in named:
        try:
            if animation is not None:
                open_gltf(scene.parent / table["file"]).animations.index(animation)
            if animation is not None or "animation" in table:
                chosen.append(table)
        except SceneError as error:
            problems.append(str(error))
    if not chosen:
        found = "; ".join(dict.fromkeys(problems)) or "none of its meshes is in an animation"
        raise AnimationError(f"{scene}: {found}")
    for table in chosen:
        table.pop("time", None)
        table |= {key: value for key, value in (("animation", animation), ("time", time)) if value is not None}


def _mesh(
    table: Any, path: str, folder: Path, models: Models, mistakes: list[str]
) -> tuple[Mesh, dict[str, Material]] | None:
    if not isinstance(table, Mapping):
        mistakes.append(f"{path}: must be a table, with a line for each of its keys, got {show(table)}")
        return None
    before = len(mistakes)
    mistakes += [f"{join(path, key)}: there is no such key; {suggest(key, KEYS)}" for key in table if key not in KEYS]
    for key in _TEXTS:
        if key in table and not isinstance(table[key], str):
            mistakes.append(f"{path}.{key}: must be a text in quotes, got {show(table[key])}")
    instances = _instances(table, path, mistakes)
    pose = {key: table[key] for key in _POSE if key in table}
    posed = build(Pose, pose, path, mistakes) if pose else None
    if not isinstance(table.get("file"), str):
        mistakes += [] if "file" in table else [f"{path}.file: is missing; name a model"]
        return None
    try:
        model = models.get(folder / table["file"], posed)
    except SceneError as error:
        key = "animation" if isinstance(error, AnimationError) else "file"
        mistakes.append(f"{path}.{key}: {error}")
        return None
    if len(mistakes) > before:
        return None
    changes = {key: table[key] for key in ("name", "material") if key in table}
    return replace(model.mesh, instances=instances, **changes), model.materials


def _instances(table: Mapping[str, Any], path: str, mistakes: list[str]) -> tuple[Placement, ...]:
    own = {key: table[key] for key in _PLACEMENT if key in table}
    tables = table.get("instance", [])
    if not isinstance(tables, list):
        mistakes.append(f"{path}.instance: must be an array of tables, each opened by [[mesh.instance]]")
        return ()
    if own and "instance" in table:
        mistakes.append(f"{path}: move {', '.join(own)} into the [[mesh.instance]] tables, one for each instance")
    placed = [build(Placement, item, f"{path}.instance[{index}]", mistakes) for index, item in enumerate(tables)]
    placed = placed if "instance" in table else [build(Placement, own, path, mistakes)]
    return tuple(item for item in placed if item is not None)


def plain_meshes(scene: Scene, folder: Path) -> tuple[list[dict[str, Any]], dict[str, Material]]:
    """The ``[[mesh]]`` tables for a file in ``folder``, of the meshes that have triangles, and the materials that come
    with the model files.

    Raises
    ------
    OutputError
        If a mesh has no file, or differs from the content of its file.
    """
    models, tables, materials = Models(), [], {}
    for index, mesh in enumerate(scene.meshes):
        if not has_triangles(mesh):
            continue
        model = _stored(mesh, models)
        if model is None or mesh.file is None:
            raise OutputError(f"mesh[{index}]: {mesh.name} is in no file; fragtracer.save writes one beside the scene")
        materials.update(model.materials)
        tables.append(_plain_mesh(mesh, folder))
    return tables, materials


def has_triangles(mesh: Mesh) -> bool:
    return any(len(part.geometry.triangles) for part in mesh.parts)


def is_stored(mesh: Mesh, models: Models) -> bool:
    """Whether the file of ``mesh`` holds its parts. Call it for the meshes of a scene in their order."""
    return _stored(mesh, models) is not None


def _stored(mesh: Mesh, models: Models) -> Model | None:
    if mesh.file is None:
        return None
    try:
        model = models.get(mesh.file, mesh.pose)
    except SceneError:
        return None
    return model if model.mesh.parts == mesh.parts else None


def _plain_mesh(mesh: Mesh, folder: Path) -> dict[str, Any]:
    assert mesh.file is not None
    table: dict[str, Any] = {"file": relative(mesh.file, folder)}
    if mesh.name != stem(mesh.file):
        table["name"] = mesh.name
    if mesh.material is not None:
        table["material"] = mesh.material
    if mesh.pose is not None:
        table |= plain(mesh.pose)
    placed = [_plain_placement(item) for item in mesh.instances]
    return table | (placed[0] if len(placed) == 1 else {"instance": placed})


def _plain_placement(placement: Placement) -> dict[str, Any]:
    """The fields that are not default, and always the translation: tomli_w would write an empty inline table."""
    return {"translation": placement.translation} | plain(placement)
