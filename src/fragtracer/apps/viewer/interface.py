# SPDX-License-Identifier: MIT
"""The panels and overlays, and the input on them and on the picture; no OpenGL in here."""

import time
from collections.abc import Callable

from imgui_bundle import imgui

from fragtracer.apps.viewer import actions, layout
from fragtracer.apps.viewer.gizmo import Gizmo
from fragtracer.apps.viewer.input import Navigator
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels import display as display_panel
from fragtracer.apps.viewer.panels import marks, menu, objects, overlay, widgets
from fragtracer.apps.viewer.panels import render as render_panel
from fragtracer.apps.viewer.panels import scene as scene_panel
from fragtracer.apps.viewer.panels import statistics as statistics_panel
from fragtracer.apps.viewer.panels.statistics import Figures
from fragtracer.apps.viewer.session import Session
from fragtracer.apps.viewer.statistics import FrameTimes
from fragtracer.apps.viewer.wipe import Wipe
from fragtracer.io import toml


class Interface:
    """Edits ``session`` and drags ``wipe``; ``used_at`` is the time of the last input."""

    def __init__(self, session: Session, wipe: Wipe) -> None:
        self.session, self.wipe = session, wipe
        self.panels_shown, self.help_shown = True, False
        self.used_at = time.perf_counter()
        self._navigator, self._gizmo = Navigator(), Gizmo()
        self._scenes = list(toml.bundled())
        self._reset_layout = False

    def show(self, what: str) -> None:
        """Toggle the "panels" or the "help", or reset the "layout"."""
        match what:
            case "panels":
                self.panels_shown = not self.panels_shown
            case "help":
                self.help_shown = not self.help_shown
            case "layout":
                self._reset_layout = True

    def describe(self, figures: Figures, times: FrameTimes, compares: bool, problem: str) -> tuple[Area, str]:
        """Describe the panels of a frame to imgui, and apply the edits made in them.

        ``compares`` if there is a reference right of the wipe. Returns the area that the panels leave to the
        picture, and the action chosen by a key or in the menu, "" for none.
        """
        chosen = menu.keys()
        area = layout.whole_window()
        if self.panels_shown:
            if imgui.begin_main_menu_bar():
                chosen = menu.draw(self.session, self._scenes) or chosen
                imgui.end_main_menu_bar()
            area = layout.dock_panels(self._reset_layout)
            self._reset_layout = False
            self._docked(figures, times, compares)
        top_of_status = overlay.status(area, figures, times.fps)
        overlay.messages(area, top_of_status, self.session.toast, problem)
        if self.help_shown:
            overlay.help_window(area)
        self._navigate(area, compares)
        if not (imgui.is_any_item_active() or imgui.is_mouse_down(0)):
            self.session.history.close()
        return area, chosen

    def _docked(self, figures: Figures, times: FrameTimes, compares: bool) -> None:
        panels: dict[str, Callable[[], None]] = {
            "Scene": lambda: scene_panel.draw(self.session),
            "Render": self._render_panel,
            "Display": lambda: self._display_panel(compares),
            "Statistics": lambda: statistics_panel.draw(figures, times),
        }
        for name, draw in panels.items():
            if imgui.begin(name)[0]:
                draw()
            imgui.end()

    def _render_panel(self) -> None:
        document = self.session.document
        scene = widgets.edited(document.scene, render=render_panel.edit(document.scene.render))
        self.session.edit(widgets.edited(document, scene=scene), "render settings")
        render_panel.limits(self.session)

    def _display_panel(self, compares: bool) -> None:
        self.session.display = display_panel.edit(self.session.display, compares)

    def _navigate(self, area: Area, compares: bool) -> None:
        session = self.session
        session.display = self.wipe.drag(area, session.display, compares)
        if self.panels_shown:
            marks.draw(session.camera, area, session.posed, session.selected)
        self._drag_selected(area)
        blocked = self._gizmo.takes_mouse or self.wipe.takes_mouse
        session.camera, click = self._navigator.navigate(session.camera, area, blocked)
        if click is not None:
            actions.click(session, click, area.width / area.height, has_marks=self.panels_shown)
        io = imgui.get_io()
        moved = io.mouse_delta.x or io.mouse_delta.y or io.mouse_wheel
        if moved or any(io.mouse_down[:3]) or imgui.is_any_item_active():
            self.used_at = time.perf_counter()

    def _drag_selected(self, area: Area) -> None:
        session, place = self.session, self.session.selected
        part = None if place is None or place in session.document.hidden else session.document.part(place)
        step = self._gizmo.drag(session.camera, area, part)
        if step is not None and place is not None:
            with session.checked():  # two dielectrics that overlap cannot have the same priority
                session.edit(session.document.with_part(place, objects.moved(part, step)), f"drag {place}")
