# SPDX-License-Identifier: MIT
"""Scenes made smaller in bytes: images with fewer texels, vertices on a coarser grid."""

from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.packing.atlas import smaller_image
from fragtracer.scene import Geometry, Material, Mesh, Scene
from fragtracer.scene.mesh import Part


def with_smaller_images(scene: Scene, halvings: int) -> tuple[Scene, int]:
    """``scene`` with images whose sides are halved so many times, and the longest side that is left; 0 for none."""
    longest = 0

    def reduced(material: Material) -> Material:
        nonlocal longest
        changes: dict[str, Any] = {}
        for name, texture in material.textures.items():
            image = smaller_image(texture.image, 0.5**halvings)
            longest = max(longest, *image.pixels.shape[:2])
            changes[f"{name}_texture"] = replace(texture, image=image)
        return replace(material, **changes)

    return replace(scene, materials={name: reduced(m) for name, m in scene.materials.items()}), longest


def with_quantised_meshes(scene: Scene, bits: int) -> Scene:
    """``scene`` with the vertices of each mesh on a grid of 2^bits steps along its longest side.

    A step is a power of two, so that numbers end in zeros; normals and texture coordinates lose as many digits.
    """

    def of_part(part: Part) -> Part:
        geometry = part.geometry
        size = float(np.ptp(geometry.positions, axis=0).max()) if len(geometry.positions) else 0.0
        if size == 0:
            return part
        step = 2.0 ** (np.ceil(np.log2(size)) - bits)
        unit = 2.0**-bits
        normals, uvs = geometry.normals, geometry.uvs
        return replace(
            part,
            geometry=Geometry(
                np.round(geometry.positions / step) * step,
                geometry.triangles,
                None if normals is None else np.round(normals / unit) * unit,
                None if uvs is None else np.round(uvs / unit) * unit,
                geometry.uvs_1,
                geometry.tangents,
                geometry.colors,
            ),
        )

    def of_mesh(mesh: Mesh) -> Mesh:
        return replace(mesh, parts=tuple(map(of_part, mesh.parts)))

    return replace(scene, meshes=tuple(map(of_mesh, scene.meshes)))
