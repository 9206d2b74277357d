# SPDX-License-Identifier: MIT
"""Compares the speed of this checkout with that of another one, scene by scene; prints a Markdown table.

usage: python scripts/compare_checkouts.py PATH [--scenes three-spheres,cornell-box] [--size WxH] [--bounces N]
                                                [--launches N] [--runs N] [--seconds S]

Each checkout renders in a process of its own, compiled and warm, and the two take turns; then both are launched anew,
since the speed of the same code differs from launch to launch by 5 to 10 %. A ratio above 1 says that this checkout is
faster. CPU time, which all threads of a process take together, is steadier than the wall clock where other processes
run on the machine; with a GPU it says nothing.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

THIS = Path(__file__).resolve().parents[1]
SCENES = "three-spheres,cornell-box,roughness-grid"


@dataclass(frozen=True)
class Cost:
    """Seconds of a sample of one pixel, by the wall clock and of CPU time."""

    wall: float
    cpu: float


class Worker:
    """A process that renders one scene with the code of one checkout."""

    def __init__(self, checkout: Path, scene: str, options: argparse.Namespace) -> None:
        self._name = f"{checkout}: {scene}"
        self._pixels = options.size[0] * options.size[1]
        settings = {"scene": scene, "size": options.size, "bounces": options.bounces}
        self._process = subprocess.Popen(
            [sys.executable, __file__, "--worker", json.dumps(settings)],
            env=os.environ | {"PYTHONPATH": os.pathsep.join([str(checkout / "src"), os.environ.get("PYTHONPATH", "")])},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        package = Path(self._answer()["package"])
        if not package.is_relative_to(checkout / "src"):
            sys.exit(f"{checkout}: Python imports {package} in its place")

    def sample(self, seconds: float) -> Cost:
        """Samples for about so long."""
        assert self._process.stdin is not None
        print(seconds, file=self._process.stdin, flush=True)
        found = self._answer()
        samples = found["spp"] * self._pixels
        return Cost(found["wall"] / samples, found["cpu"] / samples)

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            sys.exit(f"{self._name}: the process ended with {self._process.wait()}")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        self._process.communicate()


@contextmanager
def workers(checkouts: Sequence[Path], scene: str, options: argparse.Namespace) -> Iterator[list[Worker]]:
    """A process for each checkout."""
    started: list[Worker] = []
    try:
        for checkout in checkouts:
            started.append(Worker(checkout, scene, options))
        yield started
    finally:
        for worker in started:
            worker.close()


def work(settings: dict[str, Any]) -> None:
    """What a worker does, with the public names alone: the modules behind them differ between versions."""
    import fragtracer

    scene = fragtracer.load(settings["scene"])
    # As many samples in each pixel, and paths alike, in the versions that know of anything else.
    names = ("adaptive", "guiding", "light_tracing", "gradient_domain")
    evenly = {name: "off" for name in names if hasattr(scene.render, name)}
    with fragtracer.Renderer(scene, tuple(settings["size"]), bounces=settings["bounces"], **evenly) as renderer:
        step = renderer.settings.rays
        renderer.sample(step)
        print(json.dumps({"package": str(Path(fragtracer.__file__).resolve())}), flush=True)
        for line in sys.stdin:
            spp, start, cpu = 0, time.perf_counter(), time.process_time()
            while time.perf_counter() - start < float(line):
                renderer.sample(step)
                spp += step
            wall, cpu = time.perf_counter() - start, time.process_time() - cpu
            print(json.dumps({"spp": spp, "wall": wall, "cpu": cpu}), flush=True)


def row(scene: str, other: Path, options: argparse.Namespace) -> str:
    """A row of the table."""
    costs: tuple[list[Cost], list[Cost]] = ([], [])
    for _ in range(options.launches):
        with workers((THIS, other), scene, options) as both:
            for number in range(options.runs):
                for which in (0, 1) if number % 2 == 0 else (1, 0):
                    costs[which].append(both[which].sample(options.seconds))
    pairs = list(zip(*costs, strict=True))
    rates = [f"{1e-6 / median(cost.wall for cost in found):.3g}" for found in costs]
    cpu = [f"{1e9 * median(cost.cpu for cost in found):.3g}" for found in costs]
    wall_ratio = ratio([theirs.wall / mine.wall for mine, theirs in pairs])
    cpu_ratio = ratio([theirs.cpu / mine.cpu for mine, theirs in pairs])
    return f"| {scene} | {' | '.join(rates)} | {wall_ratio} | {' | '.join(cpu)} | {cpu_ratio} |"


def ratio(values: Sequence[float]) -> str:
    """The median with the least and the greatest."""
    return f"{median(values):.3f} ({min(values):.3f} to {max(values):.3f})"


def describe(checkout: Path) -> str:
    """The commit, and whether files differ from it."""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(checkout), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()

    commit = git("log", "-1", "--format=%h %s") or "no commit"
    return f"{commit}{', changed' if git('status', '--porcelain', '--untracked-files=no') else ''}"


def table(other: Path, options: argparse.Namespace) -> Iterator[str]:
    """The lines of the table, each as soon as it is known."""
    width, height = options.size
    yield f"This: {describe(THIS)}.  "
    yield f"Other: {describe(other)}.  "
    yield (
        f"{width}x{height} pixels, {options.bounces} bounces, {options.launches} launches of {options.runs} runs of "
        f"{options.seconds} s in turns; ratios are medians of all runs' (least to greatest), above 1 where this is "
        "faster.\n"
    )
    columns = "this, Msamples/s", "other, Msamples/s", "ratio", "this, CPU ns/sample", "other, CPU ns/sample"
    yield f"| scene | {' | '.join(columns)} | ratio by CPU time |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    for scene in options.scenes.split(","):
        yield row(scene, other, options)


def size(text: str) -> tuple[int, int]:
    width, height = map(int, text.split("x"))
    return width, height


def main() -> None:
    if sys.argv[1:2] == ["--worker"]:
        work(json.loads(sys.argv[2]))
        return
    parser = argparse.ArgumentParser(description="Compare the speed of this checkout with that of another one.")
    parser.add_argument("other", type=Path, metavar="PATH", help="the other checkout")
    parser.add_argument("--scenes", default=SCENES, metavar="NAME,NAME,..", help="bundled scenes, or files")
    parser.add_argument("--size", type=size, default=(256, 256), metavar="WxH", help="in pixels")
    parser.add_argument("--bounces", type=int, default=5, metavar="N")
    parser.add_argument("--launches", type=int, default=3, metavar="N", help="of both, one after the other")
    parser.add_argument("--runs", type=int, default=5, metavar="N", help="turns of each checkout in a launch")
    parser.add_argument("--seconds", type=float, default=1.0, metavar="S", help="of each turn")
    options = parser.parse_args()
    other = options.other.resolve()
    if not (other / "src" / "fragtracer").is_dir():
        parser.error(f"{options.other} is no checkout of fragtracer")
    for line in table(other, options):
        print(line, flush=True)


if __name__ == "__main__":
    main()
