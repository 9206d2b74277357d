# SPDX-License-Identifier: MIT
"""Seconds that a driver takes to compile the program of a scene, printed by a process of its own.

usage: python -m fragtracer.apps.bench.compile_time SCENE WIDTH HEIGHT

A process that has compiled before, or has the driver's cache, would take less.
"""

import sys
import time

from fragtracer.gpu.context import create_context
from fragtracer.gpu.film import Film
from fragtracer.gpu.specialise import MOST_LISTED
from fragtracer.gpu.tracer import Tracer, TracerProgram, picture_level
from fragtracer.io.toml import load
from fragtracer.packing import pack


def compile_seconds(name: str, width: int, height: int) -> float:
    """From the packed scene to the end of the first draw: with the upload of textures, which takes milliseconds."""
    scene = load(name)
    context = create_context()
    packed = pack(scene, scene.render, width, height, MOST_LISTED["default"])
    film = Film(context, width, height)
    start = time.perf_counter()
    tracer = Tracer(context, packed, TracerProgram(level=picture_level(context)))
    tracer.warm_up(film)
    return time.perf_counter() - start


if __name__ == "__main__":
    print(compile_seconds(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
