# SPDX-License-Identifier: MIT
"""Renders a scene with fragtracer or with Mitsuba, in independent batches and with its time taken."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.reference.render import ReferenceRenderer
from fragtracer.renderer import Renderer
from fragtracer.scene import RenderSettings, Scene

Progress = Callable[[str, float, int], None]

OURS, REFERENCE = "fragtracer", "Mitsuba"


@dataclass(frozen=True)
class Rendering:
    """What one renderer made.

    ``pictures`` is (batches, height, width, 3) float32 linear radiance, row 0 at the top, of ``spp``
    samples per pixel together. ``start_seconds`` went by with loading and compiling, ``seconds`` with
    rendering. ``device`` is the name of what rendered; ``non_finite`` counts samples that were NaN or
    infinite and were left out.
    """

    name: str
    pictures: NDArray[np.float32]
    spp: int
    start_seconds: float
    seconds: float
    device: str
    non_finite: int = 0

    @property
    def picture(self) -> NDArray[np.float32]:
        """The mean of the batches, (height, width, 3)."""
        mean: NDArray[np.float32] = self.pictures.mean(axis=0, dtype=np.float64).astype(np.float32)
        return mean


def render_ours(
    scene: Scene,
    size: tuple[int, int],
    spp: int,
    batches: int,
    seed: int = 0,
    progress: Progress | None = None,
    context: Any = None,
) -> Rendering:
    """``scene`` by fragtracer: ``spp`` samples per pixel, a multiple of ``batches``, each with a seed of its own.

    ``progress`` is called with the name of the renderer, the samples per pixel done and ``spp``. ``context`` is as
    for :class:`fragtracer.renderer.Renderer`.
    """
    each = _split(spp, batches)
    pictures: list[NDArray[np.float32]] = []
    non_finite, rendering = 0, 0.0
    begin = time.perf_counter()
    scene = replace(scene, render=as_compared(scene.render, each))
    with Renderer(scene, size, context) as renderer:
        device = renderer.context_info["GL renderer"]
        for batch_seed in np.random.SeedSequence((seed, 0)).generate_state(batches):
            renderer.reset(seed=int(batch_seed))
            report = part_of(progress, OURS, each * len(pictures), spp)
            start = time.perf_counter()
            renderer.sample(each, report)
            pictures.append(renderer.image())
            rendering += time.perf_counter() - start
            non_finite += renderer.non_finite_samples()
    starting = time.perf_counter() - begin - rendering
    return Rendering(OURS, np.stack(pictures), spp, starting, rendering, device, non_finite)


def as_compared(settings: RenderSettings, samples: int) -> RenderSettings:
    """Those of fragtracer in a comparison, ``samples`` of each pixel in a batch.

    Without guiding and light tracing, as the reference: light that they alone find, too rare for any batch of the other
    side, would show as a difference (docs/correctness.md). Batches are too short for a pilot of adaptive sampling to
    pay. In the gradient domain the errors of neighbours would not be independent, as the tests take them.
    """
    off: dict[str, Any] = {name: "off" for name in ("adaptive", "light_tracing") if getattr(settings, name) == "auto"}
    off |= {"guiding": "off", "gradient_domain": "off"}
    return replace(settings, rays=min(samples, settings.rays), **off)


def part_of(progress: Progress | None, name: str, before: int, spp: int) -> Callable[[float], None] | None:
    """A report of one batch, made a part of that of all ``spp`` samples, ``before`` of which are done."""
    return None if progress is None else lambda done: progress(name, before + done, spp)


def render_reference(
    scene: Scene,
    size: tuple[int, int],
    spp: int,
    batches: int,
    seed: int = 0,
    progress: Progress | None = None,
    variant: str | None = None,
    is_timed: bool = True,
    file: Path | None = None,
) -> Rendering:
    """``scene`` by Mitsuba; the parameters are those of :func:`render_ours`. Unless ``is_timed`` all that is compiled
    counts as rendering, which takes less time on the whole. With ``file``, the Mitsuba scene that ``scene`` was read
    from, Mitsuba renders that.

    Raises
    ------
    FragtracerError
        If Mitsuba or ``variant`` is missing, or its pictures have pixels that are not finite.
    """
    each = _split(spp, batches)
    begin = time.perf_counter()
    with ReferenceRenderer(scene, size, variant, file=file) as renderer:
        if is_timed:
            renderer.warm_up(batches, each)
        start = time.perf_counter()
        done, (own,) = 0, np.random.SeedSequence((seed, 1)).generate_state(1)

        def report(samples: int) -> None:
            nonlocal done
            done += samples
            if progress:
                progress(REFERENCE, done, spp)

        pictures = renderer.batches(batches, each, int(own), report).astype(np.float32)
        seconds = time.perf_counter() - start
        device = renderer.variant
    if not np.isfinite(pictures).all():
        raise FragtracerError("Mitsuba's pictures have NaN or infinite pixels: there is nothing to compare with")
    return Rendering(REFERENCE, pictures, spp, start - begin, seconds, device)


def _split(spp: int, batches: int) -> int:
    if batches < 2 or spp < 1 or spp % batches:
        raise ValueError(f"spp = {spp} must be a positive multiple of batches = {batches}, which are two at least")
    return spp // batches
