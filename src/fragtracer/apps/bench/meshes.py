# SPDX-License-Identifier: MIT
"""Meshes of a thousand to a million triangles: building their BVHs, memory, the time of a ray, speed against
Mitsuba."""

import time
from typing import Any

import numpy as np

from fragtracer.apps.bench.contenders import Ours
from fragtracer.apps.bench.memory import resident_mib
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.speed import against_mitsuba
from fragtracer.apps.bench.statistics import Estimate, inverse, median, write_exponent
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.apps.bench.work import count_work
from fragtracer.bvh import build
from fragtracer.packing.instances import triangle_bounds
from fragtracer.scene import (
    PLAIN,
    Ambient,
    Camera,
    Geometry,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    RenderSettings,
    Scene,
)

TRIANGLES = (1_000, 10_000, 70_000, 1_000_000)
_SIZE = (256, 256)
_BOUNCES = 5
_RUNS = 5
_SECONDS = 1.0  # of each renderer in a run
_BUILDS = 3
_MIB = 2**20


def table(plan: Plan) -> Table:
    width, height = plan.size or _SIZE
    return Table(
        "meshes",
        "Meshes of a thousand to a million triangles",
        (
            Column("triangles", "triangles"),
            Column("build", "build, s", "less"),
            Column("rate", "triangles/s built", "more"),
            Column("host_mib", "this process, MiB"),
            Column("gpu_mib", "on the GPU, MiB"),
            Column("ns", "ns/ray", "less"),
            Column("exponent", "exponent"),
            Column("fragtracer", "fragtracer, Msamples/s", "more"),
            Column("mitsuba", "Mitsuba, Msamples/s"),
            Column("ratio", "ratio", "more"),
            Column("sampling", "Mitsuba's sampler"),
        ),
        keys=("triangles",),
        plots=(Plot("triangles", ("ns",), (), "triangles", "nanoseconds per ray"),),
        notes=[
            f"A knot of that many triangles over a plane, a round light and an even sky; {width}x{height} pixels, "
            f"{_BOUNCES} bounces. The build is that of the BVH, without reading and packing. The exponent p of "
            "time per ray ~ triangles^p is fitted to all rows, ± its standard error."
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    for place, part in steps(progress, [f"{count} triangles" for count in TRIANGLES]):
        result.rows.append(_row(knot_scene(TRIANGLES[place], plan.size or _SIZE), plan, result, part))
        write_exponent(result.rows, "triangles", "ns")


def _row(scene: Scene, plan: Plan, result: Table, part: Progress) -> Row:
    geometry = scene.meshes[0].parts[0].geometry
    count = len(geometry.triangles)
    built = median([_seconds_to_build(geometry) for _ in range(_BUILDS)])
    row: Row = {"triangles": count, "build": built, "rate": inverse(built, count)}
    rays = count_work(scene, 8).rays
    with Ours(scene, **PLAIN) as ours:
        row |= {"host_mib": round(resident_mib()), "gpu_mib": round(ours.gpu_bytes / _MIB)}
        row |= against_mitsuba(ours, scene, plan, result, part, plan.runs or _RUNS, plan.seconds or _SECONDS)
    rate = row["fragtracer"]
    assert isinstance(rate, Estimate)
    return row | {"ns": inverse(rate, 1e3 / rays)}


def _seconds_to_build(geometry: Geometry) -> float:
    bounds = triangle_bounds(geometry.positions[geometry.triangles].astype(np.float32))
    start = time.perf_counter()
    build(bounds)
    return time.perf_counter() - start


def knot_scene(triangles: int, size: tuple[int, int]) -> Scene:
    """A trefoil knot of about so many triangles."""
    mesh = Mesh((Part(knot(triangles), "knot"),), (Placement((0.0, 0.9, 0.0), scale=(0.25, 0.25, 0.25)),))
    return Scene(
        camera=Camera((0.0, 1.6, 2.2), (0.0, 0.8, 0.0)),
        materials={"floor": Material(specular=0.0), "knot": Material(albedo=(0.7, 0.3, 0.1), roughness=0.4)},
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor"),),
        meshes=(mesh,),
        lights=(Light((2.0, 4.0, 2.0), 0.5, power=(300.0,) * 3),),
        ambient=Ambient((0.2,) * 3),
        render=RenderSettings(width=size[0], height=size[1], bounces=_BOUNCES),
        name=f"knot of {triangles}",
    )


def knot(triangles: int) -> Geometry:
    """A tube around a trefoil, flat triangles, its front outside."""
    around = max(3, round((triangles / 16) ** 0.5))
    along = max(3, round(triangles / 2 / around))
    s, t = np.meshgrid(np.arange(along) * 2 * np.pi / along, np.arange(around) * 2 * np.pi / around, indexing="ij")

    def path(s: Any) -> Any:
        return np.stack([np.sin(s) + 2 * np.sin(2 * s), np.cos(s) - 2 * np.cos(2 * s), -np.sin(3 * s)], axis=-1)

    forward = path(s + 1e-4) - path(s - 1e-4)
    side = np.cross(forward, path(s))
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    up = np.cross(side, forward)
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    points = path(s) + 0.5 * (np.cos(t)[..., None] * side + np.sin(t)[..., None] * up)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    a, b, c, d = (((i + k) % along) * around + (j + m) % around for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return Geometry(points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


BENCHMARK = Benchmark(table, run)
