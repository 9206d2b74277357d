# SPDX-License-Identifier: MIT
"""What the viewer measures about itself and about the picture."""

import time
from collections import deque

import numpy as np

from fragtracer.apps.viewer.lit_film import ShownFilm
from fragtracer.sampling.pixels import Pixels

_FRAMES = 160  # that are plotted
_SLICES = 16  # of the film, one read in each frame
LAG = 2 * _SLICES  # frames without a sample after which the figures are those of the film


class FilmStatistics:
    """Error and non-finite samples of a film, read a slice at a time; they lag behind by one round of slices."""

    def __init__(self) -> None:
        self.relative_error: float | None = None  # mean standard error over mean radiance; None until known
        self.non_finite = 0
        self._slice = 0
        self._mean = self._error = 0.0
        self._faults = 0

    def forget(self) -> None:
        """The film was cleared."""
        self.__init__()  # type: ignore[misc]

    def look(self, film: ShownFilm) -> None:
        """Read the next slice of ``film``."""
        height = film.size[1]
        bottom, top = (height * k // _SLICES for k in (self._slice, self._slice + 1))
        if top > bottom:
            self._add(film.read_rows(bottom, top - bottom))
        self._slice += 1
        if self._slice == _SLICES:
            black = 0.0 if self._error == 0 else np.inf
            error = self._error / self._mean if self._mean > 0 else black
            self.relative_error = error if np.isfinite(error) else None
            self.non_finite = self._faults
            self._slice, self._mean, self._error, self._faults = 0, 0.0, 0.0, 0

    def _add(self, pixels: Pixels) -> None:
        self._mean += float(pixels.mean[..., :3].sum(dtype=np.float64))
        self._error += float(pixels.standard_error().sum(dtype=np.float64))
        self._faults += int(pixels.variance[..., 3].sum(dtype=np.float64))


class FrameTimes:
    """Durations of frames, from the input to the picture on the screen."""

    def __init__(self) -> None:
        self.recent: deque[float] = deque(maxlen=_FRAMES)  # seconds
        self.passes: deque[float] = deque(maxlen=_FRAMES)
        self.all: list[float] = []
        self.keeps_all = False
        self._shown_at: deque[float] = deque(maxlen=30)

    def add(self, seconds: float, pass_seconds: float) -> None:
        self.recent.append(seconds)
        self.passes.append(pass_seconds)
        self._shown_at.append(time.perf_counter())
        if self.keeps_all:
            self.all.append(seconds)

    @property
    def fps(self) -> float:
        if len(self._shown_at) < 2:
            return 0.0
        return (len(self._shown_at) - 1) / max(self._shown_at[-1] - self._shown_at[0], 1e-9)

    def summary(self) -> dict[str, float]:
        """Count, mean, percentiles and maximum of all frames that were kept, in milliseconds."""
        if not self.all:
            return {}
        milliseconds = 1000 * np.asarray(self.all)
        found = {f"p{p}": float(np.percentile(milliseconds, p)) for p in (50, 90, 95, 99)}
        return (
            {"frames": float(len(milliseconds)), "mean": float(milliseconds.mean())}
            | found
            | {"max": float(milliseconds.max())}
        )
