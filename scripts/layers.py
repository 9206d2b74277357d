# SPDX-License-Identifier: MIT
"""What layers cost: processor time of pictures with the parts of the light, and of the layers drawn afterwards.

usage: python scripts/layers.py [--scenes cornell-box,glass] [--size 240x135] [--spp 64]

Prints a Markdown table, the least of three times each. Without adaptive sampling and guiding.
"""

import argparse
import time
from collections.abc import Callable

from fragtracer.apps.cli.options import parse_size
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN


def least(action: Callable[[], object], before: Callable[[], object]) -> float:
    """Seconds of processor time, after the first run, which compiles."""
    times = []
    for _ in range(4):
        before()
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return min(times[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--scenes", default="three-spheres-ambient,cornell-box,sun-sky,still-life,glass")
    parser.add_argument("--size", type=parse_size, default=(240, 135))
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    print("| scene | s | with parts × | geometry + | a matte + |\n| --- | ---: | ---: | ---: | ---: |")
    for name in options.scenes.split(","):
        seconds = []
        for aovs in ((), ("direct",)):
            with Renderer(load(name), options.size, aovs=aovs, **PLAIN) as renderer:
                draw, reset = lambda r=renderer: r.sample(options.spp), lambda r=renderer: r.reset()
                seconds.append(least(draw, reset))
                if aovs:
                    continue
                for layer in ("albedo", "object"):  # of another number of samples each time: what is drawn is kept
                    seconds.append(least(lambda r=renderer, one=layer: r.aov(one), lambda r=renderer: r.sample(1)))
        plain, geometry, matte, parts = seconds
        print(f"| {name} | {plain:.2f} | {parts / plain:.2f} | {geometry / plain:.0%} | {matte / plain:.0%} |")


if __name__ == "__main__":
    main()
