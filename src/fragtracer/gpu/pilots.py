# SPDX-License-Identifier: MIT
"""Draws pilots: samples that are in no picture, which say how those of the picture are to be taken."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from fragtracer.gpu.tracer import Tracer
from fragtracer.gpu.work import ItemList
from fragtracer.sampling import gradients
from fragtracer.sampling.allocation import Window, WorkList
from fragtracer.sampling.gradients import GradientPilot, Gradients
from fragtracer.sampling.pilot import SAMPLES, STREAM, SURVEY_SAMPLES, Pilot, Tiles, pilot_list, survey_list
from fragtracer.sampling.pixels import Pixels


@dataclass(frozen=True, eq=False)
class PilotTracer:
    """Draws the pilots of an image of ``size`` (width, height), which has a tile at least. They yield after each draw,
    which is meant to take ``budget`` seconds (:meth:`Tracer.bands`), so that a window goes on meanwhile."""

    ctx: moderngl.Context
    size: tuple[int, int]
    tracer: Tracer
    budget: float | None = None

    def first_tiles(self) -> Generator[float, None, Pixels]:
        """The items of :meth:`Pilot.of`, of the tiles that are drawn first alone."""
        items, _ = yield from self._first_tiles()
        return items

    def tiles(self, least_gain: float, is_rare: bool) -> Generator[float, None, Pixels]:
        """The items of :meth:`Pilot.of`: of all tiles, where the first leave open whether adaptive sampling gains
        ``least_gain`` (:meth:`Pilot.asks_for_more`)."""
        items, pilot = yield from self._first_tiles()
        if pilot.asks_for_more(least_gain, is_rare, *self.size):
            first, every = pilot.drawn
            more = yield from self._sampled(pilot_list(every.pixels[len(first.pixels) :]), SAMPLES)
            items = _joined([items, more])
        return items

    def gradients(self, pilot: Pilot, least_gain: float) -> Generator[float, None, Gradients]:
        """What differences of neighbours are worth, by the first tiles of ``pilot``, or by all where these leave open
        whether a picture is made from differences, whose gain must be ``least_gain``."""
        first, every = pilot.drawn
        variance, known = pilot.tiles.variance(pilot.items), len(first.pixels)
        items = yield from self._sampled(gradients.pilot_list(first.pixels), SAMPLES)
        found = GradientPilot(items, first, variance[:known], pilot.rate)
        if found.asks_for_more(least_gain, *self.size):
            others = Tiles(every.pixels[known:], every.weights[known:])
            more = yield from self._sampled(gradients.pilot_list(others.pixels), SAMPLES)
            if len(variance) == known:
                pixels = others.pixels.ravel()
                single = yield from self._sampled(WorkList(pixels, np.zeros_like(pixels)), SURVEY_SAMPLES)
                variance = np.concatenate([variance, others.variance(single)])
            found = GradientPilot(_joined([items, more]), every, variance, pilot.rate)
        return found.found()

    def _first_tiles(self) -> Generator[float, None, tuple[Pixels, Pilot]]:
        survey = yield from self._sampled(survey_list(*self.size), SURVEY_SAMPLES)
        first, every = Tiles.by(survey, *self.size)
        items = yield from self._sampled(pilot_list(first.pixels), SAMPLES)
        return _joined([survey, items]), Pilot(first, items, (first, every))

    def _sampled(self, work: WorkList, rays: int) -> Generator[float, None, Pixels]:
        items = ItemList(self.ctx, self.size[1], Window(0, 0, *self.size), len(work.pixels))
        try:
            for _ in items.trace(self.tracer, work, STREAM, rays, self.budget):
                yield 0.0
            return items.read(len(work.pixels))
        finally:
            items.release()


def _joined(items: Sequence[Pixels]) -> Pixels:
    """Items (items, 1), one after the other."""
    parts = zip(*(vars(some).values() for some in items), strict=True)
    return Pixels(*(np.concatenate(part) for part in parts))
