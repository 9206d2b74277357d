# SPDX-License-Identifier: MIT
"""Signals that Python handles, as Ctrl-C, where an exception at any time would break something."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_Handler = Callable[[int, Any], Any]


@contextmanager
def deferred() -> Iterator[None]:
    """Have signals wait until the block has ended: C code that calls Python may not bear an exception from there.

    Threads other than the main one, which no signal reaches, are left as they are.
    """
    came: list[int] = []

    def note(number: int, _: Any) -> None:
        came.append(number)

    try:
        with _handled(lambda _: note):
            yield
    finally:
        if came:
            signal.raise_signal(came[0])


@contextmanager
def once() -> Iterator[None]:
    """Have the first signal do what it does, and no other one that comes before the block has ended, so that what the
    first one leaves can be written."""
    came: list[int] = []

    def first(handler: _Handler) -> _Handler:
        def handle(number: int, frame: Any) -> None:
            came.append(number)
            if len(came) == 1:
                handler(number, frame)

        return handle

    with _handled(first):
        yield


@contextmanager
def children_uninterrupted() -> Iterator[None]:
    """Have Ctrl-C, which a terminal sends to all processes of a command, reach none that is started in this block, or
    later by a thread that is; on Windows it does."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    resource_tracker.ensure_running()  # started later, it would take the signal from the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _handled(change: Callable[[_Handler], _Handler]) -> Iterator[None]:
    """Change the handlers of all signals that Python handles, as long as the block takes."""
    is_main = threading.current_thread() is threading.main_thread()
    found = {number: signal.getsignal(number) for number in signal.valid_signals()} if is_main else {}
    before = {number: handler for number, handler in found.items() if callable(handler)}
    try:
        for number, handler in before.items():
            signal.signal(number, change(handler))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
