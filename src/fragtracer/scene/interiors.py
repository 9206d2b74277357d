# SPDX-License-Identifier: MIT
"""What the dielectrics of a scene fill: where they overlap, and which of them a point lies in."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.scene.fields import Triple
from fragtracer.scene.material import Material
from fragtracer.scene.mesh import Geometry
from fragtracer.scene.shapes import Plane, Rectangle, Sphere

if TYPE_CHECKING:
    from fragtracer.scene import Scene

Floats = NDArray[np.float64]
NO_TRIANGLES = np.zeros((0, 3, 3))
_MATCHED = 1e-4  # ETA_MATCHED of bsdf/dielectric.glsl


@dataclass(frozen=True, eq=False)
class Solid:
    """What surfaces of one material bound: a sphere, the space behind a plane, or triangles (n, 3, 3) that are closed.

    ``name`` is "sphere_0", "plane_0", "mesh_0_1_2" of the second part of the third instance, or, of all flat shapes
    before a material, "flat_NAME"; ``material`` is what fills it. ``low`` and ``high`` (3,) are the corners of its
    bounding box, in metres.
    """

    name: str
    material: str
    low: Floats
    high: Floats
    shape: Sphere | Plane | None = None
    triangles: Callable[[], Floats] = lambda: NO_TRIANGLES

    def contains(self, point: ArrayLike) -> bool:
        """Whether ``point`` (3,) lies in it; of triangles, by their winding number."""
        place = np.asarray(point, np.float64)
        if isinstance(self.shape, Plane):
            return float(np.dot(self.shape.normal, place - self.shape.point)) < 0
        if isinstance(self.shape, Sphere):
            return float(np.linalg.norm(place - self.shape.center)) < self.shape.radius
        if (place < self.low).any() or (place > self.high).any():
            return False
        return abs(winding_number(self.triangles() - place)) > 0.5

    def may_meet(self, low: Floats, high: Floats, margin: float = 0.0) -> NDArray[np.bool_]:
        """Which boxes with the corners ``low`` and ``high`` (..., 3) may have points within ``margin`` metres of which
        some lie in it, (...): exactly for spheres and planes, else by its own box."""
        if isinstance(self.shape, Plane):
            normal = np.asarray(self.shape.normal) / np.linalg.norm(self.shape.normal)
            heights = (np.where(normal > 0, low, high) - self.shape.point) @ normal
            return np.asarray(heights < margin)
        if isinstance(self.shape, Sphere):
            center = np.asarray(self.shape.center)
            distances = np.linalg.norm(np.clip(center, low, high) - center, axis=-1)
            return np.asarray(distances < self.shape.radius + margin)
        return np.asarray(((low - margin < self.high) & (self.low < high + margin)).all(axis=-1))

    def may_hold(self, low: Floats, high: Floats, margin: float = 0.0) -> bool:
        """As :meth:`may_meet` of one box, but of triangles only if one may come so near, or the middle lies within."""
        if self.shape is not None or not self.may_meet(low, high, margin):
            return bool(self.may_meet(low, high, margin))
        triangles, middle, half = self.triangles(), (low + high) / 2, (high - low) / 2 + margin
        a, b, c = (triangles - middle).swapaxes(0, 1)
        normals = np.cross(b - a, c - a)
        is_near = (triangles.min(axis=1) < middle + half) & (middle - half < triangles.max(axis=1))
        is_cut = np.abs((a * normals).sum(axis=1)) < np.abs(normals) @ half
        return bool((is_near.all(axis=1) & is_cut).any()) or self.contains(middle)

    def overlaps(self, other: "Solid") -> bool:
        """Whether the two may have points in common: spheres exactly, others by their bounding boxes."""
        if isinstance(self.shape, Sphere) and isinstance(other.shape, Sphere):
            distance = np.linalg.norm(np.subtract(self.shape.center, other.shape.center))
            return float(distance) < self.shape.radius + other.shape.radius
        for plane, solid in ((self, other), (other, self)):
            if isinstance(plane.shape, Plane) and not isinstance(solid.shape, Plane):
                return bool(plane.may_meet(solid.low, solid.high))
        return bool((self.low < other.high).all() and (other.low < self.high).all())


def winding_number(triangles: Floats) -> float:
    """How often ``triangles`` (n, 3, 3) wind around the origin: 1 within a closed surface whose front is outside
    (van Oosterom and Strackee 1983, "The solid angle of a plane triangle", eq. 8)."""
    a, b, c = triangles.transpose(1, 0, 2)
    x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    base = x * y * z + (a * b).sum(axis=1) * z + (b * c).sum(axis=1) * x + (c * a).sum(axis=1) * y
    return float(np.arctan2(volume, base).sum() / (2 * np.pi))


def fillings(scene: "Scene") -> dict[str, str]:
    """What lies behind surfaces, by the name of their material: the solid that it is, or with which it is blended."""
    return {name: solid for name in scene.materials for solid in scene.blended(name) if scene.materials[solid].is_solid}


def solids(scene: "Scene") -> Iterator[Solid]:
    """What the dielectrics of ``scene`` fill. Flat shapes before one material are one solid; disks are left out, since
    none bounds anything by itself."""
    inside = fillings(scene)
    if not inside:
        return
    for i, sphere in enumerate(scene.spheres):
        if sphere.material in inside:
            low, high = map(np.asarray, sphere.bounds)
            yield Solid(f"sphere_{i}", inside[sphere.material], low, high, sphere)
    everywhere = np.full(3, np.inf)
    for i, plane in enumerate(scene.planes):
        if plane.material in inside:
            yield Solid(f"plane_{i}", inside[plane.material], -everywhere, everywhere, plane)
    for name in sorted(set(inside.values())):
        flats = [halves(shape) for shape in scene.rectangles if inside.get(shape.material) == name]
        flats += [np.array([shape.vertices]) for shape in scene.triangles if inside.get(shape.material) == name]
        if flats:
            triangles = np.concatenate(flats)
            low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
            yield Solid(f"flat_{name}", name, low, high, None, partial(np.asarray, triangles))
    for i, mesh in enumerate(scene.meshes):
        for (j, part), (k, placement) in product(enumerate(mesh.parts), enumerate(mesh.instances)):
            filling = inside.get(mesh.material_of(part))
            if filling is not None and len(part.geometry.triangles):
                matrix = placement.matrix @ np.asarray(part.matrix)
                yield _of_mesh(f"mesh_{i}_{j}_{k}", filling, matrix, part.geometry)


def _of_mesh(name: str, material: str, matrix: Floats, geometry: Geometry) -> Solid:
    def placed(points: Floats) -> Floats:
        return points @ matrix[:3, :3].T + matrix[:3, 3]

    corners = placed(np.array(list(product(*geometry.bounds.T))))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Solid(name, material, low, high, None, lambda: placed(geometry.positions)[geometry.triangles])


def halves(shape: Rectangle) -> Floats:
    """The two triangles (2, 3, 3) of a rectangle."""
    a, u, v = (np.asarray(x, np.float64) for x in (shape.corner, shape.edge_u, shape.edge_v))
    return np.array([(a, a + u, a + u + v), (a, a + u + v, a + v)])


def has_interiors(materials: dict[str, Material], found: list[Solid]) -> bool:
    """Whether paths have to know what they are inside of: something absorbs, scatters or does not refract, or solids
    may overlap."""
    inside = [materials[solid.material] for solid in found]
    absorbs = any(max(material.absorption) > 0 or material.interior is not None for material in inside)
    passes = any(abs(material.index - 1) < _MATCHED for material in inside)
    return absorbs or passes or any(True for _ in _overlapping(found))


def has_media(scene: "Scene") -> bool:
    """Whether there is a medium anywhere, or the boundary of one, which all rays pass."""
    inside = (scene.materials[solid.material] for solid in solids(scene))
    return scene.fog is not None or any(m.interior is not None or m.model == "null" for m in inside)


def passed_by_fog(scene: "Scene") -> Triple:
    """1 for each colour in which light from infinitely far away arrives, 0 where fog, which has no end, keeps it."""
    fog = scene.media[scene.fog.medium] if scene.fog else None
    if fog is None or fog.density is not None:
        return (1.0, 1.0, 1.0)
    r, g, b = (float(extinction == 0) for extinction in fog.sigma_t)
    return (r, g, b)


def _overlapping(found: list[Solid]) -> Iterator[tuple[Solid, Solid]]:
    """Pairs that may have points in common, by a sweep along x."""
    if len(found) < 2:
        return
    low, high = (np.array([getattr(solid, corner) for solid in found]) for corner in ("low", "high"))
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0])
    for place, (i, end) in enumerate(zip(order, ends, strict=True)):
        others = order[place + 1 : end]
        near = others[((low[others] < high[i]) & (low[i] < high[others])).all(axis=1)]
        yield from ((found[i], found[j]) for j in near if found[i].overlaps(found[j]))


def conflict(scene: "Scene") -> str:
    """A sentence about two dielectrics of the same priority that may overlap; empty if there are none."""
    priorities = [material.priority for material in scene.materials.values() if material.is_solid]
    if len(priorities) == len(set(priorities)):
        return ""
    for one, other in _overlapping(list(solids(scene))):
        same = scene.materials[one.material].priority == scene.materials[other.material].priority
        if one.material != other.material and same:
            return (
                f"material.{other.material}.priority: shapes of {one.material!r} and {other.material!r} may overlap, "
                f"and both have the priority {scene.materials[one.material].priority}; give the one that fills what is "
                "common to both a higher priority"
            )
    return ""
