# SPDX-License-Identifier: MIT
"""Reads one OpenEXR file in a process of its own: a damaged file can crash the library or exhaust the memory.
``python exr_child.py FILE RESULT.npy [--alpha] [LAYER ...]`` writes the pixels and prints metadata or an error as JSON.

It does not import fragtracer, to start fast.
"""

import json
import os
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_PIXELS = 2**28  # 16384 x 16384, the largest that is rendered
_MOST_BYTES = 2**33
_MOST_SECONDS = 120
Shapes = Mapping[str, tuple[int, int]]  # of channels, by name
_REC_709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
_TYPES = (np.uint32, np.float16, np.float32)  # of a channel, by the number of its type in the file
_CHROMA = ("Y", "RY", "BY")
# Of the samples 1, 3, … 13 pixels away on either side, for a pixel between two (OpenEXR, ImfRgbaYca.cpp).
_CHROMA_FILTER = (0.627123, -0.186077, 0.087929, -0.043159, 0.019597, -0.007540, 0.002128)


class Unsupported(ValueError):
    """The file is valid, but of a kind that is not read."""


def limit() -> None:
    """Limit memory and processor time of this process; not possible on Windows."""
    try:
        import resource
    except ImportError:
        return
    for kind, most in ((resource.RLIMIT_AS, _MOST_BYTES), (resource.RLIMIT_CPU, _MOST_SECONDS)):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def read(path: str, layers: Sequence[str] = (), alpha: bool = False) -> tuple[NDArray[Any], dict[str, str]]:
    """The pixels of the display window, (h, w, 3 + 3 layers), black outside the data window, and the strings of the
    header. With ``alpha`` a fourth channel follows the first three if the file has it.

    Raises ``Unsupported`` for a valid file of another kind, and ``ValueError`` or ``RuntimeError`` for a damaged one.
    """
    import OpenEXR

    name = os.fsencode(path)  # OpenEXR takes no str with surrogates
    with open(name, "rb") as beginning:
        if beginning.read(4) != b"\x76\x2f\x31\x01":
            raise ValueError("it does not begin as an OpenEXR file does")
    with OpenEXR.File(name, header_only=True) as file:
        header = file.header()
        data, display = (_window(header, name) for name in ("dataWindow", "displayWindow"))
        chromaticities = header.get("chromaticities") or _REC_709
        if "deep" in str(header.get("type")):
            raise Unsupported("it is a deep image, of many samples a pixel; flatten it")
        texts = {key: value for key, value in header.items() if isinstance(value, str)}
    # A File reads all channels, which may be more than there is memory for.
    source = OpenEXR.InputFile(name)
    channels = source.header()["channels"]
    size = data[3] - data[1] + 1, data[2] - data[0] + 1
    shapes = {name: (size[0] // one.ySampling, size[1] // one.xSampling) for name, one in channels.items()}
    is_chroma = shapes.keys() >= set(_CHROMA)
    colors, opacity = (_CHROMA, "A") if is_chroma else _colors(shapes, size)
    names = [*colors, *([opacity] if alpha and shapes.get(opacity) == size else [])]
    names += [name for layer in layers for name in _layer(shapes, layer, size)]
    types = {name: np.dtype(_TYPES[channels[name].type.v]) for name in names}
    if 2 * size[0] * size[1] * sum(kind.itemsize for kind in types.values()) > _MOST_BYTES:  # with their stack
        raise MemoryError
    # Channels of fewer samples than pixels are not among those that the library reads at once.
    samples = [source.channel(name) for name in types] if is_chroma else source.channels(list(types))
    pixels = {name: np.frombuffer(one, types[name]) for name, one in zip(types, samples, strict=True)}
    planes = [pixels[name].reshape(shapes[name]) for name in names]
    if is_chroma:
        planes[:3] = _from_luminance_chroma(planes[:3], chromaticities)
    stack = np.stack(planes, axis=-1)
    return (stack if data == display else _placed(stack, data, display)), texts


def _window(header: Any, name: str) -> tuple[int, int, int, int]:
    """Left, top, right and bottom, all inclusive."""
    left, top, right, bottom = (int(x) for corner in header[name] for x in corner)
    width, height = right - left + 1, bottom - top + 1
    if width < 1 or height < 1 or width * height > MOST_PIXELS:
        raise ValueError(f"its {name} is {width} x {height} pixels; from 1 to {MOST_PIXELS} can be read")
    return left, top, right, bottom


def _colors(shapes: Shapes, size: tuple[int, int]) -> tuple[Sequence[str], str]:
    """Of red, green and blue: the channels R, G and B, or those of the first layer that has them, or a single grey one;
    and the name of the channel with their alpha, if there is one."""
    layers = ["", *sorted({name.removesuffix("R") for name in shapes if name.endswith(".R")})]
    found = [([f"{layer}{color}" for color in "RGB"], f"{layer}A") for layer in layers]
    if (grey := _grey(shapes.keys() - {"A"})) is not None:
        found.append(([grey] * 3, "A"))
    for names, alpha in found:
        if shapes.keys() >= set(names):
            if any(shapes[name] != size for name in names):
                raise Unsupported(f"its channels {', '.join(dict.fromkeys(names))} have fewer samples than pixels")
            return names, alpha
    raise Unsupported(f"it has no channels R, G and B, only {', '.join(sorted(shapes)) or 'none'}")


def _layer(shapes: Shapes, layer: str, size: tuple[int, int]) -> list[str]:
    """The three channels of a layer: LAYER.R, G and B, or X, Y and Z."""
    for letters in ("RGB", "XYZ"):
        names = [f"{layer}.{letter}" for letter in letters]
        if all(shapes.get(name) == size for name in names):
            return names
    raise Unsupported(f"it has no layer {layer}")


def _grey(names: set[str]) -> str | None:
    """The channel of a grey image: Y without chroma, or the only one, unless that is the depth Z."""
    if "Y" in names and not {"RY", "BY"} & names:
        return "Y"
    return next(iter(names)) if len(names) == 1 and names != {"Z"} else None


def _from_luminance_chroma(
    planes: Sequence[NDArray[Any]], chromaticities: tuple[float, ...]
) -> list[NDArray[np.float32]]:
    """RGB of luminance Y and the chroma RY = (R - Y) / Y and BY = (B - Y) / Y, subsampled by 2 or not."""
    y, ry, by = (plane.astype(np.float32) for plane in planes)
    height, width = y.shape
    if ry.shape != by.shape or ry.shape not in (y.shape, (height // 2, width // 2)):
        raise Unsupported("it has luminance and chroma, but not of each pixel or every second one")
    if ry.shape != y.shape:
        ry, by = (_upsampled(_upsampled(chroma, 0), 1) for chroma in (ry, by))
    red, green, blue = _luminance_weights(chromaticities)
    r, b = (ry + 1) * y, (by + 1) * y
    return [plane.astype(np.float32) for plane in (r, (y - red * r - blue * b) / green, b)]


def _upsampled(samples: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Samples at twice the rate along ``axis``, those between two by :data:`_CHROMA_FILTER`."""
    count, half = samples.shape[axis], len(_CHROMA_FILTER)
    padded = np.pad(np.moveaxis(samples, axis, 0), ((half, half), (0, 0)), mode="edge")
    between = np.zeros_like(padded[:count])
    for step, weight in enumerate(_CHROMA_FILTER):
        before, after = half - step, half + step + 1
        between += np.float32(weight) * (padded[before : before + count] + padded[after : after + count])
    both = np.stack([padded[half : half + count], between], axis=1).reshape(2 * count, -1)
    return np.moveaxis(both, 0, axis)


def _luminance_weights(chromaticities: tuple[float, ...]) -> NDArray[np.float64]:
    """The luminance of the red, green and blue primary, of chromaticities x, y of the three and of white."""
    x, y = np.reshape(chromaticities, (4, 2)).T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    weights: NDArray[np.float64] = np.linalg.solve(xyz[:, :3], xyz[:, 3])
    return weights


def _placed(pixels: NDArray[Any], data: tuple[int, ...], display: tuple[int, ...]) -> NDArray[Any]:
    """The display window of pixels of the data window, black outside."""
    result = np.zeros((display[3] - display[1] + 1, display[2] - display[0] + 1, pixels.shape[2]), pixels.dtype)
    x, y = data[0] - display[0], data[1] - display[1]
    left, top = max(x, 0), max(y, 0)
    right, bottom = min(x + pixels.shape[1], result.shape[1]), min(y + pixels.shape[0], result.shape[0])
    if right > left and bottom > top:
        result[top:bottom, left:right] = pixels[top - y : bottom - y, left - x : right - x]
    return result


def main() -> None:
    """Print {"metadata": {...}}, or {"unsupported": "..."} for a kind that is not read, or {"error": "..."}."""
    limit()
    try:
        layers = [name for name in sys.argv[3:] if name != "--alpha"]
        pixels, metadata = read(sys.argv[1], layers, "--alpha" in sys.argv[3:])
        np.save(sys.argv[2], pixels if pixels.dtype == np.float16 else pixels.astype(np.float32))
        print(json.dumps({"metadata": metadata}))
    except Unsupported as error:
        print(json.dumps({"unsupported": str(error)}))
    except MemoryError:
        print(json.dumps({"unsupported": f"it needs more than {_MOST_BYTES / 2**30:.3g} GiB of memory"}))
    except Exception as error:
        first, *_ = [*str(error).strip().splitlines(), repr(error)]
        print(json.dumps({"error": first.partition(" when attempting to open")[0]}))


if __name__ == "__main__":
    main()
