# SPDX-License-Identifier: MIT
"""Arrays in the .npy format, with a header that is not trusted: numpy.load allocates whatever it claims."""

import io
import math
import tokenize
from typing import Any

import numpy as np
from numpy.typing import NDArray


def decode(data: bytes) -> NDArray[Any]:
    """The array in the bytes of a .npy file, read-only.

    Raises ``ValueError`` if they are damaged, too few, or Python objects.
    """
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = header(file)
    except (ValueError, SyntaxError, tokenize.TokenError, TypeError, RecursionError, MemoryError) as error:
        raise ValueError("it does not open with the header of an array") from error
    if dtype.hasobject:
        raise ValueError("it holds Python objects")
    size = math.prod(shape)
    if min(shape, default=0) < 0 or dtype.itemsize == 0 or dtype.itemsize * size > len(data) - file.tell():
        raise ValueError(f"its header says {shape} of {dtype}, more than it has")
    flat = np.frombuffer(data, dtype, size, file.tell()) if size else np.zeros(0, dtype)
    array: NDArray[Any] = flat.reshape(shape, order="F" if fortran else "C")
    return array
