# SPDX-License-Identifier: MIT
"""What a picture is cut into for many machines."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fragtracer.sampling.allocation import (
    FIRST_STAGE,
    StagePart,
    Window,
    samples_before,
    stage_samples,
)
from fragtracer.sampling.pilot import pilot_samples
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Camera
from fragtracer.scene.content import content_digest

TILE = 256  # pixels, a side
BLOCK = 256  # samples of each pixel, at most
NOT_OF_WORKERS = ("adaptive", "light_tracing", "gradient_domain")  # settings that are off where parts are rendered
UNKNOWN = ""  # the author of what the checkpoints of earlier versions hold
CORNERS = ("left", "top", "width", "height")  # of a window, as checkpoints have them
_LEAST_SIDE = 8  # pixels, of a part of a tile
_GRID = 4  # pixels, a side of what is shaded together, which no cut should part


@dataclass(frozen=True)
class Frame:
    """What a picture has of its own, where ``count`` in all are of the same scene."""

    camera: Camera
    seed: int
    count: int = 1


@dataclass(frozen=True)
class Task:
    """What one worker is asked for at once: the samples of a ``window`` of a tile in one step of a picture."""

    step: int
    tile: int
    window: Window

    @property
    def pixels(self) -> int:
        return self.window.width * self.window.height

    def halves(self) -> tuple["Task", ...]:
        """Of the window, across its longer side; the task alone where it is too small. No pixel's samples depend on
        those of others, so that it makes no difference to the bits."""
        width, height = self.window.width, self.window.height
        half = max(width, height) // 2
        half -= half % _GRID
        if half < _LEAST_SIDE:
            return (self,)
        if width >= height:
            parts = ({"width": half}, {"width": width - half, "left": self.window.left + half})
        else:
            parts = ({"height": half}, {"height": height - half, "top": self.window.top + half})
        return tuple(replace(self, window=replace(self.window, **part)) for part in parts)


def without(task: Task, done: set[Task]) -> list[Task]:
    """What is left of a task where some of its parts are done."""
    if task in done:
        return []
    window = task.window
    if not any(_lies_in(other.window, window) for other in done):
        return [task]
    return [piece for half in task.halves() for piece in without(half, done)]


def _lies_in(one: Window, other: Window) -> bool:
    return other.left <= one.left < other.left + other.width and other.top <= one.top < other.top + other.height


@dataclass(frozen=True)
class Block:
    """``spp`` samples of each pixel of a window, from its first sample on."""

    window: Window
    spp: int


@dataclass(frozen=True)
class PilotSamples:
    """What says whether adaptive sampling pays, for an image of this size."""

    width: int
    height: int


Part = Block | StagePart | PilotSamples


def flaw(part: Part, pixels: Pixels) -> str:
    """What is wrong at first sight with the pixels of a part; empty if nothing is."""
    expected: Any
    match part:
        case Block(window, spp):
            shape, expected = (window.height, window.width), spp
        case StagePart():
            shape, expected = part.sampled.shape, part.samples
        case PilotSamples(width, height):
            short, long = pilot_samples(width, height)
            expected = short if len(pixels.mean) == len(short) else long
            shape = expected.shape
    if [image.shape for image in vars(pixels).values()] != [(*shape, n) for n in (4, 4, 3)]:
        return "returned a block of another size"
    if not (pixels.mean[..., 3] + pixels.variance[..., 3] == expected).all():
        return "returned a block without all of its samples"
    return ""


def sent_bytes(part: Part) -> int:
    """Of the arrays that a worker needs for a part."""
    if not isinstance(part, StagePart):
        return 0
    film = () if part.film is None else vars(part.film).values()
    return sum(values.nbytes for values in (part.sampled, *(items for items, _ in part.work), *film))


def pixels_digest(pixels: Pixels) -> str:
    """By which two renders of a part are compared."""
    return content_digest(pixels.mean, pixels.variance, pixels.half_difference)


@dataclass(frozen=True)
class Cut:
    """An image of ``width`` x ``height`` pixels in tiles, of ``spp`` samples of each pixel, or without end. The samples
    of a tile come in blocks, which grow as stages do (:mod:`fragtracer.sampling.allocation`) until they have
    ``samples`` of each pixel; so the whole picture is there early. Blocks end as well at the numbers of samples
    ``ends``, which are even, at which it was to end before."""

    width: int
    height: int
    samples: int = BLOCK
    spp: int | None = None
    ends: tuple[int, ...] = ()

    @cached_property
    def tiles(self) -> list[Window]:
        """Row by row from the top."""
        corners = [(left, top) for top in range(0, self.height, TILE) for left in range(0, self.width, TILE)]
        return [Window(x, y, min(TILE, self.width - x), min(TILE, self.height - y)) for x, y in corners]

    def tasks(self, step: int) -> Iterator[Task]:
        """Of all tiles."""
        return (Task(step, number, tile) for number, tile in enumerate(self.tiles))

    def all_tasks(self) -> Iterator[Task]:
        """The first block of each tile, then the second of each, and so on, so that the whole picture is there
        early."""
        number = 0
        while self.rounds is None or number < self.rounds:
            yield from self.tasks(number)
            number += 1

    @property
    def most(self) -> int:
        """Samples of the largest block."""
        return self.samples * min(TILE, self.width) * min(TILE, self.height)

    @cached_property
    def rounds(self) -> int | None:
        """Blocks of a tile."""
        if self.spp is None:
            return None
        number = 0
        while self.first(number) < self.spp:
            number += 1
        return number

    def first(self, number: int) -> int:
        """The number of the first sample of a block."""
        if number in self._more:
            return self._more[number]
        return self._first(number - sum(other < number for other in self._more))

    @cached_property
    def _more(self) -> dict[int, int]:
        """The numbers of the blocks that begin at one of the ``ends``, where none would else, and of their first
        samples."""
        more: dict[int, int] = {}
        number = 0
        for end in sorted(set(self.ends)):
            while self._first(number) < end:
                number += 1
            if self._first(number) != end:
                more[number + len(more)] = end
        return more

    def _first(self, number: int) -> int:
        """Where there are no ``ends``."""
        growing = 0
        while stage_samples(growing) < self.samples and growing < number:
            growing += 1
        return samples_before(growing) + (number - growing) * max(self.samples, FIRST_STAGE)

    def span(self, number: int) -> tuple[int, int]:
        """The numbers of the first sample of a block, and of the one behind the last."""
        end = self.first(number + 1)
        return self.first(number), end if self.spp is None else min(end, self.spp)

    def spp_of(self, number: int) -> int:
        """Samples of each pixel in a block."""
        first, end = self.span(number)
        return end - first


def empty(height: int, width: int) -> Pixels:
    """A film without samples."""
    return Pixels(*(np.zeros((height, width, n), np.float32) for n in (4, 4, 3)))


def at(window: Window) -> tuple[slice, slice]:
    """Where a window lies in an array of its image."""
    return slice(window.top, window.top + window.height), slice(window.left, window.left + window.width)


def place(image: Pixels, part: Pixels, window: Window) -> None:
    """Write ``part`` into a window of ``image``, whose arrays must be writable."""
    for there, here in zip(vars(image).values(), vars(part).values(), strict=True):
        there[at(window)] = here


def crop(image: Pixels, window: Window) -> Pixels:
    """The pixels of a window."""
    return Pixels(*(np.ascontiguousarray(values[at(window)]) for values in vars(image).values()))
