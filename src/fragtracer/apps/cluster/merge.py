# SPDX-License-Identifier: MIT
"""How the blocks of a tile are put together again: always by the same tree."""

from functools import reduce

from fragtracer.apps.cluster.work import Cut, empty, place
from fragtracer.sampling.merging import Moments
from fragtracer.sampling.pixels import Pixels


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
    picture = empty(cut.height, cut.width)
    for number, window in enumerate(cut.tiles):
        pixels = tiles[number].joined()
        if pixels is not None:
            place(picture, pixels, window)
    return picture
