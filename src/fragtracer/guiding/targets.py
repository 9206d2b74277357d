# SPDX-License-Identifier: MIT
"""What photons are aimed at: bounding spheres of all that a scene holds."""

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import SHAPES, Scene, Sphere

Floats = NDArray[np.float64]

_MOST = 4096  # with more, neighbours in the scene's order share one


def targets_of(scene: Scene) -> Floats:
    """Centres and radii (n, 4) of bounding spheres, in metres. Where the radius is below 0, the surface is not all
    outside: chords then begin anywhere within."""
    # A sphere that emits may be a sun, far away: it would take the precision from what it shines on.
    dark = [s for s in scene.spheres if not scene.materials[s.material].is_emissive]
    spheres = np.array([(*s.center, s.radius) for s in dark], np.float64).reshape(-1, 4)
    boxes = [s.bounds for kind in SHAPES if kind != "planes" for s in getattr(scene, kind) if not isinstance(s, Sphere)]
    corners = [np.array(box, np.float64) for box in boxes]
    corners += [part for mesh in scene.meshes for part in mesh.box_corners().reshape(-1, 8, 3)]
    around = np.array([_around(points) for points in _merged(corners)]).reshape(-1, 4)
    found = np.concatenate([_merged_spheres(spheres), around])
    if scene.planes and len(found):
        # A plane is infinite: what it has near the rest of the scene.
        low, high = (found[:, :3] - np.abs(found[:, 3:])).min(axis=0), (found[:, :3] + np.abs(found[:, 3:])).max(axis=0)
        found = np.concatenate([found, _around(np.stack([low, high]))[None]])
    return found


def _around(points: Floats) -> Floats:
    low, high = points.min(axis=0), points.max(axis=0)
    return np.append((low + high) / 2, -max(float(np.linalg.norm(high - low)) / 2, 1e-30))


def _merged(corners: list[Floats]) -> list[Floats]:
    share = -(-len(corners) // _MOST)
    return [np.concatenate(corners[i : i + share]) for i in range(0, len(corners), max(share, 1))]


def _merged_spheres(spheres: Floats) -> Floats:
    if len(spheres) <= _MOST:
        return spheres
    ends = np.concatenate([spheres[:, :3] - spheres[:, 3:], spheres[:, :3] + spheres[:, 3:]], axis=1).reshape(-1, 2, 3)
    return np.array([_around(points) for points in _merged(list(ends))])
