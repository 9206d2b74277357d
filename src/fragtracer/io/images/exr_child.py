# SPDX-License-Identifier: MIT
"""Reads one OpenEXR file, as a program of its own: a damaged file can crash the library, or ask it for any amount of
memory. ``python exr_child.py FILE RESULT.npy`` writes the pixels and prints what else there is, as JSON.

It imports nothing of fragtracer, so that it starts fast.
"""

import json
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_PIXELS = 2**27  # 16384 x 8192
_MOST_BYTES = 2**33
_MOST_SECONDS = 120


def limit() -> None:
    """Let the system end this process where it takes too much; Windows cannot."""
    try:
        import resource
    except ImportError:
        return
    for kind, most in ((resource.RLIMIT_AS, _MOST_BYTES), (resource.RLIMIT_CPU, _MOST_SECONDS)):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def read(path: str) -> tuple[NDArray[Any], dict[str, str]]:
    """The pixels of the display window, (h, w, 3), black where the file has none, and the texts of the header.

    Raises ``ValueError`` or ``RuntimeError`` for a file that is damaged or has no colours.
    """
    import OpenEXR

    with open(path, "rb") as beginning:
        if beginning.read(4) != b"\x76\x2f\x31\x01":
            raise ValueError("it does not begin as an OpenEXR file does")
    with OpenEXR.File(path, header_only=True) as file:
        data, display = (_window(file.header(), name) for name in ("dataWindow", "displayWindow"))
    with OpenEXR.File(path, separate_channels=True) as file:
        if not file.parts:
            raise ValueError("its pixels cannot be decoded")
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        texts = {key: value for key, value in file.header().items() if isinstance(value, str)}
    stack = np.stack([channels[name] for name in _colors(list(channels))], axis=-1)
    left, top, right, bottom = data
    if stack.shape[:2] != (bottom - top + 1, right - left + 1):
        raise ValueError("its channels have fewer samples than pixels")
    if data != display:
        stack = _placed(stack, data, display)
    return stack, texts


def _window(header: Any, name: str) -> tuple[int, int, int, int]:
    """Left, top, right and bottom, the last two included."""
    left, top, right, bottom = (int(x) for corner in header[name] for x in corner)
    width, height = right - left + 1, bottom - top + 1
    if width < 1 or height < 1 or width * height > MOST_PIXELS:
        raise ValueError(f"its {name} is {width} x {height} pixels; from 1 to {MOST_PIXELS} can be read")
    return left, top, right, bottom


def _colors(names: list[str]) -> list[str]:
    """The channels of red, green and blue: R, G, B, or those of the first layer that has them, or a grey one."""
    layers = ["", *sorted({name.removesuffix("R") for name in names if name.endswith(".R")})]
    for layer in layers:
        if {f"{layer}{color}" for color in "RGB"} <= set(names):
            return [f"{layer}{color}" for color in "RGB"]
    if "Y" in names and not {"RY", "BY"} & set(names):
        return ["Y"] * 3
    raise ValueError(f"it has no channels R, G and B, only {', '.join(sorted(names)) or 'none'}")


def _placed(pixels: NDArray[Any], data: tuple[int, ...], display: tuple[int, ...]) -> NDArray[Any]:
    """Pixels of the data window where they lie in the display window."""
    result = np.zeros((display[3] - display[1] + 1, display[2] - display[0] + 1, 3), pixels.dtype)
    x, y = data[0] - display[0], data[1] - display[1]
    left, top = max(x, 0), max(y, 0)
    right, bottom = min(x + pixels.shape[1], result.shape[1]), min(y + pixels.shape[0], result.shape[0])
    if right > left and bottom > top:
        result[top:bottom, left:right] = pixels[top - y : bottom - y, left - x : right - x]
    return result


def main() -> None:
    """Print {"metadata": {...}}, or {"error": "..."} where the file cannot be read."""
    limit()
    try:
        pixels, metadata = read(sys.argv[1])
        np.save(sys.argv[2], pixels if pixels.dtype == np.float16 else pixels.astype(np.float32))
        print(json.dumps({"metadata": metadata}))
    except MemoryError:
        print(json.dumps({"error": "it needs too much memory"}))
    except Exception as error:
        first, *_ = [*str(error).strip().splitlines(), repr(error)]
        print(json.dumps({"error": first.partition(" when attempting to open")[0]}))


if __name__ == "__main__":
    main()
