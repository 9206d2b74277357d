# SPDX-License-Identifier: MIT
"""Writes the table of what the tree of lights gives in docs/sampling.md: the variance that it saves at equal samples
and what it costs, against choice by power alone. A minute for all.

    python scripts/many_lights.py
"""

import time

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.bench.fields import light_field
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.packing import lights as packed_lights
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, Camera, Light, Material, Plane, Rectangle, RenderSettings, Scene, Sphere

SIZE, SPP, SEEDS = (192, 108), 64, 3
COUNTS = (10, 100, 1_000, 10_000)
SIDE = 30.0  # metres, of a floor
RENDER = RenderSettings(bounces=3)
GREY = {"grey": Material(albedo=(0.5,) * 3, specular=0.0)}


def scattered(count: int, walls: bool) -> Scene:
    """Spherical lights of powers from one to ten over a floor with twelve spheres, 4 m high walls every 5 m."""
    rng = np.random.default_rng(count)
    places = np.column_stack([rng.uniform(-SIDE / 2, SIDE / 2, (count, 2)), rng.uniform(1.5, 3.0, count)])
    powers = 3000 / count * 10 ** rng.uniform(0, 1, count)
    lights = tuple(
        Light((x, y, z), 0.05, power=p) for (x, z, y), p in zip(places.tolist(), powers.tolist(), strict=True)
    )
    rectangles = []
    for place in np.arange(-17.5, 13.0, 5.0).tolist() if walls else []:
        rectangles.append(Rectangle((place, 0.0, -SIDE / 2), (0.0, 4.0, 0.0), (0.0, 0.0, SIDE), "grey"))
        rectangles.append(Rectangle((-SIDE / 2, 0.0, place), (0.0, 4.0, 0.0), (SIDE, 0.0, 0.0), "grey"))
    spheres = tuple(Sphere((x, 0.4, z), 0.4, "grey") for x, z in rng.uniform(-12, 12, (12, 2)).tolist())
    floor = (Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "grey"),)
    camera = Camera((0.0, 14.0, 16.0), (0.0, 0.0, 0.0), fov_degrees=50.0)
    shapes = {"spheres": spheres, "planes": floor, "rectangles": tuple(rectangles)}
    return Scene(camera, GREY, lights=lights, render=RENDER, **shapes)


def measured(scene: Scene, few: int) -> tuple[NDArray[np.float64], float]:
    """Pictures (seeds, height, width, 3), and ns of CPU time a sample; more than ``few`` lights have a tree."""
    packed_lights.FEW_LIGHTS = few
    pictures = []
    with Renderer(scene, SIZE, **PLAIN) as renderer:
        renderer.sample(8)
        start = time.process_time()
        for seed in range(SEEDS):
            renderer.reset(seed=seed)
            renderer.sample(SPP)
            pictures.append(renderer.image())
        seconds = time.process_time() - start
    return np.array(pictures, np.float64), 1e9 * seconds / (SEEDS * SPP * SIZE[0] * SIZE[1])


def main() -> None:
    kept = packed_lights.FEW_LIGHTS
    print("| lights | by power, ns | by the tree, ns | variance ÷ | efficiency × |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name, scene_of in {
        "in rooms of 5 m": lambda count: scattered(count, True),
        "over a floor of 30 m": lambda count: scattered(count, False),
        "evenly over 3 m, 2.5 m high": lambda count: light_field(count, RENDER, "points"),
    }.items():
        for count in COUNTS:
            scene = scene_of(count)
            (by_power, cost_by_power), (by_tree, cost) = (measured(scene, few) for few in (10**9, kept))
            weight = relative_weight((by_power.mean(axis=0) + by_tree.mean(axis=0)) / 2)
            gain = np.mean(by_power.var(axis=0) * weight) / np.mean(by_tree.var(axis=0) * weight)
            cells = f"{cost_by_power:.0f} | {cost:.0f} | {gain:.1f} | {gain * cost_by_power / cost:.1f}"
            print(f"| {count:,} {name} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
