# SPDX-License-Identifier: MIT
"""What the split-sum approximation looks up instead of integrating (shaders/split_sum/), computed on the GPU."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.cache import Arrays, cached
from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.resources import folder
from fragtracer.scene.content import content_digest

Floats = NDArray[np.float32]

_VERSION = 2  # of what the shaders compute; another one, and what is kept on disk is made anew
_LARGEST_MAP = 4096  # texels around; a larger environment is halved first
_LARGEST_CUBE = 512  # texels along a face of the environment
_IRRADIANCE_SOURCE = 64  # texels along a face of the level that is summed up
_LOOKUPS = 1 << 22  # in one draw, so that none takes long


@dataclass(frozen=True)
class MapSizes:
    """How finely the maps are computed; the values are those of Karis 2013.

    ``prefiltered`` and ``irradiance`` are texels along a face, powers of two; ``levels`` counts the
    roughnesses from 0 to 1, ``samples`` those for each texel, ``brdf`` the texels along the BRDF map.
    """

    prefiltered: int = 128
    levels: int = 5
    samples: int = 1024
    irradiance: int = 32
    brdf: int = 512


def environment_maps(ctx: moderngl.Context, pixels: Floats, sizes: MapSizes = MapSizes()) -> Arrays:
    """The maps of an equirectangular environment, (h, w, 3): computed, or kept from an earlier start.

    Returns
    -------
    dict
        ``irradiance`` (one level; divided by pi) and ``prefiltered`` (``levels``): cube maps in the
        layout of shaders/texture/cube.glsl, (rows, columns, 3) float32, row 0 the lowest.
    """
    key = content_digest(pixels, repr(_VERSION), repr(sizes))
    return cached("environment", key, lambda: _environment_maps(ctx, pixels, sizes), "filtering the environment")


def brdf_map(ctx: moderngl.Context, geometry: str, sizes: MapSizes = MapSizes()) -> Floats:
    """The BRDF integration map, (roughness, cosine, 3): factors of F0 and F90, and the integral of the lobe.

    ``geometry`` is a geometry term of bsdf/ggx.glsl, without its prefix.
    """
    key = content_digest(repr(_VERSION), repr(sizes), geometry)
    found = cached("brdf", key, lambda: {"map": _brdf_map(ctx, geometry, sizes)}, "integrating the BRDF")
    return found["map"]


def stacked(levels: list[Floats]) -> Floats:
    """A cube map of its levels, the widest first."""
    rows = [np.pad(level, ((0, 0), (0, levels[0].shape[1] - level.shape[1]), (0, 0))) for level in levels]
    return np.concatenate(rows)


def _environment_maps(ctx: moderngl.Context, pixels: Floats, sizes: MapSizes) -> Arrays:
    levels = pyramid(ctx, pixels)
    source = {"u_environment": stacked(levels)}
    size = levels[0].shape[0] - 2
    common = {"u_environment_size": size}
    level = max(0, (size // _IRRADIANCE_SOURCE).bit_length() - 1)
    numbers = common | {"u_level": level}
    irradiance = _cube(ctx, "irradiance", sizes.irradiance, 6 * (size >> level) ** 2, source, numbers)
    prefiltered = []
    for level in range(sizes.levels):
        alpha = (level / max(sizes.levels - 1, 1)) ** 2
        numbers = common | {"u_environment_levels": len(levels), "u_alpha": alpha, "u_samples": sizes.samples}
        face = sizes.prefiltered >> level
        prefiltered.append(_cube(ctx, "prefilter", face, 2 * sizes.samples, source, numbers))
    return {"irradiance": irradiance, "prefiltered": stacked(prefiltered)}


def _brdf_map(ctx: moderngl.Context, geometry: str, sizes: MapSizes) -> Floats:
    numbers = {"u_inverse_size": (1 / sizes.brdf,) * 2, "u_samples": sizes.samples}
    defines = {"GEOMETRY_TERM": f"GEOMETRY_{geometry}"}
    return _draw(ctx, "brdf_map", (sizes.brdf, sizes.brdf), sizes.samples, {}, numbers, defines)


def pyramid(ctx: moderngl.Context, pixels: Floats) -> list[Floats]:
    """An equirectangular map as the levels of a cube map, down to faces of one texel."""
    while max(pixels.shape) > _LARGEST_MAP:
        pixels = _halved(pixels)
    around = max(pixels.shape[1], 2 * pixels.shape[0])
    size = min(_LARGEST_CUBE, max(_IRRADIANCE_SOURCE, 1 << (around // 4 - 1).bit_length()))
    taps = int(np.ceil(4 * around / (np.pi * size)))
    numbers = {"u_size": size, "u_taps": taps}
    levels = [_cube(ctx, "from_equirect", size, taps**2, {"u_map": _evened(pixels)}, numbers)]
    while size > 1:
        levels.append(_cube(ctx, "halve", size // 2, 4, {"u_cube": levels[-1]}, {"u_size": size}))
        size //= 2
    return levels


def _cube(
    ctx: moderngl.Context, program: str, size: int, lookups: int, source: dict[str, Floats], numbers: dict[str, Any]
) -> Floats:
    """One level of a cube map of faces ``size`` wide."""
    return _draw(ctx, program, (6 * (size + 2), size + 2), lookups, source, {"u_size": size} | numbers)


def _draw(
    ctx: moderngl.Context,
    name: str,
    size: tuple[int, int],
    lookups: int,
    source: Mapping[str, Floats],
    numbers: Mapping[str, Any],
    defines: Mapping[str, int | str] | None = None,
) -> Floats:
    """What the program makes of ``source``, its one texture if it has one, taking ``lookups`` for each texel."""
    width, height = size
    program = FullscreenProgram(ctx, folder("shaders"), f"split_sum/{name}.frag", defines)
    program.set(dict.fromkeys(source, 0) | dict(numbers))
    textures = [texture_of(ctx, pixels) for pixels in source.values()]
    target = ctx.texture(size, 4, dtype="f4")
    rows = max(1, _LOOKUPS // (width * lookups))
    with drawing_to(ctx, [target]) as outputs:
        for row in range(0, height, rows):
            outputs.restrict(row, min(rows, height - row))
            for texture in textures:
                texture.use(0)
            program.draw()
            ctx.finish()
    pixels = np.frombuffer(target.read(), np.float32).reshape(height, width, 4)
    program.release()
    for texture in (target, *textures):
        texture.release()
    return np.ascontiguousarray(pixels[..., :3])


def texture_of(ctx: moderngl.Context, pixels: Floats) -> moderngl.Texture:
    """``pixels`` (rows, columns, 3), row 0 the lowest, filtered linearly; around in u, to the edge in v."""
    height, width, _ = pixels.shape
    texture = ctx.texture((width, height), 3, np.ascontiguousarray(pixels, np.float32).tobytes(), dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_y = False
    return texture


def _evened(pixels: Floats) -> Floats:
    """Each row smeared around by a tent, until its texels are as wide as those of the equator: else lookups
    would miss small lights near the poles, where texels are narrow."""
    height, width, _ = pixels.shape
    sines = np.sin(np.pi * (np.arange(height) + 0.5) / height)
    spans = np.minimum(width, 2 * np.round((1 / sines - 1) / 2).astype(int) + 1)  # odd, so that nothing moves
    rows = [_smeared(_smeared(row.astype(np.float64), n), n) for row, n in zip(pixels, spans, strict=True)]
    return np.stack(rows).astype(np.float32)


def _smeared(row: NDArray[np.float64], span: int) -> NDArray[np.float64]:
    """The mean of ``span`` neighbours, around."""
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(np.concatenate([row, row[:span]]), axis=0)])
    means: NDArray[np.float64] = (sums[span : len(row) + span] - sums[: len(row)]) / span
    return np.roll(means, span // 2, axis=0)


def _halved(pixels: Floats) -> Floats:
    """Each texel the mean of four, as far as there are as many."""
    height, width, _ = pixels.shape
    tall, wide = min(2, height), min(2, width)
    blocks = pixels[: height // tall * tall, : width // wide * wide]
    blocks = blocks.reshape(height // tall, tall, width // wide, wide, 3)
    return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float64), np.float32)
