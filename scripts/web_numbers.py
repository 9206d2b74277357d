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
from fragtracer import renderer
from fragtracer.resources import folder

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from chromium import Chromium

SIZE, SPP, TURNS = (320, 180), 16, 3


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
        with new_renderer(scene, False) as desktop, new_renderer(scene, True) as same:
            rates = [(rate_of_page(browser), rate_of_desktop(desktop), rate_of_desktop(same)) for _ in range(TURNS)]
    page, usual, alike = (max(turns) / 1e6 for turns in zip(*rates, strict=True))
    cells = (f"{path.stat().st_size / 1e3:,.0f}", f"{poster:.2f}", f"{frame:.2f}", f"{page:.2f}", f"{usual:.2f}")
    print(f"| {name} | {' | '.join(cells)} | {page / usual:.2f} | {page / alike:.2f} |", flush=True)


def new_renderer(scene, like_a_page):
    """Of the desktop, or with the shapes that a page tests one by one, which are as many as on a GPU."""
    usual = renderer.MOST_LISTED
    renderer.MOST_LISTED = {**usual, "software": usual["gpu"]} if like_a_page else usual
    made = ft.Renderer(scene, SIZE, adaptive="off", guiding="off")
    made.sample(1)
    renderer.MOST_LISTED = usual
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--time", type=float, default=5.0, metavar="SECONDS", help="that a poster may take")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    names = arguments.scenes or sorted(path.stem for path in folder("scenes").glob("*.toml"))
    print("| scene | kB | poster s | first frame s | page M samples/s | desktop M samples/s | ratio | with its BVH |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as there:
        for name in names:
            measure(name, arguments.time, there)


if __name__ == "__main__":
    main()
