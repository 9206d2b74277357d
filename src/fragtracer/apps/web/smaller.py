# SPDX-License-Identifier: MIT
"""Scenes made smaller in bytes: images with fewer texels, vertices on a coarser grid."""

from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.packing.atlas import smaller_image
from fragtracer.scene import Geometry, Material, Mesh, Scene


def with_smaller_images(scene: Scene, halvings: int) -> tuple[Scene, int]:
    """``scene`` with images whose sides are halved so many times, that of the environment as long as they are even, and
    the longest side that is left; 0 for none."""
    longest = 0

    def reduced(material: Material) -> Material:
        nonlocal longest
        changes: dict[str, Any] = {}
        for name, texture in material.textures.items():
            image = smaller_image(texture.image, 0.5**halvings)
            longest = max(longest, *image.pixels.shape[:2])
            changes[f"{name}_texture"] = replace(texture, image=image)
        return replace(material, **changes)

    environment = scene.environment
    if environment is not None and environment.image is not None:
        image = environment.image.reduced(environment.image.pixels.shape[1] >> halvings)
        longest = max(longest, *image.pixels.shape[:2])
        environment = replace(environment, image=image)
    materials = {name: reduced(m) for name, m in scene.materials.items()}
    return replace(scene, materials=materials, environment=environment), longest


def with_quantised_meshes(scene: Scene, bits: int) -> Scene:
    """``scene`` with the vertices of each mesh on a grid of 2^bits steps along the longest side of its smallest part:
    one grid, so that parts which meet still do.

    A step is a power of two, so that numbers end in zeros; normals and texture coordinates lose as many digits.
    """
    return replace(scene, meshes=tuple(_quantised(mesh, bits) for mesh in scene.meshes))


def _quantised(mesh: Mesh, bits: int) -> Mesh:
    scales: dict[Geometry, float] = {}  # the largest, so that parts with the same geometry still share it
    least = np.inf
    for part in mesh.parts:
        scale = float(np.linalg.norm(np.asarray(part.matrix)[:3, :3], 2))
        size = scale * _longest_side(part.geometry)
        if size > 0:
            least = min(least, size)
            scales[part.geometry] = max(scale, scales.get(part.geometry, 0.0))
    geometries = {
        geometry: _on_grid(geometry, 2.0 ** (np.ceil(np.log2(least / scale)) - bits), 2.0**-bits)
        for geometry, scale in scales.items()
    }
    parts = [replace(part, geometry=geometries.get(part.geometry, part.geometry)) for part in mesh.parts]
    return replace(mesh, parts=tuple(parts))


def _longest_side(geometry: Geometry) -> float:
    return float(np.ptp(geometry.positions, axis=0).max()) if len(geometry.positions) else 0.0


def _on_grid(geometry: Geometry, step: float, unit: float) -> Geometry:
    """Positions are multiples of ``step``, normals and texture coordinates of ``unit``."""
    normals, uvs = geometry.normals, geometry.uvs
    return Geometry(
        np.round(geometry.positions / step) * step,
        geometry.triangles,
        None if normals is None else np.round(normals / unit) * unit,
        None if uvs is None else np.round(uvs / unit) * unit,
        geometry.uvs_1,
        geometry.tangents,
        geometry.colors,
    )
