# SPDX-License-Identifier: MIT
"""Buffer views that meshoptimizer has compressed (EXT_meshopt_compression and KHR_meshopt_compression)."""

from importlib import import_module
from types import ModuleType

from fragtracer.io.gltf import document as gltf

EXTENSIONS = ("KHR_meshopt_compression", "EXT_meshopt_compression")


def is_installed() -> bool:
    """Whether there is something to decompress with."""
    return _meshopt() is not None


def decompress(data: memoryview, view: gltf.Meshopt) -> bytes:
    """What a compressed ``view`` holds, ``count`` elements of ``byteStride`` bytes, by its compressed ``data``.

    Raises ValueError, with what is wrong, if meshopt is not installed or the data are damaged.
    """
    meshopt = _meshopt()
    if meshopt is None:
        raise ValueError("this model is compressed; pip install 'fragtracer[meshopt]'")
    kind = None if view.filter == "NONE" else view.filter
    try:
        found = meshopt.decode_gltf_buffer(bytes(data), view.count, view.byteStride, view.mode, kind)
    except (ValueError, MemoryError) as error:
        raise ValueError(f"its data are damaged, or no {view.count} {view.mode} of {view.byteStride} bytes") from error
    return bytes(found)


def _meshopt() -> ModuleType | None:
    try:
        return import_module("meshopt")
    except ImportError:
        return None
