# SPDX-License-Identifier: MIT
"""Camera navigation by mouse and keys, with the gestures of Blender and Maya."""

from dataclasses import dataclass

import numpy as np
from imgui_bundle import imgui

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.layout import Area
from fragtracer.scene import Camera

_TURN = np.pi  # radians for a drag over the height of the picture
_DOLLY = 0.88  # of the distance for each click of the wheel
_CLICK = 4.0  # units of movement below which a press is a click
_WALK = 0.8  # of the distance to the target in each second
_RUN = 4.0

HELP = (
    ("Orbit the target", "drag, middle drag, Alt+drag"),
    ("Pan", "Shift+middle drag, Shift+drag, Alt+middle drag"),
    ("Dolly", "wheel, Ctrl+middle drag, Alt+right drag"),
    ("Look around", "right drag"),
    ("Fly", "W A S D, Q down, E up, Shift faster"),
    ("Select an object, a light or its mark", "click"),
    ("Focus the lens on a point", "Ctrl+click"),
    ("Frame the selection", "F"),
    ("Home", "Home"),
    ("Viewpoint: go to, save", "1 … 9, Ctrl+1 … 9"),
    ("Pause refining, play animations", "Space, P"),
    ("Hide the selection, show all", "H, Alt+H"),
    ("Remove the selection", "Delete"),
    ("Undo, redo", "Ctrl+Z, Ctrl+Shift+Z"),
    ("Save scene, save image", "Ctrl+S, F12"),
    ("Compare with Mitsuba, see significance", "M, M again; drag the line"),
    ("Panels on and off", "Tab"),
    ("Dismiss a message", "Escape"),
    ("This list", "F1"),
)


@dataclass
class Click:
    """Where in the picture was clicked, x to the right and y down from 0 to 1."""

    x: float
    y: float
    focuses: bool  # Ctrl was held


class Navigator:
    """Tells clicks on the picture from drags, and moves the camera by drags, wheel and keys."""

    def __init__(self) -> None:
        self._drag = ""
        self._travel = 0.0

    def navigate(self, camera: Camera, area: Area, blocked: bool) -> tuple[Camera, Click | None]:
        """The camera after this frame's input and the click on the picture, if there was one.

        ``blocked`` says that something over the picture, such as a gizmo, takes the mouse.
        """
        io = imgui.get_io()
        over = area.holds(*io.mouse_pos) and not io.want_capture_mouse and not blocked
        click = self._follow_buttons(over, area)
        if self._drag and self._travel >= _CLICK:
            camera = _dragged(camera, self._drag, io.mouse_delta.x / area.height, io.mouse_delta.y / area.height)
        if over and (io.mouse_wheel or io.mouse_wheel_h):
            camera = _scrolled(camera, io)
        if not io.want_text_input:
            camera = _walked(camera, io)
        return camera, click

    def _follow_buttons(self, over: bool, area: Area) -> Click | None:
        io = imgui.get_io()
        click = None
        if self._drag:
            self._travel += abs(io.mouse_delta.x) + abs(io.mouse_delta.y)
            if not any(io.mouse_down[:3]):
                if self._travel < _CLICK and self._drag in ("orbit", "focus", "pan"):
                    x, y = (io.mouse_pos.x - area.x) / area.width, (io.mouse_pos.y - area.y) / area.height
                    click = Click(x, y, self._drag == "focus")
                self._drag = ""
        elif over:
            pressed = next((b for b in range(3) if imgui.is_mouse_clicked(b)), None)
            if pressed is not None:
                self._drag, self._travel = _gesture(pressed, io), 0.0
        return click


def _gesture(button: int, io: imgui.IO) -> str:
    if button == imgui.MouseButton_.left:
        return "pan" if io.key_shift else "focus" if io.key_ctrl else "orbit"
    if button == imgui.MouseButton_.right:
        return "dolly" if io.key_alt else "look"
    return "pan" if io.key_shift or io.key_alt else "dolly" if io.key_ctrl else "orbit"


def _dragged(camera: Camera, drag: str, right: float, down: float) -> Camera:
    if not right and not down:
        return camera
    match drag:
        case "orbit":
            return cameras.orbit(camera, _TURN * right, _TURN * down)
        case "pan":
            return cameras.pan(camera, right, down)
        case "dolly":
            return cameras.dolly(camera, float(np.exp(2 * (down - right))))
        case "look":
            return cameras.look_around(camera, 0.5 * _TURN * right, 0.5 * _TURN * down)
    return camera


def _scrolled(camera: Camera, io: imgui.IO) -> Camera:
    """The wheel moves nearer; two fingers on a trackpad with Shift, or sideways, pan."""
    if io.key_shift or abs(io.mouse_wheel_h) > abs(io.mouse_wheel):
        return cameras.pan(camera, 0.05 * io.mouse_wheel_h, 0.05 * io.mouse_wheel)
    return cameras.dolly(camera, _DOLLY**io.mouse_wheel)


def _walked(camera: Camera, io: imgui.IO) -> Camera:
    if io.key_ctrl or io.key_alt or io.key_super:
        return camera
    key = imgui.Key

    def held(positive: imgui.Key, negative: imgui.Key) -> int:
        return int(imgui.is_key_down(positive)) - int(imgui.is_key_down(negative))

    right, up, forward = held(key.d, key.a), held(key.e, key.q), held(key.w, key.s)
    if not (right or up or forward):
        return camera
    step = cameras.distance(camera) * _WALK * (_RUN if io.key_shift else 1.0) * min(io.delta_time, 0.1)
    return cameras.fly(camera, step * right, step * up, step * forward)
