# SPDX-License-Identifier: MIT
"""Error over time, and efficiency 1 / (error × time), against Mitsuba on the same scene, in turns."""

from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Contender, Mitsuba, Ours, race
from fragtracer.apps.bench.error import Reference, make_reference, sample_for
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import Estimate, inverse, median
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.yardstick import sampling_for
from fragtracer.scene import Scene

_SIZES = {"three-spheres": (512, 512), "roughness-grid": (512, 512), "cornell-box": (256, 256)}
_BOUNCES = 5
_RUNS = 6
_SECONDS = 16.0
_REFERENCE_TIME = 2.0  # for each of its two images, in units of the longest time of a contender


def table(plan: Plan) -> Table:
    return Table(
        "error",
        "Relative mean squared error over time",
        (
            Column("scene", "scene"),
            Column("size", "size"),
            Column("bounces", "bounces"),
            Column("seconds", "seconds"),
            Column("fragtracer_spp", "fragtracer, spp", "more"),
            Column("mitsuba_spp", "Mitsuba, spp"),
            Column("fragtracer_error", "fragtracer, relMSE", "less"),
            Column("mitsuba_error", "Mitsuba, relMSE"),
            Column("fragtracer_efficiency", "fragtracer, 1/(relMSE·s)", "more"),
            Column("mitsuba_efficiency", "Mitsuba, 1/(relMSE·s)"),
            Column("efficiency_ratio", "efficiency ratio", "more"),
            Column("trimmed_ratio", "of the best 99 % of pixels", "more"),
            Column("sampling", "Mitsuba's sampler"),
        ),
        keys=("scene", "size", "bounces", "seconds"),
        plots=(
            Plot("seconds", ("fragtracer_error", "mitsuba_error"), ("scene", "bounces"), "seconds", "relative MSE"),
            Plot("seconds", ("efficiency_ratio",), ("scene", "bounces"), "seconds", "efficiency over Mitsuba's"),
        ),
        notes=[
            'The ratio "of the best 99 % of pixels" leaves out, of both renderers, the 1 % where an image differs most '
            "from the mean of that renderer's other runs.",
            "The clock starts when a renderer is compiled and warm and, of fragtracer, when it has learned where light "
            "comes from and decided what pays (docs/sampling.md), and stands while the other one works. fragtracer is "
            "told when it ends, as by `render --time`.",
        ],
    )


@dataclass
class _Log:
    """Of one renderer at one time, for each run: samples per pixel, error, and ``cost``, error times exact seconds."""

    spp: list[float] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    images: list[NDArray[np.float32]] = field(default_factory=list)

    def add(self, contender: Contender, reference: Reference) -> None:
        image = contender.image()
        error = reference.relative_mse(image)
        self.spp.append(contender.spp)
        self.error.append(error)
        self.cost.append(error * contender.seconds)
        self.seconds.append(contender.seconds)
        self.images.append(image.astype(np.float32))

    def trimmed(self, reference: Reference) -> list[float]:
        """As ``cost``, without the worst pixels; of at least two runs."""
        total = np.sum(self.images, axis=0, dtype=np.float64)
        others = [(total - image) / (len(self.images) - 1) for image in self.images]
        parts = zip(self.images, others, self.seconds, strict=True)
        return [reference.trimmed_mse(image.astype(np.float64), other) * seconds for image, other, seconds in parts]


def run(plan: Plan, result: Table, progress: Progress) -> None:
    names = list(plan.scenes or _SIZES)
    for place, part in steps(progress, names):
        size = plan.size or _SIZES.get(names[place], (512, 512))
        for bounces in plan.bounces or (_BOUNCES,):
            scene = with_settings(case(names[place]), size, bounces=bounces)
            _run_scene(scene, plan, result, part)


def _run_scene(scene: Scene, plan: Plan, result: Table, part: Progress) -> None:
    longest = plan.seconds or _SECONDS
    runs = plan.runs or _RUNS
    part(0.0, "reference")
    reference = make_reference(scene, _REFERENCE_TIME * longest, plan.reference, plan.variant)
    waited = _REFERENCE_TIME / (_REFERENCE_TIME + runs)
    noise = f"its own relMSE {reference.noise:.1e} (subtracted)"
    result.notes.append(f"{scene.name}: reference by {plan.reference}, {noise}")
    sampling = sampling_for(scene, plan, lambda m: _cost(m, reference, longest / 4), lambda text: part(waited, text))
    times = _times(longest)
    logs: dict[float, tuple[_Log, _Log]] = {t: (_Log(), _Log()) for t in times}
    settings = scene.render
    key: Row = {"scene": scene.name, "size": f"{settings.width}x{settings.height}", "bounces": settings.bounces}
    before = len(result.rows)
    for number in range(runs):
        with ExitStack() as stack:
            ours, mitsuba = (
                stack.enter_context(Ours(scene, number, longest=longest)),
                stack.enter_context(Mitsuba(scene, number, plan.variant, sampling)),
            )
            for t in times:
                part(waited + (1 - waited) * (number + t / longest) / runs, f"run {number + 1} of {runs}")
                race((ours, mitsuba), t)
                logs[t][0].add(ours, reference)
                logs[t][1].add(mitsuba, reference)
        result.rows[before:] = [key | _row(t, *logs[t], reference) | {"sampling": str(sampling)} for t in times]


def _cost(mitsuba: Mitsuba, reference: Reference, seconds: float) -> float:
    """relMSE times seconds."""
    sample_for(mitsuba, seconds)
    return reference.relative_mse(mitsuba.image()) * mitsuba.seconds


def _times(longest: float) -> list[float]:
    """1, 2, 4, … up to ``longest``; a sixteenth of it and on where it is short."""
    first = min(1.0, longest / 16)
    times = []
    while first < longest * 0.99:
        times.append(first)
        first *= 2
    return [*times, longest]


def _row(t: float, ours: _Log, mitsuba: _Log, reference: Reference) -> Row:
    row: Row = {"seconds": t}
    for name, log in (("fragtracer", ours), ("mitsuba", mitsuba)):
        row[f"{name}_spp"] = median(log.spp)
        row[f"{name}_error"] = median(log.error)
        row[f"{name}_efficiency"] = _efficiency(log.cost)
    row["efficiency_ratio"] = _ratio(ours.cost, mitsuba.cost)
    if len(ours.images) > 1:
        row["trimmed_ratio"] = _ratio(ours.trimmed(reference), mitsuba.trimmed(reference))
    return row


def _ratio(ours: list[float], mitsuba: list[float]) -> Estimate | None:
    """Mitsuba's cost over ours."""
    return median([m / o for o, m in zip(ours, mitsuba, strict=True)]) if min(*ours, *mitsuba) > 0 else None


def _efficiency(cost: list[float]) -> Estimate | None:
    """None where an error was too small against the reference's noise to be told from 0."""
    return inverse(median(cost)) if min(cost) > 0 else None


BENCHMARK = Benchmark(table, run)
