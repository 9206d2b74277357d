# SPDX-License-Identifier: MIT
"""Many images in two texture arrays (shaders/texture/texture.glsl).

The texels of images follow each other, row by row, in rows and layers of the array, whatever the sizes of images: the
shader filters by hand, texel by texel, and so wraps as exactly as a texture of their own would. Bytes stay bytes, sRGB
with them, since the shader decodes each texel before it filters; images of floats lie in an array of their own, linear.
"""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.display.tone import srgb_decode, srgb_encode
from fragtracer.scene import Image
from fragtracer.scene.content import kept_by_digest

TEXTURE_SRGB, TEXTURE_FLOAT = 1, 2  # of scene/texture.glsl

COLUMNS, ROWS = 4096, 256  # of a layer, as texture.glsl has them; every driver has 256 layers, which are 1 GiB of bytes
MAX_SIDE = 4096
MAX_BYTES = 2**30
_STRIP = 64  # rows or columns that are computed at once, which bounds the memory
_KEPT = 2  # scenes whose atlas is not made again at every edit


@dataclass(frozen=True)
class Region:
    """Where an image lies: from texel ``first`` on, row 0 the image's top row; ``flags`` are :data:`TEXTURE_SRGB` and
    :data:`TEXTURE_FLOAT`."""

    first: int
    width: int
    height: int
    flags: int


@dataclass(frozen=True, eq=False)
class Atlas:
    """The texels, (layers, rows, :data:`COLUMNS`, 4) uint8 and float32, either without layers where no image needs it,
    and the region of each image."""

    bytes: NDArray[np.uint8]
    floats: NDArray[np.float32]
    regions: Mapping[Image, Region]


def build_atlas(images: Iterable[Image], max_side: int = MAX_SIDE, max_bytes: int = MAX_BYTES) -> Atlas:
    """Lay out the ``images``, each once.

    An image with a side above ``max_side`` texels is made smaller, and where all together would take
    more than ``max_bytes`` the largest are, with a warning: texels become means over the area they
    cover, of linear colours.
    """
    return _build(tuple(dict.fromkeys(images)), max_side, max_bytes)


def smaller_image(image: Image, factor: float) -> Image:
    """``image`` with its sides times ``factor``, at least a texel: means over the area of each, of linear colours."""
    rgba = _rgba(image)
    size = (max(1, round(rgba.shape[0] * factor)), max(1, round(rgba.shape[1] * factor)))
    space = "linear" if rgba.dtype == np.float32 else image.color_space
    return Image(_resized(rgba, size, image.color_space == "srgb"), space, image.file)


@lru_cache(_KEPT)
def _build(images: tuple[Image, ...], max_side: int, max_bytes: int) -> Atlas:
    pixels: dict[Image, NDArray[Any]] = {}
    for image in images:
        pixels[image] = _rgba(image)
        _limit_side(pixels, image, max_side)
    _limit_bytes(pixels, max_bytes)
    regions: dict[Image, Region] = {}
    arrays = []
    for dtype in (np.uint8, np.float32):
        chosen = {image: p for image, p in pixels.items() if p.dtype == dtype}
        sizes = [p.shape[0] * p.shape[1] for p in chosen.values()]
        ends = np.cumsum(sizes, dtype=int).tolist()
        rows = -(-sum(sizes) // COLUMNS)
        layers = -(-rows // ROWS)
        texels = np.zeros((layers * min(rows, ROWS) * COLUMNS, 4), dtype)
        for (image, p), size, end in zip(chosen.items(), sizes, ends, strict=True):
            texels[end - size : end] = p.reshape(-1, 4)
            regions[image] = Region(end - size, p.shape[1], p.shape[0], _flags(image, p))
        texels.setflags(write=False)
        arrays.append(texels.reshape(layers, max(1, min(rows, ROWS)), COLUMNS, 4))
    return Atlas(arrays[0], arrays[1], regions)


def _flags(image: Image, pixels: NDArray[Any]) -> int:
    if pixels.dtype == np.float32:
        return TEXTURE_FLOAT
    return TEXTURE_SRGB if image.color_space == "srgb" else 0


def _rgba(image: Image) -> NDArray[Any]:
    """(h, w, 4) uint8 as the image has it, or float32 with linear colours."""
    pixels = image.pixels
    height, width, channels = pixels.shape
    rgba: NDArray[Any] = np.full((height, width, 4), 255 if pixels.dtype == np.uint8 else 1, pixels.dtype)
    rgba[..., :3] = pixels[..., :3] if channels > 2 else pixels[..., :1]
    if channels in (2, 4):
        rgba[..., 3] = pixels[..., -1]
    if rgba.dtype == np.float32 and image.color_space == "srgb":
        rgba[..., :3] = srgb_decode(rgba[..., :3])
    return rgba


def _limit_side(pixels: dict[Image, NDArray[Any]], image: Image, max_side: int) -> None:
    side = max(pixels[image].shape[:2])
    if side > max_side:
        _shrink(pixels, image, max_side / side, f"a texture may be {max_side} texels wide or high")


def _limit_bytes(pixels: dict[Image, NDArray[Any]], max_bytes: int) -> None:
    while sum(p.nbytes for p in pixels.values()) > max_bytes:
        largest = max(pixels, key=lambda image: pixels[image].nbytes)
        _shrink(pixels, largest, 0.5, f"textures may take {max_bytes / 2**20:g} MiB together")


def _shrink(pixels: dict[Image, NDArray[Any]], image: Image, factor: float, why: str) -> None:
    height, width, _ = pixels[image].shape
    size = (max(1, int(height * factor)), max(1, int(width * factor)))
    warnings.warn(
        f"{image.file or 'a texture'} is made smaller, from {width}x{height} to {size[1]}x{size[0]}: {why}",
        stacklevel=2,
    )
    pixels[image] = _resized(pixels[image], size, image.color_space == "srgb")


def _resized(pixels: NDArray[Any], size: tuple[int, int], srgb: bool) -> NDArray[Any]:
    """Means over the area of each new texel, (height, width) = ``size``; bytes stay bytes."""
    narrow = np.empty((pixels.shape[0], size[1], 4), np.float32)
    for first in range(0, len(pixels), _STRIP):
        rows = slice(first, first + _STRIP)
        narrow[rows] = _area_means(_linear(pixels[rows], srgb), size[1], 1)
    means = np.empty((*size, 4), np.float32)
    for first in range(0, size[1], _STRIP):
        columns = slice(first, first + _STRIP)
        means[:, columns] = _area_means(narrow[:, columns], size[0], 0)
    if pixels.dtype == np.float32:
        return means
    reduced = np.empty(means.shape, np.uint8)
    for row, values in enumerate(means):
        values[:, :3] = srgb_encode(values[:, :3]) if srgb else values[:, :3]
        reduced[row] = np.rint(255 * values)
    return reduced


def _linear(rgba: NDArray[Any], srgb: bool) -> NDArray[np.float32]:
    """What the shader makes of the texels of the atlas."""
    if rgba.dtype == np.float32:
        return rgba
    fractions = np.arange(256, dtype=np.float32) / np.float32(255)
    linear: NDArray[np.float32] = fractions[rgba]
    if srgb:
        linear[..., :3] = srgb_decode(fractions)[rgba[..., :3]]
    return linear


def _area_means(values: NDArray[Any], count: int, axis: int) -> NDArray[np.float64]:
    """``count`` means along ``axis``, from differences of the integral, which is linear in each texel."""
    values = np.moveaxis(values, axis, 0)
    if len(values) % count == 0:
        blocks = values.reshape(count, len(values) // count, *values.shape[1:])
        return np.moveaxis(blocks.mean(axis=1, dtype=np.float64), 0, axis)
    integral = np.concatenate([np.zeros_like(values[:1], np.float64), np.cumsum(values, 0, np.float64)])
    places = np.linspace(0, len(values), count + 1)
    below = np.minimum(places.astype(int), len(values) - 1)
    part = (places - below).reshape(-1, *(1,) * (values.ndim - 1))
    means: NDArray[np.float64] = np.diff(integral[below] + part * values[below], axis=0) * (count / len(values))
    return np.moveaxis(means, 0, axis)


@kept_by_digest(256)
def mean_color(image: Image) -> tuple[float, float, float]:
    """The linear mean of the colours over the whole image."""
    rgba, total = _rgba(image), np.zeros(3)
    for first in range(0, len(rgba), _STRIP):
        strip = _linear(rgba[first : first + _STRIP], image.color_space == "srgb")
        total += strip[..., :3].sum(axis=(0, 1), dtype=np.float64)
    r, g, b = (total / (rgba.shape[0] * rgba.shape[1])).tolist()
    return (r, g, b)
