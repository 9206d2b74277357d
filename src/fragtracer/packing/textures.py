# SPDX-License-Identifier: MIT
"""Textures as records: where the image lies in the atlas, and how coordinates find their place in it."""

from typing import Any

import numpy as np

from fragtracer.packing.atlas import Region
from fragtracer.scene import Texture
from fragtracer.shader_composer import CONSTANTS


def texture_record(texture: Texture, region: Region) -> dict[str, Any]:
    """The fields of a ``Texture`` record.

    The rows are those of KHR_texture_transform: scaled, turned counter-clockwise as seen on the
    image, whose v runs downwards, and moved.
    """
    cos, sin = np.cos(texture.rotation), np.sin(texture.rotation)
    (scale_u, scale_v), (offset_u, offset_v) = texture.scale, texture.offset
    nearest = CONSTANTS["TEXTURE_NEAREST"] if texture.filter == "nearest" else 0
    return {
        "u_row": (cos * scale_u, sin * scale_v, offset_u),
        "v_row": (-sin * scale_u, cos * scale_v, offset_v),
        "coordinates": texture.coordinates,
        "channel": "rgba".index(texture.channel),
        **{name: getattr(region, name) for name in ("x", "y", "width", "height", "layer")},
        "flags": region.flags | nearest,
        "wrap_u": CONSTANTS[f"WRAP_{texture.wrap_u.upper()}"],
        "wrap_v": CONSTANTS[f"WRAP_{texture.wrap_v.upper()}"],
    }
