# SPDX-License-Identifier: MIT
"""The window, and what a frame draws into it: the picture in its rectangle, and the panels over all."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.viewer.display import Display, DisplaySettings, Rectangle
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.apps.viewer.window import Window
from fragtracer.errors import DeviceError, ShaderError
from fragtracer.gpu.context import attach_context

_BACKGROUND = (0.06, 0.06, 0.07)
_CHECKED_EVERY = 60  # frames
_FATAL = ("GL_OUT_OF_MEMORY", "GL_UNKNOWN_ERROR")


class Screen:
    """Open until :meth:`close`; ``rectangle`` is that of the picture, ``frames`` counts what was presented,
    ``problem`` says why the last frame has no picture.

    ``size`` is that of the window in screen coordinates, ``ini`` where the layout of the panels is kept.

    Raises
    ------
    DeviceError
        Without a display, or if it offers no OpenGL 3.3.
    """

    def __init__(self, size: tuple[int, int], ini: Path | None) -> None:
        self.window = Window("fragtracer", size, ini)
        self.context = attach_context()
        self.display = Display(self.context)
        self.rectangle: Rectangle = (0, 0, 1, 1)
        self.frames = 0
        self.problem = ""
        self._title = ""

    def place(self, area: Area) -> tuple[int, int]:
        """Put the picture into ``area``; returns its width and height in pixels."""
        scale, height = self.window.pixels_per_unit, self.window.pixels[1]
        size = (max(1, round(area.width * scale)), max(1, round(area.height * scale)))
        self.rectangle = (round(area.x * scale), height - round(area.y * scale) - size[1], *size)
        return size

    def announce(self, text: str) -> None:
        """Present a frame that says why there is no picture yet."""
        with self.window.panels():
            self.window.write_in_the_middle(text)
        target: Any = self.context.detect_framebuffer(0)
        target.viewport = target.scissor = (0, 0, *self.window.pixels)
        target.clear(*_BACKGROUND)
        self.window.draw_panels()
        self.window.present()
        self.window.poll()

    def show(self, refiner: Refiner, settings: DisplaySettings) -> None:
        """Draw a frame and present it.

        Raises
        ------
        DeviceError
            If the driver has lost the context, or has no memory left.
        """
        self._draw(self.context.detect_framebuffer(0), refiner, settings)
        self.window.present()
        self.frames += 1
        if self.frames % _CHECKED_EVERY == 0 and self.context.error in _FATAL:
            raise DeviceError("the graphics driver ran out of memory or lost the window's context")

    def grab(self, refiner: Refiner, settings: DisplaySettings) -> NDArray[np.uint8]:
        """What the window shows, (height, width, 3) sRGB bytes, row 0 at the top."""
        width, height = self.window.pixels
        target: Any = self.context.simple_framebuffer((width, height), 3)
        self._draw(target, refiner, settings)
        pixels = np.frombuffer(target.read((0, 0, width, height), 3, alignment=1), np.uint8)
        self.context.detect_framebuffer(0).use()  # moderngl would bind the released one again
        target.release()
        return np.ascontiguousarray(pixels.reshape(height, width, 3)[::-1])

    def set_title(self, title: str) -> None:
        if title != self._title:
            self._title = title
            self.window.set_title(title)

    def close(self) -> None:
        self.display.release()
        self.window.close()

    def _draw(self, target: Any, refiner: Refiner, settings: DisplaySettings) -> None:
        """Draw picture and panels into a framebuffer of the size of the window."""
        everything = (0, 0, *self.window.pixels)
        target.viewport = target.scissor = everything
        target.clear(*_BACKGROUND)
        spp, shown, held = refiner.renderer.spp, refiner.renderer.film, refiner.held
        if held is not None and spp == 0:  # the new film is empty, and blending takes time
            shown, held = held, None
        try:
            self.display.draw(target, shown, self.rectangle, settings, spp, held, refiner.held_weight)
            self.problem = ""
        except ShaderError as error:
            self.problem = str(error)
            target.use()
        target.viewport = target.scissor = everything
        self.window.draw_panels()
