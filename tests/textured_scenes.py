# SPDX-License-Identifier: MIT
"""Scenes of textured rectangles whose pictures are known."""

from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.scene import Ambient, Camera, Geometry, Image, Light, Material, Mesh, Part, Scene, Texture


def quad(
    corner: Any = (-1.0, -1.0, 0.0), edge_u: Any = (2.0, 0.0, 0.0), edge_v: Any = (0.0, 2.0, 0.0), **attributes: Any
) -> Geometry:
    """Two triangles whose front is along edge_u x edge_v, the image upright along edge_v."""
    p, u, v = (np.asarray(x, float) for x in (corner, edge_u, edge_v))
    attributes.setdefault("uvs", [(0, 1), (1, 1), (1, 0), (0, 0)])
    return Geometry([p, p + u, p + u + v, p + v], [(0, 1, 2), (0, 2, 3)], **attributes)


def mesh(geometry: Geometry, material: str) -> Mesh:
    return Mesh((Part(geometry, material),))


def facing(materials: dict[str, Material], *meshes: Mesh, ambient: float = 1.0, **fields: Any) -> Scene:
    """A scene looked at along -z so that [-1, 1]² of the plane z = 0 fills the picture."""
    camera = Camera((0.0, 0.0, 100.0), (0.0, 0.0, 0.0), fov_degrees=float(2 * np.degrees(np.arctan(0.01))))
    return Scene(camera, materials, meshes=meshes, ambient=Ambient(ambient), **fields)


def texture(pixels: Any, color_space: Any = "linear", **fields: Any) -> Texture:
    return Texture(Image(np.asarray(pixels), color_space), filter="nearest", **fields)


def under_sheets(sheets: int, light: Light | None, opacity: float = 0.3, **fields: Any) -> Scene:
    """A Lambert floor at z = 0 that sees the light through sheets the camera does not."""
    materials = {
        "floor": Material(albedo=0.5, specular=0.0),
        "black": Material(albedo=0.0, specular=0.0, opacity=opacity, alpha_mode="blend"),
    }
    stack = [mesh(quad((1.0 + 0.1 * i, -20.0, 0.0), (0, 40, 0), (0, 0, 40)), "black") for i in range(sheets)]
    scene = facing(materials, mesh(quad(), "floor"), *stack, ambient=0.0, lights=(light,) if light else (), **fields)
    return replace(scene, camera=replace(scene.camera, fov_degrees=0.1))
