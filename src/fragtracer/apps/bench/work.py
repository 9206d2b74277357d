# SPDX-License-Identifier: MIT
"""The rays and vertices of a sample, counted by a variant of the same program."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fragtracer.apps.bench.variants import COUNT_WORK, Edit, edited_shaders
from fragtracer.renderer import Renderer
from fragtracer.scene import Scene

_SIDE = 64  # pixels of the longer side of the image that is counted
_SPP = 64
# Compiling the scene into the program would take longer than so few samples.
_SETTINGS: dict[str, Any] = {
    "rays": 16,
    "adaptive": "off",
    "guiding": "off",
    "light_tracing": "off",
    "gradient_domain": "off",
    "specialised": False,
}


@dataclass(frozen=True)
class Work:
    """Means over the samples of an image. A vertex is a point where a path scatters."""

    path_rays: float
    shadow_rays: float
    vertices: float

    @property
    def rays(self) -> float:
        return self.path_rays + self.shadow_rays


def count_work(scene: Scene, spp: int = _SPP, edits: Sequence[Edit] = ()) -> Work:
    """Count on a small image of the same view with the same settings, by shaders with ``edits``."""
    settings = scene.render
    scale = min(1.0, _SIDE / max(settings.width, settings.height))
    width, height = (max(1, round(scale * side)) for side in (settings.width, settings.height))
    with (
        edited_shaders((*COUNT_WORK, *edits)) as shaders,
        Renderer(scene, (width, height), shaders=shaders, **_SETTINGS) as renderer,
    ):
        path_rays, shadow_rays, vertices = renderer.render(spp).mean((0, 1), dtype=float).tolist()
    return Work(path_rays, shadow_rays, vertices)
