# SPDX-License-Identifier: MIT
"""Probes over textures in their atlas."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from fragtracer.gpu.probe import probe
from fragtracer.packing.atlas import Atlas, build_atlas
from fragtracer.packing.records import scene_layout, texels_of
from fragtracer.packing.textures import texture_record
from fragtracer.scene import Texture

from . import Floats


@contextmanager
def uploaded(ctx: moderngl.Context, atlas: Atlas) -> Iterator[dict[str, moderngl.TextureArray]]:
    """The atlas on the GPU, by the names of its samplers."""
    arrays = {"u_byte_texels": (atlas.bytes, "f1"), "u_float_texels": (atlas.floats, "f4")}
    textures = {}
    for name, (array, dtype) in arrays.items():
        if len(array):
            layers, height, width, _ = array.shape
            textures[name] = ctx.texture_array((width, height, layers), 4, array.tobytes(), dtype=dtype)
            textures[name].filter = (moderngl.NEAREST, moderngl.NEAREST)
    try:
        yield textures
    finally:
        for texture in textures.values():
            texture.release()


def looked_up(
    ctx: moderngl.Context, textures: Sequence[Texture], index: ArrayLike, uv: ArrayLike, body: str = ""
) -> Floats:
    """What the shader finds in ``textures[index]`` at (n, 4) coordinates of both sets, (n, 4)."""
    atlas = build_atlas(texture.image for texture in textures)
    records = {"Texture": [texture_record(t, atlas.regions[t.image]) for t in textures]}
    texels = texels_of("Texture", records["Texture"])
    defines = {
        "SCENE_TEXELS": len(texels),
        "HAS_TEXTURES": 1,
        "HAS_BYTE_TEXTURES": int(len(atlas.bytes) > 0),
        "HAS_FLOAT_TEXTURES": int(len(atlas.floats) > 0),
    }
    block = ctx.buffer(texels.tobytes())
    try:
        with uploaded(ctx, atlas) as samplers:
            return probe(
                ctx,
                ["core/constants.glsl", "generated/scene_layout.glsl", "texture/texture.glsl"],
                body or "value = texture_value(texture_select(int(index)), uv);",
                {"index": index, "uv": uv},
                {"value": 4},
                defines,
                {"generated/scene_layout.glsl": scene_layout(records, texels, False)},
                resources={"SceneBlock": block, **samplers},
            )["value"].astype(np.float64)
    finally:
        block.release()
