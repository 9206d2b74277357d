# SPDX-License-Identifier: MIT
"""Windows of all sizes on all monitors."""

import ctypes
from dataclasses import replace
from typing import Any

import glfw
import numpy as np
import pytest
from common import GOLD, opened, picture, refined
from hand import Hand
from imgui_bundle import imgui
from x11 import say_density, say_state

from fragtracer.apps.viewer import app
from fragtracer.apps.viewer.window import Window
from fragtracer.display.look import Look

GL = ctypes.CDLL("libGL.so.1")
RGB, UNSIGNED_BYTE = 0x1907, 0x1401


def says_that_a_gpu_compiles() -> None:
    """In a frame with nothing but the text, before the first picture."""
    presented: list[Any] = []
    present, live_renderer = Window.present, app.LiveRenderer

    def kept(window: Window) -> None:
        frame = np.zeros((400, 640, 3), np.uint8)
        GL.glReadPixels(0, 0, 640, 400, RGB, UNSIGNED_BYTE, frame.ctypes.data_as(ctypes.c_void_p))
        presented.append(frame)
        present(window)

    def begun(*arguments: Any) -> Any:
        presented.append("the renderer begins")
        return live_renderer(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "is_software", lambda _: False)
        patch.setattr(app, "LiveRenderer", begun)
        patch.setattr(Window, "present", kept)
        with opened() as viewer:
            refined(viewer, Hand(viewer), 4)
            assert viewer.screen.context.error == "GL_NO_ERROR"
            assert picture(viewer).mean() > 0.05
    assert presented[1] == "the renderer begins"
    rows, columns = np.nonzero(presented[0].max(axis=2) > 128)
    assert abs(rows.mean() - 200) < 10
    assert abs(columns.mean() - 320) < 20
    assert 100 < np.ptp(columns) < 400


def survives_sizes() -> None:
    """Small and large windows, from one pixel to 4K."""
    with opened() as viewer:
        hand = Hand(viewer)
        for width, height in ((1, 1), (40, 700), (3840, 2160), (640, 400)):
            viewer.screen.window.set_size(width, height)
            hand.until(lambda size=(width, height): viewer.screen.window.pixels == size, "resize")  # type: ignore[misc]
            hand.frames(3)
            assert viewer.refiner.size == viewer.screen.rectangle[2:]
            hand.until(
                lambda: not viewer.refiner.is_moving and viewer.renderer.size == viewer.refiner.size, "a picture"
            )
            assert width < 100 or picture(viewer).mean() > 0.05, "not black, before the first pass is done either"
            turns = 0
            while width == 3840 and viewer.renderer.spp == 0 and turns < 4:
                viewer.frame()
                turns += 1
            assert width != 3840 or turns == 4, "a pass over so many pixels takes several turns of the loop"
        hand.until(lambda: viewer.renderer.spp >= 1, "samples")
        viewer.do("copy command")
        hand.frames(4)
        status, toast = (imgui.internal.find_window_by_name(f"##{name}") for name in ("status", "toast"))
        assert 0 < status.size.x < viewer.screen.rectangle[2], "the status bar ends where the panels begin"
        assert 0 < toast.size.x < viewer.screen.rectangle[2], "so does a message"
        assert toast.pos.y + toast.size.y <= status.pos.y, "above the status bar"
        assert viewer.screen.context.error == "GL_NO_ERROR"


def survives_being_minimised() -> None:
    """While the window is minimised nothing is drawn, an edit waits, and then it shows."""
    with opened() as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 4)
        window = glfw.get_x11_window(viewer.screen.window._handle)
        say_state(window, 3)
        hand.until(lambda: viewer.screen.window.is_minimised, "minimised")
        frames = len(viewer.times.recent)
        viewer.session.camera = replace(viewer.session.camera, fov_degrees=60.0)
        for _ in range(3):
            viewer.frame()
        assert len(viewer.times.recent) == frames
        assert viewer.renderer.scene.camera.fov_degrees != 60.0
        say_state(window, 1)
        viewer.session.max_samples = 0
        hand.until(lambda: viewer.renderer.scene.camera.fov_degrees == 60.0, "the edit")
        refined(viewer, hand, 4)
        assert picture(viewer).mean() > 0.05


def goes_to_a_monitor_of_high_density() -> None:
    """There the window opens twice as large, text is twice as large, and a click meets what is under it."""
    say_density(192)
    try:
        viewer = opened(size=(800, 500))
    finally:
        say_density(96)
    with viewer:
        hand = Hand(viewer)
        assert viewer.screen.window.scale == 2.0
        assert viewer.screen.window.pixels == (1600, 1000)
        assert imgui.get_style().font_scale_dpi == 2.0
        side = viewer.screen.window.pixels[0] - viewer.screen.rectangle[2]
        hand.click(*hand.place_of(viewer.session.document.part(GOLD).center))
        assert viewer.session.selected == GOLD
        Window.scale = property(lambda _: 1.0)  # type: ignore[assignment]
        hand.frames(3)
        assert imgui.get_style().font_scale_dpi == 1.0, "taken to another monitor"
        assert viewer.screen.window.pixels[0] - viewer.screen.rectangle[2] == pytest.approx(side / 2, rel=0.1)
        hand.key("Escape")
        hand.click(*hand.place_of(viewer.session.document.part(("spheres", 0)).center))
        assert viewer.session.selected == ("spheres", 0)


def draws_more_pixels_than_the_window_has_units() -> None:
    """On macOS and Wayland the picture has more pixels than the window has units, and fills them."""
    size = glfw.get_framebuffer_size
    glfw.get_framebuffer_size = lambda handle: tuple(2 * n for n in size(handle))
    with opened(size=(800, 500)) as viewer:
        hand = Hand(viewer)
        assert viewer.screen.window.pixels_per_unit == 2.0
        refined(viewer, hand, 2)
        left, bottom, width, height = viewer.screen.rectangle
        assert (left, bottom + height) == (0, 1000 - 2 * imgui.get_frame_height())
        assert viewer.renderer.size == (width, height)
        assert width > 800
        expected = Look().show(viewer.renderer.image())
        free = slice(0, 400), slice(0, 780)  # imgui draws the panels over the rest, as large as X11's pixels
        assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255
