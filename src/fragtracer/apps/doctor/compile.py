# SPDX-License-Identifier: MIT
"""The combinations of features that scenes produce compile and draw: each scene with its own settings, and with one of
the sets of settings that change the program, in turns."""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import cycle
from typing import Any

from fragtracer.apps.doctor import Finding
from fragtracer.errors import FragtracerError
from fragtracer.io.toml import bundled, load
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, DirectionalLight, Disk, Scene, SpotLight, Triangle

_SETTINGS: tuple[dict[str, Any], ...] = (
    {"geometry": "smith-height-correlated"},
    {"geometry": "schlick-beckmann"},
    {"geometry": "karis"},
    {"multiple_scattering": True},
    {"estimator": "nee", "sampler": "hash", "pixel_filter": "tent"},
    {"estimator": "bsdf", "light_samples": 3, "pixel_filter": "gaussian"},
)


def findings(context: Any) -> Iterator[Finding]:
    for (name, scene), others in zip(_scenes(), cycle(_SETTINGS), strict=False):
        slowest, failures = 0.0, []
        for settings in ({}, others):
            start = time.perf_counter()
            try:
                with Renderer(scene, (8, 8), context, **settings) as renderer:
                    renderer.sample(1)
                    renderer.image()
            except FragtracerError as error:
                failures.append(f"{settings}: {error}")
            slowest = max(slowest, time.perf_counter() - start)
        detail = failures[0] if failures else f"the slower of two programs {slowest:.2f} s"
        yield Finding("compile", name, not failures, detail)


def _scenes() -> Iterator[tuple[str, Scene]]:
    scenes = {name: load(name) for name in bundled()}
    yield from scenes.items()
    lens = Camera(aperture_radius=0.05)
    corners = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    sail = Triangle(corners, "lamp")
    lamp = replace(next(iter(scenes["furnace"].materials.values())), emission=(1.0, 1.0, 1.0))
    yield "lens, triangle light", Scene(camera=lens, materials={"lamp": lamp}, triangles=(sail,))
    grid = scenes["roughness-grid"]
    yield "more than a short list holds", replace(grid, spheres=grid.spheres * 20)
    disk = Disk((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 0.5, "lamp")
    spot, sun = (
        SpotLight((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), (10.0,) * 3),
        DirectionalLight((0.0, -1.0, 0.0), (1.0,) * 3),
    )
    materials = {"lamp": lamp, **grid.materials}
    yield (
        "disk, spot and directional light",
        replace(grid, materials=materials, disks=(disk,), spot_lights=(spot,), directional_lights=(sun,)),
    )
