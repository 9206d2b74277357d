# SPDX-License-Identifier: MIT
"""Writes the table of what it gives to learn for all frames of a film in docs/sampling.md: the error of a frame, and
what it costs, where the film has one frame and where it has many."""

import argparse
import time

import numpy as np

from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", type=int, nargs=2, default=(160, 90), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=12)
    options = parser.parse_args()
    print("| scene | frames | relMSE | ms a frame | 1 / (relMSE · s) | guided | light traced |")
    print("| --- | ---: | ---: | ---: | ---: | --- | --- |")
    for name in options.scenes:
        scene = load(name)
        with Renderer(scene, options.size, seed=2**31) as renderer:
            reference = renderer.render(4096).astype(np.float64)
        weight = relative_weight(reference)
        for frames in (1, options.frames):
            settings = {"spp": options.spp, "moves": True, "pictures": frames}
            with Renderer(scene, options.size, **settings) as renderer:
                renderer.render()  # compiles
                errors, start = [], time.perf_counter()
                for seed in range(options.seeds):
                    renderer.reset(scene, seed=seed)
                    errors.append((np.square(renderer.render() - reference) * weight).mean())
                seconds = (time.perf_counter() - start) / options.seeds
                metadata = renderer.metadata()
            error = np.mean(errors)
            said = (metadata[f"{part}_decision"].partition(":")[0] for part in ("guiding", "light_tracing"))
            cells = f"{error:.3g} | {1e3 * seconds:.0f} | {1 / (error * seconds):.3g} | {' | '.join(said)}"
            print(f"| {name} | {frames} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
