# SPDX-License-Identifier: MIT
"""Renders a fragtracer scene with Mitsuba's path tracer, in independent batches."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.reference.translate import to_mitsuba
from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene import Scene

MAX_PATHS = 2**21  # in flight at once; bounds the memory


def render_reference(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seed: int = 0,
    batches: int = 1,
    variant: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.float32]:
    """Mitsuba's picture of a scene, as independent estimates of the same radiance.

    Parameters
    ----------
    scene
        Any scene.
    size
        Width and height in pixels; left out, the scene's own.
    spp
        Samples per pixel of all batches together, a multiple of ``batches``; left out, the scene's
        own, rounded up to one.
    seed
        Another seed gives other random numbers; every batch has its own.
    batches
        How many estimates, each of ``spp / batches`` samples per pixel.
    variant
        Mitsuba variant, see :func:`fragtracer.reference.variant.choose_variant`.
    progress
        Called after each pass with the samples per pixel done and ``spp``.

    Returns
    -------
    ndarray
        Float32, shape (batches, height, width, 3): linear radiance, row 0 at the top.

    Raises
    ------
    ValueError
        If ``spp`` is not a positive multiple of ``batches``.
    FragtracerError
        If Mitsuba, or the variant asked for, is missing.
    """
    width, height = size or (scene.render.width, scene.render.height)
    spp = spp or -(-scene.render.spp // batches) * batches
    if batches < 1 or spp < 1 or spp % batches:
        raise ValueError(f"spp = {spp} must be a positive multiple of batches = {batches}")
    scene = replace(scene, render=replace(scene.render, width=width, height=height))
    passes = _split(spp // batches, max(1, MAX_PATHS // (width * height)))
    seeds = iter(np.random.SeedSequence(seed).generate_state(batches * len(passes)).tolist())
    images = np.zeros((batches, height, width, 3))
    with mitsuba_variant(variant), tempfile.TemporaryDirectory() as folder:
        import mitsuba as mi

        world = mi.load_dict(to_mitsuba(scene, Path(folder)), parallel=False)
        done = 0
        for image in images:
            for samples in passes:
                image += np.array(mi.render(world, spp=samples, seed=next(seeds))) * (samples * batches / spp)
                done += samples
                if progress:
                    progress(done, spp)
    return images.astype(np.float32)


def _split(samples: int, most: int) -> list[int]:
    """``samples`` in as few nearly equal parts as do not exceed ``most``."""
    return [len(part) for part in np.array_split(np.empty(samples), -(-samples // most))]
