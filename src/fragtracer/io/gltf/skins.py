# SPDX-License-Identifier: MIT
"""Meshes that bones carry, in the pose that the nodes give them (glTF 2.0, section 3.7.3)."""

from collections.abc import Mapping

import numpy as np

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.nodes import Matrix
from fragtracer.io.model import geometry
from fragtracer.scene import Geometry


class Skins:
    """The skins of one model. ``placed`` has the matrix to the world of each node of the scene."""

    def __init__(self, container: Container, accessors: Accessors, placed: Mapping[int, Matrix]) -> None:
        self._container, self._accessors, self._placed = container, accessors, placed

    def posed(self, skin: int, primitive: gltf.Primitive, flat: Geometry, place: str) -> Geometry | None:
        """``flat`` where the bones put it, in the world; None where no bones are named for its vertices."""
        joints, weights = primitive.attributes.get("JOINTS_0"), primitive.attributes.get("WEIGHTS_0")
        if joints is None or weights is None:
            return None
        bones = self._bones(skin)
        numbers = self._accessors.get(joints, f"{place}.attributes.JOINTS_0", ("VEC4",))
        shares = self._accessors.get(weights, f"{place}.attributes.WEIGHTS_0", ("VEC4",)).astype(np.float64)
        named = numbers.dtype.kind == "u" and (numbers.size == 0 or numbers.max() < len(bones))
        if not (named and len(numbers) == len(shares) == len(flat.positions)):
            raise self._container.error(place, f"its JOINTS_0 and WEIGHTS_0 do not fit its vertices and skins[{skin}]")
        with np.errstate(all="ignore"):
            shares = shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-30)
            blended = sum(shares[:, i, None, None] * bones[numbers[:, i]] for i in range(4))
            linear = blended[:, :, :3]
            arrays = {"positions": np.einsum("nij,nj->ni", linear, flat.positions) + blended[:, :, 3]}
            if flat.normals is not None:
                cofactors = np.stack([np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)], 1)
                arrays["normals"] = np.einsum("nij,nj->ni", cofactors, flat.normals)
            if flat.tangents is not None:
                turned = np.einsum("nij,nj->ni", linear, flat.tangents[:, :3])
                arrays["tangents"] = np.column_stack([turned, flat.tangents[:, 3]])
        kept = {"uvs": flat.uvs, "uvs_1": flat.uvs_1, "colors": flat.colors}
        return geometry(f"{self._container.path}: {place}", triangles=flat.triangles, **arrays, **kept)

    def _bones(self, index: int) -> Matrix:
        """(bones, 3, 4) from the space of the mesh to the world."""
        skin: gltf.Skin = self._container.item(self._container.document.skins, index, "skin")
        place = f"skins[{index}]"
        missing = [joint for joint in skin.joints if joint not in self._placed]
        if missing:
            raise self._container.error(place, f"its joint {missing[0]} is no node of the scene")
        world = np.array([self._placed[joint] for joint in skin.joints]).reshape(-1, 4, 4)
        if skin.inverseBindMatrices is None:
            return world[:, :3]
        inverse = self._accessors.get(skin.inverseBindMatrices, f"{place}.inverseBindMatrices", ("MAT4",))
        if len(inverse) < len(world):
            raise self._container.error(place, f"it has {len(world)} joints and {len(inverse)} inverse bind matrices")
        # The columns of a matrix follow each other in the file.
        with np.errstate(all="ignore"):
            bones: Matrix = (world @ inverse[: len(world)].reshape(-1, 4, 4).swapaxes(1, 2))[:, :3]
        return bones
