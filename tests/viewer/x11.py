# SPDX-License-Identifier: MIT
"""Says to windows what a desktop would say; the display of the tests has none."""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def _display() -> Iterator[tuple[Any, Any]]:
    library = ctypes.CDLL("libX11.so.6")
    library.XOpenDisplay.restype = ctypes.c_void_p
    library.XInternAtom.restype = library.XDefaultRootWindow.restype = ctypes.c_ulong
    display = ctypes.c_void_p(library.XOpenDisplay(None))
    yield library, display
    library.XCloseDisplay(display)


def say_density(dots_per_inch: int) -> None:
    """Set the density of the monitor (the resource Xft.dpi); windows opened afterwards follow it."""
    text = f"Xft.dpi:\t{dots_per_inch}\n".encode()
    with _display() as (library, display):
        root = ctypes.c_ulong(library.XDefaultRootWindow(display))
        name, kind = (ctypes.c_ulong(library.XInternAtom(display, n, 0)) for n in (b"RESOURCE_MANAGER", b"STRING"))
        library.XChangeProperty(display, root, name, kind, 8, 0, text, len(text))


def say_state(window: int, state: int) -> None:
    """Minimise a window (state 3) or show it (1), as a window manager does (ICCCM, section 4.1.3.1)."""
    with _display() as (library, display):
        name = ctypes.c_ulong(library.XInternAtom(display, b"WM_STATE", 0))
        value = (ctypes.c_ulong * 2)(state, 0)
        library.XChangeProperty(display, ctypes.c_ulong(window), name, name, 32, 0, value, 2)
        show = library.XMapWindow if state == 1 else library.XUnmapWindow
        show(display, ctypes.c_ulong(window))
