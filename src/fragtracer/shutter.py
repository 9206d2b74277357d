# SPDX-License-Identifier: MIT
"""Motion blur: pictures of what is seen while a shutter is open."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fragtracer.scene import Scene


@dataclass(frozen=True)
class Shutter:
    """Makes a picture the mean over what is seen while a shutter is open.

    Parameters
    ----------
    at
        The scene at a time from 0, when the shutter opens, to 1, when it closes. Cameras, poses of meshes and places of
        lights may differ, as :meth:`fragtracer.Renderer.reset` takes them without compiling.
    moments
        How many times the samples of a picture are divided among, at most; few show as so many pictures laid over each
        other where something moves by many pixels.
    name
        What tells this shutter from others of the same scene, for checkpoints.

    Raises
    ------
    ValueError
        If there is not one moment at least.
    """

    at: Callable[[float], Scene]
    moments: int = 32
    name: str = "open"

    def __post_init__(self) -> None:
        if self.moments < 1:
            raise ValueError(f"a shutter is open for one moment at least, not for {self.moments}")

    def samples(self, spp: int) -> int:
        """Per pixel in each moment of a picture of ``spp`` samples: an even number, since samples belong to two streams
        in turns."""
        return 2 * max(1, -(-spp // (2 * self.moments)))

    def time(self, number: int, seed: int) -> float:
        """Of a moment, at least 0 and less than 1.

        The times of a picture are those of van der Corput (1935, Verteilungsfunktionen), which are stratified however
        many there are, shifted by a random number (Cranley and Patterson 1976, Randomization of Number Theoretic
        Methods for Multiple Integration), so that each is equally likely and the mean over the moments is without bias.
        """
        shift = np.random.default_rng(seed).random()
        inverse = int(f"{number:032b}"[::-1], 2) / 2**32
        return float((inverse + shift) % 1.0)
