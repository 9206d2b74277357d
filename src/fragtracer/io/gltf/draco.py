# SPDX-License-Identifier: MIT
"""Primitives whose arrays Google's Draco has compressed (KHR_draco_mesh_compression), read by DracoPy."""

from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container

EXTENSION = "KHR_draco_mesh_compression"


def decompress(
    container: Container, accessors: Accessors, primitive: gltf.Primitive, place: str
) -> NDArray[np.int64] | None:
    """The vertex numbers of the triangles of a compressed primitive, (3 n,), whose other arrays are what its
    ``accessors`` give from now on; None if it is not compressed, or is there uncompressed as well.

    Raises SceneError if DracoPy is not installed, or the data are damaged.
    """
    found = container.extension(gltf.Draco, primitive, EXTENSION, place)
    if found is None or _is_there(container, primitive):
        return None
    where = f"{place}.extensions.{EXTENSION}"
    draco, data = _draco(container, where), bytes(container.view(found.bufferView, f"{where}.bufferView"))
    try:
        mesh = draco.decode(data)
    except (draco.FileTypeException, ValueError, MemoryError) as error:
        raise container.error(where, "its data are damaged, or no mesh") from error
    if getattr(mesh, "faces", None) is None:
        raise container.error(where, "its data are points, not triangles")
    arrays = {array["unique_id"]: array["data"] for array in mesh.attributes}
    for name, number in found.attributes.items():
        if number not in arrays:
            raise container.error(f"{where}.attributes.{name}", f"there is no array {number} in its data")
        if name in primitive.attributes:
            accessors.supply(primitive.attributes[name], arrays[number], f"{place}.attributes.{name}")
    return np.asarray(mesh.faces, np.int64).ravel()


def _is_there(container: Container, primitive: gltf.Primitive) -> bool:
    positions, accessors = primitive.attributes.get("POSITION"), container.document.accessors
    return positions is not None and positions < len(accessors) and accessors[positions].bufferView is not None


def _draco(container: Container, place: str) -> ModuleType:
    try:
        import DracoPy
    except ImportError as error:
        raise container.error(place, "this model is compressed; pip install 'fragtracer[draco]'") from error
    module: ModuleType = DracoPy
    return module
