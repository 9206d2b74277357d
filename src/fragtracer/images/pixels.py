# SPDX-License-Identifier: MIT
"""Pixels of texture files as they are stored, with all their channels; no transfer curve is applied or undone."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.images.formats import read_exr, read_hdr, read_npy

LINEAR_SUFFIXES = (".exr", ".hdr", ".npy")
_PICTURES = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP", ".bmp": "BMP", ".tga": "TGA"}
_READERS = {".exr": read_exr, ".hdr": read_hdr, ".npy": read_npy}
SUFFIXES = (*_PICTURES, *_READERS)
_LARGEST_SIDE = 16384


def read_pixels(path: Path) -> NDArray[Any]:
    """Pixels of a file.

    Returns
    -------
    numpy.ndarray
        (h, w, 1 to 4) uint8, or float32 from a file of more than 8 bits a channel; row 0 at the top.

    Raises
    ------
    FragtracerError
        If the file is missing, damaged, too large or of another kind.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise FragtracerError(f"{path}: cannot read this kind of image; choose from {', '.join(SUFFIXES)}")
    try:
        data = path.read_bytes()
        if suffix in _PICTURES:
            return decode_picture(data, str(path))
        return _READERS[suffix](path)[0]
    except (OSError, RuntimeError, ValueError, EOFError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise FragtracerError(f"{path}: cannot read this image: {reason or error}") from error


def decode_picture(data: bytes, name: str) -> NDArray[Any]:
    """Pixels of a picture in memory (PNG, JPEG, WebP, BMP, TGA), as :func:`read_pixels`; ``name`` is for messages."""
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=sorted(set(_PICTURES.values()))) as picture:
                if max(picture.size) > _LARGEST_SIDE:
                    raise ValueError(f"it has more than {_LARGEST_SIDE} pixels along a side; make it smaller")
                return _as_array(picture)
    except UnidentifiedImageError as error:
        raise FragtracerError(f"{name}: this is not a PNG, JPEG, WebP, BMP or TGA picture") from error
    except (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError) as error:
        raise FragtracerError(f"{name}: this picture is damaged or too large: {error}") from error


def _as_array(picture: Any) -> NDArray[Any]:
    if picture.mode.startswith("I"):
        return np.asarray(picture, np.float32)[..., None] / np.float32(65535)
    has_alpha = picture.mode in ("LA", "PA", "RGBA", "La", "RGBa") or "transparency" in picture.info
    is_grey = picture.mode in ("1", "L", "LA", "La")
    mode = ("LA" if has_alpha else "L") if is_grey else ("RGBA" if has_alpha else "RGB")
    pixels = np.asarray(picture.convert(mode))
    return pixels if pixels.ndim == 3 else pixels[..., None]
