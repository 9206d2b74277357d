# SPDX-License-Identifier: MIT
"""texture/: every wrap, filter and kind of image against float64."""

from itertools import product

import moderngl
import numpy as np
import pytest

from fragtracer.scene import Image, Texture

from . import Floats
from .texture_oracle import linear_pixels, lookup, transformed
from .texture_probe import looked_up

RNG = np.random.default_rng(1)
WRAPS = ("repeat", "mirror", "clamp")
SIZES = [(1, 1), (1, 5), (5, 1), (2, 2), (7, 3), (16, 64), (33, 8)]  # height, width


def image(size: tuple[int, int], kind: str = "srgb", channels: int = 4) -> Image:
    if kind == "float":
        return Image(RNG.uniform(0, 20, (*size, channels)).astype(np.float32), "linear")
    if kind == "float srgb":
        return Image(RNG.random((*size, channels)).astype(np.float32), "srgb")
    return Image(RNG.integers(0, 256, (*size, channels), np.uint8), kind)


def coordinates(textures: list[Texture], count: int = 2000) -> tuple[Floats, Floats]:
    """Indices and coordinates: inside, around, far off, negative, and the centres and edges of texels."""
    index = RNG.integers(0, len(textures), count)
    sizes = np.array([t.image.pixels.shape[1::-1] for t in textures])[index]
    scale = 10.0 ** RNG.integers(0, 6, (count, 1))
    uv = RNG.uniform(-1, 1, (count, 2)) * np.where(RNG.random((count, 1)) < 0.5, 1, scale)
    places = RNG.integers(-20, 20, (count, 2)) / 2 / sizes
    return index, np.where(RNG.random((count, 1)) < 0.5, uv, places).astype(np.float32)


def uncertainty(texture: Texture, uv: Floats) -> Floats:
    """How many texels float32 may be off, (n, 1): of the position alone, or of the transform's sums as well."""
    size = max(texture.image.pixels.shape[:2])
    identity = (texture.rotation, texture.scale, texture.offset) == (0, (1, 1), (0, 0))
    sums = 1 if identity else 2 + 4 * np.abs(uv * texture.scale).max(axis=1, keepdims=True)
    return 2e-7 * size * sums * np.ones((len(uv), 1))


def compare(ctx: moderngl.Context, textures: list[Texture]) -> None:
    index, uv = coordinates(textures)
    uv = np.concatenate([uv, RNG.random(uv.shape).astype(np.float32)], axis=1)
    found = looked_up(ctx, textures, index, uv)
    checked = 0
    for i, texture in enumerate(textures):
        chosen = index == i
        own = uv[chosen, 2 * texture.coordinates :][:, :2].astype(np.float64)
        expected = lookup(texture, own)
        slack = uncertainty(texture, own)
        kept = np.ones(len(own), bool)
        if texture.filter == "nearest":  # but for those whose texel is uncertain
            position = transformed(texture, own) * texture.image.pixels.shape[1::-1]
            kept = (np.abs(position - np.rint(position)) > slack).all(axis=1)
            slack = slack * 0
        error = np.abs(found[chosen] - expected) / linear_pixels(texture.image).max()
        np.testing.assert_array_less(error[kept], (1e-6 + 2 * slack + 0 * error)[kept])
        checked += kept.sum()
    assert checked > 0.4 * len(index)


@pytest.mark.parametrize("kind", ["srgb", "linear", "float", "float srgb"])
@pytest.mark.parametrize("filtering", ["linear", "nearest"])
def test_lookup(ctx: moderngl.Context, kind: str, filtering: str) -> None:
    images = [image(size, kind) for size in SIZES]
    compare(ctx, [Texture(i, u, v, filtering) for i in images for u, v in product(WRAPS, WRAPS)])


@pytest.mark.parametrize("filtering", ["linear", "nearest"])
def test_transform_and_second_coordinates(ctx: moderngl.Context, filtering: str) -> None:
    textures = [
        Texture(image((8, 8)), filter=filtering, offset=(0.3, -0.2)),
        Texture(image((8, 8)), filter=filtering, scale=(3.0, -0.5)),
        Texture(image((8, 8)), "mirror", "clamp", filtering, rotation=0.7),
        Texture(image((5, 7), "float"), "clamp", "repeat", filtering, (0.1, 0.2), -2.0, (1.5, 2.5), 1),
        Texture(image((5, 7)), filter=filtering, coordinates=1),
    ]
    compare(ctx, textures)


def test_nearest_takes_the_texel_that_begins_at_an_edge(ctx: moderngl.Context) -> None:
    textures = [Texture(image((16, 8)), u, v, "nearest") for u, v in product(WRAPS, WRAPS)]
    x, y = np.meshgrid(np.arange(-24, 24), np.arange(-40, 40))
    uv = np.stack([x.ravel() / 8, y.ravel() / 16], axis=1)
    for i, texture in enumerate(textures):
        inside = ((uv > -3) & (uv < 3)).all(axis=1)
        if "mirror" in (texture.wrap_u, texture.wrap_v):  # there an edge belongs to the texel on its other side
            inside &= (np.mod(uv, 2) < 1).all(axis=1)
        if "clamp" in (texture.wrap_u, texture.wrap_v):
            inside &= (uv < 1).all(axis=1)
        found = looked_up(ctx, textures, np.full(len(uv), i), np.concatenate([uv, uv], axis=1))
        np.testing.assert_allclose(found[inside], lookup(texture, uv)[inside], atol=1e-6)


def test_decoding_of_every_byte(ctx: moderngl.Context) -> None:
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 4, axis=2)
    texture = Texture(Image(ramp), "clamp", "clamp", "nearest")
    uv = np.stack([(np.arange(256) + 0.5) / 256, np.full(256, 0.5)], axis=1)
    found = looked_up(ctx, [texture], np.zeros(256), np.concatenate([uv, uv], axis=1))
    np.testing.assert_allclose(found, linear_pixels(texture.image)[0], rtol=2e-6, atol=1e-9)


def test_few_channels(ctx: moderngl.Context) -> None:
    for channels in (1, 2, 3):
        for kind in ("srgb", "linear", "float"):
            texture = Texture(image((3, 4), kind, channels))
            uv = RNG.random((50, 2)).astype(np.float32)
            found = looked_up(ctx, [texture], np.zeros(50), np.concatenate([uv, uv], axis=1))
            np.testing.assert_allclose(found, lookup(texture, uv), rtol=5e-6, atol=1e-6)


def test_channel(ctx: moderngl.Context) -> None:
    source = image((3, 3))
    textures = [Texture(source, channel=c) for c in "rgba"]
    uv = np.tile(RNG.random((1, 2)).astype(np.float32), (4, 2))
    body = "value = vec4(texture_channel(texture_load(int(index)), uv));"
    found = looked_up(ctx, textures, np.arange(4), uv, body)
    np.testing.assert_allclose(found[:, 0], lookup(textures[0], uv[:1, :2])[0], rtol=1e-5)


def test_bytes_and_floats_together(ctx: moderngl.Context) -> None:
    compare(ctx, [Texture(image(size, kind)) for size in SIZES for kind in ("srgb", "float", "linear")])
