# SPDX-License-Identifier: MIT
"""Marks over the picture where lights are that have no surface to be seen: point lights and spot lights."""

import numpy as np
from imgui_bundle import imgui

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.document import Document, Part
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels.maps import packed
from fragtracer.apps.viewer.picking import MARK, marked
from fragtracer.apps.viewer.theme import ACCENT
from fragtracer.scene import Camera, SpotLight

_COLOR = (1.0, 0.93, 0.7, 0.9)
_RAYS = 8
_ARM = 4.0  # radii of a mark that the axis of a spot light is long


def draw(camera: Camera, area: Area, document: Document, selected: Part | None) -> None:
    """Draw the mark of each visible one; the ``selected`` one in the colour of what is active."""
    canvas = imgui.get_background_draw_list()
    corners = imgui.ImVec2(area.x, area.y), imgui.ImVec2(area.x + area.width, area.y + area.height)
    canvas.push_clip_rect(*corners, True)
    for part, light in marked(document):
        center = _on_screen(camera, area, light.position)
        if center is None:
            continue
        color = packed(*ACCENT) if part == selected else packed(*_COLOR)
        if isinstance(light, SpotLight):
            _draw_axis(canvas, camera, area, light, center, color)
        _draw_sun(canvas, center, MARK * area.height, color)
    canvas.pop_clip_rect()


def _draw_sun(canvas: imgui.ImDrawList, center: imgui.ImVec2, radius: float, color: int) -> None:
    canvas.add_circle_filled(center, 0.4 * radius, color)
    for angle in 2 * np.pi * np.arange(_RAYS) / _RAYS:
        x, y = float(np.cos(angle)), float(np.sin(angle))
        inner = imgui.ImVec2(center.x + 0.6 * radius * x, center.y + 0.6 * radius * y)
        canvas.add_line(inner, imgui.ImVec2(center.x + radius * x, center.y + radius * y), color, 1.5)


def _draw_axis(
    canvas: imgui.ImDrawList, camera: Camera, area: Area, light: SpotLight, center: imgui.ImVec2, color: int
) -> None:
    """A line along the direction of ``light``, as long as some marks are at its distance."""
    depth = float(np.subtract(light.position, camera.position) @ cameras.axes(camera)[2])
    length = _ARM * 2 * MARK * depth * np.tan(np.radians(camera.fov_degrees) / 2)
    direction = np.asarray(light.direction) / np.linalg.norm(light.direction)
    end = _on_screen(camera, area, (light.position + length * direction).tolist())
    if end is not None:
        canvas.add_line(center, end, color, 1.5)


def _on_screen(camera: Camera, area: Area, point: tuple[float, float, float]) -> imgui.ImVec2 | None:
    place = cameras.project(camera, point, area.width / area.height)
    return None if place is None else imgui.ImVec2(area.x + place[0] * area.width, area.y + place[1] * area.height)
