# SPDX-License-Identifier: MIT
"""Memory of this process and, by what is held there, of the GPU; over time, to show that it stays constant."""

import time

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.tables import Column, Plot, Row, Table
from fragtracer.errors import FragtracerError
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, Scene

_SCENES = ("three-spheres", "roughness-grid", "cornell-box")
_SIZE = (640, 360)
_SECONDS = 60.0
_POINTS = 6
_MIB = 2**20
GPU_NOTE = (
    "The GPU's share is the size of textures and buffers, without the program and what the driver adds; "
    "with a software renderer it is part of the process."
)


def table(plan: Plan) -> Table:
    return Table(
        "memory",
        "Memory while rendering",
        (
            Column("scene", "scene"),
            Column("size", "size"),
            Column("seconds", "seconds"),
            Column("host_mib", "this process, MiB"),
            Column("peak_mib", "its peak, MiB"),
            Column("gpu_mib", "on the GPU, MiB"),
        ),
        keys=("scene", "size", "seconds"),
        plots=(Plot("seconds", ("host_mib",), ("scene",), "seconds", "MiB of this process", "linear", "linear"),),
        notes=[GPU_NOTE],
    )


def run(plan: Plan, result: Table, progress: Progress) -> None:
    names = list(plan.scenes or _SCENES)
    for place, part in steps(progress, names):
        scene = with_settings(case(names[place]), plan.size or _SIZE)
        _run_scene(scene, plan.seconds or _SECONDS, result, part)


def _run_scene(scene: Scene, seconds: float, result: Table, part: Progress) -> None:
    settings = scene.render
    peak = 0.0
    with Renderer(scene, **PLAIN) as renderer:
        renderer.sample(settings.rays)
        start = time.perf_counter()
        for point in range(_POINTS + 1):
            while time.perf_counter() - start < seconds * point / _POINTS:
                renderer.sample(settings.rays)
                peak = max(peak, resident_mib())
            renderer.image()
            host = resident_mib()
            peak = max(peak, host)
            part(point / _POINTS, "")
            row: Row = {"scene": scene.name, "size": f"{settings.width}x{settings.height}"}
            row |= {
                "seconds": round(seconds * point / _POINTS, 2),
                "host_mib": round(host, 1),
                "peak_mib": round(peak, 1),
            }
            result.rows.append(row | {"gpu_mib": round(renderer.gpu_bytes / _MIB, 1)})


def resident_mib() -> float:
    """Memory of this process that is in RAM."""
    try:
        import psutil
    except ImportError:
        raise FragtracerError("measuring memory needs psutil; pip install 'fragtracer[bench]'") from None
    return float(psutil.Process().memory_info().rss) / _MIB


BENCHMARK = Benchmark(table, run)
