# SPDX-License-Identifier: MIT
"""The comparison with Mitsuba on the screen: a line to drag, ours on its left, Mitsuba's on its right."""

from dataclasses import replace

from imgui_bundle import imgui

from fragtracer.scene import Scene
from fragtracer.viewer.display import Display, DisplaySettings
from fragtracer.viewer.layout import Area
from fragtracer.viewer.reference import Image, LiveReference

_GRIP = 8.0  # units to both sides of the line


class Wipe:
    """Holds the reference of the scene on the screen, and lets go of it when that changes."""

    def __init__(self) -> None:
        self._reference: LiveReference | None = None
        self._of: tuple[Scene, tuple[int, int]] | None = None
        self._shown = 0
        self._dragging = False
        self.takes_mouse = False

    @property
    def is_on(self) -> bool:
        return self._reference is not None

    @property
    def image(self) -> Image | None:
        """Mitsuba's picture so far."""
        return None if self._reference is None else self._reference.image

    def start(self, scene: Scene, size: tuple[int, int]) -> None:
        """Begin to render ``scene`` with Mitsuba."""
        self.stop()
        self._reference, self._of, self._shown = LiveReference(scene, size), (scene, size), 0

    def stop(self) -> None:
        if self._reference is not None:
            self._reference.stop()
        self._reference = None

    def update(self, scene: Scene, size: tuple[int, int], display: Display) -> str:
        """Show what has come; returns a problem, if there is one. Ends when the scene is another one."""
        reference = self._reference
        if reference is not None and (scene, size) != self._of:
            self.stop()
        if self._reference is None:
            if display.compares:
                display.compare_with(None)
            return ""
        assert reference is not None
        if reference.spp != self._shown and reference.image is not None:
            self._shown = reference.spp
            display.compare_with(reference.image)
        if reference.problem:
            self.stop()
            return f"Mitsuba: {reference.problem}"
        return ""

    def drag(self, area: Area, settings: DisplaySettings, compares: bool) -> DisplaySettings:
        """Draw the line and its labels, and follow the mouse that drags it."""
        self.takes_mouse = False
        if not self.is_on:
            return settings
        x = area.x + settings.wipe * area.width
        draw = imgui.get_background_draw_list()
        white = imgui.get_color_u32(imgui.ImVec4(1, 1, 1, 0.85))
        if compares:
            draw.add_line(imgui.ImVec2(x, area.y), imgui.ImVec2(x, area.y + area.height), white, 1.5)
            draw.add_circle_filled(imgui.ImVec2(x, area.y + area.height / 2), 6.0, white)
            draw.add_text(imgui.ImVec2(x - 82, area.y + 10), white, "fragtracer")
        draw.add_text(
            imgui.ImVec2(x + 12, area.y + 10), white, f"Mitsuba, {self._shown} spp" if compares else "Mitsuba …"
        )
        return self._follow(area, settings, x) if compares else settings

    def _follow(self, area: Area, settings: DisplaySettings, x: float) -> DisplaySettings:
        io = imgui.get_io()
        near = area.holds(*io.mouse_pos) and abs(io.mouse_pos.x - x) < _GRIP and not io.want_capture_mouse
        if near and imgui.is_mouse_clicked(0):
            self._dragging = True
        self._dragging = self._dragging and imgui.is_mouse_down(0)
        self.takes_mouse = near or self._dragging
        if self.takes_mouse:
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        if not self._dragging:
            return settings
        return replace(settings, wipe=min(1.0, max(0.0, (io.mouse_pos.x - area.x) / area.width)))
