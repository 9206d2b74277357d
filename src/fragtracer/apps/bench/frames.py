# SPDX-License-Identifier: MIT
"""How long one frame takes, which is a pass of ``rays`` paths for every pixel."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from fragtracer.apps.bench.statistics import Estimate, median
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, Scene

RUNS = 7
_SHORTEST = 0.25  # seconds of a run; shorter frames are measured several at a time
_MOST_FRAMES = 256


@dataclass(frozen=True)
class FrameTime:
    """``seconds`` of a frame; None where one would take too long, ``expected`` seconds."""

    seconds: Estimate | None
    expected: float
    gpu_clock: bool


class _TooLongError(Exception):
    pass


def frame_time(
    scene: Scene,
    runs: int = RUNS,
    limit: float = 20.0,
    progress: Callable[[float], None] = lambda share: None,
    **options: Any,
) -> FrameTime:
    """Measure frames of ``scene`` by the GPU's clock where it has one, else by the wall clock.

    ``limit`` is in seconds for one frame, and 10 times that for all of them. ``options`` are those of
    :class:`Renderer`; ``progress`` hears the share that is done.
    """
    with Renderer(scene, **PLAIN, **options) as renderer:
        first = _first_frame(renderer, limit)
        if first > limit:
            return FrameTime(None, first, renderer.gpu_clock)
        frames = max(1, min(_MOST_FRAMES, round(_SHORTEST / max(first, 1e-6))))
        times: list[float] = []
        start = time.perf_counter()
        while len(times) < runs and (not times or time.perf_counter() - start < 10 * limit):
            before = renderer.draw_seconds
            for _ in range(frames):
                renderer.sample(renderer.settings.rays)
            times.append((renderer.draw_seconds - before) / frames)
            progress(len(times) / runs)
        return FrameTime(median(times), first, renderer.gpu_clock)


def _first_frame(renderer: Renderer, limit: float) -> float:
    """Seconds of the second frame, the first being warm-up, or an estimate where either exceeds the limit."""
    rays = renderer.settings.rays
    seconds = 0.0
    for _ in range(2):
        start, before = time.perf_counter(), renderer.spp
        share = 0.0

        def watch(spp: float, start: float = start, before: int = before) -> None:
            nonlocal share
            share = (spp - before) / rays
            if time.perf_counter() - start > limit:
                raise _TooLongError

        with suppress(_TooLongError):
            renderer.sample(rays, watch)
        seconds = (time.perf_counter() - start) / max(share, 1e-6)
        if seconds > limit:
            break
    return seconds
