# SPDX-License-Identifier: MIT
"""Pictures of equal time, a row for each scene: ours sampled evenly and unguided, ours with its defaults, Mitsuba with
its best sampler, and the reference.

Prints relMSE and samples per pixel as a Markdown table. Compiling is not counted, nor is learning to guide.

    python scripts/equal_time.py [--seconds SECONDS] [--size WxH] [--bounces N] --strip OUT.png [SCENE ...]
"""

import argparse
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Mitsuba, Ours
from fragtracer.apps.bench.error import make_reference, sample_for
from fragtracer.apps.bench.plan import Plan
from fragtracer.apps.bench.yardstick import sampling_for
from fragtracer.apps.cli.options import parse_size
from fragtracer.apps.compare.measures import auto_exposure, displayed
from fragtracer.scene import PLAIN

SPP = 1024  # that are asked for: small pictures are not guided
REFERENCE_TIME = 8.0  # of each of its two images, in times of the pictures


def pictures(name: str, size: tuple[int, int], bounces: int, seconds: float) -> np.ndarray:
    """A row of the strip, (height, 4 width, 3)."""
    scene = with_settings(case(name), size, bounces=bounces, spp=SPP)
    reference = make_reference(scene, REFERENCE_TIME * seconds)

    def sampled(contender: Ours | Mitsuba) -> np.ndarray:
        sample_for(contender, seconds)
        return contender.image()

    sampling = sampling_for(scene, Plan(), lambda m: reference.relative_mse(sampled(m)) * m.seconds, lambda text: None)
    makers = {
        "paths alone, even, unguided": lambda: Ours(scene, **PLAIN),
        "by default": lambda: Ours(scene),
        f"Mitsuba, {sampling}": lambda: Mitsuba(scene, sampling=sampling),
    }
    images = []
    for what, make in makers.items():
        with make() as contender:
            images.append(sampled(contender))
            error = reference.relative_mse(images[-1])
            print(f"| {name} | {what} | {contender.spp} | {contender.seconds:.2f} | {error:.2g} |", flush=True)
    images.append((reference.first + reference.second) / 2)
    exposure = auto_exposure(images[-1])
    return np.concatenate([displayed(image, exposure) for image in images], axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=["three-spheres", "ring", "five-lights"])
    parser.add_argument("--seconds", type=float, default=4.0, help="that each picture takes")
    parser.add_argument("--size", type=parse_size, default=(256, 144), metavar="WxH")
    parser.add_argument("--bounces", type=int, default=5)
    parser.add_argument("--strip", type=Path, required=True)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    print("| scene | renderer | spp | s | relMSE |\n| --- | --- | ---: | ---: | ---: |")
    rows = [pictures(name, arguments.size, arguments.bounces, arguments.seconds) for name in arguments.scenes]
    Image.fromarray(np.uint8(np.rint(255 * np.concatenate(rows)))).save(arguments.strip, optimize=True)


if __name__ == "__main__":
    main()
