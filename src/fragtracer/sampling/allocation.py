# SPDX-License-Identifier: MIT
"""Adaptive sampling: how many samples each pixel gets, and how stages make one unbiased picture.

Samples come in stages. The first gives each pixel as many; each later one, three times as large as all before it,
places its samples by the relative error seen so far. Given what was seen before, the mean of a stage is unbiased in
every pixel, whatever its number of samples, if that is at least one; so is any sum of stages with weights that are
fixed in advance.
Weights by the number of samples that a pixel got would be biased (Kirk and Arvo 1991, Unbiased Sampling Techniques for
Image Synthesis). docs/sampling.md has the proof.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.sampling.pixels import Pixels, around, bright, color_sum, in_bands

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

FIRST_STAGE = 32  # samples per pixel
_GROWTH = 4  # of the samples there are, by each later stage (docs/sampling.md)
_FIRST_WEIGHT = 0.5  # of a sample of the first stage, which no plan has placed (docs/sampling.md)
ITEM_SAMPLES = 16  # of an item of work in the first stages
_MOST_ITEM_SAMPLES = 64  # in later ones, where they cost less: lanes wait for the longest path of an item
_FIRST_ITEMS = 2  # per pixel, in the mean, of the first pass of a stage, in the place of one as large as all of them
MOST_STAGES = 31  # that have streams of random numbers of their own (shaders/sampler/stream.glsl)
# In squared error, at which the pilot says that adaptive sampling pays; and with meshes, where rays that go apart cost
# more (docs/sampling.md).
LEAST_GAIN, _LEAST_GAIN_OF_MESHES = 1.3, 1.6
_LEAST_SHARE = 8  # of the mean number of samples that every pixel gets: an eighth
_MOST_SHARE = 64  # times the mean that a pixel gets
_SMOOTH = 5  # pixels, a side of the square over which the variance is averaged
BLOCK = 4  # pixels, a side of what is shaded together


def samples_before(stage: int) -> int:
    """Samples per pixel of all stages before one, in the mean over pixels."""
    return FIRST_STAGE * _GROWTH ** (stage - 1) if stage else 0


def stage_samples(stage: int) -> int:
    """Samples per pixel of a stage, in the mean over pixels."""
    return samples_before(stage + 1) - samples_before(stage)


def stage_weight(stage: int, samples: float) -> float:
    """Of the first ``samples`` per pixel of a stage, in the mean over pixels, in the picture: fixed in advance."""
    return samples * (1.0 if stage else _FIRST_WEIGHT)


def picture_weight(samples: float) -> float:
    """Of a picture of ``samples`` per pixel, in the mean over pixels, which are more than one stage."""
    return samples - (FIRST_STAGE - stage_weight(0, FIRST_STAGE))


def item_samples(stage: int) -> int:
    """Samples of an item of work in a stage."""
    return min(ITEM_SAMPLES << max(0, stage - 1), _MOST_ITEM_SAMPLES)


@dataclass(frozen=True)
class Stages:
    """What finished stages, and the one that is being sampled, say of the picture together.

    ``mean`` (height, width, 3) is their weighted mean, ``variance`` that between samples; ``weight`` (height, width, 1)
    is the sum of the stages' weights, ``share`` that of weight² / samples, by which the variance of the mean follows
    from that between samples, and ``halves`` (height, width, 3) the sum of (weight · half-difference)².
    """

    mean: Floats
    variance: Floats
    halves: Floats
    weight: Floats
    share: Floats
    samples: Floats
    non_finite: Floats

    @staticmethod
    def none(height: int, width: int) -> "Stages":
        colors, single = np.zeros((height, width, 3)), np.zeros((height, width, 1))
        return Stages(colors, colors, colors, single, single, single, single)

    def with_stage(self, pixels: Pixels, weight: float | Floats) -> "Stages":
        """Together with a stage of a weight fixed in advance (:func:`stage_weight`). Where some pixels are further in
        the stage than others, it is (height, width, 1)."""
        own, new = list(vars(self).values()), list(vars(pixels).values())

        def together(weight: Floats, *bands: Any) -> list[Floats]:
            stages, some = Stages(*bands[: len(own)]), Pixels(*bands[len(own) :])
            return list(vars(stages._with_stage(some, weight)).values())

        return Stages(*in_bands(together, [np.broadcast_to(weight, self.weight.shape), *own, *new]))

    def _with_stage(self, pixels: Pixels, weight: Floats) -> "Stages":
        count = pixels.mean[..., 3:].astype(np.float64)
        here = np.where(count > 0, weight, 0.0)
        samples, total = self.samples + count, self.weight + here
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = self.mean + np.where(here > 0, (pixels.mean[..., :3] - self.mean) * (here / total), 0)
            variance = self.variance + np.where(
                count > 0, (pixels.variance[..., :3] - self.variance) * (count / samples), 0
            )
            share = self.share + np.where(count > 0, here**2 / count, 0)
        halves = self.halves + (here * pixels.centred_half_difference()) ** 2
        return Stages(mean, variance, halves, total, share, samples, self.non_finite + pixels.variance[..., 3:])

    def pixels(self) -> Pixels:
        """The picture as one film would have it that had sampled all stages evenly, with the same standard error."""

        def shown(*bands: Floats) -> list[NDArray[np.float32]]:
            return list(vars(Stages(*bands)._pixels()).values())

        return Pixels(*in_bands(shown, list(vars(self).values())))

    def _pixels(self) -> Pixels:
        with np.errstate(divide="ignore", invalid="ignore"):
            variance = self.variance * np.where(self.weight > 0, self.share / self.weight**2 * (self.samples - 1), 0)
            halves = np.where(self.weight > 0, np.sqrt(self.halves) / self.weight, 0)
        mean = np.concatenate([self.mean, self.samples], axis=2)
        noise = np.concatenate([np.maximum(variance, 0), self.non_finite], axis=2)
        return Pixels(mean.astype(np.float32), noise.astype(np.float32), halves.astype(np.float32))

    def deviation(self, pixels: Pixels) -> Floats:
        """Standard deviation of a sample of each pixel as stratification leaves it, relative to brightness, (height,
        width): to it the best numbers of samples are proportional. It is smooth, since a bright sample that one pixel
        has met might as well have been met by its neighbours. ``pixels`` are those of :meth:`pixels`."""
        error = np.sqrt(color_sum(np.square(pixels.standard_error(), dtype=np.float64)) / 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = error * (self.weight / np.sqrt(self.share))[..., 0] / bright(pixels.mean)
        return np.sqrt(around(np.where(np.isfinite(found), found, 0) ** 2, _SMOOTH))


class Plan:
    """Where the samples of a stage go.

    A pass has ``item_samples`` samples per pixel, in the mean. The first has ``first`` (pixels,) short items of each
    pixel, one at least, so that every pixel has its share of an unfinished stage. The passes after it have together
    ``items`` (pixels,) of ``item_samples`` samples, each of them nearly as many as there are pixels.
    """

    def __init__(self, stage: int, first: Counts, items: Counts) -> None:
        self.item_samples = item_samples(stage)
        self.passes = stage_samples(stage) // self.item_samples
        self.first, self.items = first, items
        # Low-discrepancy phases, so that neighbours do not get their items in the same pass.
        self._phase = np.arange(items.size) * ((5**0.5 - 1) / 2) % 1

    @staticmethod
    def by(stage: int, deviation: Floats) -> "Plan":
        """The plan for a ``deviation`` (height, width) as :meth:`Stages.deviation` has it."""
        relative = _relative(deviation.ravel())
        passes = stage_samples(stage) // item_samples(stage)
        return Plan(stage, _placed(relative, _FIRST_ITEMS), _placed(relative, passes - 1))

    def work(self, number: int, passes: int, rays: int) -> list[tuple[Counts, int]]:
        """Items of each pixel, (pixels,), and how many samples an item has, in so many passes from ``number`` on: whole
        ones, whose ``rays`` are ``item_samples``, or a shorter one."""
        found = []
        if number == 0:
            short, rest = divmod(rays, _FIRST_ITEMS)
            found.append((np.ones_like(self.first), rays) if rest else (self.first, short))
        if number + passes > 1:
            found.append((self._items_before(number + passes) - self._items_before(max(1, number)), rays))
        return found

    def sampled_before(self, number: int) -> Counts:
        """Samples of each pixel, (pixels,), in all passes before, which were whole."""
        if number == 0:
            return np.zeros_like(self.items)
        return self.first * (self.item_samples // _FIRST_ITEMS) + self._items_before(number) * self.item_samples

    def _items_before(self, number: int) -> Counts:
        """Of those after the first pass."""
        return (self.items * ((number - 1) / (self.passes - 1)) + self._phase).astype(np.int64)


def _placed(relative: Floats, mean: int) -> Counts:
    """So many items per pixel in the mean, by what each wants, over the mean of that."""
    least = -(-mean // _LEAST_SHARE)
    wanted = np.minimum(relative * (mean - least), _MOST_SHARE * mean)
    scale = (mean - least) * relative.size / wanted.sum()
    edges = np.floor(np.concatenate([[0.0], np.cumsum(wanted)]) * scale + 0.5).astype(np.int64)
    return np.asarray(least + np.diff(edges))


def _relative(deviation: Floats) -> Floats:
    """To its mean; 1 where there is none."""
    mean = float(deviation.mean())
    return deviation / mean if mean > 0 else np.ones_like(deviation)


def shares(relative: Floats) -> Floats:
    """The number of samples that a plan gives to pixels, over its mean, by their deviation over its mean."""
    return 1 / _LEAST_SHARE + (1 - 1 / _LEAST_SHARE) * relative


def least_gain(has_meshes: bool) -> float:
    """The gain from which on adaptive sampling pays in a scene that has meshes, or none."""
    return _LEAST_GAIN_OF_MESHES if has_meshes else LEAST_GAIN


def decision(adaptive: str, gain: float | None, least: float) -> str:
    """Whether sampling is adaptive, and why, where a pilot has found ``gain``, and it pays from ``least`` on."""
    if adaptive != "auto":
        return f"{adaptive}: as asked for"
    if gain is None:
        return f"off: there are no more than {FIRST_STAGE} samples per pixel"
    if gain < least:
        return f"off: at equal samples it would divide the squared error by {gain:.2f} < {least:g}"
    return f"on: at equal samples it divides the squared error by {gain:.2f}"


@dataclass(frozen=True)
class Window:
    """Some pixels of an image, ``left`` and ``top`` counted from its corner, and the number of their first sample."""

    left: int
    top: int
    width: int
    height: int
    first_sample: int = 0


@dataclass(frozen=True)
class StagePart:
    """What the pixels of a window get in a stage after the first, where they have had ``sampled`` (height, width)
    samples of it, which are in ``film``; without one, none. ``work`` has the items of each pixel, (height, width), and
    how many samples an item has, one kind after the other (:meth:`Plan.work`)."""

    window: Window
    stage: int
    film: Pixels | None
    sampled: NDArray[np.int32]
    work: tuple[tuple[NDArray[np.int32], int], ...]

    @property
    def samples(self) -> NDArray[np.int32]:
        """Of each pixel of the stage, (height, width), once the work is done."""
        return self.sampled + sum(rays * items for items, rays in self.work)


@dataclass(frozen=True)
class WorkList:
    """Some samples of one pixel for each item; those of a pixel follow each other.

    ``pixels`` (items,) are their numbers, row by row from the top, ``first`` (items,) the numbers of their first
    samples in the stage. ``numbers`` (items,) says where samples do not take the random numbers of their own pixel
    (:mod:`fragtracer.sampling.gradients`).
    """

    pixels: Counts
    first: Counts
    numbers: NDArray[np.uint32] | None = None

    def cut(self, most: int) -> Iterator["WorkList"]:
        """In lists of at most ``most`` items."""
        for start in range(0, len(self.pixels), most):
            part = slice(start, start + most)
            numbers = None if self.numbers is None else self.numbers[part]
            yield WorkList(self.pixels[part], self.first[part], numbers)


def work_list(items: Counts, sampled: Counts, item_samples: int, order: Counts) -> WorkList:
    """``items`` (pixels,) items of each pixel, which had ``sampled`` (pixels,) samples of the stage before; the pixels
    in their ``order`` (pixels,)."""
    of_pixel = items[order]
    pixels = np.repeat(order, of_pixel)
    # The first sample of item number 0 of the list, were it of this pixel: its items count on from there.
    begin = sampled[order] - (np.cumsum(of_pixel) - of_pixel) * item_samples
    return WorkList(pixels, np.repeat(begin, of_pixel) + np.arange(0, len(pixels) * item_samples, item_samples))


@lru_cache(maxsize=2)
def block_order(width: int, height: int) -> Counts:
    """The pixels of an image, (width * height,), block by block of 4 x 4, so that those shaded together are
    neighbours."""
    y, x = np.divmod(np.arange(width * height), width)
    order = np.lexsort((x, y, x // BLOCK, y // BLOCK))
    order.setflags(write=False)
    return order
