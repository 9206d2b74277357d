# SPDX-License-Identifier: MIT
"""What a cluster costs: the tables of docs/cluster.md.

    python scripts/cluster.py

Times are of the processor, per process, so that other work on the machine shows less; the wall clock is beside them.
"""

import argparse
import os
import time
from dataclasses import dataclass, replace

import numpy as np

from fragtracer.apps import cluster
from fragtracer.io.toml import load
from fragtracer.scene import Scene

SCENE, SIZE = "three-spheres-ambient", (512, 512)
BLOCKS = ((4, 128), (16, 256), (64, 768))  # samples of each pixel in a block, and in all
WORKERS = (10, 100, 1_000, 10_000)
TILE_PIXELS = 256 * 256


@dataclass(frozen=True)
class Run:
    """A picture on ``workers``: ``blocks`` of ``block`` samples, bytes on the ``wire``, blocks ``checked`` by another
    worker, seconds by the clock on the ``wall``, of the processor in the ``client`` (with the scheduler) and in all
    workers."""

    workers: int
    block: int
    blocks: int
    wire: int
    checked: int
    wall: float
    client: float
    rendering: float

    @property
    def samples(self) -> int:
        return self.blocks * self.block * TILE_PIXELS

    @property
    def work(self) -> float:
        """Blocks that were rendered, over those of the picture."""
        return 1 + self.checked / self.blocks


def measure(scene: Scene, client: object, workers: int, block: int, spp: int) -> Run:
    cluster.render(scene, client, spp=2 * block, block=block)  # compiles
    before, own, start = sum(client.run(time.process_time).values()), time.process_time(), time.perf_counter()
    picture = cluster.render(scene, client, spp=spp, block=block)
    checked = int(picture.metadata["checked_blocks"])
    wall, own = time.perf_counter() - start, time.process_time() - own
    rendering = sum(client.run(time.process_time).values()) - before
    blocks = picture.wire // (44 * TILE_PIXELS)
    return Run(workers, block, blocks, picture.wire, checked, wall, own, rendering)


def model(workers: int, seconds: float, overhead: float, client: float) -> float:
    """Efficiency of ``workers`` that render a block in ``seconds`` and lose ``overhead`` to each, where one client
    takes in a block in ``client`` seconds."""
    rate = min(workers / (seconds + overhead), 1 / client)
    return rate * seconds / workers


def table(runs: list[Run]) -> None:
    print(
        "| workers | block | blocks | rendered twice | wall s | client s | workers s | bytes / (megapixel · sample) |"
    )
    print("|---:|---:|---:|---:|---:|---:|---:|---:|")
    for run in runs:
        seconds = f"{run.wall:.1f} | {run.client:.2f} | {run.rendering:.2f}"
        wire = run.wire / (run.samples / 1e6)
        print(f"| {run.workers} | {run.block} | {run.blocks} | {run.checked} | {seconds} | {wire:,.0f} |")
    one, two = (next(run for run in runs if (run.workers, run.block) == (n, BLOCKS[-1][0])) for n in (1, 2))
    ratio = one.rendering / two.rendering
    print(f"\nefficiency of 2 workers against 1, of blocks of {one.block}: {one.wall / two.wall / 2:.2f} by the clock,")
    print(f"{ratio:.2f} by processor time, {ratio * two.work:.2f} without what was rendered twice")


def fitted(runs: list[Run]) -> tuple[float, float, float]:
    """Samples of a worker in a second, seconds that a block costs in its worker, and in the client."""
    work = np.array([[run.work * run.samples, run.work * run.blocks] for run in runs])
    takes = np.array([[run.wall, run.work * run.blocks] for run in runs])
    rendering, client = np.array([run.rendering for run in runs]), np.array([run.client for run in runs])
    worker_fit, client_fit = np.linalg.lstsq(work, rendering)[0], np.linalg.lstsq(takes, client)[0]
    print("\nBy least squares:")
    print(f"{1e-6 / worker_fit[0]:.2f} Msamples/s of a worker; {1e3 * worker_fit[1]:.0f} ms a block in its worker, ")
    print(f"{1e3 * client_fit[1]:.0f} ms in the client, which takes {100 * client_fit[0]:.0f} % of its time besides\n")
    print("Processor time by these figures over that measured:\n")
    for run, worker, own in zip(runs, work @ worker_fit / rendering, takes @ client_fit / client, strict=True):
        print(f"- {run.workers} workers, blocks of {run.block}: workers {worker:.2f}, client {own:.2f}")
    return 1 / worker_fit[0], worker_fit[1], client_fit[1]


def main() -> None:
    argparse.ArgumentParser(description=str(__doc__).splitlines()[0]).parse_args()
    os.environ["LP_NUM_THREADS"] = "1"  # of each worker
    scene = load(SCENE)
    scene = replace(scene, render=replace(scene.render, width=SIZE[0], height=SIZE[1], adaptive="off", guiding="off"))
    runs = []
    for workers in (1, 2):
        with cluster.connected(f"local:{workers}") as client:
            runs += [measure(scene, client, workers, block, spp) for block, spp in BLOCKS]
    table(runs)
    speed, overhead, client_cost = fitted(runs)
    print("\n| block | seconds of a worker |" + "".join(f" {n:,} workers |" for n in WORKERS))
    print("|---:|---:|" + "---:|" * len(WORKERS))
    for block in (16, 64, 256, 1024, 4096, 16384, 65536):
        seconds = block * TILE_PIXELS / speed
        cells = "".join(f" {100 * model(n, seconds, overhead, client_cost):.0f} % |" for n in WORKERS)
        print(f"| {block} | {seconds:.2f} |{cells}")


if __name__ == "__main__":
    main()
