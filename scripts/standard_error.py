# SPDX-License-Identifier: MIT
"""How well the renderer knows its error: the mean standard error it tells, over the scatter of independent pictures.

usage: python scripts/standard_error.py [--scenes cornell-box,three-spheres] [--size 64x64] [--spp 64,256] [--seeds 48]

Prints a Markdown table. A ratio of 1 is the truth, of less an error larger than it is said to be.
"""

import argparse

import numpy as np

from fragtracer.apps.cli.options import parse_size
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer


def ratio(name: str, size: tuple[int, int], spp: int, seeds: int, adaptive: bool) -> float:
    """Told over true, both means over the pixels of a picture without guiding."""
    images, told = [], []
    with Renderer(
        load(name),
        size,
        adaptive="on" if adaptive else "off",
        guiding="off",
        light_tracing="off",
        gradient_domain="off",
    ) as renderer:
        for seed in range(seeds):
            renderer.reset(seed=seed)
            renderer.sample(spp)
            images.append(renderer.image().astype(np.float64))
            told.append(renderer.relative_error())
    pictures = np.array(images)
    return float(np.mean(told) * pictures.mean() / pictures.std(axis=0, ddof=1).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--scenes", default="cornell-box,three-spheres,roughness-grid,sun-sky")
    parser.add_argument("--size", type=parse_size, default=(64, 64))
    parser.add_argument("--spp", default="64,256")
    parser.add_argument("--seeds", type=int, default=48)
    options = parser.parse_args()
    print("| scene | spp | even | adaptive |\n| --- | ---: | ---: | ---: |")
    for name in options.scenes.split(","):
        for spp in map(int, options.spp.split(",")):
            found = (ratio(name, options.size, spp, options.seeds, adaptive) for adaptive in (False, True))
            print(f"| {name} | {spp} |", " | ".join(f"{value:.2f}" for value in found), "|", flush=True)


if __name__ == "__main__":
    main()
