# SPDX-License-Identifier: MIT
"""Tables of texels as textures."""

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

WIDTH = 4096  # that of shape/mesh.glsl, and ENVIRONMENT_WIDTH of emitter/environment.glsl


def folded_texture(ctx: moderngl.Context, texels: NDArray[Any]) -> moderngl.Texture:
    """A texture of ``texels``, float16, float32 or uint32 (n, 4), in rows of WIDTH."""
    whole = len(texels) // WIDTH
    rows = -(-len(texels) // WIDTH)
    texture = ctx.texture((WIDTH, rows), 4, dtype=f"{texels.dtype.kind}{texels.dtype.itemsize}")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    if whole:
        texture.write(texels[: whole * WIDTH].data, (0, 0, WIDTH, whole))
    if rows > whole:
        last = np.zeros((WIDTH, 4), texels.dtype)
        last[: len(texels) - whole * WIDTH] = texels[whole * WIDTH :]
        texture.write(last.data, (0, whole, WIDTH, 1))
    return texture
