# SPDX-License-Identifier: MIT
"""What a cluster costs: the tables of docs/cluster.md.

    python scripts/cluster.py

Times are of the processor, per process, so that other work on the machine shows less; the wall clock is beside them.
"""

import argparse
import os
import time
from dataclasses import dataclass, replace

from fragtracer.apps import cluster
from fragtracer.io.toml import load
from fragtracer.scene import Scene

SCENE, SIZE = "three-spheres-ambient", (512, 512)
BLOCKS = ((4, 128), (16, 256), (64, 768))  # samples of each pixel in a block, and in all
WORKERS = (10, 100, 1_000, 10_000)
TILE_PIXELS = 256 * 256


@dataclass(frozen=True)
class Run:
    """Of a picture on ``workers``: ``blocks`` of ``block`` samples, bytes on the ``wire``, blocks ``checked`` by another
    worker, seconds by the clock of the ``wall``, of the processor in the ``client`` (with the scheduler) and in all
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


def measure(scene: Scene, client: object, workers: int, block: int, spp: int) -> Run:
    cluster.render(scene, client, spp=2 * block, block=block)  # compiles
    before, own, start = sum(client.run(time.process_time).values()), time.process_time(), time.perf_counter()
    picture = cluster.render(scene, client, spp=spp, block=block)
    wall, own = time.perf_counter() - start, time.process_time() - own
    rendering = sum(client.run(time.process_time).values()) - before
    blocks = picture.wire // (44 * TILE_PIXELS)
    return Run(workers, block, blocks, picture.wire, int(picture.metadata["checked_blocks"]), wall, own, rendering)


def model(workers: int, seconds: float, overhead: float, client: float) -> float:
    """Efficiency of ``workers`` that render a block in ``seconds`` and lose ``overhead`` to each, where one client
    takes in a block in ``client`` seconds."""
    rate = min(workers / (seconds + overhead), 1 / client)
    return rate * seconds / workers


def main() -> None:
    argparse.ArgumentParser(description=str(__doc__).splitlines()[0]).parse_args()
    os.environ["LP_NUM_THREADS"] = "1"  # of each worker
    scene = load(SCENE)
    scene = replace(scene, render=replace(scene.render, width=SIZE[0], height=SIZE[1], adaptive="off", guiding="off"))
    runs = []
    for workers in (1, 2):
        with cluster.connected(f"local:{workers}") as client:
            runs += [measure(scene, client, workers, block, spp) for block, spp in BLOCKS]
    print("| workers | block | blocks | wall s | client s | workers s | bytes / (megapixel · sample) |")
    print("|---:|---:|---:|---:|---:|---:|---:|")
    for run in runs:
        wire = run.wire / (run.samples / 1e6)
        print(
            f"| {run.workers} | {run.block} | {run.blocks} | {run.wall:.1f} | {run.client:.2f} | {run.rendering:.2f} "
            f"| {wire:,.0f} |"
        )
    one, two = (next(run for run in runs if (run.workers, run.block) == (n, 64)) for n in (1, 2))
    print(f"\nefficiency of 2 workers against 1: {one.wall / two.wall / 2:.2f} by the wall clock, ", end="")
    print(
        f"{one.rendering / two.rendering:.2f} by the processor time of the workers, {two.checked} blocks of which were"
    )
    print(f"rendered twice; without these {one.rendering / two.rendering * (1 + two.checked / two.blocks):.2f}")
    small, large = (next(run for run in runs if (run.workers, run.block) == (1, n)) for n in (4, 64))
    overhead = (small.rendering - large.rendering) / (small.blocks - large.blocks)
    client_cost = (small.client - large.client) / (small.blocks - large.blocks)
    speed = large.samples / (large.rendering - overhead * large.blocks)
    print(f"overhead of a block: {1e3 * overhead:.1f} ms in its worker, {1e3 * client_cost:.1f} ms in the client")
    print(f"speed of a worker: {speed / 1e6:.2f} Msamples/s\n")
    print(
        "Checked against the runs: processor time of the client and of the workers as the model has it, over measured\n"
    )
    for run in runs:
        predicted = (run.samples / speed + overhead * run.blocks) * (1 + run.checked / run.blocks)
        print(
            f"- {run.workers} workers, blocks of {run.block}: client {client_cost * run.blocks / run.client:.2f}, "
            f"workers {predicted / run.rendering:.2f}"
        )
    print("\n| block | seconds of a worker |" + "".join(f" {n:,} workers |" for n in WORKERS))
    print("|---:|---:|" + "---:|" * len(WORKERS))
    for block in (16, 64, 256, 1024, 4096, 16384, 65536):
        seconds = block * TILE_PIXELS / speed
        cells = "".join(f" {100 * model(n, seconds, overhead, client_cost):.0f} % |" for n in WORKERS)
        print(f"| {block} | {seconds:.2f} |{cells}")


if __name__ == "__main__":
    main()
