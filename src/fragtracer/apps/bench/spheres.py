# SPDX-License-Identifier: MIT
"""Fields of spheres against Mitsuba, and how long a user waits for the first picture of one."""

from dataclasses import replace

from fragtracer.apps.bench.cases import case
from fragtracer.apps.bench.cold import cold_scene, compile_seconds, first_picture_seconds
from fragtracer.apps.bench.contenders import Ours
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.speed import against_mitsuba
from fragtracer.apps.bench.sphere_field import SPHERES, sphere_field
from fragtracer.apps.bench.statistics import median
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.scene import PLAIN, RenderSettings, Scene

COUNTS = (100, 250, SPHERES, 1_000, 10_000)
BUNDLED = "sphere-field"
_SIZE = (480, 270)
_BOUNCES = 5
_RUNS = 5
_SECONDS = 1.0  # of each renderer in a run
_COLD_RUNS = 3


def table(plan: Plan) -> Table:
    width, height = plan.size or _SIZE
    return Table(
        "spheres",
        "Fields of spheres",
        (
            Column("spheres", "spheres"),
            Column("fragtracer", "fragtracer, Msamples/s", "more"),
            Column("mitsuba", "Mitsuba, Msamples/s"),
            Column("ratio", "ratio", "more"),
            Column("sampling", "Mitsuba's sampler"),
            Column("compile", "compile, s", "less"),
            Column("first", "first picture, s", "less"),
        ),
        keys=("spheres",),
        plots=(Plot("spheres", ("fragtracer", "mitsuba"), (), "spheres", "millions of samples per second"),),
        notes=[
            f"The bundled scene {BUNDLED} and fields like it, each sphere with a material of its own; {width}x{height} "
            f"pixels, {_bounces(plan)} bounces.",
            "Compile: the program of the scene. First picture: `fragtracer render --spp 1`, from its start to its end. "
            "Both in new processes with empty caches.",
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    for place, part in steps(progress, [f"{count:,} spheres" for count in COUNTS]):
        result.rows.append(_row(_scene(COUNTS[place], plan), plan, result, part))


def _bounces(plan: Plan) -> int:
    return (plan.bounces or (_BOUNCES,))[0]


def _scene(count: int, plan: Plan) -> Scene:
    scene = case(BUNDLED) if count == SPHERES else sphere_field(count)
    width, height = plan.size or _SIZE
    return replace(scene, render=RenderSettings(width=width, height=height, bounces=_bounces(plan)))


def _row(scene: Scene, plan: Plan, result: Table, part: Progress) -> Row:
    row: Row = {"spheres": len(scene.spheres)}
    with cold_scene(scene) as path:
        part(0.0, "first picture")
        size = scene.render.width, scene.render.height
        runs = min(plan.runs or _COLD_RUNS, _COLD_RUNS)
        row["compile"] = median([compile_seconds(path, size) for _ in range(runs)])
        row["first"] = median([first_picture_seconds(path, size) for _ in range(runs)])
    with Ours(scene, **PLAIN) as ours:
        return row | against_mitsuba(ours, scene, plan, result, part, plan.runs or _RUNS, plan.seconds or _SECONDS)


BENCHMARK = Benchmark(table, run)
