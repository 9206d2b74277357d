# SPDX-License-Identifier: MIT
"""Radiance .hdr files: three mantissas of 8 bits that share one exponent.

Ward 1991, "Real pixels", Graphics Gems II. Written flat, read flat or run-length encoded.
"""

import json
import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

LARGEST = float(np.float32(2.0**127 * 255 / 256))
_FORMAT = "32-bit_rle_rgbe"


def encode(image: npt.NDArray[np.float32], metadata: Mapping[str, str]) -> bytes:
    """The file for linear (h, w, 3) radiance in [0, :data:`LARGEST`], its top row first."""
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
    """The (h, w, 3) float32 radiance, its top row first, and the variables of the header.

    Raises
    ------
    ValueError
        If the data are damaged, or in a layout that is seldom used (XYZ colours, other scan directions).
    """
    header, _, rest = data.partition(b"\n\n")
    resolution, _, pixels = rest.partition(b"\n")
    match resolution.split():
        case [b"-Y", height, b"+X", width] if header.startswith(b"#?") and height.isdigit() and width.isdigit():
            rgbe = _scanlines(pixels, int(height), int(width))
        case _:
            raise ValueError("it is no Radiance file whose rows run from the top and from the left")
    lines = header.decode("latin-1").splitlines()
    variables = dict(line.split("=", 1) for line in lines if "=" in line)
    if variables.get("FORMAT", _FORMAT) != _FORMAT:
        raise ValueError(f"its pixels are {variables['FORMAT']}, not {_FORMAT}")
    exposure = math.prod(float(line.split("=")[1]) for line in lines if line.startswith("EXPOSURE="))
    if not exposure > 0:
        raise ValueError(f"its EXPOSURE is {exposure}")
    return _from_rgbe(rgbe) / np.float32(exposure), {key: _text(value) for key, value in variables.items()}


def _text(value: str) -> str:
    try:
        return str(json.loads(value)) if value.startswith('"') else value
    except ValueError:
        return value


def _from_rgbe(rgbe: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    exponent = rgbe[..., 3:].astype(np.int32)
    color = np.ldexp(rgbe[..., :3].astype(np.float32), exponent - 136)
    return np.where(exponent > 0, color, np.float32(0))


def _scanlines(pixels: bytes, height: int, width: int) -> npt.NDArray[np.uint8]:
    size = math.prod((height, width, 4))
    marker = bytes((2, 2, width >> 8 & 255, width & 255))
    if 8 <= width < 2**15 and pixels.startswith(marker):
        pixels = _expand(pixels, height, width, marker)
    if len(pixels) < size or size == 0:
        raise ValueError(f"it holds {len(pixels)} bytes of pixels where {size} are needed")
    return np.frombuffer(pixels, np.uint8, size).reshape(height, width, 4)


def _expand(pixels: bytes, height: int, width: int, marker: bytes) -> bytes:
    rows, at = [], 0
    for _ in range(height):
        if not pixels.startswith(marker, at):
            raise ValueError("a run-length encoded row is damaged")
        channels, at = _runs(pixels, at + 4, 4 * width)
        rows.append(np.frombuffer(channels, np.uint8).reshape(4, width).T.tobytes())
    return b"".join(rows)


def _runs(pixels: bytes, at: int, size: int) -> tuple[bytes, int]:
    row = bytearray()
    while len(row) < size:
        if at + 1 >= len(pixels) or pixels[at] == 0:
            raise ValueError("a run-length encoded row is damaged")
        count = pixels[at]
        run = pixels[at + 1 : at + 2] * (count - 128) if count > 128 else pixels[at + 1 : at + 1 + count]
        row += run
        at += 2 if count > 128 else 1 + count
    if len(row) != size:
        raise ValueError("a run-length encoded row is damaged")
    return bytes(row), at
