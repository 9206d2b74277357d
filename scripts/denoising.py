# SPDX-License-Identifier: MIT
"""What denoising is worth: the error of pictures, raw and denoised, over their samples and over time.

usage: python scripts/denoising.py [--scenes cornell-box,glass] [--size 240x135] [--reference 2048] [--strip FILE.png]

Prints a Markdown table, and before it how many raw samples have the relMSE of 16 denoised ones. relMSE and FLIP are
those of fragtracer compare, against a picture of --reference samples of another seed. Raw samples are even and not
guided, as 16 are by default; the first table has besides what 256 are by default. Seconds are by the wall clock: of
rendering, and of drawing layers and denoising. --strip writes the pictures of 16 samples, those denoised, and the
references of --shown.
"""

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fragtracer.aov import DENOISING
from fragtracer.apps.cli.options import parse_size
from fragtracer.apps.compare.measures import auto_exposure, displayed, mean_flip
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.denoising import denoise
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN

Floats = NDArray[np.float32]
SPP = (1, 4, 16, 64, 256)
FEW, MIDDLE, MANY = 16, 64, 256


@dataclass(frozen=True)
class Errors:
    """Of a picture against the reference."""

    relative_mse: float
    flip: float

    @classmethod
    def of(cls, image: Floats, reference: Floats) -> "Errors":
        error = (image - reference.astype(np.float64)) ** 2 * relative_weight(reference)
        exposure = auto_exposure(reference)
        flip = mean_flip(displayed(reference, exposure), displayed(image, exposure))
        assert flip is not None, "FLIP is not installed; pip install 'fragtracer[reference]'"
        return cls(float(error.mean()), flip)


@dataclass(frozen=True)
class Row:
    """Errors at so many samples, and the seconds to render and to draw layers and denoise."""

    spp: int
    raw: Errors
    denoised: Errors
    seconds: float
    denoising: float


@dataclass(frozen=True)
class Study:
    """What was found of one scene; pictures as they are shown."""

    name: str
    rows: list[Row]
    by_default: float  # relMSE of MANY samples, adaptive and guided where that pays
    pictures: list[Floats]

    def at(self, spp: int) -> Row:
        return next(row for row in self.rows if row.spp == spp)

    @property
    def equal_samples(self) -> float:
        """How many raw samples have the relMSE of FEW denoised ones; beyond the last, as if its error fell with 1/n."""
        wanted = np.log(self.at(FEW).denoised.relative_mse)
        errors = np.log([row.raw.relative_mse for row in self.rows])
        samples = np.log([row.spp for row in self.rows])
        if wanted < errors[-1]:
            return float(np.exp(samples[-1] + errors[-1] - wanted))
        return float(np.exp(np.interp(-wanted, -np.minimum.accumulate(errors), samples)))


def study(name: str, size: tuple[int, int], reference_spp: int) -> Study:
    scene = load(name)
    with Renderer(scene, size, seed=1) as renderer:
        reference = renderer.render(spp=reference_spp)
    rows, pictures, seconds = [], [], 0.0
    with Renderer(scene, size, **PLAIN) as renderer:
        renderer.sample(1)
        renderer.aov(DENOISING[0])  # compiles
        renderer.reset()
        for spp in SPP:
            start = time.perf_counter()
            image = renderer.render(spp=spp)
            seconds += time.perf_counter() - start
            start = time.perf_counter()
            clean = denoise(image, *map(renderer.aov, DENOISING))
            denoising = time.perf_counter() - start
            rows.append(Row(spp, Errors.of(image, reference), Errors.of(clean, reference), seconds, denoising))
            if spp == FEW:
                pictures = [displayed(shown, auto_exposure(reference)) for shown in (image, clean, reference)]
    with Renderer(scene, size) as renderer:
        by_default = Errors.of(renderer.render(spp=MANY), reference).relative_mse
    return Study(name, rows, by_default, pictures)


def main() -> None:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--scenes", default="three-spheres-ambient,cornell-box,sun-sky,still-life,glass")
    parser.add_argument("--size", type=parse_size, default=(240, 135))
    parser.add_argument("--reference", type=int, default=2048)
    parser.add_argument("--strip", type=Path)
    parser.add_argument("--shown", default="cornell-box,still-life")
    options = parser.parse_args()
    studies = [study(name, options.size, options.reference) for name in options.scenes.split(",")]
    print(f"| scene | raw samples with the relMSE of {FEW} denoised | relMSE: {FEW} denoised | {MANY} raw |", end="")
    print(f" {MANY} by default | FLIP: {FEW} denoised | {MIDDLE} raw |\n| --- |{' ---: |' * 6}")
    for s in studies:
        few, many = s.at(FEW).denoised, s.at(MANY).raw
        print(f"| {s.name} | {s.equal_samples:.0f} | {few.relative_mse:.2g} | {many.relative_mse:.2g} |", end="")
        print(f" {s.by_default:.2g} | {few.flip:.3f} | {s.at(MIDDLE).raw.flip:.3f} |")
    print("\n| scene | spp | relMSE | denoised | FLIP | denoised | s | s more |\n| --- |" + " ---: |" * 7)
    for s in studies:
        for row in s.rows:
            errors = f"{row.raw.relative_mse:.2g} | {row.denoised.relative_mse:.2g}"
            flips = f"{row.raw.flip:.3f} | {row.denoised.flip:.3f}"
            print(f"| {s.name} | {row.spp} | {errors} | {flips} | {row.seconds:.2f} | {row.denoising:.2f} |")
    if options.strip:
        shown = [np.concatenate(s.pictures, axis=1) for s in studies if s.name in options.shown.split(",")]
        pixels = np.uint8(np.rint(255 * np.concatenate(shown, axis=0)))
        Image.fromarray(pixels).save(options.strip, optimize=True)


if __name__ == "__main__":
    main()
