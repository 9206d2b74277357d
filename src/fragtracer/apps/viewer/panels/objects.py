# SPDX-License-Identifier: MIT
"""The list of objects and lights, and the controls of one object."""

from bisect import bisect_right
from dataclasses import Field, fields
from itertools import accumulate
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from fragtracer.apps.viewer.document import KINDS, Document, Part, materials_of
from fragtracer.apps.viewer.panels import widgets
from fragtracer.apps.viewer.theme import MUTED
from fragtracer.scene import Mesh, Placement, Scene, Vector
from fragtracer.scene.fields import Point, Points, Positive

_OWN = "its own"
_MOST_INSTANCES = 8  # that are shown
_SMALLEST = 1e-6  # of what is looked at, that a size can be dragged to


def choose(document: Document, selected: Part | None) -> tuple[Document, Part | None]:
    """A list with a check box for the visibility of each part; returns the document and what is selected."""
    ends = [*accumulate(len(getattr(document.scene, kind)) for kind in KINDS)]
    rows = imgui.ListClipper()
    rows.begin(ends[-1])
    while rows.step():
        for row in range(rows.display_start, rows.display_end):
            kind = bisect_right(ends, row)
            place = KINDS[kind], row - (ends[kind - 1] if kind else 0)
            imgui.push_id(f"{place}")
            document, selected = _row(document, selected, place)
            imgui.pop_id()
    return document, selected


def _row(document: Document, selected: Part | None, place: Part) -> tuple[Document, Part | None]:
    part = document.part(place)
    seen = place not in document.hidden
    imgui.push_style_var(imgui.StyleVar_.frame_padding, imgui.ImVec2(1, 1))
    changed, seen = imgui.checkbox("##seen", seen)
    imgui.pop_style_var()
    imgui.set_item_tooltip("Visible in the picture")
    if changed:
        document = document.with_hidden(place, not seen)
    imgui.same_line()
    if imgui.selectable(title(document.scene, place), place == selected)[0]:
        selected = None if place == selected else place
    if names := materials_of(part):
        imgui.same_line(imgui.get_content_region_avail().x * 0.62)
        imgui.text_colored(MUTED, names[0] if len(names) == 1 else f"{len(names)} materials")
    return document, selected


def title(scene: Scene, part: Part) -> str:
    """The name of a part if it has one, else its kind with a number from 1."""
    kind, index = part
    name = getattr(getattr(scene, kind)[index], "name", "mesh")
    singular = {"meshes": "mesh"}.get(kind, kind.removesuffix("s")).replace("_", " ")
    return f"{singular.capitalize()} {index + 1}" if name == "mesh" else str(name)


def edit(part: Any, materials: list[str], around: float) -> Any:
    """Controls for the position, size and material of an object, of which ``around`` metres are looked at."""
    if isinstance(part, Mesh):
        return _mesh(part, materials, around)
    material = widgets.choice("Material", part.material, materials)
    rest = (field for field in fields(part) if field.name != "material")
    new = {field.name: _control(field, getattr(part, field.name), around) for field in rest}
    return widgets.edited(part, material=material, **new)


def _control(field: Field[Any], value: Any, around: float) -> Any:
    """The control of a length, a vector or several places."""
    name = field.name.capitalize().replace("_", " ")
    if field.type == Positive:
        return widgets.length(name, value, around, _SMALLEST)
    if field.type == Vector:
        return widgets.vector(name, value)
    if field.type == Point:
        return widgets.point(name, value, around)
    return tuple(widgets.point(f"{name} {i + 1}", v, around) for i, v in enumerate(value))


def _mesh(mesh: Mesh, materials: list[str], around: float) -> Mesh:
    """Controls for the instances of a mesh and the material that may replace its own."""
    count = sum(len(part.geometry.triangles) for part in mesh.parts)
    widgets.pair("Triangles", f"{count:,}" + (f" × {len(mesh.instances)}" if len(mesh.instances) > 1 else ""))
    if mesh.file:
        widgets.pair("File", Path(mesh.file).name)
    chosen = widgets.choice("Material", mesh.material or _OWN, [_OWN, *materials])
    instances = list(mesh.instances)
    for i, placement in enumerate(instances[:_MOST_INSTANCES]):
        if len(instances) > 1:
            imgui.separator_text(f"Instance {i + 1}")
        imgui.push_id(i)
        instances[i] = _placement(placement, around)
        imgui.pop_id()
    if len(instances) > _MOST_INSTANCES:
        imgui.text_colored(MUTED, f"and {len(instances) - _MOST_INSTANCES} more instances")
    return widgets.edited(mesh, material=None if chosen == _OWN else chosen, instances=tuple(instances))


def _placement(placement: Placement, around: float) -> Placement:
    new = {
        "translation": widgets.point("Translation", placement.translation, around),
        "rotation_degrees": widgets.triple("Rotation", placement.rotation_degrees, 0.5),
        "scale": widgets.vector("Scale", placement.scale),
    }
    return widgets.edited(placement, **new)


def moved(part: Any, step: tuple[float, float, float]) -> Any:
    """``part``, an object or light with a position, translated by ``step`` metres."""

    def shifted(v: tuple[float, float, float]) -> tuple[float, float, float]:
        return v[0] + step[0], v[1] + step[1], v[2] + step[2]

    if isinstance(part, Mesh):
        instances = (widgets.edited(p, translation=shifted(p.translation)) for p in part.instances)
        return widgets.edited(part, instances=tuple(instances))
    values = {field.name: (field.type, getattr(part, field.name)) for field in fields(part)}
    new = {name: shifted(value) for name, (kind, value) in values.items() if kind == Point}
    several = {name: value for name, (kind, value) in values.items() if kind == Points}
    return widgets.edited(part, **new, **{name: tuple(map(shifted, value)) for name, value in several.items()})
