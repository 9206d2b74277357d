# SPDX-License-Identifier: MIT
"""Probes over a packed scene, and a scene with everything in it."""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.gpu.specialise import Level, specialise
from fragtracer.gpu.textures import folded_textures
from fragtracer.packing import PackedScene
from fragtracer.packing.hierarchy import RECORDS_IN_ROW
from fragtracer.packing.records import Words
from fragtracer.packing.shapes import Kind
from fragtracer.resources import folder
from fragtracer.scene import Camera, Material, Scene
from fragtracer.shader_composer import compose

from . import Floats
from .kept import kept_probe
from .light_oracle import LIGHTS
from .scene_oracle import SHAPES

LAST_UNIT = 15  # that every driver has


@lru_cache
def declared(includes: tuple[str, ...]) -> tuple[frozenset[str], Mapping[str, str]]:
    """The features of shader files together, and their uniforms by name, with their types."""
    text = "\n".join(f'#include "{path}"' for path in includes)
    source = compose("files", {}, folder("shaders"), {"files": text})
    uniforms = re.findall(r"^uniform\s+(?:highp\s+)?(\w+)\s+(\w+);", source.text, re.MULTILINE)
    tables = re.findall(r"^U?TEXELS(?:_3D)?\(\d+\)\s+(\w+);", source.text, re.MULTILINE)
    return frozenset(source.features), {name: kind for kind, name in uniforms} | dict.fromkeys(tables, "sampler")


def scene_probe(
    ctx: moderngl.Context,
    packed: PackedScene,
    includes: Sequence[str],
    body: str,
    inputs: Mapping[str, ArrayLike],
    outputs: Mapping[str, int],
    level: Level = Level.NOTHING,
) -> dict[str, Floats]:
    """A probe with ``packed`` at hand, compiled in to a ``level`` or all in textures; results in float64."""
    features, kinds = declared(tuple(includes))
    textures = folded_textures(ctx, packed.tables, [name for name in packed.tables if name in kinds])
    # Samplers of tables that the scene does not have: each another unit, since types must not share one.
    missing = [name for name, kind in kinds.items() if "sampler" in kind and name not in textures]
    uniforms = {name: LAST_UNIT - i for i, name in enumerate(missing)}
    assert len(inputs) + len(textures) + len(missing) <= LAST_UNIT + 1
    try:
        result = kept_probe(
            ctx,
            includes,
            body,
            inputs,
            outputs,
            defines={name: value for name, value in packed.features.items() if name in features},
            uniforms=uniforms | {name: value for name, value in packed.all_uniforms.items() if name in kinds},
            resources=textures,
            constants=specialise(packed, level),
        )
    finally:
        for texture in textures.values():
            texture.release()
    return {key: values.astype(np.float64) for key, values in result.items()}


def snake(name: str) -> str:
    """light_choice of LightChoice."""
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()


def light_numbers(packed: PackedScene) -> dict[tuple[int, int], int]:
    """The number of each light by its kind and the place of its record, which is in the order of the scene."""
    _, _, kind, record = packed.scene_records["LightChoice"].reshape(-1, 8)[:, :4].astype(np.int64).T
    return {key: number for number, key in enumerate(zip(kind.tolist(), record.tolist(), strict=True))}


def shape_records(packed: PackedScene) -> tuple[NDArray[np.int64], Words]:
    """The numbers of all records of u_shapes, and the records (n, 4, 4): the short list, then the BVH."""
    parts = [part.reshape(-1, 4, 4) for part in packed.tables["u_shapes"]]
    rows = [max(1, -(-len(part) // RECORDS_IN_ROW)) for part in parts]  # each begins a row
    first = RECORDS_IN_ROW * (np.cumsum(rows) - rows)
    numbers = [start + np.arange(len(part)) for start, part in zip(first, parts, strict=True)]
    return np.concatenate(numbers), np.concatenate(parts)


def triangles_of(packed: PackedScene) -> tuple[NDArray[np.int64], Floats]:
    """The records that are triangles of meshes, and their vertices (n, 3, 3)."""
    numbers, words = shape_records(packed)
    chosen = words[:, 0, 3] >> 24 == Kind.TRIANGLE
    return numbers[chosen], words[chosen].view(np.float32)[:, :3, :3].astype(np.float64)


def camera_on(scale: float, shift: float) -> Camera:
    """One that does not make the scene larger, as it would if it stayed at its default place."""
    return Camera((shift, shift, shift + 2 * scale), (shift, shift, shift))


def random_scene(
    seed: int = 1, triangles: int = 12, scale: float = 1.0, shift: float = 0.0, culled: bool = False
) -> Scene:
    """Shapes and lights of all kinds, crossing each other, in a ball of about ``scale`` metres that lies
    ``shift`` metres off the origin; every other material is there from the front alone, if ``culled``."""
    rng = np.random.default_rng(seed)

    def points(count: int) -> Floats:
        return scale * rng.normal(size=(count, 3)) + shift

    names = [f"material {i}" for i in range(10)]
    materials = {
        name: Material(
            albedo=tuple(rng.random(3).tolist()),
            roughness=float(rng.random()),
            metallic=float(rng.integers(0, 2)),
            emission=tuple(rng.random(3).tolist()) if i >= 7 else 0.0,
            double_sided=not (culled and i % 2),
        )
        for i, name in enumerate(names)
    }

    counts = dict.fromkeys(SHAPES, 5) | {"planes": 2, "triangles": triangles}
    contents: dict[str, list[Any]] = {kind: [] for kind in SHAPES}
    for kind, shape in SHAPES.items():
        for place in points(counts[kind]):
            is_plane = kind == "planes"  # which is further away, and cannot emit
            material = str(rng.choice(names[:7] if is_plane else names))
            contents[kind].append(shape(rng, 3 * place if is_plane else place, scale, material))
    contents |= {kind: model.random(rng, np.full(3, shift), scale) for kind, model in LIGHTS.items()}
    return Scene(camera=camera_on(scale, shift), materials=materials, **contents)
