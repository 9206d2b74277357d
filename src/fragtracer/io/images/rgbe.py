# SPDX-License-Identifier: MIT
"""Radiance .hdr files: three mantissas of 8 bits that share one exponent.

Ward 1991, "Real pixels", Graphics Gems II. Written flat, read flat or run-length encoded.
"""

import json
import re
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fragtracer.io.images.exr_child import MOST_PIXELS
from fragtracer.io.images.scanlines import decode_scanlines

LARGEST = float(np.float32(2.0**127 * 255 / 256))
_FORMAT = "32-bit_rle_rgbe"
_LONGEST_HEADER = 2**20
_RESOLUTION = re.compile(rb"([+-][XY]) +(\d{1,9}) +([+-][XY]) +(\d{1,9})")


def encode(image: npt.NDArray[np.float32], metadata: Mapping[str, str]) -> bytes:
    """The bytes of a file for linear (h, w, 3) radiance in [0, :data:`LARGEST`], row 0 at the top."""
    lines = ["#?RADIANCE", f"FORMAT={_FORMAT}", *(f"{key}={json.dumps(value)}" for key, value in metadata.items())]
    height, width, _ = image.shape
    return (
        "\n".join([*lines, "", f"-Y {height} +X {width}", ""]).encode("ascii", "backslashreplace")
        + _to_rgbe(image).tobytes()
    )


def _to_rgbe(image: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    peak = image.max(axis=-1, keepdims=True)
    mantissa, exponent = np.frexp(peak)
    exponent = exponent + (mantissa >= 255.5 / 256)
    rgbe = np.concatenate([np.rint(np.ldexp(image, 8 - exponent)), exponent + 128], axis=-1)
    return np.where(exponent > -128, rgbe, 0).astype(np.uint8)


def decode(data: bytes) -> tuple[npt.NDArray[np.float32], dict[str, str]]:
    """The (h, w, 3) float32 radiance, row 0 at the top, and the variables of the header.

    Scanlines may have any of the eight orientations. Pixels are divided by EXPOSURE and COLORCORR.

    Raises
    ------
    ValueError
        If the data are damaged, or the colours are XYZ.
    """
    end = data.find(b"\n\n", 0, _LONGEST_HEADER)
    start = data.find(b"\n", end + 2, end + 2 + 200) + 1
    order = _RESOLUTION.fullmatch(data[end + 2 : start].strip())
    if not (data.startswith(b"#?") and end > 0 and start > 0 and order) or order[1][1:] == order[3][1:]:
        raise ValueError("it is no Radiance file: it has no header with the size of the picture")
    lines = data[:end].decode("latin-1").splitlines()
    variables = dict(line.split("=", 1) for line in lines if "=" in line)
    if variables.get("FORMAT", _FORMAT).strip() != _FORMAT:
        raise ValueError(f"its pixels are {variables['FORMAT']}, not {_FORMAT}")
    factor = _factors(lines, "EXPOSURE", 1) * _factors(lines, "COLORCORR", 3)
    major, count, minor, length = order[1], int(order[2]), order[3], int(order[4])
    if not 0 < count * length <= MOST_PIXELS:
        raise ValueError(f"it says that it has {count} x {length} pixels; from 1 to {MOST_PIXELS} can be read")
    pixels = _from_rgbe(decode_scanlines(data, start, count, length))
    if (factor != 1).any():
        pixels /= factor.astype(np.float32)
    if major[1:] == b"X":
        pixels, major, minor = pixels.swapaxes(0, 1), minor, major
    pixels = pixels[:: -1 if major == b"+Y" else 1, :: -1 if minor == b"-X" else 1]
    return np.ascontiguousarray(pixels), {key: _text(value) for key, value in variables.items()}


def _factors(lines: list[str], name: str, count: int) -> npt.NDArray[np.float64]:
    """The product of all occurrences of a variable of ``count`` numbers."""
    product = np.ones(count)
    for line in lines:
        if line.startswith(f"{name}="):
            numbers = line.partition("=")[2].split()
            product = product * np.array([float(number) for number in numbers] if len(numbers) == count else np.nan)
    if not (np.isfinite(product).all() and (product > 0).all()):
        raise ValueError(f"its {name} is not {count} positive number{'s' if count > 1 else ''}")
    return product


def _text(value: str) -> str:
    try:
        return str(json.loads(value)) if value.startswith('"') else value
    except ValueError:
        return value


def _from_rgbe(rgbe: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    exponents = np.arange(256)
    units = np.where(exponents > 0, np.ldexp(np.float32(1), exponents - 136), 0).astype(np.float32)
    pixels = np.empty((*rgbe.shape[:2], 3), np.float32)
    for row, bytes_of_row in zip(pixels, rgbe, strict=True):  # a row stays in the cache
        np.multiply(bytes_of_row[:, :3], units[bytes_of_row[:, 3:]], out=row)
    return pixels
