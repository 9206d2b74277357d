# SPDX-License-Identifier: MIT
"""Writes the table of what adaptive sampling gives in docs/sampling.md: for each bundled scene the squared error that
it saves at equal samples, what it costs, and whether the pilot would have chosen it. Minutes for a scene of meshes."""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.io.toml import bundled, load
from fragtracer.renderer import Renderer


def measured(name: str, adaptive: str, options: argparse.Namespace) -> tuple[NDArray[np.float64], float, str]:
    """Pictures (seeds, height, width, 3), seconds of CPU time, and what was decided."""
    pictures = []
    with Renderer(load(name), options.size, adaptive=adaptive, guiding="off") as renderer:
        renderer.sample(48)  # compiles and draws what is new
        start = time.process_time()
        for seed in range(options.seeds):
            renderer.reset(seed=seed)
            renderer.sample(options.spp)
            pictures.append(renderer.image())
        return np.array(pictures, np.float64), time.process_time() - start, renderer.metadata()["adaptive_decision"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="all bundled ones, if there are none here")
    parser.add_argument("--size", type=int, nargs=2, default=(240, 135), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    print("| scene | variance ÷ | cost × | efficiency × | auto |\n| --- | ---: | ---: | ---: | --- |")
    for name in options.scenes or bundled():
        (even, even_cost, _), (uneven, cost, _) = (measured(name, adaptive, options) for adaptive in ("off", "on"))
        weight = relative_weight((even.mean(axis=0) + uneven.mean(axis=0)) / 2)
        gain = (even.var(axis=0) * weight).mean() / (uneven.var(axis=0) * weight).mean()
        decision = measured(name, "auto", argparse.Namespace(**vars(options) | {"spp": 40, "seeds": 1}))[2]
        efficiency = gain * even_cost / cost
        print(f"| {name} | {gain:.2f} | {cost / even_cost:.2f} | {efficiency:.2f} | {decision} |", flush=True)


if __name__ == "__main__":
    main()
