# SPDX-License-Identifier: MIT
"""The list of what is in the scene, and where one thing of it is."""

from typing import Any

from imgui_bundle import imgui

from fragtracer.scene import Light, Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.viewer.document import KINDS, Document, Part
from fragtracer.viewer.panels import widgets
from fragtracer.viewer.theme import MUTED


def choose(document: Document, selected: Part | None) -> tuple[Document, Part | None]:
    """A list with a check box for each part, whether it is seen, and the one that is selected."""
    for kind in KINDS:
        for index, part in enumerate(getattr(document.scene, kind)):
            place = (kind, index)
            imgui.push_id(f"{kind}{index}")
            seen = place not in document.hidden
            imgui.push_style_var(imgui.StyleVar_.frame_padding, imgui.ImVec2(1, 1))
            changed, seen = imgui.checkbox("##seen", seen)
            imgui.pop_style_var()
            imgui.set_item_tooltip("Seen, or hidden for now")
            if changed:
                document = document.with_hidden(place, not seen)
            imgui.same_line()
            if imgui.selectable(title(document.scene, place), place == selected)[0]:
                selected = None if place == selected else place
            if not isinstance(part, Light):
                imgui.same_line(imgui.get_content_region_avail().x * 0.62)
                imgui.text_colored(MUTED, part.material)
            imgui.pop_id()
    return document, selected


def title(scene: Scene, part: Part) -> str:
    """What a part is called, counted from 1."""
    kind, index = part
    return f"{kind.removesuffix('s').capitalize()} {index + 1}"


def edit(part: Any, materials: list[str]) -> Any:
    """Controls for the place and size of an object, and which material it has."""
    new: dict[str, Any] = {"material": widgets.choice("Material", part.material, materials)}
    match part:
        case Sphere():
            new["center"] = widgets.point("Centre", part.center)
            new["radius"] = widgets.number("Radius", part.radius, 0.005, 1e-4, 1e6, "%.3f m")
        case Plane():
            new["point"] = widgets.point("Through", part.point)
        case Rectangle():
            new["corner"] = widgets.point("Corner", part.corner)
        case Triangle():
            vertices = [widgets.point(f"Vertex {i + 1}", v) for i, v in enumerate(part.vertices)]
            new["vertices"] = tuple(vertices)
    return widgets.edited(part, **new)


def moved(part: Any, step: tuple[float, float, float]) -> Any:
    """A part of a scene, shifted by metres."""

    def shifted(v: tuple[float, float, float]) -> tuple[float, float, float]:
        return v[0] + step[0], v[1] + step[1], v[2] + step[2]

    if isinstance(part, Triangle):
        return widgets.edited(part, vertices=tuple(shifted(v) for v in part.vertices))
    names = {Sphere: "center", Plane: "point", Rectangle: "corner", Light: "position"}
    name = names[type(part)]
    return widgets.edited(part, **{name: shifted(getattr(part, name))})
