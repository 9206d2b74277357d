# SPDX-License-Identifier: MIT
"""How much of a surface transmits: by KHR_materials_transmission some of its dielectric part, but no metal.

With metallic m and transmission t a surface is, in the mean, a metal by m, the base by (1 - m) (1 - t), and what
transmits by (1 - m) t. Blended with the last of these, of that weight, the others have between them a metallic of
m / (1 - (1 - m) t).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import Image, Texture

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Varying:
    """A factor, times one channel of a texture if there is one."""

    factor: float
    texture: Texture | None = None

    @property
    def values(self) -> _Floats:
        """At the texels (h, w); (1, 1) without a texture."""
        if self.texture is None:
            return np.full((1, 1), self.factor)
        pixels = self.texture.image.pixels
        colors = (pixels.shape[2] - 1) // 2 * 2 + 1  # grey, or three
        channel = pixels[..., min("rgb".index(self.texture.channel), colors - 1)]
        return self.factor * channel / (255.0 if pixels.dtype == np.uint8 else 1.0)


def is_mapped_alike(one: Texture, other: Texture) -> bool:
    """Whether the two differ in their images and channels alone."""
    return replace(one, image=other.image, channel=other.channel) == other


def blended(transmission: Varying, metallic: Varying) -> tuple[Varying, Varying]:
    """The weight of what transmits, and the metallic of what it is blended with. Textures of both are mapped alike; of
    two sizes the smaller is made as large as the other, in texels of one value."""
    if metallic.factor == 0:
        return transmission, metallic
    texture = transmission.texture or metallic.texture
    t, m = transmission.values, metallic.values
    size = np.maximum(t.shape, m.shape)
    t, m = _enlarged(t, size), _enlarged(m, size)
    weight = (1 - m) * t
    rest = np.divide(m, 1 - weight, out=np.zeros_like(m), where=weight < 1)
    return _varying(weight, texture), _varying(rest, texture)


def _enlarged(values: _Floats, size: Any) -> _Floats:
    rows, columns = (np.arange(n) * m // n for n, m in zip(size, values.shape, strict=True))
    enlarged: _Floats = values[rows][:, columns]
    return enlarged


def _varying(values: _Floats, texture: Texture | None) -> Varying:
    """As a number, or as a texture of bytes that is mapped as ``texture``."""
    if texture is None:
        return Varying(float(values[0, 0]))
    pixels = np.round(255 * np.clip(values, 0, 1)).astype(np.uint8)
    return Varying(1.0, replace(texture, image=Image(pixels, "linear"), channel="r"))
