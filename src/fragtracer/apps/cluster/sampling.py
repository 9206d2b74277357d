# SPDX-License-Identifier: MIT
"""Which samples of a picture are due, and what has come of them: before sampling begins, and evenly."""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.cluster.merge import Tree, assembled
from fragtracer.apps.cluster.work import CORNERS, UNKNOWN, Block, Cut, Part, PilotSamples, Task, empty, place, without
from fragtracer.sampling.allocation import Window
from fragtracer.sampling.pilot import Pilot
from fragtracer.sampling.pixels import Pixels

_MOST_WAITING = 512  # blocks that are there before those of the round that is due


class Sampling(Protocol):
    """The samples of one picture, some of which are done by others."""

    error: float | None  # the mean relative standard error when last looked at
    is_done: bool
    samples: int  # that are there

    @property
    def is_everywhere(self) -> bool:
        """Whether each pixel has samples."""

    def next(self) -> Task | None:
        """What is to be rendered, if anything is before more comes back."""

    def put_back(self, task: Task) -> None:
        """A task of which nothing has come, or will."""

    def part(self, task: Task) -> Part:
        """What a worker needs to know of a task."""

    def cost(self, task: Task) -> int:
        """Samples of a task."""

    @property
    def left(self) -> float:
        """Samples that are not being rendered yet, as far as is known."""

    def take(self, task: Task, pixels: Pixels, author: str) -> None:
        """What has come of a task."""

    def forget(self, author: str) -> bool:
        """Render again what this worker has had a part in, also in a checkpoint; False if this is all, or may be."""

    def advance(self, is_certain: bool) -> bool:
        """Go on from a step of which all is there; whether anything has changed. What is ``is_certain`` is not being
        checked any more."""

    def picture(self) -> Pixels: ...

    def all_there_is(self) -> Pixels:
        """Also of what is not finished."""


class PilotSampling:
    """Finds out whether adaptive sampling pays, at ``gain``; its samples are not in the picture."""

    error: float | None = None
    samples = 0
    is_everywhere = False

    def __init__(self, cut: Cut) -> None:
        self._cut = cut
        self._window = Window(0, 0, cut.width, cut.height)
        self._due: list[Task] = [Task(-1, 0, self._window)]
        self._author: str | None = None
        self.gain: float | None = None
        self.is_done = False

    def next(self) -> Task | None:
        return self._due.pop() if self._due else None

    def put_back(self, task: Task) -> None:
        self._due.append(task)

    def part(self, _: Task) -> Part:
        return PilotSamples(self._cut.width, self._cut.height)

    def cost(self, _: Task) -> int:
        return 0  # it is not cut

    left = np.inf

    def take(self, _: Task, pixels: Pixels, author: str) -> None:
        self.gain, self._author = Pilot.of(pixels, self._cut.width, self._cut.height).gain(), author

    def forget(self, author: str) -> bool:
        return author != self._author

    def advance(self, is_certain: bool) -> bool:
        self.is_done = is_certain and self.gain is not None
        return self.is_done

    def picture(self) -> Pixels:
        return empty(self._cut.height, self._cut.width)

    all_there_is = picture


class EvenSampling:
    """As many samples of each pixel; the bits depend on the cut alone."""

    def __init__(self, cut: Cut, until: float | None) -> None:
        self._cut, self._until = cut, until
        self._trees = {tile: Tree() for tile in range(len(cut.tiles))}
        self._blocks = cut.all_tasks()
        self._due: deque[Task] = deque()
        self._there: set[Task] = set()  # tasks
        self._authors: dict[int, set[str]] = {tile: set() for tile in self._trees}  # who has had a part in each
        self._parts: dict[Task, tuple[Pixels, int]] = {}  # of blocks of which a part is there, and the pixels it lacks
        self._waiting: dict[Task, Pixels] = {}  # beyond the round at which the error is looked at next
        self._round = 1  # whose blocks are all that the trees hold
        self._present = 0  # blocks that the trees hold
        self._looked = 0  # the round after which the error was looked at
        self._given = 0  # samples that are being rendered, or were
        self._all_samples = np.inf if cut.spp is None else cut.spp * cut.width * cut.height
        self.samples = 0
        self.error: float | None = None
        self.is_done = False

    @property
    def is_everywhere(self) -> bool:
        return all(tree.numbers for tree in self._trees.values())

    def next(self) -> Task | None:
        if not self._due and len(self._waiting) > _MOST_WAITING:
            return None
        task = self._due.popleft() if self._due else next(self._blocks, None)
        self._given += self.cost(task) if task else 0
        return task

    def put_back(self, task: Task) -> None:
        self._due.appendleft(task)
        self._given -= self.cost(task)

    def part(self, task: Task) -> Part:
        first = self._cut.first(task.step)
        return Block(replace(task.window, first_sample=first), self._cut.spp_of(task.step))

    def cost(self, task: Task) -> int:
        return task.pixels * self._cut.spp_of(task.step)

    @property
    def left(self) -> float:
        return self._all_samples - self._given

    def take(self, task: Task, pixels: Pixels, author: str) -> None:
        self._there.add(task)
        self._authors[task.tile].add(author)
        self.samples += self.cost(task)
        block, window = self._block(task), self._cut.tiles[task.tile]
        if task != block:
            if block not in self._parts:
                self._parts[block] = empty(window.height, window.width), block.pixels
            whole, lacking = self._parts.pop(block)
            left, top = task.window.left - window.left, task.window.top - window.top
            place(whole, pixels, replace(task.window, left=left, top=top))
            if lacking > task.pixels:
                self._parts[block] = whole, lacking - task.pixels
                return
            pixels = whole
        self._waiting[block] = pixels
        self._plant()

    def forget(self, author: str) -> bool:
        if any(UNKNOWN in authors for authors in self._authors.values()):
            return False
        tiles = {tile for tile, authors in self._authors.items() if author in authors}
        for task in sorted((task for task in self._there if task.tile in tiles), key=lambda task: -task.step):
            self._there.remove(task)
            self.samples -= self.cost(task)
            self.put_back(task)
        for pieces in (self._parts, self._waiting):
            for block in [block for block in pieces if block.tile in tiles]:
                del pieces[block]
        for tile in tiles:
            self._present -= len(self._trees[tile].numbers)
            self._trees[tile] = Tree()
            self._authors[tile].clear()
        self._looked = 0
        return True

    def advance(self, is_certain: bool) -> bool:
        if self.is_done or self._present < self._round * len(self._trees):
            return False
        if self._looked != self._round:
            self.error, self._looked = self.picture().relative_error(), self._round
        assert self.error is not None
        if self._round == self._cut.rounds or (self._until is not None and self.error <= self._until):
            self.is_done = is_certain
            return is_certain
        # A quarter more samples, or, where nothing depends on it, twice as many.
        self._round += max(1, self._round // 4) if self._until is not None else self._round
        self._round = min(self._round, self._cut.rounds or self._round)
        self._plant()
        return True

    def _plant(self) -> None:
        """Give the trees the blocks of the rounds that are due."""
        for block in [block for block in self._waiting if block.step < self._round]:
            self._trees[block.tile].add(block.step, self._waiting.pop(block))
            self._present += 1

    def picture(self) -> Pixels:
        return assembled(self._cut, self._trees)

    def all_there_is(self) -> Pixels:
        for block, pixels in self._beyond().items():
            self._trees[block.tile].add(block.step, pixels)
        self._waiting.clear()
        self._parts.clear()
        return self.picture()

    def _beyond(self) -> dict[Task, Pixels]:
        """What is there, but not in the trees."""
        return self._waiting | {block: pixels for block, (pixels, _) in self._parts.items()}

    def _block(self, task: Task) -> Task:
        return replace(task, window=self._cut.tiles[task.tile])

    def state(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """All that :meth:`restore` needs."""
        blocks = [[step, tile] for tile, tree in self._trees.items() for step in sorted(tree.numbers)]
        blocks += [[block.step, block.tile] for block in self._waiting]
        parts = sorted(
            [task.step, task.tile, *(vars(task.window)[name] for name in CORNERS)]
            for task in self._there
            if self._block(task) in self._parts
        )
        nodes = {
            f"{tile}.{level}.{at}": n for tile, tree in self._trees.items() for (level, at), n in tree.nodes.items()
        }
        nodes |= {f"{block.tile}.0.{block.step}": pixels for block, pixels in self._beyond().items()}
        arrays = {f"{place}.{name}": image for place, node in nodes.items() for name, image in vars(node).items()}
        cut = {"block": self._cut.samples, "spp": self._cut.spp, "ends": self._cut.ends}
        authors = [sorted(self._authors[tile]) for tile in range(len(self._cut.tiles))]
        return cut | {"blocks": blocks, "parts": parts, "rendered_by": authors, "round": self._round}, arrays

    def restore(self, state: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bool:
        """Go on from what :meth:`state` has returned for a picture of this size in blocks of as many samples; False
        if not all of its blocks are of this cut."""
        before = replace(self._cut, spp=state["spp"], ends=tuple(state.get("ends", ())))
        tiles = self._cut.tiles
        blocks = [Task(step, tile, tiles[tile]) for step, tile in state["blocks"]]
        parts = [Task(step, tile, Window(*corners)) for step, tile, *corners in state["parts"]]
        steps = {task.step for task in blocks + parts}
        if any(self._cut.span(step) != before.span(step) for step in steps):
            return False
        self._there = set(blocks + parts)
        pieces: dict[Task, set[Task]] = {}  # of blocks
        for task in blocks + parts:
            pieces.setdefault(self._block(task), set()).add(task)
        authors = state.get("rendered_by", [[UNKNOWN]] * len(tiles))
        self._authors = {tile: set(names) for tile, names in enumerate(authors)}
        self._round = state["round"]
        for name in {name.rpartition(".")[0] for name in arrays}:
            tile, level, at = map(int, name.split("."))
            node = Pixels(*(arrays[f"{name}.{part}"] for part in Pixels.__dataclass_fields__))
            block = Task(at, tile, tiles[tile])
            if level == 0 and block not in self._there:
                self._parts[block] = node, block.pixels - sum(task.pixels for task in pieces[block])
            elif level == 0 and at >= self._round:
                self._waiting[block] = node
            else:
                self._trees[tile].nodes[level, at] = node
        self._present = len(blocks) - len(self._waiting)
        while pieces:
            block = next(self._blocks)
            self._due.extend(without(block, pieces.pop(block, set())))
        self.samples = self._given = sum(self.cost(task) for task in self._there)
        return True
