# SPDX-License-Identifier: MIT
"""Textures in float64: decoded first, then filtered, with indices wrapped by whole-number arithmetic."""

import numpy as np
from numpy.typing import ArrayLike

from fragtracer.scene import Image, Texture

from . import Floats


def linear_pixels(image: Image) -> Floats:
    """(h, w, 4) float64, linear."""
    values = image.pixels / 255.0 if image.pixels.dtype == np.uint8 else image.pixels.astype(np.float64)
    channels = values.shape[2]
    color = values[..., :3] if channels > 2 else np.repeat(values[..., :1], 3, axis=2)
    if image.color_space == "srgb":
        color = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    alpha = values[..., -1:] if channels in (2, 4) else np.ones((*values.shape[:2], 1))
    return np.concatenate([color, alpha], axis=2)


def transformed(texture: Texture, uv: ArrayLike) -> Floats:
    """KHR_texture_transform, step by step; the image's v runs down, so counter-clockwise is towards smaller v."""
    u, v = (np.asarray(uv, np.float64) * texture.scale).T
    turned = (u + 1j * -v) * np.exp(1j * texture.rotation)
    return np.stack([turned.real, -turned.imag], axis=1) + texture.offset


def lookup(texture: Texture, uv: ArrayLike) -> Floats:
    """(n, 4) for (n, 2) float64 coordinates before the transform."""
    pixels = linear_pixels(texture.image)
    height, width, _ = pixels.shape
    position = transformed(texture, uv) * (width, height)
    if texture.filter == "nearest":
        x, y = np.floor(position).astype(np.int64).T
        return pixels[wrapped(y, height, texture.wrap_v), wrapped(x, width, texture.wrap_u)]
    x, y = np.floor(position - 0.5).astype(np.int64).T
    result = np.zeros((len(position), 4))
    for dx in (0, 1):
        for dy in (0, 1):
            weights = 1 - np.abs(position - 0.5 - np.stack([x + dx, y + dy], axis=1))
            rows, columns = wrapped(y + dy, height, texture.wrap_v), wrapped(x + dx, width, texture.wrap_u)
            result += weights.prod(axis=1)[:, None] * pixels[rows, columns]
    return result


def wrapped(index: ArrayLike, size: int, wrap: str) -> ArrayLike:
    if wrap == "repeat":
        return np.mod(index, size)
    if wrap == "clamp":
        return np.clip(index, 0, size - 1)
    turn = np.mod(index, 2 * size)
    return np.minimum(turn, 2 * size - 1 - turn)
