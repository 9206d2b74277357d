# SPDX-License-Identifier: MIT
"""Image files as textures."""

import io
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.images import check_regular, npy, read_texels
from fragtracer.scene import Image
from fragtracer.scene.texture import ColorSpace

# Checked against the header, before decoding; Pillow itself warns from 89 million on.
MOST_PIXELS = 8192 * 8192
_FORMATS = ["PNG", "JPEG", "BMP", "TGA", "WEBP"]
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_SIXTEEN_BIT_PNG = {(16, color_type) for color_type in (0, 2, 4, 6)}  # bytes 24 and 25 of the file


def read_texture(source: str | Path | bytes, color_space: ColorSpace = "srgb", name: str | None = None) -> Image:
    """Read the image of a texture.

    Parameters
    ----------
    source
        A .png, .jpg, .bmp, .tga, .webp, .exr, .hdr or .npy file, or the bytes of one of the first five. Alpha is
        kept, and colours are not divided by it; palettes are resolved, a PNG of 16 bits a channel becomes float32; .npy
        is an array as :class:`Image` takes it. Colour profiles, gamma chunks and the Exif orientation are ignored, as
        glTF 2.0 requires (section 3.8.2).
    color_space
        The encoding: "srgb" for colours, "linear" for other data, as normals and roughness. Files of floats are
        always linear.
    name
        What errors and :attr:`Image.file` call it; left out, the path.

    Raises
    ------
    FragtracerError
        If the file is missing, damaged, not an image, or claims more than :data:`MOST_PIXELS` pixels.
    """
    name = name or ("this texture" if isinstance(source, bytes) else str(source))
    try:
        if isinstance(source, bytes):
            return Image(_pixels(source), color_space, name)
        check_regular(source)
        suffix = Path(source).suffix.lower()
        if suffix in (".exr", ".hdr"):
            return Image(read_texels(source), "linear", name)
        data = Path(source).read_bytes()
        if suffix == ".npy":
            return Image(npy.decode(data), "linear", name)
        return Image(_pixels(data), color_space, name)
    except (OSError, ValueError, SyntaxError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error).replace(repr(source), "it")
        raise FragtracerError(f"{name}: cannot read this texture: {reason}") from None


def _pixels(data: bytes) -> NDArray[Any]:
    """(h, w, 1 to 4), uint8, or float32 from 0 to 1 where the file has 16 bits."""
    from PIL import Image as Picture
    from PIL import UnidentifiedImageError

    if not data:
        raise ValueError("it is empty")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Picture.DecompressionBombWarning)
            picture = Picture.open(io.BytesIO(data), formats=_FORMATS)
    except UnidentifiedImageError:
        raise ValueError("it is none of .png, .jpg, .bmp, .tga and .webp, or damaged") from None
    except (Picture.DecompressionBombError, Picture.DecompressionBombWarning):
        raise ValueError(f"it claims more than {MOST_PIXELS} pixels; make it smaller") from None
    with picture:
        width, height = picture.size
        if width * height > MOST_PIXELS:
            raise ValueError(f"it is {width}x{height}, more than {MOST_PIXELS} pixels; make it smaller")
        if data.startswith(_PNG_SIGNATURE) and tuple(data[24:26]) in _SIXTEEN_BIT_PNG:
            return _sixteen_bit_png(data)
        if picture.mode in ("P", "PA", "RGBa", "La") or "transparency" in picture.info:
            transparent = picture.mode != "P" or "transparency" in picture.info
            return np.asarray(picture.convert("RGBA" if transparent else "RGB"))
        if picture.mode not in ("L", "LA", "RGB", "RGBA"):
            return np.asarray(picture.convert("L" if picture.mode == "1" else "RGB"))
        return np.asarray(picture)


def _sixteen_bit_png(data: bytes) -> NDArray[np.float32]:
    """Pillow keeps the upper 8 of the 16 bits."""
    import png

    try:
        width, height, rows, info = png.Reader(bytes=data).read()
        pixels = np.vstack([np.asarray(row, np.uint16) for row in rows])
    except png.Error as error:
        raise ValueError(str(error)) from error
    pixels = pixels.reshape(height, width, info["planes"])
    if (key := info.get("transparent")) is not None:
        opacity = np.where((pixels == key).all(axis=2, keepdims=True), 0, 65535)
        pixels = np.concatenate([pixels, opacity], axis=2)
    return (pixels / 65535).astype(np.float32)
