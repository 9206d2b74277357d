# SPDX-License-Identifier: MIT
"""What a cluster costs: the tables of docs/cluster.md.

    python scripts/cluster.py

One worker with a thread of Mesa, two of them, and one with two threads; and two workers that render without client and
scheduler, which says what the machine itself costs. The wall clock is what counts, where nothing else runs; the
processor time of each process says where it goes. Takes nine minutes.
"""

import argparse
import os
import pickle
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fragtracer.apps import cluster
from fragtracer.apps.cluster import worker as here
from fragtracer.apps.cluster.work import Block
from fragtracer.apps.cluster.workers import LONGEST, Workers
from fragtracer.io.toml import load
from fragtracer.sampling.allocation import Plan, Stages, Window, stage_samples
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene

SCENE, SIZE = "three-spheres-ambient", (512, 512)
# Adaptive or not, samples of each pixel in a block at most, and in all.
RUNS = (("off", 32, 512), ("off", 256, 3072), ("on", 256, 1024))
PROCESSES = ((1, 1), (2, 1), (1, 2))  # workers, and threads of each
WORKERS = (10, 100, 1_000, 10_000)
TILE_PIXELS = 256 * 256
CORES = 2
PLANNED = 1024  # pixels, a side of the picture of which planning is timed


@dataclass(frozen=True)
class Run:
    """A picture on ``workers`` of so many ``threads``, in ``tasks``, of which ``checked`` were rendered twice; ``wire``
    bytes there and back; seconds by the clock on the ``wall``, of the processor in the ``client`` (with the scheduler)
    and in all workers."""

    workers: int
    threads: int
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


def measure(scene: Scene, client: Any, workers: int, threads: int, adaptive: str, block: int, spp: int) -> Run:
    scene = replace(scene, render=replace(scene.render, adaptive=adaptive))
    cluster.render(scene, client, spp=64, block=block)  # compiles
    before, own, start = sum(client.run(time.process_time).values()), time.process_time(), time.perf_counter()
    picture = cluster.render(scene, client, spp=spp, block=block)
    wall, own = time.perf_counter() - start, time.process_time() - own
    rendering = sum(client.run(time.process_time).values()) - before
    checked = int(picture.metadata["checked_blocks"])
    return Run(workers, threads, adaptive, block, spp, picture.tasks, checked, picture.wire, wall, own, rendering)


def table(runs: list[Run]) -> None:
    heads = ("workers x threads", "adaptive", "block", "tasks", "twice", "wall s", "client s", "workers s")
    print(f"| {' | '.join(heads)} | bytes / (megapixel · sample) |")
    print("|---:|---|" + "---:|" * 7)
    for run in runs:
        seconds = f"{run.wall:.1f} | {run.client:.2f} | {run.rendering:.2f}"
        wire = run.wire / (run.samples / 1e6)
        what = f"{run.workers} x {run.threads} | {run.adaptive} | {run.block} | {run.tasks} | {run.checked}"
        print(f"| {what} | {seconds} | {wire:,.0f} |")
    print("\n| adaptive | block | 2 workers against 1, clock | processor time | against 1 with 2 threads, clock |")
    print("|---|---:|---:|---:|---:|")
    for one, two, wide in zip(*(runs[k : k + len(RUNS)] for k in range(0, len(runs), len(RUNS))), strict=True):
        found = f"{one.wall / two.wall / 2:.3f} | {one.rendering / two.rendering:.3f} | {wide.wall / two.wall:.3f}"
        print(f"| {one.adaptive} | {one.block} | {found} |")


def apart(scene: bytes, key: str) -> None:
    """Four blocks, on a worker that nobody speaks to meanwhile."""
    for number in range(4):
        here.render_part(scene, key, None, Block(Window(0, 0, 256, 256, 256 * number), 256), "apart")


def ceiling(scene: Scene, client: Any) -> float:
    """What two workers do that render apart from each other and from all else, of twice what one does."""
    scene = replace(scene, render=replace(scene.render, adaptive="off"))
    content, addresses = pickle.dumps(scene), sorted(client.nthreads())

    def seconds(some: list[str]) -> float:
        start = time.perf_counter()
        client.run(apart, content, "apart", workers=some)
        return time.perf_counter() - start

    seconds(addresses)  # compiles
    return seconds(addresses[:1]) / seconds(addresses)


def task_seconds(client: Any) -> float:
    """Of the processor, in the client and the scheduler, for a task that does nothing."""
    workers, tasks = Workers(client, b"", 60), 1000
    start = time.process_time()
    fetched = [workers.fetch(client.submit(here.versions, pure=False)) for _ in range(tasks)]
    for future in fetched:
        future.result()
    return (time.process_time() - start) / tasks


@dataclass(frozen=True)
class Costs:
    """Samples of a worker in a ``second``, and seconds: ``overhead`` of a film in its worker; in the client, with the
    scheduler, ``merge`` of a film and ``task`` of a task, besides a share ``idle`` of its time; ``planning`` of a
    stage, a pixel."""

    second: float
    overhead: float
    merge: float
    task: float
    idle: float
    planning: float


def fitted(runs: list[Run], task: float, planning: float) -> Costs:
    """By least squares of the runs without adaptive sampling, whose samples cost more and differently, of workers with
    one thread."""
    runs = [run for run in runs if run.adaptive == "off" and run.threads == 1]
    twice = [1 + run.checked / run.tasks for run in runs]
    work = np.array([[share * run.samples, share * run.films] for share, run in zip(twice, runs, strict=True)])
    takes = np.array([[run.wall, share * run.films] for share, run in zip(twice, runs, strict=True)])
    given = np.array([task * (run.tasks + run.checked) for run in runs])
    rendering, client = np.array([run.rendering for run in runs]), np.array([run.client for run in runs])
    worker_fit, client_fit = np.linalg.lstsq(work, rendering)[0], np.linalg.lstsq(takes, client - given)[0]
    costs = Costs(1 / worker_fit[0], worker_fit[1], client_fit[1], task, client_fit[0], planning)
    print("\nBy least squares:")
    print(f"{1e-6 * costs.second:.2f} Msamples/s of a worker; {1e3 * costs.overhead:.0f} ms a film in its worker, ")
    print(f"{1e3 * costs.merge:.0f} ms in the client, {1e3 * task:.1f} ms a task (measured apart), ")
    print(f"and {100 * costs.idle:.0f} % of its time besides; {1e6 * planning:.2f} s to plan a stage of a megapixel\n")
    print("Wall clock by these figures over that measured, client and workers on the same cores:\n")
    for run, workers, own in zip(runs, work @ worker_fit, takes @ client_fit + given, strict=True):
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
    stages = Stages.none(PLANNED, PLANNED).with_stage(film, 32)
    Plan.by(1, stages.deviation(stages.pixels()))
    return (time.perf_counter() - start) / PLANNED**2


def evenly(costs: Costs, workers: int, seconds: float) -> float:
    """Efficiency of ``workers`` that render a block in ``seconds``, in tasks that take no longer than they may, where
    one client takes in one film after the other."""
    tasks = max(1.0, seconds / LONGEST)
    rate = min(workers / (seconds + costs.overhead), 1 / (costs.merge + costs.task * tasks))
    return rate * seconds / workers


def adaptively(costs: Costs, workers: int, pixels: int, spp: int) -> float:
    """Efficiency of ``workers`` where all wait for the last of a stage and for the plan of the next: a film of each
    tile is taken in for each stage."""
    busy = total = 0.0
    stage, done = 0, 0
    while done < spp:
        samples = min(stage_samples(stage), spp - done)
        rendering = samples * pixels / costs.second / workers
        tasks = max(pixels / TILE_PIXELS, 2 * workers, workers * rendering / LONGEST)  # each has two parts, at least
        taking = costs.merge * pixels / TILE_PIXELS + costs.task * tasks
        busy += rendering
        total += max(rendering + costs.overhead * tasks / workers, taking) + costs.planning * pixels
        stage, done = stage + 1, done + samples
    return busy / total


def main() -> None:
    argparse.ArgumentParser(description=str(__doc__).splitlines()[0]).parse_args()
    scene = load(SCENE)
    scene = replace(
        scene,
        render=replace(
            scene.render, width=SIZE[0], height=SIZE[1], guiding="off", light_tracing="off", gradient_domain="off"
        ),
    )
    runs: list[Run] = []
    for workers, threads in PROCESSES:
        os.environ["LP_NUM_THREADS"] = str(threads)  # of each worker
        with cluster.connected(f"local:{workers}") as client:
            runs += [measure(scene, client, workers, threads, *run) for run in RUNS]
            if workers == 2:
                share, task = ceiling(scene, client), task_seconds(client)
    table(runs)
    print(f"\nTwo workers that render apart, without client and scheduler: {share:.3f} of twice the work of one.")
    costs = fitted(runs, task, planning_seconds())
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
