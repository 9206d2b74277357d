# SPDX-License-Identifier: MIT
"""Frames per second over rays, bounces and light samples: the table of N. Roth, Lancer de rayons en
temps réel (Université de Strasbourg), for a path tracer in WebGL on a GTX 970 in Chrome 79."""

from functools import partial
from itertools import product

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.frames import RUNS, FrameTime, frame_time
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import inverse, scaled
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.work import count_work
from fragtracer.scene import Scene

DOCUMENT = {
    (5, 1, 1): "> 60",
    (10, 1, 1): "> 60",
    (15, 1, 1): "> 60",
    (20, 1, 1): "> 60",
    (10, 5, 1): "> 60",
    (15, 5, 1): "30",
    (20, 10, 1): "27",
    (10, 5, 5): "30",
    (15, 5, 10): "20",
    (15, 5, 15): "14",
}
_SCENES = ("three-spheres",)
_SIZE = (640, 360)


def table(plan: Plan) -> Table:
    return Table(
        "sweep",
        "Frames per second over rays, bounces and light samples",
        (
            Column("scene", "scene"),
            Column("size", "size"),
            Column("rays", "rays"),
            Column("bounces", "bounces"),
            Column("light_samples", "light samples"),
            Column("fps", "frames/s", "more"),
            Column("document_fps", "document (GTX 970)"),
            Column("rays_per_second", "Mrays/s", "more"),
            Column("ns_per_vertex", "ns/vertex", "less"),
            Column("note", "note"),
        ),
        keys=("scene", "size", "rays", "bounces", "light_samples"),
        plots=(Plot("rays", ("fps",), ("scene", "bounces", "light_samples"), "rays per frame", "frames per second"),),
        notes=["Rays are all rays, shadow rays too; a vertex is a point where a path scatters."],
    )


def combinations(plan: Plan) -> list[tuple[int, int, int]]:
    """Rays, bounces and light samples of each row: the document's, or all combinations of what was asked for."""
    if plan.rays is None and plan.bounces is None and plan.light_samples is None:
        return list(DOCUMENT)
    return list(product(plan.rays or (10,), plan.bounces or (5,), plan.light_samples or (1,)))


def run(plan: Plan, result: Table, progress: Progress) -> None:
    rows = [(name, *numbers) for name in plan.scenes or _SCENES for numbers in combinations(plan)]
    size = plan.size or _SIZE
    for place, part in steps(progress, ["{} {} rays, {} bounces, {} light samples".format(*row) for row in rows]):
        name, rays, bounces, light_samples = rows[place]
        scene = with_settings(case(name), size, rays=rays, bounces=bounces, light_samples=light_samples)
        frame = frame_time(scene, plan.runs or RUNS, plan.row_limit, progress=partial(part, text=""))
        clock = f"Time is the {'GPU' if frame.gpu_clock else 'wall'} clock's."
        if clock not in result.notes:
            result.notes.append(clock)
        result.rows.append(_row(scene, frame))


def _row(scene: Scene, frame: FrameTime) -> Row:
    settings = scene.render
    numbers = (settings.rays, settings.bounces, settings.light_samples)
    row: Row = {"scene": scene.name, "size": f"{settings.width}x{settings.height}"}
    row |= dict(zip(("rays", "bounces", "light_samples"), numbers, strict=True))
    row["document_fps"] = DOCUMENT.get(numbers)
    if frame.seconds is None:
        return row | {"note": f"stopped: a frame takes about {frame.expected:.0f} s"}
    work = count_work(scene)
    samples = settings.width * settings.height * settings.rays
    row["fps"] = inverse(frame.seconds)
    row["rays_per_second"] = inverse(frame.seconds, 1e-6 * samples * work.rays)
    if work.vertices > 0:
        row["ns_per_vertex"] = scaled(frame.seconds, 1e9 / (samples * work.vertices))
    return row


BENCHMARK = Benchmark(table, run)
