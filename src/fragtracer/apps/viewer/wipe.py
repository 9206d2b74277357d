# SPDX-License-Identifier: MIT
"""The comparison on the screen: a line to drag, with fragtracer's picture on its left and on its right the
reference, or a map of the difference. The reference is Mitsuba's picture; that of the split-sum approximation
is the path-traced one."""

from dataclasses import replace
from typing import Literal

from imgui_bundle import imgui

from fragtracer.apps.viewer.display import Display, DisplaySettings
from fragtracer.apps.viewer.finding import LOOKS
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.apps.viewer.panels import difference, maps, significance
from fragtracer.apps.viewer.reference import BATCH, Image, LiveReference
from fragtracer.apps.viewer.significance import SPP, Batches, Significance
from fragtracer.errors import DeviceError
from fragtracer.scene import Scene

Mode = Literal["", "reference", "significance"]
_AFTER: dict[Mode, Mode] = {"": "reference", "reference": "significance", "significance": ""}
_GRIP = 8.0  # units to both sides of the line


class Wipe:
    """Holds the reference of the scene on the screen, and drops it when the scene changes."""

    def __init__(self) -> None:
        self.mode: Mode = ""
        self._reference: LiveReference | None = None
        self._of: tuple[Scene, tuple[int, int]] | None = None
        self._shown = 0
        self._dragging = False
        self._batches: Batches | None = None
        self._significance = Significance()
        self.takes_mouse = False

    @property
    def is_on(self) -> bool:
        return self._reference is not None

    @property
    def image(self) -> Image | None:
        """The reference so far."""
        return None if self._reference is None else self._reference.image

    @property
    def significance(self) -> Significance:
        return self._significance

    def step(self, scene: Scene, size: tuple[int, int]) -> None:
        """Switch from nothing to the reference of ``scene``, then to the map, then to nothing."""
        mode = _AFTER[self.mode]
        if mode == "reference":
            self.start(scene, size)
        elif not mode:
            self.stop()
        self.mode = mode

    def start(self, scene: Scene, size: tuple[int, int]) -> None:
        """Begin to render the reference of ``scene``."""
        self.stop()
        self._reference, self._of, self._shown = LiveReference(scene, size), (scene, size), 0
        self.mode = "reference"

    def stop(self) -> None:
        if self._reference is not None:
            self._reference.stop()
        self._reference, self.mode = None, ""
        self.forget_ours()

    def forget_ours(self) -> None:
        """Discard our pictures: they were drawn by another program."""
        if self._batches is not None:
            self._batches.release()
        self._batches = None
        self._significance.release()
        self._significance = Significance()

    def update(self, scene: Scene, size: tuple[int, int], display: Display) -> str:
        """Show the newest reference; returns a problem, or "". Stops when the scene or size has changed."""
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
        if self._batches is not None and self._name == "Mitsuba":
            self._significance.look(self._batches.means, reference.means, self._batches.non_finite)
        if reference.problem:
            self.stop()
            return f"{self._name}: {reference.problem}"
        return ""

    @property
    def wants_pictures(self) -> bool:
        """Whether :meth:`draw_ours` has something to do."""
        return self.mode == "significance" and not (self._batches is not None and self._batches.is_complete)

    def draw_ours(self, renderer: LiveRenderer, seconds: float) -> float:
        """Draw more of our pictures of what ``renderer`` shows, for about ``seconds``; returns how long it took."""
        try:
            if self._batches is None:
                self._batches = Batches(renderer)
            return self._batches.draw(seconds)
        except DeviceError:
            self.stop()
            raise

    def drag(self, area: Area, settings: DisplaySettings, compares: bool) -> DisplaySettings:
        """Draw the line, its labels and the map, and follow the mouse that drags the line."""
        self.takes_mouse = False
        if not self.is_on:
            return settings
        x = area.x + settings.wipe * area.width
        if self.mode == "significance":
            self._draw_map(area, x)
        draw = imgui.get_background_draw_list()
        if compares:
            white = imgui.get_color_u32(imgui.ImVec4(1, 1, 1, 0.85))
            draw.add_line(imgui.ImVec2(x, area.y), imgui.ImVec2(x, area.y + area.height), white, 1.5)
            draw.add_circle_filled(imgui.ImVec2(x, area.y + area.height / 2), 6.0, white)
            ours = "fragtracer" if self._name == "Mitsuba" else "Split sum"
            maps.label(x - 12, area.y + 10, ours, to_the_left=True)
        if self.mode == "significance":
            title = "Significance of the difference" if self._name == "Mitsuba" else "Error of the split sum"
            maps.label(x + 12, area.y + 10, title)
        else:
            maps.label(x + 12, area.y + 10, f"{self._name}, {self._shown} spp" if compares else f"{self._name} …")
        return self._follow(area, settings, x) if compares else settings

    @property
    def _name(self) -> str:
        """Who made the reference."""
        is_split_sum = self._of is not None and self._of[0].render.integrator == "split-sum"
        return "Path traced" if is_split_sum else "Mitsuba"

    def _draw_map(self, area: Area, x: float) -> None:
        if self._name == "Mitsuba":
            significance.draw(area, x, self._significance.finding, self._progress())
        elif self._batches is not None and self._reference is not None:
            difference.draw(area, x, self._batches.means, self._reference.means)

    def _progress(self) -> str:
        """How many pictures the map is based on, or still waits for."""
        ours = len(self._batches.means) if self._batches is not None else 0
        reference = len(self._reference.means) if self._reference is not None else 0
        finding = self._significance.finding
        if finding is None:
            return f"{min(ours, LOOKS[0])} of {LOOKS[0]} pictures of ours, {min(reference, LOOKS[0])} of Mitsuba’s"
        return f"{finding.pictures} pictures of {SPP} spp against as many of {BATCH} spp"

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
