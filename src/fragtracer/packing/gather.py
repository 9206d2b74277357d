# SPDX-License-Identifier: MIT
"""Many single triangles, made a mesh."""

from dataclasses import replace

import numpy as np

from fragtracer.scene import Geometry, Material, Mesh, Part, Scene, Triangle

# With more single triangles than these, a tree beats trying all of them.
MOST_TRIANGLES = 64


def gather_triangles(scene: Scene) -> Scene:
    """The scene, its single triangles a mesh for each material where there are many.

    Those stay single whose material says what holds for meshes alone: textures, sides, opacity.
    """
    if len(scene.triangles) <= MOST_TRIANGLES:
        return scene
    single: list[Triangle] = []
    gathered: dict[str, list[Triangle]] = {}
    for triangle in scene.triangles:
        is_plain = _is_plain(scene.materials[triangle.material])
        (gathered.setdefault(triangle.material, []) if is_plain else single).append(triangle)
    return replace(scene, triangles=tuple(single), meshes=(*scene.meshes, *map(_mesh, gathered.values())))


def _is_plain(material: Material) -> bool:
    return not material.textures and material.double_sided and material.alpha_mode == "opaque"


def _mesh(triangles: list[Triangle]) -> Mesh:
    positions = np.reshape([triangle.vertices for triangle in triangles], (-1, 3))
    geometry = Geometry(positions, np.arange(len(positions)).reshape(-1, 3))
    return Mesh((Part(geometry, triangles[0].material),))
