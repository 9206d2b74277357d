# SPDX-License-Identifier: MIT
"""Samples per second against Mitsuba: the same scene, size, depth, box filter and roulette, in turns."""

from contextlib import ExitStack

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Contender, Mitsuba, Ours
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import inverse, median
from fragtracer.apps.bench.tables import Column, Row, Table
from fragtracer.apps.bench.yardstick import sampling_for
from fragtracer.errors import FragtracerError
from fragtracer.scene import PLAIN, Scene

_SIZES = {
    "three-spheres-lambert": (512, 512),
    "three-spheres": (512, 512),
    "cornell-box": (256, 256),
    "roughness-grid": (512, 512),
}
_BOUNCES = 5
_RUNS = 7
_SECONDS = 1.0  # of each renderer in a run


def table(plan: Plan) -> Table:
    return Table(
        "speed",
        "Samples per second against Mitsuba",
        (
            Column("scene", "scene"),
            Column("size", "size"),
            Column("bounces", "bounces"),
            Column("fragtracer", "fragtracer, Msamples/s", "more"),
            Column("mitsuba", "Mitsuba, Msamples/s"),
            Column("ratio", "ratio", "more"),
            Column("sampling", "Mitsuba's sampler"),
        ),
        keys=("scene", "size", "bounces"),
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    names = list(plan.scenes or _SIZES)
    for place, part in steps(progress, names):
        size = plan.size or _SIZES.get(names[place], (512, 512))
        for bounces in plan.bounces or (_BOUNCES,):
            scene = with_settings(case(names[place]), size, bounces=bounces)
            result.rows.append(_row(scene, plan, result, part))


def _row(scene: Scene, plan: Plan, result: Table, part: Progress) -> Row:
    settings = scene.render
    key: Row = {"scene": scene.name, "size": f"{settings.width}x{settings.height}", "bounces": settings.bounces}
    with Ours(scene, **PLAIN) as ours:
        return key | against_mitsuba(ours, scene, plan, result, part, plan.runs or _RUNS, plan.seconds or _SECONDS)


def against_mitsuba(
    ours: Ours, scene: Scene, plan: Plan, result: Table, part: Progress, runs: int, seconds: float
) -> Row:
    """Millions of samples per second of ``ours`` and of Mitsuba on ``scene``, in turns of ``seconds``, and their ratio.

    A note in ``result`` says which Mitsuba it is, or why there is none.
    """
    pixels = scene.render.width * scene.render.height
    with ExitStack() as stack:
        contenders: list[Contender] = [ours]
        try:
            sampling = sampling_for(
                scene, plan, lambda m: seconds_per_sample(m, seconds / 2), lambda text: part(0.0, text)
            )
            mitsuba = stack.enter_context(Mitsuba(scene, 0, plan.variant, sampling))
            contenders.append(mitsuba)
            note = f"Mitsuba is {mitsuba.variant}"
        except FragtracerError as error:
            note = f"no Mitsuba: {error}"
        if note not in result.notes:
            result.notes.append(note)
        times: list[list[float]] = [[] for _ in contenders]
        for number in range(runs):
            part(number / runs, "")
            for contender, found in zip(contenders, times, strict=True):
                found.append(seconds_per_sample(contender, seconds) / pixels)
    row: Row = {"fragtracer": inverse(median(times[0]), 1e-6)}
    if len(times) > 1:
        row["sampling"] = str(sampling)
        row["mitsuba"] = inverse(median(times[1]), 1e-6)
        row["ratio"] = median([theirs / mine for mine, theirs in zip(*times, strict=True)])
    return row


def seconds_per_sample(contender: Contender, seconds: float) -> float:
    """Seconds for one sample of every pixel, over about ``seconds``."""
    contender.seconds, contender.spp = 0.0, 0
    while contender.seconds < seconds:
        contender.sample(contender.step)
    return contender.seconds / contender.spp


BENCHMARK = Benchmark(table, run)
