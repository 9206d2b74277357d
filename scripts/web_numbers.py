# SPDX-License-Identifier: MIT
"""Size and speed of pages: bytes, seconds to the poster and to the first traced frame in a browser that has just been
started, with Mesa's cache of programs off, and samples per second beside the desktop on the same driver (llvmpipe).

The rates are the best of three turns each, by the clock of the page and of the desktop's draws, with the same samples.

    python scripts/web_numbers.py [--time SECONDS] [SCENE ...]
"""

import argparse
import os
import sys
import tempfile
import time
import warnings
from pathlib import Path

import fragtracer as ft
from fragtracer.resources import folder

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from chromium import Chromium

SIZE, SPP, TURNS = (320, 180), 8, 3


def rate_of_page(browser, spp=SPP):
    width, height = SIZE
    seconds = browser.run(
        "(async () => { const start = performance.now(); "
        f"await fragtracer.trace({width}, {height}, {spp}, 0); return (performance.now() - start) / 1000; }})()",
        300,
    )
    return width * height * spp / seconds


def rate_of_desktop(renderer):
    before = renderer.draw_seconds
    renderer.sample(SPP)
    return SIZE[0] * SIZE[1] * SPP / (renderer.draw_seconds - before)


def measure(name, seconds, there):
    scene = ft.load(name)
    path = Path(there) / "page.html"
    ft.export_html(scene, path, seconds=seconds)
    with Chromium("mesa") as browser:
        browser.resize(800, 700)
        time.sleep(1)
        browser.call("Page.navigate", url=path.resolve().as_uri())
        browser.wait("performance.getEntriesByName('first-frame').length", 300)
        poster, frame = browser.run(
            "[performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000, "
            "performance.getEntriesByName('first-frame')[0].startTime / 1000]"
        )
        rate_of_page(browser, 1)
        with ft.Renderer(scene, SIZE, adaptive="off", guiding="off") as renderer:
            renderer.sample(1)
            rates = [(rate_of_page(browser), rate_of_desktop(renderer)) for _ in range(TURNS)]
    page, desktop = (max(turn) for turn in zip(*rates, strict=True))
    kilobytes = path.stat().st_size / 1e3
    cells = (f"{kilobytes:,.0f}", f"{poster:.2f}", f"{frame:.2f}", f"{page / 1e6:.2f}", f"{desktop / 1e6:.2f}")
    print(f"| {name} | {' | '.join(cells)} | {page / desktop:.2f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--time", type=float, default=5.0, metavar="SECONDS", help="that a poster may take")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    names = arguments.scenes or sorted(path.stem for path in folder("scenes").glob("*.toml"))
    print("| scene | kB | poster s | first frame s | page M samples/s | desktop M samples/s | ratio |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as there:
        for name in names:
            measure(name, arguments.time, there)


if __name__ == "__main__":
    main()
