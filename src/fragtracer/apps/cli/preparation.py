# SPDX-License-Identifier: MIT
"""What the terminal shows while a picture is prepared."""

import logging
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any


@contextmanager
def preparing() -> Iterator[None]:
    """Show the last message of fragtracer's log, and take it away at the end; on a terminal alone."""
    log = logging.getLogger("fragtracer")
    level = log.level
    with ExitStack() as stack:
        if sys.stderr.isatty():
            shower = _Shower(stack)
            log.addHandler(shower)
            stack.callback(log.removeHandler, shower)
            log.setLevel(logging.INFO)
            stack.callback(log.setLevel, level)
        yield


class _Shower(logging.Handler):
    """Shows one message at a time, until ``stack`` is closed."""

    def __init__(self, stack: ExitStack) -> None:
        super().__init__(logging.INFO)
        self._stack = stack
        self._live: Any = None

    def emit(self, record: logging.LogRecord) -> None:
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        if self._live is None:
            # It is drawn when there is something new alone: while a driver compiles, no thread of Python runs.
            live = Live(console=Console(stderr=True), transient=True, auto_refresh=False)
            self._live = self._stack.enter_context(live)
        self._live.update(Text(f"{record.getMessage()} …"), refresh=True)
