# SPDX-License-Identifier: MIT
"""How long draws take: by the GPU's own clock where there is a GPU, else by the wall clock."""

import time
from types import TracebackType
from typing import Any, Self

import moderngl

from fragtracer.gpu.context import is_software


class DrawTimer:
    """A ``with`` block around draws and the ``glFinish`` after them; ``seconds`` adds up the blocks.

    ``gpu_clock`` chooses timer queries (OpenGL 3.3, GL_TIME_ELAPSED), which leave out what the driver
    and Python take; left out, they are used unless the CPU does the rendering, where both are one.
    """

    def __init__(self, ctx: moderngl.Context, gpu_clock: bool | None = None) -> None:
        self.gpu_clock = not is_software(ctx) if gpu_clock is None else gpu_clock
        self.seconds = 0.0
        self._query: Any = ctx.query(time=True) if self.gpu_clock else None
        self._start = 0.0

    def __enter__(self) -> Self:
        if self._query is not None:
            self._query.__enter__()
        self._start = time.perf_counter()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        wall = time.perf_counter() - self._start
        if self._query is None:
            self.seconds += wall
            return
        self._query.__exit__(kind, error, trace)
        self.seconds += self._query.elapsed * 1e-9
