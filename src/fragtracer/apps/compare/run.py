# SPDX-License-Identifier: MIT
"""Renders a scene with fragtracer and with Mitsuba and compares the images."""

from dataclasses import dataclass, field
from pathlib import Path

from fragtracer.apps.compare.machine import describe_machine
from fragtracer.apps.compare.measures import Measures, measure
from fragtracer.apps.compare.rendering import Progress, Rendering, render_ours, render_reference
from fragtracer.apps.compare.verdict import ALPHA, MARGIN, Verdict, judge
from fragtracer.scene import Scene

PIXELS = 57600  # 320 x 180
SPP = 1024
BATCHES = 16


@dataclass(frozen=True)
class Comparison:
    """All that is known of one comparison; ``exit_status`` is 0, 1 or 2 (:mod:`fragtracer.apps.compare.verdict`).

    ``file`` is the Mitsuba scene that Mitsuba rendered itself; none, it rendered our translation of ``scene``.
    """

    scene: Scene
    ours: Rendering
    reference: Rendering
    verdict: Verdict
    measures: Measures
    seed: int = 0
    file: Path | None = None
    machine: dict[str, str] = field(default_factory=describe_machine)

    @property
    def exit_status(self) -> int:
        return self.verdict.exit_status

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        _, height, width, _ = self.ours.pictures.shape
        return width, height

    @property
    def spp(self) -> int:
        """Samples per pixel of each renderer."""
        return self.ours.spp

    @property
    def batches(self) -> int:
        return len(self.ours.pictures)

    @property
    def spp_needed(self) -> int:
        """Samples per pixel that would probably make an inconclusive comparison conclusive; else :attr:`spp`."""
        return rounded_up(self.spp * self.verdict.spp_factor, self.batches)


def compare_scene(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int = SPP,
    batches: int = BATCHES,
    seed: int = 0,
    margin: float = MARGIN,
    variant: str | None = None,
    progress: Progress | None = None,
    file: Path | None = None,
) -> Comparison:
    """Render ``scene`` here and with Mitsuba, and judge whether the pictures agree.

    Parameters
    ----------
    scene
        Any scene, with its own render settings.
    size
        (width, height) in pixels; left out, the scene's own shape with about 57600 pixels. The tests
        look at parts of the picture, for which more pixels do the same as more samples.
    spp
        Samples per pixel of each renderer, rounded up to a multiple of ``batches``.
    batches
        Independent pictures of each renderer, two at least. Fewer than about eight weaken the tests.
    seed
        Another seed repeats the comparison with other random numbers.
    margin
        The relative difference up to which means count as equal, 0.01 for 1 %.
    variant
        Mitsuba's, see :func:`fragtracer.reference.variant.choose_variant`.
    progress
        Called many times with "Mitsuba" and then "fragtracer", the samples per pixel done, and those in all.
    file
        The Mitsuba scene that ``scene`` was read from, which Mitsuba then renders in place of our translation.

    Raises
    ------
    FragtracerError
        If one renderer cannot render it.
    ValueError
        If a number is out of its range.
    """
    if not 0 < margin < 1:
        raise ValueError(f"margin = {margin} must lie between 0 and 1")
    size, spp = size or default_size(scene), rounded_up(spp, batches)
    reference = render_reference(scene, size, spp, batches, seed, progress, variant, file=file)
    ours = render_ours(scene, size, spp, batches, seed, progress)
    return compare_renderings(scene, ours, reference, margin, seed, file)


def compare_renderings(
    scene: Scene,
    ours: Rendering,
    reference: Rendering,
    margin: float = MARGIN,
    seed: int = 0,
    file: Path | None = None,
) -> Comparison:
    """Judge two renderings of one scene; ``file`` as in :func:`compare_scene`."""
    verdict = judge(ours.pictures, reference.pictures, margin, ALPHA, ours.non_finite)
    return Comparison(scene, ours, reference, verdict, measure(ours, reference), seed, file)


def default_size(scene: Scene) -> tuple[int, int]:
    """(width, height) of the scene's shape, with about :data:`PIXELS` pixels."""
    width, height = scene.render.width, scene.render.height
    shrink = (PIXELS / (width * height)) ** 0.5
    return max(1, round(width * shrink)), max(1, round(height * shrink))


def rounded_up(spp: float, batches: int) -> int:
    """The next multiple of ``batches``."""
    return -int(-spp // batches) * batches
