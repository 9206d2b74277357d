# SPDX-License-Identifier: MIT
"""A window with OpenGL and imgui: glfw, without anything of fragtracer in it."""

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from imgui_bundle import imgui, implot  # before glfw: both must load the same library

from fragtracer.apps.viewer import layout, theme
from fragtracer.errors import DeviceError

import glfw  # isort: skip


class Window:
    """Open until :meth:`close`; ``size`` is (width, height) in screen coordinates.

    Raises
    ------
    DeviceError
        Without a display, or if it offers no OpenGL 3.3.
    """

    def __init__(self, title: str, size: tuple[int, int], ini: Path | None) -> None:
        self._handle = _create(title, size)
        self.dropped: list[str] = []
        glfw.make_context_current(self._handle)
        glfw.swap_interval(1)
        self._imgui = imgui.create_context()
        self._plots = implot.create_context()
        io = imgui.get_io()
        io.config_flags |= imgui.ConfigFlags_.docking_enable
        io.config_windows_move_from_title_bar_only = True
        io.set_ini_filename(str(ini) if ini else "")
        theme.load_font()
        self._themed_for = 0.0
        self._is_shown = False
        self._touched = True
        self._watch_events()  # before imgui, which calls these callbacks from its own
        imgui.backends.glfw_init_for_opengl(ctypes.cast(self._handle, ctypes.c_void_p).value or 0, True)
        imgui.backends.opengl3_init("#version 330")
        on_drop: Any = self._drop  # glfw's own types are wrong here
        glfw.set_drop_callback(self._handle, on_drop)

    def _drop(self, _: Any, paths: Any) -> None:
        self._touched = True
        self.dropped.extend(paths)

    def _watch_events(self) -> None:
        def touch(*_: Any) -> None:
            self._touched = True

        for listen in (
            glfw.set_cursor_pos_callback,
            glfw.set_mouse_button_callback,
            glfw.set_scroll_callback,
            glfw.set_key_callback,
            glfw.set_char_callback,
            glfw.set_window_focus_callback,
            glfw.set_window_size_callback,
            glfw.set_window_refresh_callback,
            glfw.set_window_content_scale_callback,
            glfw.set_window_close_callback,
        ):
            listen(self._handle, touch)

    @property
    def was_touched(self) -> bool:
        """Whether anything happened to the window since the last :meth:`present`."""
        return self._touched

    @property
    def scale(self) -> float:
        """How much larger than usual the monitor wants text to be."""
        return float(glfw.get_window_content_scale(self._handle)[0]) if sys.platform != "darwin" else 1.0

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height in pixels; 0 while minimised."""
        width, height = glfw.get_framebuffer_size(self._handle)
        return int(width), int(height)

    @property
    def pixels_per_unit(self) -> float:
        """Pixels for each unit of imgui's coordinates: more than 1 on a high-DPI monitor of macOS."""
        return self.pixels[0] / max(1, glfw.get_window_size(self._handle)[0])

    @property
    def should_close(self) -> bool:
        return bool(glfw.window_should_close(self._handle))

    @property
    def is_minimised(self) -> bool:
        return bool(glfw.get_window_attrib(self._handle, glfw.ICONIFIED)) or 0 in self.pixels

    def request_close(self) -> None:
        glfw.set_window_should_close(self._handle, True)

    def set_title(self, title: str) -> None:
        glfw.set_window_title(self._handle, title)

    def set_size(self, width: int, height: int) -> None:
        glfw.set_window_size(self._handle, width, height)

    def take_dropped(self) -> list[str]:
        """The files that were dropped on the window since the last call."""
        dropped, self.dropped[:] = list(self.dropped), []
        return dropped

    def poll(self, wait: float = 0.0) -> None:
        """Take in events; with ``wait``, sleep until one comes, for so many seconds at most."""
        if wait > 0:
            glfw.wait_events_timeout(wait)
        else:
            glfw.poll_events()

    @contextmanager
    def panels(self) -> Iterator[None]:
        """Within the block, imgui calls describe the panels of a frame."""
        if self.scale != self._themed_for:  # at first, and when the window is taken to another monitor
            if self._themed_for:
                layout.rescale(self.scale / self._themed_for)
            self._themed_for = self.scale
            theme.apply(self.scale)
        imgui.backends.opengl3_new_frame()
        imgui.backends.glfw_new_frame()
        imgui.new_frame()
        try:
            yield
        finally:
            imgui.render()

    def write_in_the_middle(self, text: str) -> None:
        """Within :meth:`panels`."""
        viewport = imgui.get_main_viewport()
        size = imgui.calc_text_size(text)
        middle = viewport.get_center()
        place = imgui.ImVec2(middle.x - size.x / 2, middle.y - size.y / 2)
        imgui.get_background_draw_list().add_text(place, imgui.get_color_u32(imgui.Col_.text), text)

    def draw_panels(self) -> None:
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())

    def present(self) -> None:
        """Show what was drawn; the window itself appears only now, with its first frame."""
        if not self._is_shown:
            self._is_shown = True
            glfw.show_window(self._handle)
        self._touched = False
        glfw.swap_buffers(self._handle)

    def close(self) -> None:
        imgui.backends.opengl3_shutdown()
        imgui.backends.glfw_shutdown()
        implot.destroy_context(self._plots)
        imgui.destroy_context(self._imgui)
        glfw.destroy_window(self._handle)


def _create(title: str, size: tuple[int, int]) -> Any:
    problems: list[str] = []
    with _errors_to(problems):
        if not glfw.init():
            raise DeviceError(_no_window(problems))
        glfw.default_window_hints()
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            (glfw.CONTEXT_ROBUSTNESS, glfw.LOSE_CONTEXT_ON_RESET),  # else nothing tells that it was lost
            (glfw.SCALE_TO_MONITOR, True),
            (glfw.VISIBLE, False),
        ):
            glfw.window_hint(hint, value)
        handle = glfw.create_window(*size, title, None, None)
        if not handle:
            raise DeviceError(_no_window(problems))
    glfw.set_window_size_limits(handle, 320, 200, glfw.DONT_CARE, glfw.DONT_CARE)
    return handle


def _no_window(problems: list[str]) -> str:
    missing = sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    reason = "there is no display" if missing else "; ".join(problems) or "unknown reason"
    return f"cannot open a window: {reason}. Without one, 'fragtracer render SCENE -o image.png' makes an image file"


@contextmanager
def _errors_to(problems: list[str]) -> Iterator[None]:
    def note(_: int, text: bytes | str) -> None:
        problems.append(text.decode() if isinstance(text, bytes) else text)

    def ignore(_: int, __: bytes | str) -> None:
        """glfw's errors in running, such as a cursor shape that a desktop lacks, harm nothing."""

    callback: Callable[..., None] = note
    glfw.set_error_callback(callback)
    try:
        yield
    finally:
        glfw.set_error_callback(ignore)
