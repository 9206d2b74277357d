# SPDX-License-Identifier: MIT
"""Does the picture on the screen differ from Mitsuba's by more than noise?

The samples of one picture are not independent (the sampler stratifies them), so their variance does not
give the error of the mean. Ours is therefore drawn repeatedly on a film of its own, by the same program and
with a new seed each time; Mitsuba's comes in independent pictures anyway.
:mod:`fragtracer.apps.viewer.finding` tests the means of their blocks.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.verdict import Means, scale_means
from fragtracer.apps.viewer.finding import LOOKS, Finding, judged_elsewhere
from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.gpu.film import Film

SPP = 4  # samples per pixel of each of our pictures
_SLICES = 16  # in which a picture is read, so that no frame waits for all of it


class Batches:
    """Our pictures, drawn on a film of their own; only the ``means`` of the blocks of each are kept.

    Raises :class:`fragtracer.errors.DeviceError` if the GPU has no room for the film.
    """

    def __init__(self, renderer: LiveRenderer) -> None:
        self._renderer = renderer
        self._film = Film(renderer.context, *renderer.size)
        self.means: list[Means] = []
        self.non_finite = 0
        self._seeds = np.random.SeedSequence((renderer.settings.seed, 1))
        self._steps: Iterator[None] | None = None
        self._worker = ThreadPoolExecutor(1)
        self._future: Future[Means] | None = None

    @property
    def is_complete(self) -> bool:
        return len(self.means) >= LOOKS[-1]

    def draw(self, seconds: float) -> float:
        """Go on for about ``seconds``; returns how long the draws took."""
        before = self._renderer.draw_seconds
        if self._future is not None:
            if self._future.done():
                self.means.append(self._future.result())
                self._future = None
        elif not self.is_complete:
            if self._steps is None:
                self._steps = self._picture(seconds)
            next(self._steps, None)
        return self._renderer.draw_seconds - before

    def _picture(self, seconds: float) -> Iterator[None]:
        """The steps to one picture; a thread averages its blocks."""
        film = self._film
        film.clear()
        seed = int(self._seeds.spawn(1)[0].generate_state(1)[0])
        done = 0
        while done < SPP:
            rays = min(SPP - done, self._renderer.max_rays)
            yield from self._renderer.beside(film, seed, rays, seconds)
            done += rays
        rows: list[NDArray[np.float32]] = []
        edges = [film.size[1] * k // _SLICES for k in range(_SLICES + 1)]
        for bottom, top in pairwise(edges):
            if top > bottom:
                pixels = film.read_rows(bottom, top - bottom)
                rows.append(pixels.mean[::-1, :, :3])
                self.non_finite += int(pixels.variance[..., 3].sum(dtype=np.float64))
                yield
        self._steps = None
        self._future = self._worker.submit(lambda: scale_means(np.concatenate(rows)[None, ::-1]))

    def release(self) -> None:
        self._worker.shutdown(wait=False, cancel_futures=True)
        self._film.release()


class Significance:
    """The verdict on the pictures so far; ``finding`` is None until both sides have enough."""

    def __init__(self) -> None:
        self.finding: Finding | None = None
        self._asked = 0
        self._worker = ThreadPoolExecutor(1)
        self._future: Future[Finding] | None = None

    def look(self, ours: Sequence[Means], reference: Sequence[Means], non_finite: int) -> None:
        """Take the result of the last test, and start the next one when there are pictures enough."""
        if self._future is not None:
            if self._future.done():
                self.finding, self._future = self._future.result(), None
            return
        both = min(len(ours), len(reference))
        count = max((n for n in LOOKS if n <= both), default=0)
        if count > self._asked:
            self._asked = count
            self._future = self._worker.submit(judged_elsewhere, ours[:count], reference[:count], non_finite)

    def release(self) -> None:
        self._worker.shutdown(wait=False, cancel_futures=True)
