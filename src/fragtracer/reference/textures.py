# SPDX-License-Identifier: MIT
"""Translates textures: writes their images beside a Mitsuba scene, with their mapping.

Mitsuba's bitmaps have (0, 0) in their upper left corner, as ours do. Images of bytes become PNG
files, all others OpenEXR. Mitsuba decodes sRGB before it filters; so do we.
"""

from pathlib import Path
from typing import Any, Literal

import numpy as np
import PIL.Image
from numpy.typing import ArrayLike, NDArray

from fragtracer.io.images import write_image
from fragtracer.reference.plugins import TEXTURE
from fragtracer.reference.shapes import Tree
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.texture import four_channels, linear_pixels

Use = Literal["color", "r", "g", "b", "a"]  # the colour, or one channel as a number

_FILTERS = {"linear": "bilinear", "nearest": "nearest"}


class TextureFolder:
    """The images of one scene, each written to ``folder`` when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._bitmaps: dict[tuple[str, Use, tuple[float, ...]], Tree] = {}

    def exact(self, texture: Texture, use: Use, factor: Any = (1.0, 1.0, 1.0)) -> Tree:
        """The texture by our own plugin, its colour times ``factor`` (three numbers)."""
        return {
            "type": TEXTURE,
            "image": self._bitmap(texture, use) | {"wrap_mode": "repeat"},
            "wrap_u": texture.wrap_u,
            "wrap_v": texture.wrap_v,
            "uv_offset": [*texture.offset, 0.0],
            "uv_rotation": float(texture.rotation),
            "uv_scale": [*texture.scale, 0.0],
            "factor": [float(x) for x in factor],
        }

    def nearest(self, texture: Texture, use: Use, factor: Any = 1.0) -> Tree:
        """The texture by Mitsuba's own ``bitmap``, which wraps along v as it does along u; ``factor`` (a number or
        three) is put into the image."""
        c, s = np.cos(texture.rotation), np.sin(texture.rotation)
        to_uv = np.eye(4)
        to_uv[:2, :2] = np.array([[c, s], [-s, c]]) * texture.scale
        to_uv[:2, 3] = texture.offset
        factors = tuple(float(x) for x in np.broadcast_to(factor, 3))
        return self._bitmap(texture, use, factors) | {"wrap_mode": texture.wrap_u, "to_uv": to_uv}

    def _bitmap(self, texture: Texture, use: Use, factor: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Tree:
        key = texture.image.digest, use, factor
        if key not in self._bitmaps:
            self._bitmaps[key] = self._written(texture.image, use, factor, f"texture_{len(self._bitmaps)}")
        return {**self._bitmaps[key], "filter_type": _FILTERS[texture.filter]}

    def _written(self, image: Image, use: Use, factor: tuple[float, ...], stem: str) -> Tree:
        chosen = _of_use(four_channels(image.pixels), use)
        encoded = image.color_space == "srgb" and use != "a"
        if chosen.dtype == np.uint8 and factor == (1.0, 1.0, 1.0):
            path = self._folder / f"{stem}.png"
            PIL.Image.fromarray(chosen).save(path)
            return {"type": "bitmap", "filename": str(path), "raw": not encoded}
        path = self._folder / f"{stem}.exr"
        write_image(path, _of_use(linear_pixels(image), use) * factor)
        return {"type": "bitmap", "filename": str(path), "raw": True}


def _of_use(channels: NDArray[Any], use: Use) -> NDArray[Any]:
    """Three channels of four (h, w, 4): the colour, or one of them thrice."""
    return channels[..., :3] if use == "color" else np.repeat(channels[..., "rgba".index(use), None], 3, axis=2)


def opacity_at(material: Material, alpha: ArrayLike) -> NDArray[np.float64]:
    """The opacity of a material where its texture and vertices have the ``alpha`` (any shape)."""
    opacity = material.opacity * np.asarray(alpha, np.float64)
    if material.alpha_mode == "mask":
        return (opacity >= material.alpha_cutoff).astype(np.float64)
    return opacity if material.alpha_mode == "blend" else np.ones_like(opacity)
