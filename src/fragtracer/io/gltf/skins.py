# SPDX-License-Identifier: MIT
"""Skinned meshes in the pose of their joints (glTF 2.0, section 3.7.3)."""

from collections.abc import Mapping

import numpy as np

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.nodes import Matrix
from fragtracer.io.model import geometry
from fragtracer.scene import Geometry


class Skins:
    """The skins of one model. ``placed`` has the world matrix of each node of the scene."""

    def __init__(self, container: Container, accessors: Accessors, placed: Mapping[int, Matrix]) -> None:
        self._container, self._accessors, self._placed = container, accessors, placed

    def posed(self, skin: int, primitive: gltf.Primitive, bind: Geometry, place: str) -> Geometry | None:
        """The skinned ``bind`` geometry in world space; None if the primitive has no joints."""
        joint_accessor, weight_accessor = (primitive.attributes.get(name) for name in ("JOINTS_0", "WEIGHTS_0"))
        if joint_accessor is None or weight_accessor is None:
            return None
        matrices = self._joint_matrices(skin)
        joints = self._accessors.get(joint_accessor, f"{place}.attributes.JOINTS_0", ("VEC4",))
        weights = self._accessors.get(weight_accessor, f"{place}.attributes.WEIGHTS_0", ("VEC4",)).astype(np.float64)
        exist = joints.dtype.kind == "u" and (joints.size == 0 or joints.max() < len(matrices))
        if not (exist and len(joints) == len(weights) == len(bind.positions)):
            raise self._container.error(place, f"its JOINTS_0 and WEIGHTS_0 do not fit its vertices and skins[{skin}]")
        with np.errstate(all="ignore"):
            weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)
            blended = sum(weights[:, i, None, None] * matrices[joints[:, i]] for i in range(4))
            linear = blended[:, :, :3]
            arrays = {"positions": np.einsum("nij,nj->ni", linear, bind.positions) + blended[:, :, 3]}
            if bind.normals is not None:
                cofactors = np.stack([np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)], 1)
                arrays["normals"] = np.einsum("nij,nj->ni", cofactors, bind.normals)
            if bind.tangents is not None:
                along = np.einsum("nij,nj->ni", linear, bind.tangents[:, :3])
                arrays["tangents"] = np.column_stack([along, bind.tangents[:, 3]])
        unchanged = {"uvs": bind.uvs, "uvs_1": bind.uvs_1, "colors": bind.colors}
        return geometry(f"{self._container.path}: {place}", triangles=bind.triangles, **arrays, **unchanged)

    def _joint_matrices(self, index: int) -> Matrix:
        """(joints, 3, 4) matrices from the object space of the mesh to world space."""
        skin: gltf.Skin = self._container.item(self._container.document.skins, index, "skin")
        place = f"skins[{index}]"
        missing = [joint for joint in skin.joints if joint not in self._placed]
        if missing:
            raise self._container.error(place, f"its joint {missing[0]} is not a node of the scene")
        world = np.array([self._placed[joint] for joint in skin.joints]).reshape(-1, 4, 4)
        if skin.inverseBindMatrices is None:
            return world[:, :3]
        inverse = self._accessors.get(skin.inverseBindMatrices, f"{place}.inverseBindMatrices", ("MAT4",))
        if len(inverse) < len(world):
            raise self._container.error(place, f"it has {len(world)} joints and {len(inverse)} inverse bind matrices")
        # Matrices are column-major in the file.
        with np.errstate(all="ignore"):
            matrices: Matrix = (world @ inverse[: len(world)].reshape(-1, 4, 4).swapaxes(1, 2))[:, :3]
        return matrices
