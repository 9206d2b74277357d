# SPDX-License-Identifier: MIT
"""Primitives of glTF meshes (section 3.7.2) to geometry of the scene model."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.draco import decompress
from fragtracer.io.model import geometry
from fragtracer.io.strips import fan_triangles, strip_triangles
from fragtracer.scene import Geometry

POINTS_AND_LINES = "points and lines"
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MOST_TRIANGLES = 2**25  # a small file can refer to the same triangles many times
# Attribute, its accessor types, and its name in the scene model.
_ATTRIBUTES = (
    ("NORMAL", ("VEC3",), "normals"),
    ("TANGENT", ("VEC4",), "tangents"),
    ("TEXCOORD_0", ("VEC2",), "uvs"),
    ("TEXCOORD_1", ("VEC2",), "uvs_1"),
    ("COLOR_0", ("VEC3", "VEC4"), "colors"),
)
_MORPHED = {"POSITION": "positions", "NORMAL": "normals", "TANGENT": "tangents"}
_KNOWN = {"POSITION", "TEXCOORD_0", "TEXCOORD_1", "NORMAL", "TANGENT", "COLOR_0", "JOINTS_0", "WEIGHTS_0"}


class Primitives:
    """The primitives of one model, each read once however many nodes refer to it, and kept for the next pose."""

    def __init__(self, container: Container, notes: list[str]) -> None:
        self._container, self._notes = container, notes
        self.accessors = Accessors(container)
        self._made: dict[Any, Geometry] = {}
        self._before: dict[Any, Geometry] = {}  # of the last pose
        self._compressed: dict[str, NDArray[np.int64] | None] = {}  # by the place of the primitive
        self._triangles = 0

    def begin_pose(self) -> None:
        """Forget what the last pose did not have."""
        self._before, self._made, self._triangles = self._made, {}, 0

    def get(self, primitive: gltf.Primitive, weights: Sequence[float], place: str) -> Geometry | None:
        """The triangles of a primitive whose morph targets have ``weights``, 0 where there are none; None if it has no
        triangles, with a note if it is of points or lines."""
        if primitive.mode < _TRIANGLES:
            self._notes.append(POINTS_AND_LINES)
            return None
        if "POSITION" not in primitive.attributes:
            raise self._container.error(place, "has no POSITION")
        self._notes += sorted(primitive.attributes.keys() - _KNOWN)
        targets = [(target, weight) for target, weight in zip(primitive.targets, weights, strict=False) if weight]
        morphed = tuple((*sorted(target.items()), weight) for target, weight in targets)
        key = primitive.mode, primitive.indices, *sorted(primitive.attributes.items()), morphed
        if key not in self._made:
            made = self._made[key] = self._before.get(key) or self._make(primitive, targets, place)
            self._triangles += len(made.triangles)
            if self._triangles > _MOST_TRIANGLES:
                raise self._container.error(place, f"with it the model has more than {_MOST_TRIANGLES} triangles")
        return self._made[key] if len(self._made[key].triangles) else None

    def _make(
        self, primitive: gltf.Primitive, targets: Sequence[tuple[Mapping[str, int], float]], place: str
    ) -> Geometry:
        if place not in self._compressed:
            self._compressed[place] = decompress(self._container, self.accessors, primitive, place)
        compressed = self._compressed[place]
        where = f"{place}.attributes"
        position = primitive.attributes["POSITION"]
        arrays: dict[str, NDArray[Any]] = {"positions": self.accessors.get(position, f"{where}.POSITION", ("VEC3",))}
        for name, types, key in _ATTRIBUTES:
            if name in primitive.attributes:
                arrays[key] = self.accessors.get(primitive.attributes[name], f"{where}.{name}", types)
        for target, weight in targets:
            self._morph(arrays, target, weight, f"{place}.targets")
        if "colors" in arrays and arrays["colors"].dtype.kind == "u":  # not marked as normalized, which they must be
            arrays["colors"] = arrays["colors"] / np.float32(np.iinfo(arrays["colors"].dtype).max)
        if "normals" not in arrays:
            arrays.pop("tangents", None)
        if compressed is not None:
            indices = compressed
        elif primitive.indices is None:
            indices = np.arange(len(arrays["positions"]), dtype=np.int64)
        else:
            found = self.accessors.get(primitive.indices, f"{place}.indices", ("SCALAR",))
            if found.dtype.kind != "u":
                raise self._container.error(f"{place}.indices", "must be whole numbers without a sign")
            indices = found[:, 0].astype(np.int64)
        triangles = _triangles(indices, primitive.mode if compressed is None else _TRIANGLES)
        if "JOINTS_0" not in primitive.attributes:
            arrays, triangles = _used(arrays, triangles)
        copies = {name: array.copy() for name, array in arrays.items()}  # views would keep the file in memory
        return geometry(f"{self._container.path}: {place}", triangles=triangles, **copies)

    def _morph(self, arrays: dict[str, NDArray[Any]], target: Mapping[str, int], weight: float, place: str) -> None:
        """Move vertices, normals and tangents by a morph target (glTF 2.0, section 3.7.2.2)."""
        self._notes += sorted(f"{name} of morph targets" for name in target.keys() - _MORPHED.keys())
        for name, key in _MORPHED.items():
            if name in target and key in arrays:
                by = self.accessors.get(target[name], f"{place}.{name}", ("VEC3",))
                moved = arrays[key].astype(np.float64)
                if len(by) != len(moved):
                    raise self._container.error(f"{place}.{name}", f"has {len(by)} rows for {len(moved)} vertices")
                with np.errstate(all="ignore"):  # what is not finite then is refused
                    moved[:, :3] += weight * by.astype(np.float64)
                arrays[key] = moved


def _used(
    arrays: dict[str, NDArray[Any]], triangles: NDArray[np.int64]
) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """The arrays without unused vertices: many primitives may share one long array."""
    count = len(arrays["positions"])
    if not triangles.size or triangles.max() >= count or any(len(array) != count for array in arrays.values()):
        return arrays, triangles
    is_used = np.zeros(count, bool)
    is_used[triangles] = True
    if is_used.all():
        return arrays, triangles
    numbers = np.cumsum(is_used) - 1
    return {name: array[is_used] for name, array in arrays.items()}, numbers[triangles]


def _triangles(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    if mode == _STRIP:
        return strip_triangles([indices])
    if mode == _FAN:
        return fan_triangles(indices)
    return indices[: len(indices) // 3 * 3].reshape(-1, 3)
