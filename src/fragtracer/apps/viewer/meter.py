# SPDX-License-Identifier: MIT
"""Automatic exposure of a film, through shaders/display/meter.frag; display/exposure.py defines it."""

import math
import time
from typing import Any

import numpy as np

from fragtracer.apps.viewer.lit_film import ShownFilm
from fragtracer.apps.viewer.programs import Programs
from fragtracer.display.exposure import CELL, stops_for

_EVERY = 0.1  # seconds between two measurements
_ADAPTATION = 0.2  # time constant of the adaptation, seconds


class Meter:
    """Follows the exposure that a film should have, measured by one of ``programs``."""

    def __init__(self, context: Any, programs: Programs) -> None:
        self._context, self._programs = context, programs
        self._target: float | None = None
        self._stops: float | None = None
        self._looked_at = self._moved_at = -math.inf

    def measure(self, film: ShownFilm) -> float | None:
        """The exposure in stops for ``film`` as it is, whose mean is read back in cells; None if it is black."""
        program = self._programs.get("display/meter.frag", {"u_film_mean": 0})
        width, height = (-(-side // CELL) for side in film.size)
        texture = self._context.texture((width, height), 1, dtype="f4")
        framebuffer = self._context.framebuffer([texture])
        film.textures[0].use(0)
        framebuffer.use()
        program.draw()
        cells = np.frombuffer(texture.read(alignment=1), np.float32)
        self._context.detect_framebuffer(0).use()  # moderngl would bind the released one again
        framebuffer.release()
        texture.release()
        return stops_for(cells) if cells.max() > 0 else None

    def follow(self, film: ShownFilm) -> float:
        """The exposure now, adapting over time except to the first film; a black film leaves it as it is."""
        now = time.perf_counter()
        if now - self._looked_at >= _EVERY:
            self._looked_at = now
            measured = self.measure(film)
            self._target = self._target if measured is None else measured
        if self._target is None:
            return 0.0
        if self._stops is None or abs(self._stops - self._target) < 1e-3:
            self._stops = self._target
        else:
            self._stops += (self._target - self._stops) * -math.expm1((self._moved_at - now) / _ADAPTATION)
        self._moved_at = now
        return self._stops

    @property
    def is_adapted(self) -> bool:
        """Whether the exposure is that of the film of the last measurement."""
        return self._stops == self._target

    def forget(self) -> None:
        """Adapt to the next film at once."""
        self._target = self._stops = None
        self._looked_at = -math.inf
