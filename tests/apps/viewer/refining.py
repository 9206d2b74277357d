# SPDX-License-Identifier: MIT
"""Refiners, and scenes for them."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Geometry,
    Light,
    Material,
    Mesh,
    Placement,
    Plane,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)
from fragtracer.scene import Part as MeshPart

SIZE = (40, 24)
Pixels = NDArray[np.float32]
Make = Callable[[Scene], Refiner]


def until(refiner: Refiner, condition: Callable[[], bool], limit: int | None = None, seconds: float = 120.0) -> None:
    """Turn the loop until ``condition`` holds, with at most ``limit`` samples per pixel: what is drawn while another
    process works takes time from it."""
    start = time.perf_counter()
    while not condition():
        assert time.perf_counter() - start < seconds
        refiner.frame(limit)
        time.sleep(0.01)  # leaves the processor to what compiles and learns


def everything() -> Scene:
    """One of every kind."""
    return Scene(
        Camera((0.0, 1.0, 9.0), (0.0, 0.5, 0.0)),
        {"a": Material(), "b": Material(albedo=(0.2, 0.5, 0.9)), "c": Material(emission=(1.0, 2.0, 3.0))},
        spheres=(Sphere((-2.0, 1.0, 0.0), 0.8, "b"), Sphere((-2.0, 3.0, 0.0), 0.3, "c")),
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "a"),),
        rectangles=(Rectangle((0.0, 1.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "c"),),
        disks=(Disk((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 0.5, "b"),),
        triangles=(Triangle(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (1.0, 1.0, 0.0)), "a"),),
        lights=(Light((0.0, 4.0, 2.0), power=50.0), Light((2.0, 4.0, 2.0), power=50.0, radius=0.2)),
        spot_lights=(SpotLight((1.0, 4.0, 0.0), (0.0, -1.0, 0.0), (9.0, 9.0, 9.0), 20.0, 40.0),),
        directional_lights=(DirectionalLight((0.0, -1.0, -1.0), (1.0, 1.0, 1.0)),),
    )


def grid(side: int) -> Mesh:
    """A bumpy square of 2 side^2 triangles, 10 m wide."""
    x, z = np.meshgrid(np.linspace(-5, 5, side + 1), np.linspace(-5, 5, side + 1))
    y = 0.05 * np.sin(3 * x) * np.cos(4 * z)
    i = np.arange(side)[:, None] * (side + 1) + np.arange(side)
    a, b, c, d = i, i + 1, i + side + 1, i + side + 2
    corners = np.stack([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).reshape(-1, 3)
    return Mesh((MeshPart(Geometry(np.stack([x, y, z], -1).reshape(-1, 3), corners), "a"),), (Placement(),))


def drawn(renderer: LiveRenderer) -> Pixels:
    """With all light samples, which a slow machine does not take while something moves."""
    renderer.resize(renderer.size, renderer.settings.light_samples).release()
    return drawn_anew(renderer)


def drawn_anew(renderer: LiveRenderer) -> Pixels:
    renderer.restart()
    while renderer.spp < 4:
        renderer.refine(10.0, 4)
    return renderer.image()
