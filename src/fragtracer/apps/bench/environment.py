# SPDX-License-Identifier: MIT
"""Frames per second and memory of a scene lit by its environment, with and without its objects, by both integrators,
beside the figures of the PBR document (André, Clerc and Cozzolino, table 2)."""

from dataclasses import replace
from typing import Any, Literal

from fragtracer.apps.bench.cases import case
from fragtracer.apps.bench.frames import RUNS, frame_time
from fragtracer.apps.bench.memory import GPU_NOTE, resident_mib
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import inverse
from fragtracer.apps.bench.tables import Column, Row, Table
from fragtracer.renderer import Renderer
from fragtracer.scene import LIGHTS, PLAIN, SHAPES, RenderSettings, Scene

SCENE = "spheres-49"
SIZE = (1280, 720)
Integrator = Literal["path", "split-sum"]
_INTEGRATORS: tuple[Integrator, ...] = ("path", "split-sum")
_BOUNCES = 5
_MIB = 2**20
# Frames per second and megabytes of RTX 2060 (laptop), GTX 1060, GTX 550 Ti.
DOCUMENT = {"empty": ("450, 1000, 240", "105, 64, 127"), "53 objects": ("395, 600, 105", "105, 64, 127")}


def table(plan: Plan) -> Table:
    return Table(
        "environment",
        "Light from an environment",
        (
            Column("scene", "scene"),
            Column("objects", "objects"),
            Column("integrator", "integrator"),
            Column("size", "size"),
            Column("fps", "frames/s", "more"),
            Column("host_mib", "this process, MiB"),
            Column("gpu_mib", "on the GPU, MiB"),
            Column("document_fps", "document, frames/s"),
            Column("document_mb", "document, MB"),
        ),
        keys=("scene", "objects", "integrator", "size"),
        notes=[
            "A frame is one path, or one lookup, for each pixel. The document's engine rasterises, at a size that it "
            "does not say, on a laptop's RTX 2060, a GTX 1060 and a GTX 550 Ti, in this order; its 53 objects are 49 "
            "spheres, a textured sphere and three models; here there are as many of each, but other models.",
            GPU_NOTE,
        ],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    names = [
        (scene, objects, integrator)
        for scene in plan.scenes or (SCENE,)
        for objects in ("empty", "full")
        for integrator in _INTEGRATORS
    ]
    for place, part in steps(progress, [" ".join(name) for name in names]):
        scene, objects, integrator = names[place]
        _measure(case(scene), objects == "empty", integrator, plan, result, part)


def _measure(scene: Scene, empty: bool, integrator: Integrator, plan: Plan, result: Table, progress: Progress) -> None:
    width, height = plan.size or SIZE
    settings = RenderSettings(width, height, rays=1, bounces=_BOUNCES, integrator=integrator)
    if empty:
        nothing: dict[str, Any] = dict.fromkeys(("meshes", *SHAPES, *LIGHTS), ())
        scene = replace(scene, **nothing)
    scene = replace(scene, render=settings)
    measured = frame_time(scene, plan.runs or RUNS, plan.row_limit, progress=lambda share: progress(share, ""))
    with Renderer(scene, **PLAIN) as renderer:
        renderer.sample(1)
        gpu, host = renderer.gpu_bytes / _MIB, resident_mib()
    objects = sum(len(getattr(scene, kind)) for kind in ("spheres", "planes", "rectangles", "triangles", "meshes"))
    row: Row = {"scene": scene.name, "objects": objects, "integrator": integrator, "size": f"{width}x{height}"}
    row |= {"fps": None if measured.seconds is None else inverse(measured.seconds)}
    row |= {"host_mib": round(host, 1), "gpu_mib": round(gpu, 1)}
    fps, megabytes = DOCUMENT.get("empty" if empty else f"{objects} objects", ("", ""))
    result.rows.append(row | {"document_fps": fps, "document_mb": megabytes})


BENCHMARK = Benchmark(table, run)
