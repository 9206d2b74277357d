# SPDX-License-Identifier: MIT
"""Size and speed of pages: bytes, seconds to the poster and to the first traced frame in a browser that has just been
started, with Mesa's cache of programs off, and samples per second beside the desktop on the same driver (llvmpipe).

The rates are the best of three turns each, by the clock of the page and of the desktop's draws, with the same samples.

    python scripts/web_numbers.py [--time SECONDS] [--seconds SECONDS] [SCENE ...]
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
from fragtracer.scene import PLAIN

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from chromium import Chromium

SIZE, TURNS = (320, 180), 3


def seconds_of_page(browser, spp):
    """Of drawing alone, as a page does for as long as nothing changes."""
    return browser.run(
        "(async () => { const start = performance.now(); "
        f"const film = await fragtracer.live.trace({SIZE[0]}, {SIZE[1]}, {spp}, 0); "
        "const seconds = (performance.now() - start) / 1000; film.release(); return seconds; })()",
        300,
    )


def samples_for(seconds, seconds_of):
    """How many samples per pixel take about so long."""
    spp = 2
    while (found := seconds_of(spp)) < seconds / 2:
        spp *= 2
    return round(spp * max(1, seconds / found))


def seconds_of_desktop(renderer, spp):
    before = renderer.draw_seconds
    renderer.sample(spp)
    return renderer.draw_seconds - before


def measure(name, poster_seconds, seconds, there):
    scene = ft.load(name)
    path = Path(there) / "page.html"
    ft.export_html(scene, path, seconds=poster_seconds)
    with (
        Chromium("mesa") as browser,
        ft.Renderer(scene, SIZE, **PLAIN) as desktop,
    ):
        browser.resize(800, 700)
        time.sleep(1)
        browser.call("Page.navigate", url=path.resolve().as_uri())
        browser.wait("performance.getEntriesByName('first-frame').length", 300)
        poster, frame = browser.run(
            "[performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000, "
            "performance.getEntriesByName('first-frame')[0].startTime / 1000]"
        )
        spp = samples_for(seconds, lambda spp: seconds_of_page(browser, spp))
        seconds_of_desktop(desktop, spp)
        turns = [(seconds_of_page(browser, spp), seconds_of_desktop(desktop, spp)) for _ in range(TURNS)]
    page, usual = (SIZE[0] * SIZE[1] * spp / min(of) / 1e6 for of in zip(*turns, strict=True))
    cells = (f"{path.stat().st_size / 1e3:,.0f}", f"{poster:.2f}", f"{frame:.2f}", f"{page:.2f}", f"{usual:.2f}")
    print(f"| {name} | {' | '.join(cells)} | {page / usual:.2f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--time", type=float, default=5.0, metavar="SECONDS", help="that a poster may take")
    parser.add_argument("--seconds", type=float, default=1.0, help="of a turn")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
    names = arguments.scenes or sorted(path.stem for path in folder("scenes").glob("*.toml"))
    print("| scene | kB | poster s | first frame s | page M samples/s | desktop M samples/s | ratio |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as there:
        for name in names:
            measure(name, arguments.time, arguments.seconds, there)


if __name__ == "__main__":
    main()
