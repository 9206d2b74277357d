# SPDX-License-Identifier: MIT
"""What photons are aimed at: bounding spheres of all that a scene holds."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import SHAPES, Geometry, Mesh, Scene, Sphere

Floats = NDArray[np.float64]

_MOST = 4096  # with more, neighbours in the scene's order share one
_HALVINGS = 2  # of a mesh: photons of different pieces come from different directions, and have lobes of their own


def targets_of(scene: Scene) -> Floats:
    """Centres and radii (n, 4) of bounding spheres, in metres. Where the radius is below 0, the surface is not all
    outside: chords then begin anywhere within."""
    # A sphere that emits may be a sun, far away: it would take the precision from what it shines on.
    dark = [s for s in scene.spheres if not scene.materials[s.material].is_emissive]
    spheres = np.array([(*s.center, s.radius) for s in dark], np.float64).reshape(-1, 4)
    boxes = [s.bounds for kind in SHAPES if kind != "planes" for s in getattr(scene, kind) if not isinstance(s, Sphere)]
    corners = [np.array(box, np.float64) for box in boxes]
    corners += [box for mesh in scene.meshes for box in _boxes_of(mesh)]
    around = np.array([_around(points) for points in _merged(corners)]).reshape(-1, 4)
    found = np.concatenate([_merged_spheres(spheres), around])
    if scene.planes and len(found):
        # A plane is infinite: what it has near the rest of the scene.
        low, high = (found[:, :3] - np.abs(found[:, 3:])).min(axis=0), (found[:, :3] + np.abs(found[:, 3:])).max(axis=0)
        found = np.concatenate([found, _around(np.stack([low, high]))[None]])
    return found


def _boxes_of(mesh: Mesh) -> Iterator[Floats]:
    """Corners (8, 3) of boxes around the pieces of ``mesh``, wherever it is placed."""
    pieces = {id(part.geometry): _pieces(part.geometry) for part in mesh.parts if len(part.geometry.triangles)}
    for matrix, part in mesh.placed():
        for low, high in pieces[id(part.geometry)]:
            yield np.array(list(product(*zip(low, high, strict=True)))) @ matrix[:3, :3].T + matrix[:3, 3]


def _pieces(geometry: Geometry) -> list[tuple[Floats, Floats]]:
    """The bounds of pieces with as many triangles each, halves of halves."""
    pieces = [geometry.positions[geometry.triangles].astype(np.float64)]
    for _ in range(_HALVINGS):
        pieces = [half for piece in pieces for half in _halves(piece)]
    return [(piece.min(axis=(0, 1)), piece.max(axis=(0, 1))) for piece in pieces]


def _halves(triangles: Floats) -> list[Floats]:
    """``triangles`` (n, 3, 3) parted where they extend most, or all of them where there is one."""
    middles = triangles.mean(axis=1)
    order = np.argpartition(middles[:, np.ptp(middles, axis=0).argmax()], len(middles) // 2)
    return [triangles[some] for some in np.split(order, [len(order) // 2]) if len(some)]


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
