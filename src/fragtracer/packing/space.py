# SPDX-License-Identifier: MIT
"""The coordinates of the shader: relative to the middle of the scene, or of what is small and close together in it.

That may be far from the origin of the world and from the camera, and keeps its precision."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.shapes import Shape, bounds_of
from fragtracer.scene import SHAPES, Camera, Scene, Sphere

Floats = NDArray[np.float64]

# Coordinates are chosen anew where the camera or the rest of the scene reaches further than so many times the extent
# that they were chosen for, or where all of the scene is so many times smaller.
_MOST_CAMERA = 8.0
_MOST_CONTENT = 2.0
_MOST_SHRUNK = 16.0
_LEAST_CORE = 1 / 64  # of the extent, within which a quarter of the shapes must be for their middle to be the origin


@dataclass(frozen=True, eq=False)
class Space:
    """``origin`` (3,) is the point of the world that is the shader's (0, 0, 0), ``extent`` how far in metres the scene
    extended from there when it was chosen, camera included, or the camera's target where there are planes at most.
    ``low`` and ``high`` (3,) bound what is there besides the camera, in the world, and a quarter of the things there
    are no larger than ``detail`` metres."""

    origin: Floats
    extent: float
    low: Floats
    high: Floats
    detail: float

    def serves(self, camera: Camera) -> bool:
        """Whether these coordinates are precise enough to see the scene by ``camera``."""
        low, high = np.minimum(self.low, camera.position), np.maximum(self.high, camera.position)
        reach, content = self._reach(low, high), self._reach(self.low, self.high)
        if content < 0:  # there are planes at most: what is near is what the camera looks at
            seen = float(np.linalg.norm(np.subtract(camera.position, camera.target)))
            return reach <= _MOST_CAMERA * max(self.extent, seen)
        is_near = content <= _MOST_CONTENT * self.extent and reach <= _MOST_CAMERA * self.extent
        return bool(is_near and _MOST_SHRUNK * (high - low).max() / 2 >= self.extent)

    def _reach(self, low: Floats, high: Floats) -> float:
        return float(np.maximum(high - self.origin, self.origin - low).max())


def space_of(scene: Scene, before: Space | None = None) -> Space:
    """Coordinates for ``scene``: those of ``before`` while they serve, so that an edit or a step of the camera moves
    nothing else."""
    lows, highs = boxes_of(scene)
    low, high = lows.min(axis=0, initial=np.inf), highs.max(axis=0, initial=-np.inf)
    sizes = np.linalg.norm(highs - lows, axis=1)
    detail = float(np.quantile(sizes, 0.25, method="lower")) if len(sizes) else 0.0
    if before is not None and (kept := replace(before, low=low, high=high, detail=detail)).serves(scene.camera):
        return kept
    corners = np.stack([np.minimum(low, scene.camera.position), np.maximum(high, scene.camera.position)])
    origin = _middle(np.concatenate([lows, highs])) if len(lows) else np.array(scene.camera.position, np.float64)
    seen = np.linalg.norm(np.subtract(scene.camera.target, scene.camera.position)) if not len(lows) else 0.0
    extent = float(max(np.abs(corners - origin).max(), seen, np.finfo(np.float32).tiny))
    return Space(origin, extent, low, high, detail)


def _middle(points: Floats) -> Floats:
    """Of the bounds of ``points``, (3,); or their median, where a quarter of them lies so close to it that a ground or
    a shape that is far away would take the precision from them."""
    low, high = points.min(axis=0), points.max(axis=0)
    median: Floats = np.median(points, axis=0)
    core = np.quantile(np.abs(points - median).max(axis=1), 0.25)
    return median if core < _LEAST_CORE * (high - low).max() / 2 else (low + high) / 2


def boxes_of(scene: Scene) -> tuple[Floats, Floats]:
    """Lower and upper corners (n, 3) of the boxes of everything finite, of meshes those of their parts where they are
    placed, but not of the camera and of lights, spheres that emit among them: a far sun loses nothing by its distance,
    and would take the precision from what it shines on."""
    shapes: list[Shape] = [shape for kind in SHAPES if kind != "planes" for shape in getattr(scene, kind)]
    kept = [s for s in shapes if not (isinstance(s, Sphere) and scene.materials[s.material].is_emissive)]
    low, high = bounds_of(kept)
    corners = np.concatenate([np.zeros((0, 8, 3)), *(mesh.box_corners().reshape(-1, 8, 3) for mesh in scene.meshes)])
    return np.concatenate([low, corners.min(axis=1)]), np.concatenate([high, corners.max(axis=1)])
