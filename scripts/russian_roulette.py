# SPDX-License-Identifier: MIT
"""Writes the table of Russian roulette in docs/sampling.md: variance, rays and efficiency where paths survive by other
probabilities and from other vertices, against the first of them."""

import argparse
from dataclasses import replace

import numpy as np

from fragtracer.apps.bench.variants import Edit, edited_shaders
from fragtracer.apps.bench.work import count_work
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, Scene

FILE, SURVIVAL = "integrator/path.glsl", "min(1.0, sqrt(path.eta_scale * max_component(path.throughput)))"
THROUGHPUT = "path.eta_scale * max_component(path.throughput)"
RULES = {
    "√T": (),
    "T": (Edit(FILE, SURVIVAL, f"min(1.0, {THROUGHPUT})"),),
    "1.5 T": (Edit(FILE, SURVIVAL, f"min(1.0, 1.5 * {THROUGHPUT})"),),
}
AT_16_BOUNCES = (("T", 5), ("√T", 5), ("1.5 T", 5), ("T", 8), ("√T", 8), ("√T", 3))
AT_5_BOUNCES = (("√T", 5), ("√T", 3), ("√T", 2), ("√T", 1), ("T", 3), ("T", 2), ("T", 1))


def measured(scene: Scene, edits: tuple[Edit, ...], options: argparse.Namespace) -> tuple[float, float]:
    """Relative variance of a sample, and its rays."""
    pictures = []
    with (
        edited_shaders(edits) as shaders,
        Renderer(scene, options.size, shaders=shaders, **PLAIN) as renderer,
    ):
        for seed in range(options.seeds):
            renderer.reset(seed=seed)
            renderer.sample(options.spp)
            pictures.append(renderer.image())
    images = np.array(pictures, np.float64)
    variance = (images.var(axis=0, ddof=1) * relative_weight(images.mean(axis=0))).mean()
    return float(variance), count_work(scene, edits=edits).rays


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["cornell-box", "weekend", "still-life", "three-spheres"])
    parser.add_argument("--bounces", type=int, choices=(5, 16), default=16)
    parser.add_argument("--size", type=int, nargs=2, default=(96, 54), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=12)
    options = parser.parse_args()
    rules = AT_16_BOUNCES if options.bounces == 16 else AT_5_BOUNCES
    print("| scene | survival, from vertex | variance | rays | efficiency |\n| --- | --- | ---: | ---: | ---: |")
    for name in options.scenes:
        scene = load(name)
        first = None
        for rule, vertex in rules:
            render = replace(scene.render, bounces=options.bounces, russian_roulette_depth=vertex)
            variance, rays = measured(replace(scene, render=render), RULES[rule], options)
            first = first or (variance, rays)
            error, time = variance / first[0], rays / first[1]
            print(f"| {name} | {rule}, {vertex} | {error:.2f} | {time:.2f} | {1 / (error * time):.2f} |", flush=True)


if __name__ == "__main__":
    main()
