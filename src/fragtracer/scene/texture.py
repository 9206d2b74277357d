# SPDX-License-Identifier: MIT
"""Textures."""

from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.content import Content, content_digest, read_only
from fragtracer.scene.fields import CONFIG, Number, Whole, as_vector

ColorSpace = Literal["srgb", "linear"]
Wrap = Literal["repeat", "mirror", "clamp"]
Pair = Annotated[tuple[Number, Number], BeforeValidator(as_vector)]


class Image(Content):
    """Pixels of a texture; two are equal if their content is.

    ``pixels`` is (h, w, c) with 1 to 4 channels (grey, grey and alpha, RGB, RGB and alpha), row 0 at
    the top, uint8 from 0 to 255 or float32, negative values clamped to 0. The colours of ``srgb``
    pixels are encoded by the curve of IEC 61966-2-1, alpha never is. ``file`` is the file they were read
    from, if any.

    Raises ``ValueError`` for an array of another kind.
    """

    def __init__(self, pixels: ArrayLike, color_space: ColorSpace = "srgb", file: str | None = None) -> None:
        array = np.asarray(pixels)
        array = array[..., None] if array.ndim == 2 else array
        if array.ndim != 3 or array.shape[2] not in (1, 2, 3, 4) or array.size == 0:
            raise ValueError(f"the pixels of a texture are (height, width, 1 to 4) numbers, got {array.shape}")
        if array.dtype != np.uint8 and array.dtype.kind != "f":
            raise ValueError(f"the pixels of a texture are uint8 or float32, got {array.dtype}")
        if color_space not in get_args(ColorSpace):
            raise ValueError(f"color_space must be one of {', '.join(get_args(ColorSpace))}, got {color_space!r}")
        if array.dtype.kind == "f":
            array = np.maximum(array, 0) if (array < 0).any() else array
        self.pixels: NDArray[Any] = read_only(array, np.uint8 if array.dtype == np.uint8 else np.float32)
        if not np.isfinite(self.pixels).all():
            raise ValueError("the pixels of a texture must be finite, as float32")
        self.color_space: ColorSpace = color_space
        self.file = file
        self.digest = content_digest(self.pixels, color_space)


@dataclass(frozen=True, config=CONFIG)
class Texture:
    """An image, and how it is mapped to texture coordinates.

    Texture coordinates (0, 0) are the image's upper left corner, (1, 1) the lower right one, as in
    glTF. ``offset``, ``rotation`` (radians, counter-clockwise) and ``scale`` transform the coordinates
    before the lookup (glTF, KHR_texture_transform). ``coordinates`` says which of the mesh's two sets to use.
    ``channel`` is the one used by scalar parameters.
    """

    image: Image
    wrap_u: Wrap = "repeat"
    wrap_v: Wrap = "repeat"
    filter: Literal["linear", "nearest"] = "linear"
    offset: Pair = (0.0, 0.0)
    rotation: Number = 0.0
    scale: Pair = (1.0, 1.0)
    coordinates: Annotated[Whole, Field(ge=0, le=1)] = 0
    channel: Literal["r", "g", "b", "a"] = "r"


def linear_pixels(image: Image) -> NDArray[np.float64]:
    """Red, green, blue and alpha as linear numbers, (h, w, 4)."""
    channels = four_channels(image.pixels)
    values = channels / 255 if channels.dtype == np.uint8 else channels.astype(np.float64)
    if image.color_space == "srgb":
        values[..., :3] = srgb_to_linear(values[..., :3])
    return values


def four_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    """Red, green, blue and alpha of pixels (h, w, 1 to 4) of the model, of the same type."""
    opaque = np.full_like(pixels[..., :1], 255 if pixels.dtype == np.uint8 else 1)
    count = pixels.shape[2]
    color = pixels[..., :3] if count >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    return np.concatenate([color, pixels[..., -1:] if count in (2, 4) else opaque], axis=2)


def srgb_to_linear(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """The curve of IEC 61966-2-1."""
    x = np.asarray(encoded, np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.04045) + 0.055) / 1.055) ** 2.4)
