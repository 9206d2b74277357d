# SPDX-License-Identifier: MIT
"""Writes scenes/sphere-field.toml: 480 spheres, each with a material of its own, on a ground plane under a sky.

usage: python scripts/make_sphere_field.py [--spheres N] [FILE.toml]

After the final picture of Peter Shirley, "Ray Tracing in One Weekend" (camera, sky and the three large spheres are
those of the book), without its glass. A field of any number of spheres covers the same square of 22 m, so that pictures
of fields of 100 and of 10,000 spheres cover the same pixels: the spheres become smaller. The same number gives the same
file at every run.
"""

import argparse
from pathlib import Path

from fragtracer.apps.bench.sphere_field import SPHERES, sphere_field
from fragtracer.io.toml import save

FILE = Path(__file__).parents[1] / "scenes" / "sphere-field.toml"


def main() -> None:
    parser = argparse.ArgumentParser(description="Make a scene of many spheres.")
    parser.add_argument("file", nargs="?", type=Path, default=FILE, help="the scene file to write")
    parser.add_argument("--spheres", type=int, default=SPHERES, metavar="N", help="how many, the large ones included")
    options = parser.parse_args()
    save(sphere_field(options.spheres), options.file)


if __name__ == "__main__":
    main()
