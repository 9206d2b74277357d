# SPDX-License-Identifier: MIT
"""How the time of a ray grows with the number of shapes, from one to a million, and what a scene of so many takes
before its first picture."""

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.bench.contenders import Ours
from fragtracer.apps.bench.fields import KINDS, Kind, shape_field
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.speed import seconds_per_sample
from fragtracer.apps.bench.statistics import Estimate, median, write_growth
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.work import count_work
from fragtracer.bvh import build
from fragtracer.gpu.context import create_context
from fragtracer.gpu.specialise import MOST_LISTED, Level
from fragtracer.gpu.tracer import most_outside_grid
from fragtracer.packing import pack
from fragtracer.scene import PLAIN, RenderSettings, Scene

COUNTS = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)
MOST_STEP = 1.5  # at the threshold between testing shapes one by one and a BVH or a grid
_SIZE = (256, 256)
_BOUNCES = 5
_RUNS = 5
_SECONDS = 0.5  # of a run
_BUILDS = 3
_ONE_BY_ONE = "one by one"
_CACHE = "FRAGTRACER_CACHE"


def table(plan: Plan) -> Table:
    width, height = plan.size or _SIZE
    return Table(
        "shapes",
        "Time of a ray over the number of shapes",
        (
            Column("shapes", "shapes"),
            Column("count", "number"),
            Column("traversal", "traversal"),
            Column("ns", "ns/ray", "less"),
            Column("step", "over the row above"),
            Column("growth", "ns/ray for each factor of 10"),
            Column("scene", "Python objects, s"),
            Column("build", "BVH, s", "less"),
            Column("first", "first picture, s"),
        ),
        keys=("shapes", "count"),
        plots=(Plot("count", ("ns",), ("shapes",), "shapes", "nanoseconds per ray", y_scale="linear"),),
        notes=[
            f"Matte shapes on a plane under a point light and an even sky, {width}x{height} pixels, {_bounces(plan)} "
            "bounces. The view is the same, and the shapes together have the same area: they shrink as their number "
            "grows. Rays are all rays, shadow rays too.",
            "The growth b of time per ray = a + b log10(number) is fitted to the rows of a BVH or a grid, ± its "
            "standard error.",
            "Python objects: making the scene, one checked object for each shape, or one array for a mesh. BVH: "
            "building it from bounds. First picture: from the scene to one sample of each pixel, with packing, BVH, "
            "upload and compiling, unless the driver has the program in its cache.",
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    most = most_listed()
    points = [(kind, counts) for kind in KINDS for counts in _counts(kind, most)]
    names = [f"{' and '.join(f'{count:,}' for count in counts)} {kind}" for kind, counts in points]
    for place, part in steps(progress, names):
        kind, counts = points[place]
        result.rows += _rows(kind, counts, most, plan, part)
        in_structure = [row for row in result.rows if row["shapes"] == kind and row["traversal"] != _ONE_BY_ONE]
        write_growth(in_structure, "count", "ns")
        if len(counts) > 1:
            result.notes.append(_verdict(kind, most[kind], result.rows[-1]))


def most_listed() -> dict[Kind, int]:
    """How many shapes of each kind are tested one by one at most; none of the triangles of a mesh."""
    context = create_context()
    outside_grid = most_outside_grid(context, Level.SCENE)
    context.release()
    return {"spheres": outside_grid, "rectangles": MOST_LISTED["default"]}


def _counts(kind: Kind, most: Mapping[Kind, int]) -> list[tuple[int, ...]]:
    """The numbers of shapes, both sides of the threshold together: they are measured in turns."""
    if kind not in most:
        return [(count,) for count in COUNTS]
    step = (most[kind], most[kind] + 1)
    return sorted([*((count,) for count in COUNTS if count not in step), step])


def _verdict(kind: Kind, threshold: int, row: Row) -> str:
    step = row["step"]
    assert isinstance(step, Estimate)
    passed = "passed" if step.value < MOST_STEP else "missed"
    return (
        f"From {threshold} {kind} one by one to {threshold + 1} in a {row['traversal']} a ray takes {step.value:.2f} "
        f"times as long; the aim of less than {MOST_STEP} is {passed}."
    )


def _bounces(plan: Plan) -> int:
    return (plan.bounces or (_BOUNCES,))[0]


def _rows(kind: Kind, counts: tuple[int, ...], most: Mapping[Kind, int], plan: Plan, part: Progress) -> list[Row]:
    """A row for each number; the last of several has the ratio to the first."""
    rows: list[Row] = []
    with ExitStack() as stack:
        renderers = []
        for count in counts:
            part(0.0, "first picture")
            renderer, cells = _prepared(kind, count, most, plan, stack)
            renderers.append(renderer)
            rows.append({"shapes": kind, "count": count} | cells)
        nanoseconds = _nanoseconds_per_ray(renderers, plan, part)
    for row, found in zip(rows, nanoseconds, strict=True):
        row["ns"] = median(found)
    if len(rows) > 1:
        rows[-1]["step"] = median([last / first for first, last in zip(nanoseconds[0], nanoseconds[-1], strict=True)])
    return rows


def _prepared(kind: Kind, count: int, most: Mapping[Kind, int], plan: Plan, stack: ExitStack) -> tuple["_Counted", Row]:
    """A renderer, and what it took until its first picture."""
    width, height = plan.size or _SIZE
    start = time.perf_counter()
    field = shape_field(kind, count, RenderSettings(width=width, height=height, bounces=_bounces(plan)))
    row: Row = {"scene": round(time.perf_counter() - start, 4)}
    row["build"] = median([_seconds_to_build(field.bounds) for _ in range(_BUILDS)])
    with _empty_cache():
        renderer = stack.enter_context(Ours(field.scene, **PLAIN))
    row["first"] = round(renderer.first_picture, 3)
    row["traversal"] = _traversal(field.scene, most["spheres"])
    return _Counted(renderer, width * height * count_work(field.scene, 4).rays), row


def _traversal(scene: Scene, outside_grid: int) -> str:
    """How rays find shapes."""
    packed = pack(scene, scene.render, *_SIZE, MOST_LISTED["default"], most_outside_grid=outside_grid)
    if packed.flags["u_has_sphere_grid"]:
        return "grid"
    return "BVH" if packed.uniforms["u_bvh_root"] >= 0 else _ONE_BY_ONE


@dataclass(frozen=True)
class _Counted:
    """A renderer, and how many rays it traces for a sample of every pixel."""

    renderer: Ours
    rays: float


def _nanoseconds_per_ray(counted: Sequence[_Counted], plan: Plan, part: Progress) -> list[list[float]]:
    """Of each renderer in each run; the renderers take turns."""
    found: list[list[float]] = [[] for _ in counted]
    runs = plan.runs or _RUNS
    for number in range(runs):
        part(number / runs, "")
        for item, times in zip(counted, found, strict=True):
            times.append(1e9 * seconds_per_sample(item.renderer, plan.seconds or _SECONDS) / item.rays)
    return found


def _seconds_to_build(bounds: NDArray[np.float32]) -> float:
    start = time.perf_counter()
    build(bounds)
    return time.perf_counter() - start


@contextmanager
def _empty_cache() -> Iterator[None]:
    """fragtracer finds no BVH of an earlier run."""
    before = os.environ.get(_CACHE)
    with TemporaryDirectory(prefix="fragtracer-") as folder:
        os.environ[_CACHE] = folder
        try:
            yield
        finally:
            del os.environ[_CACHE]
            if before is not None:
                os.environ[_CACHE] = before


BENCHMARK = Benchmark(table, run)
