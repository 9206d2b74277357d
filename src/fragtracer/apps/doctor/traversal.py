# SPDX-License-Identifier: MIT
"""Of many shapes rays meet the nearest, and there the texel that lies there: as float64 finds them, one by one."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.doctor import Finding
from fragtracer.apps.doctor.intersections import sphere_distance
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Geometry, Image, Material, Mesh, Part, Scene, Sphere, Texture

Floats = NDArray[np.float64]

_COUNT = 400  # spheres, and triangles
_SIDE = 64  # texels
_CAMERA = Camera(position=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), fov_degrees=45.0)
_ROOM = 20.0  # radius of a sphere around all, which rays meet that meet nothing else
_GREY = 0.5


class _Rays:
    """Those from the camera through ``points`` (n, 3), and what is the nearest of the shapes that were added."""

    def __init__(self, points: Floats) -> None:
        self.origin = np.array(_CAMERA.position)
        self.length = np.linalg.norm(points - self.origin, axis=1)
        self.direction = (points - self.origin) / self.length[:, None]
        self.distance = np.full(len(points), np.inf)
        self.albedo = np.full((len(points), 3), _GREY)
        self.unclear = np.zeros(len(points), bool)  # where rounding may decide what is met

    def add_sphere(self, center: Floats, radius: float) -> None:
        distance, is_grazing = sphere_distance(self.origin, self.direction, center, radius)
        self._add(distance, np.full(3, _GREY))
        self.unclear |= is_grazing

    def add_triangle(self, corners: Floats, uvs: Floats, texels: Floats) -> None:
        """Möller and Trumbore 1997, "Fast, minimum storage ray/triangle intersection"."""
        u, v = corners[1:] - corners[0]
        offset = self.origin - corners[0]
        scale = np.cross(self.direction, v) @ u
        b = np.cross(self.direction, v) @ offset / scale
        c = self.direction @ np.cross(offset, u) / scale
        inside = np.minimum(np.minimum(b, c), 1 - b - c)
        distance = np.cross(offset, u) @ v / scale
        is_met = (inside > 0) & (distance > 0)
        place = np.where(is_met[:, None], np.stack([1 - b - c, b, c], axis=1) @ uvs * _SIDE, 0.5)
        x, y = place.astype(int).T
        self._add(np.where(is_met, distance, np.inf), texels[y, x])
        self.unclear |= (np.abs(inside) < 2e-3) | (np.abs(place - np.round(place)).min(axis=1) < 0.02)

    def _add(self, distance: Floats, albedo: Floats) -> None:
        is_nearer = distance < self.distance
        self.albedo = np.where(is_nearer[:, None], albedo, self.albedo)
        self.distance = np.minimum(self.distance, distance)


def findings(context: Any) -> Iterator[Finding]:
    rng = np.random.default_rng(8)
    centers, radii = rng.uniform(-2, 2, (_COUNT, 3)), np.exp(rng.uniform(-4, -1, _COUNT))
    corners = rng.uniform(-2, 2, (_COUNT, 1, 3)) + 0.3 * rng.normal(size=(_COUNT, 3, 3))
    uvs, texels = rng.random((_COUNT, 3, 2)), rng.integers(0, 256, (_SIDE, _SIDE, 3), np.uint8)
    picture = Texture(Image(texels, "linear"), filter="nearest")
    triangles = np.arange(3 * _COUNT).reshape(-1, 3)
    body = Geometry(corners.reshape(-1, 3), triangles, uvs=uvs.reshape(-1, 2))
    scene = Scene(
        camera=_CAMERA,
        materials={
            "grey": Material(albedo=(_GREY, _GREY, _GREY), specular=0.0),
            "picture": Material(albedo=(1.0, 1.0, 1.0), specular=0.0, albedo_texture=picture),
        },
        spheres=(
            Sphere((0.0, 0.0, 0.0), _ROOM, "grey"),
            *(Sphere((x, y, z), radius, "grey") for (x, y, z), radius in zip(centers, radii, strict=True)),
        ),
        meshes=(Mesh((Part(body, "picture"),)),),
        ambient=Ambient((1.0, 1.0, 1.0)),
    )
    with Renderer(scene, (96, 72), context) as renderer:
        renderer.sample(1)
        points, albedo = (renderer.aov(name).reshape(-1, 3).astype(np.float64) for name in ("position", "albedo"))
    rays = _Rays(points)
    rays.add_sphere(np.zeros(3), _ROOM)
    for center, radius in zip(centers, radii, strict=True):
        rays.add_sphere(center, radius)
    for abc, uv in zip(corners, uvs, strict=True):
        rays.add_triangle(abc, uv, texels / 255)
    wrong_shape = np.abs(rays.distance - rays.length) > 1e-4 * rays.length
    wrong_albedo = np.abs(rays.albedo - albedo).max(axis=1) > 1e-3
    for subject, wrong in (("nearest shapes", wrong_shape), ("texels", wrong_albedo & ~wrong_shape)):
        count, certain = int((wrong & ~rays.unclear).sum()), int((~rays.unclear).sum())
        yield Finding("traversal", subject, count == 0, f"{count} of {certain} rays wrong")
