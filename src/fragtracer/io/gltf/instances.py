# SPDX-License-Identifier: MIT
"""Nodes that place their mesh many times (EXT_mesh_gpu_instancing)."""

import numpy as np

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.nodes import Matrix, local_matrices
from fragtracer.scene.fields import LARGEST

EXTENSION = "EXT_mesh_gpu_instancing"
_MOST = 2**20  # places of a node
# The default of each attribute, and its accessor type.
_ATTRIBUTES = {
    "TRANSLATION": ((0.0, 0.0, 0.0), "VEC3"),
    "ROTATION": ((0.0, 0.0, 0.0, 1.0), "VEC4"),
    "SCALE": ((1.0, 1.0, 1.0), "VEC3"),
}


def instance_matrices(
    container: Container, accessors: Accessors, node: gltf.Node, matrix: Matrix, place: str
) -> list[Matrix]:
    """The world matrices, (4, 4), of all places of the mesh of ``node``, whose own is ``matrix``.

    Raises SceneError where the attributes of the places are not of one number, or not finite.
    """
    found = container.extension(gltf.Instancing, node, EXTENSION, place)
    if found is None:
        return [matrix]
    where = f"{place}.extensions.{EXTENSION}.attributes"
    arrays = {}
    for name, (_, kind) in _ATTRIBUTES.items():
        if (index := getattr(found.attributes, name)) is not None:
            arrays[name] = accessors.get(index, f"{where}.{name}", (kind,)).astype(np.float64)
    counts = {len(array) for array in arrays.values()}
    if len(counts) != 1:
        raise container.error(where, "must have TRANSLATION, ROTATION or SCALE, and as many of each")
    (count,) = counts
    if count > _MOST:
        raise container.error(where, f"there are {count} places, more than {_MOST}")
    columns = (arrays.get(name, np.tile(default, (count, 1))) for name, (default, _) in _ATTRIBUTES.items())
    with np.errstate(all="ignore"):
        matrices = matrix @ local_matrices(*columns)
    if not (np.abs(matrices) <= LARGEST).all():
        raise container.error(where, "one of the places is not finite, or overflows")
    return list(matrices)
