# SPDX-License-Identifier: MIT
"""Writes the tables of what adaptive sampling, guiding, light tracing and the gradient domain give in docs/sampling.md:
for each scene the squared error that one of them saves at equal samples, what it costs, and whether it would have been
chosen. Minutes for a scene of meshes."""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from fragtracer import guiding, light_tracing
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.gpu.context import create_context
from fragtracer.io.toml import bundled, load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, RenderSettings


def measured(
    name: str, options: argparse.Namespace, said_of: str = "adaptive", **settings: str
) -> tuple[NDArray[np.float64], float, str]:
    """Pictures (seeds, height, width, 3), seconds of CPU time, and what was decided about one of the techniques."""
    pictures = []
    with Renderer(load(name), options.size, spp=2**20, **PLAIN | settings) as renderer:
        renderer.sample(48)  # compiles and draws what is new
        start = time.process_time()
        for seed in range(options.seeds):
            renderer.reset(seed=seed)
            renderer.sample(options.spp)
            pictures.append(renderer.image())
        return np.array(pictures, np.float64), time.process_time() - start, renderer.metadata()[f"{said_of}_decision"]


def decision(name: str, options: argparse.Namespace) -> str:
    """What ``auto`` says: after its pilot, or, of guiding and light tracing, for a picture of 640 x 360."""
    if options.technique in ("adaptive", "gradient_domain"):
        few = argparse.Namespace(size=options.size, spp=40, seeds=1)
        return measured(name, few, options.technique, **{options.technique: "auto"})[2]
    scene = load(name)
    settings = RenderSettings(width=640, height=360, spp=1024, bounces=scene.render.bounces)
    technique = light_tracing if options.technique == "light_tracing" else guiding
    return technique.decide(create_context(), scene, settings).reason


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("technique", choices=sorted(PLAIN))
    parser.add_argument("scenes", nargs="*", help="all bundled ones, if there are none here")
    parser.add_argument("--size", type=int, nargs=2, default=(240, 135), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    print("| scene | variance ÷ | best 99 % ÷ | cost × | efficiency × | auto |")
    print("| --- | ---: | ---: | ---: | ---: | --- |")
    for name in options.scenes or bundled():
        without, cost_without, _ = measured(name, options)
        with_it, cost, _ = measured(name, options, **{options.technique: "on"})
        weight = relative_weight((without.mean(axis=0) + with_it.mean(axis=0)) / 2)
        errors = [(pictures.var(axis=0) * weight).mean(axis=-1).ravel() for pictures in (without, with_it)]
        best = [np.sort(error)[: round(0.99 * error.size)].mean() for error in errors]
        gain, gain_of_best = errors[0].mean() / errors[1].mean(), best[0] / best[1]
        cells = f"{gain:.2f} | {gain_of_best:.2f} | {cost / cost_without:.2f} | {gain * cost_without / cost:.2f}"
        print(f"| {name} | {cells} | {decision(name, options)} |", flush=True)


if __name__ == "__main__":
    main()
