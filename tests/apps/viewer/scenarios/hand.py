# SPDX-License-Identifier: MIT
"""Real mouse and key events in a viewer's window, by xdotool."""

import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import glfw
from x11 import dropping

from fragtracer.apps.viewer.app import Viewer
from fragtracer.apps.viewer.camera import project


class Hand:
    """Acts on ``viewer`` and turns its loop after each act, so that it sees the event."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self._handle = viewer.screen.window._handle
        self.frames(2)
        self._do("windowfocus", "--sync", str(glfw.get_x11_window(self._handle)))
        self.frames(2)

    def frames(self, count: int) -> None:
        """Turn the loop until so many frames were shown, which takes somebody who is awake where nothing changes."""
        end = self.viewer.screen.frames + count
        while self.viewer.screen.frames < end:
            self.viewer.interface.used_at = time.perf_counter()
            self.viewer.frame()

    def until(self, condition: Callable[[], bool], what: str, seconds: float = 500.0) -> None:
        """Turn the loop until ``condition`` holds; the end is there to say ``what`` did not come."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, f"{what}: not within {seconds} s"
            self.viewer.frame()
            if self.viewer.refiner.is_preparing:
                time.sleep(0.1)  # leaves the processor to the process that prepares

    def move(self, x: float, y: float) -> None:
        """To a place in the window, in its coordinates from the top left."""
        left, top = glfw.get_window_pos(self._handle)
        self._do("mousemove", str(round(left + x)), str(round(top + y)))
        self.frames(1)

    def press(self, button: int = 1) -> None:
        self._do("mousedown", str(button))
        self.frames(1)

    def release(self, button: int = 1) -> None:
        self._do("mouseup", str(button))
        self.frames(1)

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self.press(button)
        self.release(button)

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: int = 1, steps: int = 6) -> None:
        self.move(*start)
        self.press(button)
        for k in range(1, steps + 1):
            self.move(*(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
        self.release(button)

    def key(self, chord: str) -> None:
        """As "F1" or "ctrl+z"."""
        self._do("key", chord)
        self.frames(2)

    def drop(self, file: Path) -> None:
        """Drop a file on the middle of the window, as a file manager does."""
        window = glfw.get_x11_window(self._handle)
        with dropping(window, file) as answer:
            while not answer():
                self.frames(1)
            self.frames(2)

    def place_of(self, point: tuple[float, float, float]) -> tuple[float, float]:
        """Where a point of the world is in the window."""
        left, bottom, width, height = self.viewer.screen.rectangle
        found = project(self.viewer.session.camera, point, width / height)
        assert found is not None
        top = self.viewer.screen.window.pixels[1] - bottom - height
        return left + found[0] * width, top + found[1] * height

    def _do(self, *words: str) -> None:
        subprocess.run(["xdotool", *words], check=True, timeout=20)
        time.sleep(0.01)
