# SPDX-License-Identifier: MIT
"""All benchmarks by name, and running several of them."""

from collections.abc import Sequence

from fragtracer.apps.bench import (
    ablations,
    convergence,
    environment,
    lights,
    memory,
    meshes,
    scaling,
    shapes,
    speed,
    spheres,
    sweep,
)
from fragtracer.apps.bench.machine import describe_machine
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress
from fragtracer.apps.bench.tables import Results
from fragtracer.errors import FragtracerError

BENCHMARKS: dict[str, tuple[Benchmark, ...]] = {
    "sweep": (sweep.BENCHMARK,),
    "speed": (speed.BENCHMARK,),
    "error": (convergence.BENCHMARK,),
    "ablations": (ablations.BENCHMARK,),
    "sampling": (ablations.SAMPLING,),
    "scaling": (scaling.BENCHMARK, shapes.BENCHMARK),
    "lights": (lights.BENCHMARK,),
    "meshes": (meshes.BENCHMARK,),
    "spheres": (spheres.BENCHMARK,),
    "memory": (memory.BENCHMARK,),
    "environment": (environment.BENCHMARK,),
}


def run_suite(names: Sequence[str], plan: Plan, progress: Progress) -> Results:
    """Run the benchmarks of those names.

    Ctrl-C, or a :class:`FragtracerError` after the first row, ends it early: ``complete`` is false,
    ``failure`` the message, and all finished rows are kept. A benchmark without any has no table.
    """
    results = Results(describe_machine(), plan.describe(), complete=False)
    try:
        benchmarks = [(name, benchmark) for name in names for benchmark in BENCHMARKS[name]]
        for place, (name, benchmark) in enumerate(benchmarks):
            table = benchmark.table(plan)
            results.tables.append(table)

            def part(share: float, text: str, place: int = place, name: str = name) -> None:
                progress((place + share) / len(benchmarks), f"{name}: {text}")

            benchmark.run(plan, table, part)
        results.complete = True
    except KeyboardInterrupt:
        pass
    except FragtracerError as error:
        if not any(table.rows for table in results.tables):
            raise
        results.failure = str(error)
    results.tables = [table for table in results.tables if table.rows]
    return results
