# SPDX-License-Identifier: MIT
"""Grids of densities: .npy of rank 3, and Mitsuba's .vol, read and written.

The latter is "VOL", a byte 3, and in little-endian 32 bits: the encoding (1: float32), the numbers of voxels along x,
y and z, that of channels, the corners of the bounding box, and the values, x the fastest (Mitsuba 3, ``gridvolume``).
"""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.images import check_regular, npy
from fragtracer.scene.medium import Density

SUFFIXES = (".npy", ".vol")
_HEADER = struct.Struct("<3sB5i6f")


def read_density(file: str | Path) -> Density:
    """Read a grid.

    Raises
    ------
    FragtracerError
        If the file is missing, damaged, or not a grid of densities.
    """
    path = Path(file)
    try:
        if path.suffix.lower() not in SUFFIXES:
            raise ValueError(f"a grid ends in {' or '.join(SUFFIXES)}")
        check_regular(path)
        data = path.read_bytes()
        return Density(npy.decode(data) if path.suffix.lower() == ".npy" else _decode(data), str(path))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FragtracerError(f"{path}: cannot read this grid: {reason}") from None


def _decode(data: bytes) -> NDArray[np.float32]:
    if len(data) < _HEADER.size or data[:3] != b"VOL":
        raise ValueError("it does not open with the header of a volume")
    _, version, encoding, x, y, z, channels, *_ = _HEADER.unpack_from(data)
    if (version, encoding, channels) != (3, 1, 1):
        raise ValueError(
            f"version {version}, encoding {encoding}, {channels} channels; only version 3 of one float32 is read"
        )
    if min(x, y, z) < 1 or 4 * x * y * z > len(data) - _HEADER.size:
        raise ValueError(f"its header says {x} x {y} x {z} voxels, more than it has")
    return np.frombuffer(data, "<f4", x * y * z, _HEADER.size).reshape(z, y, x)


def write_volume(file: Path, values: NDArray[np.floating]) -> None:
    """Write values (z, y, x, channels) as a .vol file of the unit cube."""
    z, y, x, channels = values.shape
    header = _HEADER.pack(b"VOL", 3, 1, x, y, z, channels, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    file.write_bytes(header + np.ascontiguousarray(values, "<f4").tobytes())
