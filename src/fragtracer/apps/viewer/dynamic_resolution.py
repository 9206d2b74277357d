# SPDX-License-Identifier: MIT
"""Dynamic resolution: how much to draw in one frame, so that it keeps within its time budget."""

from dataclasses import dataclass

TARGET = 0.033  # seconds of a frame while something moves
_SCALES = tuple(2 ** (-k / 2) for k in range(9))  # of the sides of the image, 1 to 1/16
_MARGIN = 1.35  # hysteresis: a larger size is taken when this many times its pixels fit the budget
_LEAST = 0.25  # of the target, left to the tracer however slow the panels are
_MOST_OVERHEAD = 0.2  # seconds; a single stall must not dominate the average
_LONGEST = 0.1  # seconds that the tracer may take while nothing moves
_CAUTION = 4.0e5  # samples per second, assumed before any was measured


@dataclass
class DynamicResolution:
    """Chooses the resolution and the number of samples while something moves; ``target`` is the
    duration of a frame in seconds.

    Light samples are lowered first, then the resolution: neither changes the expected value of a pixel.
    Fewer bounces would darken the picture until it comes to rest.
    """

    target: float = TARGET
    overhead: float = 0.005  # seconds of a frame that are not spent on tracing, measured
    level: int = len(_SCALES) - 1

    def note_overhead(self, seconds: float) -> None:
        """Learn what a frame costs beside tracing."""
        self.overhead += 0.1 * (min(seconds, _MOST_OVERHEAD) - self.overhead)

    @property
    def budget(self) -> float:
        """Seconds of a frame for the tracer: half of what the rest is over the target, where that is slow already."""
        return max(self.target - self.overhead, _LEAST * self.target, (self.overhead - self.target) / 2)

    @property
    def rest_budget(self) -> float:
        """The same while nothing moves: as much as the rest of the frame where that is slow already."""
        return max(self.budget, min(self.overhead, _LONGEST))

    def choose(
        self, full: tuple[int, int], samples_per_second: float, light_samples: int = 1, most: int = 1
    ) -> tuple[tuple[int, int], int]:
        """The size, and the light samples up to ``most``, with which one path per pixel fits into the budget.

        ``samples_per_second`` was measured with ``light_samples``. The cost model: at every vertex a path
        traces one ray and one shadow ray for each light sample.
        """
        rays_per_second = (samples_per_second or _CAUTION) * (1 + light_samples)
        affordable = rays_per_second * self.budget / _pixels(full, 0)
        chosen = max(int(affordable / _MARGIN) - 1, min(light_samples, int(affordable) - 1))
        chosen = max(1, min(most, chosen))
        return self.size(full, rays_per_second / (1 + chosen)), chosen

    def size(self, full: tuple[int, int], samples_per_second: float) -> tuple[int, int]:
        """The size, at most ``full``, at which one sample per pixel fits into the budget."""
        affordable = (samples_per_second or _CAUTION) * self.budget
        best = next((k for k in range(len(_SCALES)) if _pixels(full, k) <= affordable), len(_SCALES) - 1)
        if best < self.level and _pixels(full, best) * _MARGIN > affordable:
            best += 1
        self.level = best
        return _scaled(full, best)

    def rays(self, size: tuple[int, int], samples_per_second: float, most: int) -> int:
        """Paths per pixel, from 1 to ``most``, that fit into the budget at ``size``."""
        return max(1, min(most, int(samples_per_second * self.budget / (size[0] * size[1]))))


def _scaled(full: tuple[int, int], level: int) -> tuple[int, int]:
    if level == 0:
        return full
    width, height = (max(1, round(side * _SCALES[level])) for side in full)
    return _uneven(width), _uneven(height)


def _uneven(side: int) -> int:
    """Not a power of two: llvmpipe would compile the program again for a film of such a size."""
    return side + 1 if side > 1 and side & (side - 1) == 0 else side


def _pixels(full: tuple[int, int], level: int) -> int:
    width, height = _scaled(full, level)
    return width * height
