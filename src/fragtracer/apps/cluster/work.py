# SPDX-License-Identifier: MIT
"""What a picture is cut into for many machines, and how it is put together again: always by the same tree."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce

import numpy as np

from fragtracer.sampling.allocation import Window
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene.content import content_digest

TILE = 256  # pixels, a side
BLOCK = 64  # samples of each pixel


@dataclass(frozen=True, order=True)
class Block:
    """``spp`` samples of each pixel of a tile; blocks of a tile are numbered."""

    number: int
    tile: int
    spp: int


@dataclass(frozen=True)
class Cut:
    """An image of ``width`` x ``height`` pixels in tiles, their samples in blocks of ``samples``; of ``spp`` samples of
    each pixel in all, or without end."""

    width: int
    height: int
    samples: int = BLOCK
    spp: int | None = None

    @property
    def tiles(self) -> list[Window]:
        """Row by row from the top."""
        corners = [(left, top) for top in range(0, self.height, TILE) for left in range(0, self.width, TILE)]
        return [Window(x, y, min(TILE, self.width - x), min(TILE, self.height - y)) for x, y in corners]

    @property
    def rounds(self) -> int | None:
        """Blocks of a tile."""
        return None if self.spp is None else -(-self.spp // self.samples)

    def block(self, number: int, tile: int) -> Block:
        """One of the blocks of a tile."""
        rest = self.samples if self.spp is None else self.spp - number * self.samples
        return Block(number, tile, min(self.samples, rest))

    def blocks(self) -> Iterator[Block]:
        """All of them: the first of each tile, then the second of each, and so on, so that the whole picture is there
        early."""
        number, tiles = 0, range(len(self.tiles))
        while self.rounds is None or number < self.rounds:
            yield from (self.block(number, tile) for tile in tiles)
            number += 1


class Tree:
    """Joins the blocks of a tile in pairs, the pairs in pairs and so on, as far as they are there: in which order they
    come makes no difference to the bits. ``nodes`` are what is not joined yet, by level and place in it."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[int, int], Pixels] = {}

    def add(self, number: int, pixels: Pixels) -> None:
        """A block by its number."""
        level = 0
        while (other := self.nodes.pop((level, number ^ 1), None)) is not None:
            pixels = _joined(pixels, other) if number % 2 == 0 else _joined(other, pixels)
            level, number = level + 1, number // 2
        self.nodes[level, number] = pixels

    @property
    def numbers(self) -> set[int]:
        """Of the blocks that are there."""
        return {n for level, place in self.nodes for n in range(place << level, (place + 1) << level)}

    def joined(self) -> Pixels | None:
        """All blocks so far."""
        nodes = sorted(self.nodes, key=lambda node: node[1] << node[0])
        return reduce(_joined, (self.nodes[node] for node in nodes)) if nodes else None


def _joined(one: Pixels, other: Pixels) -> Pixels:
    return Moments.of(one).merged(Moments.of(other)).pixels()


def assembled(cut: Cut, tiles: dict[int, Tree]) -> Pixels:
    """The picture of all tiles; black where there are no samples yet."""
    mean, variance = (np.zeros((cut.height, cut.width, 4), np.float32) for _ in range(2))
    half_difference = np.zeros((cut.height, cut.width, 3), np.float32)
    for number, window in enumerate(cut.tiles):
        pixels = tiles[number].joined()
        if pixels is not None:
            place = np.s_[window.top : window.top + window.height, window.left : window.left + window.width]
            mean[place], variance[place] = pixels.mean, pixels.variance
            half_difference[place] = pixels.half_difference
    return Pixels(mean, variance, half_difference)


def pixels_digest(pixels: Pixels) -> str:
    """By which two renders of a block are compared."""
    return content_digest(pixels.mean, pixels.variance, pixels.half_difference)
