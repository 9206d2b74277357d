# SPDX-License-Identifier: MIT
"""Choosing one of many lights: its probability, and tables that draw it in constant time (Walker 1977, An Efficient
Method for Generating Discrete Random Variables with General Distributions)."""

import numpy as np
from numpy.typing import NDArray

_UNIFORM_CHOICE = 0.1  # the share of light choices that ignores power: what is weak may be near


def choice_probabilities(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """The probability with which each of n lights is chosen, by its ``power`` (n,), some of which is positive."""
    probability: NDArray[np.float64] = (1 - _UNIFORM_CHOICE) * power / power.sum() + _UNIFORM_CHOICE / max(
        1, len(power)
    )
    return probability


def alias_table(probability: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The table of ``probability`` (n,), which sums to 1.

    Draw one of n places evenly; keep it with probability ``threshold[place]``, else take ``other[place]``. Built
    by the sweep of Hübschle-Schneider and Sanders 2019 (Parallel Weighted Random Sampling), without its loop: the
    light places, in order, are filled up by the heavy ones, in order; a heavy one that has
    nothing left to give is a light one, which the next heavy one fills.
    """
    weight = probability * len(probability)
    other = np.arange(len(weight))
    threshold = np.minimum(weight, 1.0)
    is_heavy = weight >= min(1.0, weight.max())  # one at least, when all are rounded to below 1
    light, heavy = np.flatnonzero(~is_heavy), np.flatnonzero(is_heavy)
    missing = np.concatenate([[0.0], np.cumsum(1 - weight[light])])  # before each light place, and after all
    given = np.cumsum(weight[heavy] - 1)  # after each heavy one
    giver = np.searchsorted(given, missing[:-1], side="right")
    other[light] = heavy[np.minimum(giver, len(heavy) - 1)]
    filled = np.searchsorted(missing, given)
    threshold[heavy[:-1]] = np.clip(1 + given - missing[np.minimum(filled, len(light))], 0, 1)[:-1]
    other[heavy[:-1]] = heavy[1:]
    return threshold, other
