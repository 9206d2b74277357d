# SPDX-License-Identifier: MIT
"""Probes over materials and textures, each material on a triangle of its own."""

from collections.abc import Mapping, Sequence

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from fragtracer.packing import PackedScene, pack
from fragtracer.scene import Geometry, Material, Mesh, Part, Scene, Texture

from . import Floats
from .scene_probe import scene_probe


def packed_materials(materials: Sequence[Material], colored: bool = False) -> PackedScene:
    """Materials that keep their order, with vertices that have colours or not."""
    corners = np.eye(3)
    colors = np.ones((3, 4)) if colored else None
    triangle = Geometry(corners, [(0, 1, 2)], uvs=corners[:, :2], colors=colors)
    named = {f"material {i}": material for i, material in enumerate(materials)}
    scene = Scene(materials=named, meshes=(Mesh(tuple(Part(triangle, name) for name in named)),))
    return pack(scene, scene.render, 64, 64)


def material_probe(
    ctx: moderngl.Context,
    packed: PackedScene,
    body: str,
    inputs: Mapping[str, ArrayLike],
    outputs: Mapping[str, int],
) -> dict[str, Floats]:
    """A probe in which `surface` has the material `index`, the attributes `uv`, `color`, `normal` and `tangent`."""
    rows = len(np.asarray(inputs["index"]))
    nothing = {"uv": np.zeros((rows, 4)), "color": np.ones((rows, 4)), "tangent": np.zeros((rows, 4))}
    body = f"""
        Surface surface;
        surface.material = int(index); surface.uv = uv; surface.color = color;
        surface.mapped_normal = surface.shading_normal = surface.normal = normal; surface.tangent = tangent;
        {body}"""
    inputs = nothing | {"normal": np.broadcast_to((0, 0, 1), (rows, 3))} | dict(inputs)
    return scene_probe(ctx, packed, ["material/visibility.glsl"], body, inputs, outputs)


def looked_up(
    ctx: moderngl.Context,
    textures: Sequence[Texture],
    index: ArrayLike,
    uv: ArrayLike,
    body: str = "value = texture_value(texture_load(int(index)), uv);",
) -> Floats:
    """What the shader finds in ``textures[index]`` at (n, 4) coordinates of both sets, (n, 4)."""
    packed = packed_materials([Material(albedo_texture=texture) for texture in textures])
    number = {texture: i for i, texture in enumerate(dict.fromkeys(textures))}  # equal ones are there once
    inputs = {"index": np.array([number[t] for t in textures])[np.asarray(index, int)], "uv": uv}
    return scene_probe(ctx, packed, ["texture/texture.glsl"], body, inputs, {"value": 4})["value"]
