# SPDX-License-Identifier: MIT
"""What a cluster costs: the tables of docs/cluster.md.

    python scripts/cluster.py

Workers have a thread of Mesa each, so that two of them have twice what one has. The wall clock is what counts, on a
machine that has nothing else to do; the processor time of each process says where it goes. Takes four minutes.
"""

import argparse
import os
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fragtracer.apps import cluster
from fragtracer.io.toml import load
from fragtracer.sampling.allocation import Plan, Stages, stage_samples
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene

SCENE, SIZE = "three-spheres-ambient", (512, 512)
# Adaptive or not, samples of each pixel in a block at most, and in all.
RUNS = (("off", 32, 512), ("off", 256, 1536), ("on", 256, 1024))
WORKERS = (10, 100, 1_000, 10_000)
TILE_PIXELS = 256 * 256
CORES = 2
PLANNED = 1024  # pixels, a side of the picture of which planning is timed


@dataclass(frozen=True)
class Run:
    """A picture on ``workers``, in ``tasks``, of which ``checked`` were rendered twice; ``wire`` bytes there and back;
    seconds by the clock on the ``wall``, of the processor in the ``client`` (with the scheduler) and in all workers."""

    workers: int
    adaptive: str
    block: int
    spp: int
    tasks: int
    checked: int
    wire: int
    wall: float
    client: float
    rendering: float

    @property
    def samples(self) -> int:
        return self.spp * SIZE[0] * SIZE[1]

    @property
    def films(self) -> float:
        """Films of tiles that came back, those of parts by their size."""
        return self.wire / (44 * TILE_PIXELS)


def measure(scene: Scene, client: Any, workers: int, adaptive: str, block: int, spp: int) -> Run:
    scene = replace(scene, render=replace(scene.render, adaptive=adaptive))
    cluster.render(scene, client, spp=64, block=block)  # compiles
    before, own, start = sum(client.run(time.process_time).values()), time.process_time(), time.perf_counter()
    picture = cluster.render(scene, client, spp=spp, block=block)
    wall, own = time.perf_counter() - start, time.process_time() - own
    rendering = sum(client.run(time.process_time).values()) - before
    checked = int(picture.metadata["checked_blocks"])
    return Run(workers, adaptive, block, spp, picture.tasks, checked, picture.wire, wall, own, rendering)


def table(runs: list[Run]) -> None:
    print(
        "| workers | adaptive | block | tasks | twice | wall s | client s | workers s | bytes / (megapixel · sample) |"
    )
    print("|---:|---|---:|---:|---:|---:|---:|---:|---:|")
    for run in runs:
        seconds = f"{run.wall:.1f} | {run.client:.2f} | {run.rendering:.2f}"
        wire = run.wire / (run.samples / 1e6)
        what = f"{run.workers} | {run.adaptive} | {run.block} | {run.tasks} | {run.checked}"
        print(f"| {what} | {seconds} | {wire:,.0f} |")
    print("\n| adaptive | block | efficiency of 2 workers by the clock | by processor time |")
    print("|---|---:|---:|---:|")
    for one, two in pairs(runs):
        print(f"| {one.adaptive} | {one.block} | {one.wall / two.wall / 2:.3f} | {one.rendering / two.rendering:.3f} |")


def pairs(runs: list[Run]) -> list[tuple[Run, Run]]:
    """The same picture by one worker and by two."""
    return list(zip(runs[: len(RUNS)], runs[len(RUNS) :], strict=True))


@dataclass(frozen=True)
class Costs:
    """Samples of a worker in a ``second``, and seconds: ``overhead`` of a film in its worker, and ``merge`` in the
    client, which takes a share ``idle`` of its time besides; ``planning`` of a stage, a pixel."""

    second: float
    overhead: float
    merge: float
    idle: float
    planning: float


def fitted(runs: list[Run], planning: float) -> Costs:
    """By least squares of the runs without adaptive sampling, whose samples cost more and differently."""
    runs = [run for run in runs if run.adaptive == "off"]
    twice = [1 + run.checked / run.tasks for run in runs]
    work = np.array([[share * run.samples, share * run.films] for share, run in zip(twice, runs, strict=True)])
    takes = np.array([[run.wall, share * run.films] for share, run in zip(twice, runs, strict=True)])
    rendering, client = np.array([run.rendering for run in runs]), np.array([run.client for run in runs])
    worker_fit, client_fit = np.linalg.lstsq(work, rendering)[0], np.linalg.lstsq(takes, client)[0]
    costs = Costs(1 / worker_fit[0], worker_fit[1], client_fit[1], client_fit[0], planning)
    print("\nBy least squares:")
    print(f"{1e-6 * costs.second:.2f} Msamples/s of a worker; {1e3 * costs.overhead:.0f} ms a film in its worker, ")
    print(f"{1e3 * costs.merge:.0f} ms in the client, which takes {100 * costs.idle:.0f} % of its time besides;")
    print(f"{1e6 * planning:.2f} s to plan a stage of a megapixel\n")
    print("Wall clock by these figures over that measured, client and workers on the same cores:\n")
    for run, workers, own in zip(runs, work @ worker_fit, takes @ client_fit, strict=True):
        wall = max(workers / run.workers, (workers + own) / CORES)
        print(f"- {run.workers} workers, blocks of {run.block}: {wall / run.wall:.2f}")
    return costs


def planning_seconds() -> float:
    """Of a pixel, as :class:`fragtracer.apps.cluster.adaptive.AdaptiveSampling` plans."""
    random = np.random.default_rng(0)
    mean, variance = (random.exponential(size=(PLANNED, PLANNED, 4)).astype(np.float32) for _ in range(2))
    mean[..., 3], variance[..., 3] = 32, 0
    film = Pixels(mean, variance, np.sqrt(variance[..., :3] / 32).astype(np.float32))
    start = time.perf_counter()
    Plan.by(1, Stages.none(PLANNED, PLANNED).with_stage(film, 32).deviation())
    return (time.perf_counter() - start) / PLANNED**2


def evenly(costs: Costs, workers: int, seconds: float) -> float:
    """Efficiency of ``workers`` that render a block in ``seconds``, where one client takes in one after the other."""
    rate = min(workers / (seconds + costs.overhead), 1 / costs.merge)
    return rate * seconds / workers


def adaptively(costs: Costs, workers: int, pixels: int, spp: int) -> float:
    """Efficiency of ``workers`` where all wait for the last of a stage and for the plan of the next: a film of each
    tile is taken in for each stage."""
    busy = total = 0.0
    stage, done = 0, 0
    while done < spp:
        samples = min(stage_samples(stage), spp - done)
        films = max(pixels / TILE_PIXELS, 2 * workers)  # each has two parts, at least
        rendering = samples * pixels / costs.second / workers
        taking = costs.merge * pixels / TILE_PIXELS
        busy += rendering
        total += max(rendering + costs.overhead * films / workers, taking) + costs.planning * pixels
        stage, done = stage + 1, done + samples
    return busy / total


def main() -> None:
    argparse.ArgumentParser(description=str(__doc__).splitlines()[0]).parse_args()
    os.environ["LP_NUM_THREADS"] = "1"  # of each worker
    scene = load(SCENE)
    scene = replace(scene, render=replace(scene.render, width=SIZE[0], height=SIZE[1], guiding="off"))
    runs = []
    for workers in (1, 2):
        with cluster.connected(f"local:{workers}") as client:
            runs += [measure(scene, client, workers, *run) for run in RUNS]
    table(runs)
    costs = fitted(runs, planning_seconds())
    print("\n| block | seconds of a worker |" + "".join(f" {n:,} workers |" for n in WORKERS))
    print("|---:|---:|" + "---:|" * len(WORKERS))
    for block in (64, 256, 1024, 4096, 16384, 65536):
        seconds = block * TILE_PIXELS / costs.second
        cells = "".join(f" {100 * evenly(costs, n, seconds):.0f} % |" for n in WORKERS)
        print(f"| {block} | {seconds:.2f} |{cells}")
    print("\n| adaptively, samples of 1920 x 1080 pixels |" + "".join(f" {n:,} workers |" for n in WORKERS))
    print("|---:|" + "---:|" * len(WORKERS))
    for spp in (256, 1024, 4096, 16384, 65536):
        cells = "".join(f" {100 * adaptively(costs, n, 1920 * 1080, spp):.0f} % |" for n in WORKERS)
        print(f"| {spp} |{cells}")


if __name__ == "__main__":
    main()
