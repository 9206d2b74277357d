# SPDX-License-Identifier: MIT
"""Is the picture in a browser the desktop's? Every bundled scene in headless Chromium, by both of its software drivers.

With the same seeds, pixel by pixel: which share of the pixels is equal in all bits, within 2^-18 and within 2^-10 of
the brightness of the pixel. And as two renderers, with other seeds each, by the statistics of `fragtracer compare`: the
smallest p-value that the means of one of 3 x 4 parts differ in a colour, corrected for their number (Šidák), and the
bias of the whole picture that would be found.

    python scripts/web_proof.py [--driver mesa] [SCENE ...]
"""

import argparse
import base64
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import fragtracer as ft
from fragtracer.apps.compare.statistics import Pair, detectable_bias, difference_p, part_means
from fragtracer.apps.web import page
from fragtracer.resources import folder
from fragtracer.scene import PLAIN

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from chromium import DRIVERS, Chromium

WIDTH, HEIGHT, SPP, SEEDS = 64, 48, 16, 8


def browser_image(browser, seed):
    text = browser.run(f"fragtracer.trace({WIDTH}, {HEIGHT}, {SPP}, {seed})", 600)[0]
    texels = np.frombuffer(base64.b64decode(text), np.float32).reshape(HEIGHT, WIDTH, 4)
    return texels[::-1, :, :3].astype(np.float64)


def desktop_images(scene):
    """Of the seeds of the browser, and of others."""
    with ft.Renderer(scene, (WIDTH, HEIGHT), **PLAIN) as rendering:
        for seed in range(2 * SEEDS):
            rendering.reset(seed=seed)
            rendering.sample(SPP)
            yield rendering.image().astype(np.float64)


def row(name, driver, found, expected):
    same = expected[:SEEDS]
    size = np.abs(same).max(axis=-1)
    difference = np.abs(found - same).max(axis=-1)
    within = [100 * np.mean(difference <= bits * size) for bits in (0, 2.0**-18, 2.0**-10)]
    pair = Pair.of(part_means(found, 3, 4), part_means(expected[SEEDS:], 3, 4))
    p = -np.expm1(difference_p(pair).size * np.log1p(-difference_p(pair).min()))
    whole = Pair.of(part_means(found, 1, 1), part_means(expected[SEEDS:], 1, 1))
    shares = " | ".join(f"{share:.1f}" for share in within)
    print(f"| {name} | {driver} | {shares} | {p:.2f} | {100 * detectable_bias(whole, 0.01).max():.1f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--driver", choices=DRIVERS)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    names = arguments.scenes or sorted(path.stem for path in folder("scenes").glob("*.toml"))
    print("| scene | driver | equal % | within 2^-18 % | within 2^-10 % | p | bias found % |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    for driver in [arguments.driver] if arguments.driver else DRIVERS:
        with Chromium(driver) as browser, tempfile.TemporaryDirectory() as there:
            browser.resize(200, 300)
            for name in names:
                scene = ft.load(name)
                path = Path(there) / "page.html"
                path.write_text(page(scene, (32, 24), 1).text, encoding="utf-8")
                browser.open(path)
                browser.wait("window.fragtracer && fragtracer.live.shown", 120)
                found = np.array([browser_image(browser, seed) for seed in range(SEEDS)])
                row(name, driver, found, np.array(list(desktop_images(scene))))
                assert not browser.problems(), browser.problems()


if __name__ == "__main__":
    main()
