# SPDX-License-Identifier: MIT
"""Samples per second against Mitsuba: the same scene, size, depth, box filter and roulette, by turns."""

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Contender, Mitsuba, Ours
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import Estimate, inverse, median
from fragtracer.apps.bench.tables import Column, Row, Table
from fragtracer.scene import Scene

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
    pixels = scene.render.width * scene.render.height
    with Ours(scene) as ours, Mitsuba(scene, variant=plan.variant) as mitsuba:
        note = f"Mitsuba is {mitsuba.variant}"
        if note not in result.notes:
            result.notes.append(note)
        seconds: tuple[list[float], list[float]] = ([], [])
        runs = plan.runs or _RUNS
        for number in range(runs):
            part(number / runs, "")
            seconds[0].append(seconds_per_sample(ours, plan.seconds or _SECONDS) / pixels)
            seconds[1].append(seconds_per_sample(mitsuba, plan.seconds or _SECONDS) / pixels)
    ratio = median([theirs / mine for mine, theirs in zip(*seconds, strict=True)])
    rates: list[Estimate] = [inverse(median(times), 1e-6) for times in seconds]
    settings = scene.render
    key: Row = {"scene": scene.name, "size": f"{settings.width}x{settings.height}", "bounces": settings.bounces}
    return key | {"fragtracer": rates[0], "mitsuba": rates[1], "ratio": ratio}


def seconds_per_sample(contender: Contender, seconds: float) -> float:
    """Seconds for one sample of every pixel, over about ``seconds``."""
    contender.seconds, contender.spp = 0.0, 0
    while contender.seconds < seconds:
        contender.sample(contender.step)
    return contender.seconds / contender.spp


BENCHMARK = Benchmark(table, run)
