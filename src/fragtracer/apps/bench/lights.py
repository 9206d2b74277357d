# SPDX-License-Identifier: MIT
"""How the time of a sample grows with the number of lights."""

from contextlib import ExitStack

from fragtracer.apps.bench.contenders import Ours
from fragtracer.apps.bench.fields import LIGHT_KINDS, LightKind, light_field
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.speed import seconds_per_sample
from fragtracer.apps.bench.statistics import median, scaled
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.work import count_work
from fragtracer.scene import PLAIN, RenderSettings

COUNTS = (10, 100, 1_000, 10_000)
_SIZE = (256, 256)
_BOUNCES = 5
_RUNS = 5
_SECONDS = 0.5  # of a run


def table(plan: Plan) -> Table:
    width, height = plan.size or _SIZE
    return Table(
        "lights",
        "Time of a sample over the number of lights",
        (
            Column("kind", "kind"),
            Column("lights", "lights"),
            Column("ns", "ns/sample", "less"),
            Column("rays", "rays/sample"),
            Column("ns_per_ray", "ns/ray", "less"),
            Column("first", "first picture, s"),
        ),
        keys=("kind", "lights"),
        plots=(Plot("lights", ("ns",), ("kind",), "lights", "nanoseconds per sample"),),
        notes=[
            "Points, small spheres, which are shapes as well, or so many of 10,000 small spheres that are all there "
            f"and otherwise black, over nine matte spheres on a plane, {width}x{height} pixels, {_bounces(plan)} "
            "bounces, one light sample. All lights together have the same power, whatever their number, and "
            "small spheres the same area."
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    for place, part in steps(progress, list(LIGHT_KINDS)):
        result.rows += _rows(LIGHT_KINDS[place], plan, part)


def _bounces(plan: Plan) -> int:
    return (plan.bounces or (_BOUNCES,))[0]


def _rows(kind: LightKind, plan: Plan, part: Progress) -> list[Row]:
    """A row for each number; the renderers take turns."""
    width, height = plan.size or _SIZE
    render = RenderSettings(width=width, height=height, bounces=_bounces(plan))
    runs = plan.runs or _RUNS
    found: list[list[float]] = [[] for _ in COUNTS]
    rows: list[Row] = []
    with ExitStack() as stack:
        renderers, rays = [], []
        for count in COUNTS:
            part(0.0, "first picture")
            scene = light_field(count, render, kind)
            renderers.append(ours := stack.enter_context(Ours(scene, **PLAIN)))
            rays.append(count_work(scene, 8).rays)
            rows.append({"kind": kind, "lights": count, "first": round(ours.first_picture, 3)})
        for number in range(runs):
            part(number / runs, "")
            for ours, times in zip(renderers, found, strict=True):
                times.append(1e9 * seconds_per_sample(ours, plan.seconds or _SECONDS) / (width * height))
    for row, traced, times in zip(rows, rays, found, strict=True):
        row |= {"rays": round(traced, 3), "ns": median(times), "ns_per_ray": scaled(median(times), 1 / traced)}
    return rows


BENCHMARK = Benchmark(table, run)
