# SPDX-License-Identifier: MIT
"""How the time of a frame grows with one setting at a time, and the exponent of that growth."""

import math
from collections.abc import Callable
from functools import partial

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.frames import frame_time
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import scaled, write_exponent
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.scene import Scene

_SIZE = (320, 180)
_RUNS = 5
_BASE = {"rays": 8, "bounces": 4, "light_samples": 1}


def table(plan: Plan) -> Table:
    width, height = plan.size or _SIZE
    return Table(
        "scaling",
        "Time of a frame over one setting",
        (
            Column("scene", "scene"),
            Column("quantity", "setting"),
            Column("value", "value"),
            Column("ms", "ms/frame", "less"),
            Column("exponent", "exponent"),
        ),
        keys=("scene", "quantity", "value"),
        plots=(Plot("value", ("ms",), ("quantity",), "value", "milliseconds per frame"),),
        notes=[
            f"Where it is not varied: {width}x{height} pixels, {_BASE['rays']} rays, {_BASE['bounces']} bounces, "
            "1 light sample. The exponent p of time ~ value^p is fitted to all values of a setting, ± its standard "
            "error; fixed costs pull it below what it is for large values."
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    name = (plan.scenes or ("three-spheres",))[0]
    curves = _curves(case(name), plan.size or _SIZE, plan)
    points = [(quantity, value) for quantity, (values, _) in curves.items() for value in values]
    for place, part in steps(progress, [f"{quantity} {value}" for quantity, value in points]):
        quantity, value = points[place]
        scene = curves[quantity][1](value)
        frame = frame_time(scene, plan.runs or _RUNS, plan.row_limit, progress=partial(part, text=""))
        row: Row = {"scene": scene.name, "quantity": quantity, "value": value}
        row["ms"] = None if frame.seconds is None else scaled(frame.seconds, 1e3)
        result.rows.append(row)
        write_exponent([row for row in result.rows if row["quantity"] == quantity], "value", "ms")


def _curves(
    scene: Scene, size: tuple[int, int], plan: Plan
) -> dict[str, tuple[tuple[int, ...], Callable[[int], Scene]]]:
    """For each quantity its values, and the scene at one of them."""

    middle = math.sqrt(size[0] * size[1])
    sides = tuple(round(middle * factor) for factor in (0.25, 0.5, 1, 2, 4))

    def setting(name: str) -> Callable[[int], Scene]:
        return lambda value: with_settings(scene, size, **{**_BASE, name: value})

    def sized(side: int) -> Scene:
        return with_settings(scene, (side, side), **_BASE)

    return {
        "rays": (plan.rays or (1, 2, 4, 8, 16, 32), setting("rays")),
        "bounces": (plan.bounces or (1, 2, 4, 8, 16), setting("bounces")),
        "light samples": (plan.light_samples or (1, 2, 4, 8, 16), setting("light_samples")),
        "image side": (sides, sized),
    }


BENCHMARK = Benchmark(table, run)
