# SPDX-License-Identifier: MIT
"""How the time of a sample grows with the number of lights."""

from fragtracer.apps.bench.contenders import Ours
from fragtracer.apps.bench.fields import light_field
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.speed import seconds_per_sample
from fragtracer.apps.bench.statistics import median
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.work import count_work
from fragtracer.scene import RenderSettings

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
            "Points, or small spheres, which are shapes as well, over nine matte spheres on a plane, "
            f"{width}x{height} pixels, {_bounces(plan)} bounces, one light sample. All lights together have the same "
            "area and power, whatever their number."
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    rows = [(kind, count) for kind in ("points", "spheres") for count in COUNTS]
    for place, part in steps(progress, [f"{count:,} {kind}" for kind, count in rows]):
        result.rows.append(_row(*rows[place], plan, part))


def _bounces(plan: Plan) -> int:
    return (plan.bounces or (_BOUNCES,))[0]


def _row(kind: str, count: int, plan: Plan, part: Progress) -> Row:
    width, height = plan.size or _SIZE
    scene = light_field(count, RenderSettings(width=width, height=height, bounces=_bounces(plan)), kind == "points")
    rays = count_work(scene, 8).rays
    runs = plan.runs or _RUNS
    nanoseconds = []
    with Ours(scene, adaptive=False) as ours:
        for number in range(runs):
            part(number / runs, "")
            nanoseconds.append(1e9 * seconds_per_sample(ours, plan.seconds or _SECONDS) / (width * height))
    row: Row = {"kind": kind, "lights": count, "ns": median(nanoseconds), "rays": round(rays, 3)}
    return row | {"ns_per_ray": median([n / rays for n in nanoseconds]), "first": round(ours.first_picture, 3)}


BENCHMARK = Benchmark(table, run)
