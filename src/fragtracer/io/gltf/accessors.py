# SPDX-License-Identifier: MIT
"""Arrays of a glTF model (glTF 2.0, section 3.6.2)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.gltf.container import Container

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MOST_ZEROS = 2**24  # elements of an accessor without a buffer view
_MOST_BYTES = 2**32  # of all arrays that are not views of a buffer: many accessors can refer to the same bytes


class Accessors:
    """The accessors of one model, each read once, as views of the buffers where possible."""

    def __init__(self, container: Container) -> None:
        self._container = container
        self._read: dict[int, NDArray[Any]] = {}
        self._bytes = 0

    def get(self, index: int, place: str, types: tuple[str, ...]) -> NDArray[Any]:
        """(count, width) numbers, in the type of the file, or as fractions where it says that they are normalized.

        Raises SceneError where the accessor does not exist, is of another type than ``types``, or leaves its buffer.
        """
        accessor = self._container.item(self._container.document.accessors, index, place)
        if accessor.type not in types or accessor.type not in _WIDTHS:
            raise self._container.error(place, f"must be an accessor of type {' or '.join(types)}, not {accessor.type}")
        if index not in self._read:
            array = self._dense(index, accessor)
            if accessor.sparse is not None:
                array = self._sparse(index, accessor, array)
            array = _fractions(array) if accessor.normalized else array
            self._keep(index, array, place)
        return self._read[index]

    def supply(self, index: int, values: NDArray[Any], place: str) -> None:
        """Let ``values`` (count, width), which were found elsewhere, be the numbers of an accessor without data.

        Raises SceneError where they are of another number, type or width than it says.
        """
        accessor = self._container.item(self._container.document.accessors, index, place)
        dtype, shape = np.dtype(_TYPES[accessor.componentType]), (accessor.count, _WIDTHS.get(accessor.type, 0))
        with np.errstate(invalid="ignore"):
            converted = values.astype(dtype)
        if values.shape != shape or (dtype.kind != "f" and (converted != values).any()):
            found = f"{values.shape} of type {values.dtype}"
            raise self._container.error(place, f"accessors[{index}] wants {shape} numbers of type {dtype}, not {found}")
        self._keep(index, _fractions(converted) if accessor.normalized else converted, place)

    def _keep(self, index: int, array: NDArray[Any], place: str) -> None:
        self._bytes += array.nbytes if array.flags.owndata else 0
        if self._bytes > _MOST_BYTES:
            raise self._container.error(place, f"with it all arrays take more than {_MOST_BYTES} bytes")
        self._read[index] = array

    def _dense(self, index: int, accessor: Any) -> NDArray[Any]:
        dtype, width = np.dtype(_TYPES[accessor.componentType]), _WIDTHS[accessor.type]
        if accessor.bufferView is not None:
            stride = self._container.item(
                self._container.document.bufferViews, accessor.bufferView, f"accessors[{index}].bufferView"
            ).byteStride
            return self._slice(
                f"accessors[{index}]", accessor.bufferView, accessor.byteOffset, accessor.count, dtype, width, stride
            )
        if accessor.count > _MOST_ZEROS:
            raise self._container.error(f"accessors[{index}]", f"claims {accessor.count} elements, but has no data")
        return np.zeros((accessor.count, width), dtype)

    def _sparse(self, index: int, accessor: Any, array: NDArray[Any]) -> NDArray[Any]:
        sparse, place = accessor.sparse, f"accessors[{index}].sparse"
        kind = np.dtype(_TYPES[sparse.indices.componentType])
        indices, values = sparse.indices, sparse.values
        rows = self._slice(f"{place}.indices", indices.bufferView, indices.byteOffset, sparse.count, kind, 1, None)
        if rows.size and rows.max() >= len(array):
            raise self._container.error(place, f"there is no element {rows.max()}, only {len(array)} of them")
        replaced = array.copy()
        replaced[rows[:, 0]] = self._slice(
            f"{place}.values", values.bufferView, values.byteOffset, sparse.count, array.dtype, array.shape[1], None
        )
        return replaced

    def _slice(
        self, place: str, view: int, offset: int, count: int, dtype: np.dtype[Any], width: int, stride: int | None
    ) -> NDArray[Any]:
        data = self._container.view(view, f"{place}.bufferView")
        size = dtype.itemsize * width
        stride = stride or size
        if stride < size:
            raise self._container.error(place, f"its elements of {size} bytes overlap, {stride} bytes apart")
        if count and offset + stride * (count - 1) + size > len(data):
            raise self._container.error(place, f"{count} elements end behind the buffer view of {len(data)} bytes")
        if not count:
            return np.zeros((0, width), dtype)
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))


def _fractions(array: NDArray[Any]) -> NDArray[Any]:
    """Integers that stand for numbers up to 1; floats are what they are."""
    if array.dtype.kind == "f":
        return array
    return np.maximum(array / np.float32(np.iinfo(array.dtype).max), np.float32(-1))
