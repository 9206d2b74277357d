# SPDX-License-Identifier: MIT
"""Says to windows what a desktop would say; the display of the tests has none."""

import ctypes
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
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


class _Message(ctypes.Structure):
    """XClientMessageEvent, with the room of an XEvent; its first fields are those of the other kinds."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
        ("room", ctypes.c_long * 24),
    )


class _Selection(ctypes.Structure):
    """XSelectionRequestEvent and, without ``owner``, XSelectionEvent."""

    _fields_ = (
        *_Message._fields_[:4],
        ("owner", ctypes.c_ulong),
        *((name, ctypes.c_ulong) for name in ("requestor", "selection", "target", "property", "time")),
        ("room", ctypes.c_long * 24),
    )


_SELECTION_REQUEST, _SELECTION_NOTIFY, _CLIENT_MESSAGE = 30, 31, 33


@contextmanager
def dropping(window: int, file: Path) -> Iterator[Callable[[], bool]]:
    """Drag a file over a window and let it go (the XDND protocol, version 5); call what this gives until it is
    True: then the window has asked for the name of the file and has it."""
    with _display() as (library, display):
        atom = lambda name: ctypes.c_ulong(library.XInternAtom(display, name, 0)).value  # noqa: E731
        library.XCreateSimpleWindow.restype = ctypes.c_ulong
        root = ctypes.c_ulong(library.XDefaultRootWindow(display))
        own = library.XCreateSimpleWindow(display, root, 0, 0, 1, 1, 0, ctypes.c_ulong(0), ctypes.c_ulong(0))
        uris, selection = atom(b"text/uri-list"), atom(b"XdndSelection")
        library.XSetSelectionOwner(display, ctypes.c_ulong(selection), ctypes.c_ulong(own), ctypes.c_ulong(0))

        def say(name: bytes, *data: int) -> None:
            event = _Message(_CLIENT_MESSAGE, 0, 1, None, window, atom(name), 32, (own, *data))
            library.XSendEvent(display, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(event))
            library.XFlush(display)

        say(b"XdndEnter", 5 << 24, uris)
        say(b"XdndPosition", 0, 0, 0, atom(b"XdndActionCopy"))
        say(b"XdndDrop", 0, 0)
        end = time.monotonic() + 20

        def answered() -> bool:
            assert time.monotonic() < end, "the window does not ask what was dropped"
            event = _Selection()
            if not library.XCheckTypedEvent(display, _SELECTION_REQUEST, ctypes.byref(event)):
                return False
            text = file.absolute().as_uri().encode() + b"\r\n"
            requestor, place = ctypes.c_ulong(event.requestor), ctypes.c_ulong(event.property)
            library.XChangeProperty(display, requestor, place, ctypes.c_ulong(uris), 8, 0, text, len(text))
            reply = _Selection(
                _SELECTION_NOTIFY, 0, 1, None, event.requestor, event.selection, event.target, event.property
            )
            library.XSendEvent(display, requestor, 0, ctypes.c_long(0), ctypes.byref(reply))
            library.XFlush(display)
            return True

        yield answered
