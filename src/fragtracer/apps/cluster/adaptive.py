# SPDX-License-Identifier: MIT
"""Adaptive sampling by many workers, with the bits of one machine.

A pixel's samples of a stage are added up in their order by the worker that has the pixel, so that a stage may be cut
into windows at will. Between stages the plan is made here, of the whole picture.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.cluster.work import CORNERS, UNKNOWN, Block, Cut, Part, Task, at, crop, empty, place, without
from fragtracer.sampling.allocation import (
    FIRST_STAGE,
    ITEM_SAMPLES,
    Counts,
    Plan,
    StagePart,
    Stages,
    Window,
    samples_before,
    stage_weight,
)
from fragtracer.sampling.pixels import Pixels

_FIRST_LOOK = 16  # samples per pixel between looks at the error, at least, as in fragtracer.renderer


class AdaptiveSampling:
    """The stages of :mod:`fragtracer.sampling.allocation`. A step is a stage, or, where the error is looked at within
    one (``until``) or the samples end there, a part of it, of the same passes as on one machine."""

    def __init__(self, cut: Cut, until: float | None) -> None:
        self._cut, self._until = cut, until
        self._finished = Stages.none(cut.height, cut.width)
        self._plan: Plan | None = None  # of this stage; none of the first
        self._stage = self._passes = self._in_stage = 0  # passes and samples per pixel of this stage that are there
        self._next_look = FIRST_STAGE
        self._seen_stage = 0
        self._start: Pixels | None = None  # the film of this stage at the beginning of the step, if it has samples
        self._earlier: set[str] = set()  # who has rendered what the plan is of, or has had a part in a checkpoint
        self._step = -1
        self.samples = 0
        self.error: float | None = None
        self.is_done = False
        self._begin_step(*self._next_passes())

    @property
    def is_everywhere(self) -> bool:
        return self._spp > 0 or not self._missing

    def next(self) -> Task | None:
        task = self._due.popleft() if self._due else None
        self._left -= self.cost(task) if task else 0
        return task

    def put_back(self, task: Task) -> None:
        self._due.appendleft(task)
        self._left += self.cost(task)

    def part(self, task: Task) -> Part:
        if self._plan is None:
            return Block(task.window, FIRST_STAGE)
        start = None if self._start is None else crop(self._start, task.window)
        sampled = self._sampled[at(task.window)].astype(np.int32)
        work = tuple((items[at(task.window)].astype(np.int32), rays) for items, rays in self._work)
        return StagePart(task.window, self._stage, start, sampled, work)

    def cost(self, task: Task) -> int:
        return sum(rays * int(items[at(task.window)].sum()) for items, rays in self._work)

    @property
    def left(self) -> float:
        return self._left

    def take(self, task: Task, pixels: Pixels, author: str) -> None:
        place(self._film, pixels, task.window)
        self._weight[at(task.window)] = self._in_stage + self._more
        self._authors[task] = author
        self._missing -= task.pixels
        self.samples += self.cost(task)

    def forget(self, author: str) -> bool:
        if self._earlier & {author, UNKNOWN}:
            return False
        for task in [task for task, name in self._authors.items() if name == author]:
            del self._authors[task]
            self._missing += task.pixels
            self.samples -= self.cost(task)
            self.put_back(task)
            window = task.window
            self._weight[at(window)] = self._in_stage
            start = empty(window.height, window.width) if self._start is None else crop(self._start, window)
            place(self._film, start, window)
        return True

    def advance(self, is_certain: bool) -> bool:
        if self.is_done or self._missing or not is_certain:
            self._look_back()
            return False
        self._in_stage += self._more
        self._passes += self._more_passes
        self._earlier |= set(self._authors.values())
        self._authors.clear()
        self._start = self._film
        if self._until is not None and self._spp >= self._next_look:
            self.error = self.picture().relative_error()
            self.is_done = self._is_good
            self._next_look = self._spp + max(_FIRST_LOOK, self._spp // 4)
        self._go_on()
        return True

    @property
    def _is_good(self) -> bool:
        """Whether it ends by its error."""
        return self._until is not None and self.error is not None and self.error <= self._until

    def _look_back(self) -> None:
        """See what the error is after the last stage, where nothing depends on it, while workers are busy."""
        if self._until is None and self._stage > self._seen_stage and not self._due:
            self.error, self._seen_stage = self._finished.pixels().relative_error(), self._stage

    def _go_on(self) -> None:
        """Begin the next step, and perhaps a stage."""
        self.is_done |= self._spp == self._cut.spp
        if self.is_done:
            return
        if self._plan is None or self._passes == self._plan.passes:
            assert self._start is not None
            self._finished = self._finished.with_stage(self._start, stage_weight(self._stage, self._in_stage))
            self._stage += 1
            self._plan = Plan.by(self._stage, self._finished.deviation(self._finished.pixels()))
            self._passes = self._in_stage = 0
            self._start = None
        self._begin_step(*self._next_passes())

    def _next_passes(self) -> tuple[int, int]:
        """How many passes the next step has, and samples per pixel of each; no passes where there is a shorter one."""
        if self._plan is None:
            return FIRST_STAGE // ITEM_SAMPLES, ITEM_SAMPLES
        passes, rays = self._plan.passes - self._passes, self._plan.item_samples
        if self._until is not None:
            passes = min(passes, max(1, -(-(self._next_look - self._spp) // rays)))
        if self._cut.spp is not None:
            passes = min(passes, (self._cut.spp - self._spp) // rays)
            if not passes:
                return 0, self._cut.spp - self._spp
        return passes, rays

    def _begin_step(self, passes: int, rays: int) -> None:
        self._more_passes, self._rays = passes, rays
        height, width = self._cut.height, self._cut.width
        if self._plan is None:
            self._work = [(np.full((height, width), passes), rays)]
            self._sampled: Counts = np.zeros((height, width), np.int64)
        else:
            work = self._plan.work(self._passes, max(1, passes), rays)
            self._work = [(items.reshape(height, width), samples) for items, samples in work]
            self._sampled = self._plan.sampled_before(self._passes).reshape(height, width)
        start = self._start
        self._film = empty(height, width) if start is None else Pixels(*(i.copy() for i in vars(start).values()))
        self._weight = np.full((height, width, 1), float(self._in_stage))  # of this stage in the picture
        self._authors: dict[Task, str] = {}  # of the tasks of this step that are there
        self._missing = height * width  # pixels
        self._left = sum(samples * int(items.sum()) for items, samples in self._work)
        self._step += 1
        self._due = deque(self._cut.tasks(self._step))

    @property
    def _spp(self) -> int:
        """Samples per pixel of the steps that are finished."""
        return samples_before(self._stage) + self._in_stage

    @property
    def _more(self) -> int:
        """Samples per pixel of this step."""
        return max(1, self._more_passes) * self._rays

    def picture(self) -> Pixels:
        """Of the finished stages and of what there is of this one."""
        if self._plan is None:
            return self._film
        weight = self._in_stage if self._is_between_steps else self._weight
        return self._finished.with_stage(self._film, weight).pixels()

    all_there_is = picture

    @property
    def _is_between_steps(self) -> bool:
        return self._film is self._start

    @property
    def can_go_on(self) -> bool:
        """Whether more samples would give the picture of a render that was asked for them at once."""
        return self._plan is None or self._rays == self._plan.item_samples

    def state(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """All that :meth:`restore` needs."""
        numbers = {"stage": self._stage, "passes": self._passes, "in_stage": self._in_stage}
        done = [[task.tile, *(vars(task.window)[name] for name in CORNERS)] for task in self._authors]
        state = numbers | {"next_look": self._next_look, "more_passes": self._more_passes, "done": done}
        state |= {"error": self.error if self._is_good else None}
        state |= {"rendered_by": sorted(self._earlier | set(self._authors.values()))}
        arrays = {f"film.{name}": image for name, image in vars(self._film).items()}
        arrays |= {f"finished.{field.name}": getattr(self._finished, field.name) for field in fields(Stages)}
        if self._plan is not None:
            arrays |= {"plan.first": self._plan.first, "plan.items": self._plan.items}
        return state, arrays

    def restore(self, state: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bool:
        """Go on from what :meth:`state` has returned for a picture of this size; False if it has more samples than are
        asked for."""
        if self._cut.spp is not None and self._cut.spp <= FIRST_STAGE:
            return False
        self._stage, self._passes, self._in_stage = (state[name] for name in ("stage", "passes", "in_stage"))
        self._next_look, self.error = state["next_look"], state.get("error")
        self.is_done = self._is_good
        self._finished = Stages(*(arrays[f"finished.{field.name}"] for field in fields(Stages)))
        self._plan = Plan(self._stage, arrays["plan.first"], arrays["plan.items"]) if self._stage else None
        film = Pixels(*(arrays[f"film.{field.name}"] for field in fields(Pixels)))
        authors = state.get("rendered_by", [UNKNOWN])
        self._earlier = set(authors)
        if self._spp:
            self._film = self._start = film
        done = [Task(self._step + 1, tile, Window(*corners)) for tile, *corners in state["done"]]
        if done:
            self._begin_step(state["more_passes"], ITEM_SAMPLES if self._plan is None else self._plan.item_samples)
        elif self._spp:
            self._go_on()
        if self._spp + (self._more if done else 0) > (self._cut.spp or np.inf):
            return False
        self.samples = self._spp * self._cut.width * self._cut.height
        self._due = deque(piece for task in self._due for piece in without(task, set(done)))
        for task in done:
            self._left -= self.cost(task)
            self.take(task, crop(film, task.window), authors[0])  # or another of them, which makes no difference
        return True
