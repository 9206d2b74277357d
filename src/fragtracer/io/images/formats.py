# SPDX-License-Identifier: MIT
"""One pair of functions for each image format: ``write_x(path, pixels, metadata)`` and ``read_x(path)``.

Pixels are (h, w, 3) float32, row 0 at the top; those for PNG are sRGB values in [0, 1], all others linear.
A damaged file raises OSError, RuntimeError or ValueError, a valid one of a kind that is not read FragtracerError.
"""

import io
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fragtracer.display.tone import FloatImage, srgb_decode
from fragtracer.errors import FragtracerError
from fragtracer.io.images import exr_child, npy, rgbe

if TYPE_CHECKING:
    from PIL.PngImagePlugin import PngImageFile

Content = tuple[FloatImage, dict[str, str]]
_SECONDS = 120


def write_exr(
    path: Path, pixels: FloatImage, metadata: Mapping[str, str], channels: Mapping[str, FloatImage] | None = None
) -> None:
    """float32 RGB and other ``channels`` (h, w) in one part, lossless; the metadata are string attributes.

    In one part, since that is read by all that reads layers; some read the first part alone.
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **metadata}
    try:
        planes = {name: np.ascontiguousarray(plane, np.float32) for name, plane in (channels or {}).items()}
        with OpenEXR.File(header, {"RGB": pixels, **planes}) as file:
            file.write(os.fsencode(path))
    except RuntimeError as error:
        reason = str(error).rpartition('". ')[2]  # after the name of the temporary file
        raise OSError(reason.removesuffix(".")) from error


def read_exr(path: Path, layers: Sequence[str] = (), alpha: bool = False) -> Content:
    """The display window of the first part, scanline or tiled: RGB, luminance and chroma, or a single channel as grey;
    after these three channels alpha, if it is asked for and there, and those of ``layers``, which have three each.

    It is read in another process (:mod:`fragtracer.io.images.exr_child`), so that a damaged file cannot crash this one.
    """
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # each thread reserves memory
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "pixels.npy"
        options = [*(["--alpha"] if alpha else []), *layers]
        command = [sys.executable, "-P", exr_child.__file__, os.path.abspath(path), str(result), *options]
        try:
            done = subprocess.run(command, capture_output=True, env=environment, timeout=_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise ValueError(f"reading it took more than {_SECONDS} s") from None
        try:
            answer = json.loads(done.stdout.strip().rpartition(b"\n")[2])
        except ValueError:
            raise ValueError("the OpenEXR library crashed on it") from None
        if "unsupported" in answer:
            raise FragtracerError(f"{path}: cannot read this kind of .exr file: {answer['unsupported']}")
        if "error" in answer:
            raise ValueError(answer["error"])
        return np.load(result).astype(np.float32, copy=False), answer["metadata"]


def write_hdr(path: Path, pixels: FloatImage, metadata: Mapping[str, str]) -> None:
    """Radiance RGBE of values in [0, :data:`rgbe.LARGEST`]; the metadata are variables of the header."""
    path.write_bytes(rgbe.encode(pixels, metadata))


def read_hdr(path: Path) -> Content:
    """Radiance RGBE, flat or run-length encoded."""
    return rgbe.decode(path.read_bytes())


def write_npy(path: Path, pixels: FloatImage, metadata: Mapping[str, str]) -> None:
    """The bare array; the format has no place for metadata."""
    file = io.BytesIO()
    np.save(file, pixels)  # to a file it would say of a full disk only how many bytes that has taken
    path.write_bytes(file.getbuffer())


def read_npy(path: Path) -> Content:
    """Any array of (h, w, 3) numbers."""
    array = npy.decode(path.read_bytes())
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype.kind not in "fiu":
        raise ValueError("it does not hold an array of (height, width, 3) numbers")
    with np.errstate(over="ignore"):
        return array.astype(np.float32), {}


def write_png(path: Path, pixels: FloatImage, metadata: Mapping[str, str]) -> None:
    """8-bit sRGB; the metadata are text chunks."""
    from PIL import Image, PngImagePlugin

    info = PngImagePlugin.PngInfo()
    info.add(b"sRGB", b"\x00")
    for key, value in metadata.items():
        info.add_text(key, value)
    Image.fromarray(np.rint(255 * pixels).astype(np.uint8)).save(path, format="PNG", pnginfo=info)


@contextmanager
def opened_png(path: Path) -> Iterator["PngImageFile"]:
    """A PNG file for Pillow, whose own limit is below the largest pictures that are rendered."""
    from PIL.PngImagePlugin import PngImageFile

    try:
        with PngImageFile(path) as picture:
            if picture.width * picture.height > exr_child.MOST_PIXELS:
                raise ValueError(f"it has {picture.width} x {picture.height} pixels, more than {exr_child.MOST_PIXELS}")
            yield picture
    except SyntaxError as error:
        raise ValueError(str(error)) from error


def read_png(path: Path) -> Content:
    """Any PNG of 8 bits, its transparency ignored, made linear."""
    with opened_png(path) as picture:
        if picture.mode[0] in "IF":
            raise ValueError("only pictures of 8 bits a channel can be read")
        pixels = np.asarray(picture.convert("RGB"))
        metadata = _texts(picture)
    return srgb_decode(np.divide(pixels, 255, dtype=np.float32)), metadata


def read_png_metadata(path: Path) -> dict[str, str]:
    """Of a file that is whole: the checksums of all its chunks are looked at, which reading the pixels passes over."""
    with opened_png(path) as picture:
        picture.verify()
        return _texts(picture)


def _texts(picture: "PngImageFile") -> dict[str, str]:
    return {str(key): value for key, value in picture.info.items() if isinstance(value, str)}
