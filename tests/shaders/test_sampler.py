# SPDX-License-Identifier: MIT
"""sampler/: the random numbers of a path, from the texture and from the hash."""

from collections.abc import Iterator, Mapping

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu.tracer import upload_random_texture
from fragtracer.packing.random_texture import LAYERS, WIDTH
from fragtracer.probe import probe

from . import Floats
from .chi_square import assert_uniform
from .kept import kept_probe

Integers = NDArray[np.integer]

KINDS = ["TEXTURE", "HASH"]
BLOCK = WIDTH * WIDTH  # samples between two randomisations of the texture's points
# The first vertices, those that share a layer with them, and the extra dimensions of a vertex.
DIMENSIONS = [0, 1, 2, 5, LAYERS, LAYERS + 1, 0x10000, 0x10001, 0x20000]


@pytest.fixture(scope="module")
def random_texture(ctx: moderngl.Context) -> Iterator[moderngl.Texture3D]:
    with ctx:  # not yet current: this is set up before the tests are
        texture = upload_random_texture(ctx)
    yield texture
    with ctx:
        texture.release()


def draw(
    ctx: moderngl.Context,
    texture: moderngl.Texture3D,
    kind: str,
    pixel: Integers,
    index: Integers,
    dimension: Integers,
    seed: int = 0,
    body: str = "u = sampler_vec4(ivec2(pixel), uint(index), int(dimension), spare);",
    outputs: Mapping[str, int] | None = None,
) -> dict[str, Floats]:
    """The numbers ``u`` and ``spare`` of each row, or what another ``body`` makes of it."""
    columns = np.broadcast_arrays(np.asarray(pixel)[..., 0], np.asarray(pixel)[..., 1], index, dimension)
    x, y, index, dimension = (np.ravel(c) for c in columns)
    return kept_probe(
        ctx,
        ["sampler/sampler.glsl"],
        body,
        {"pixel": np.column_stack([x, y]), "index": index, "dimension": dimension},
        outputs or {"u": 4, "spare": 1},
        defines={"SAMPLER": f"SAMPLER_{kind}"},
        uniforms={"u_seed": seed},
        resources={"u_random_texture": texture} if kind == "TEXTURE" else None,
    )


def random_uses(seed: int, count: int = 1 << 20) -> dict[str, Integers]:
    """Pixels, sample indices and dimensions without any order."""
    rng = np.random.default_rng(seed)
    return {
        "pixel": rng.integers(0, 4096, (count, 2)),
        "index": rng.integers(0, 1 << 18, count),
        "dimension": rng.choice(DIMENSIONS, count),
    }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_numbers_are_uniform(ctx: moderngl.Context, random_texture: moderngl.Texture3D, kind: str, seed: int) -> None:
    """One by one and in pairs; of four million none is 1 (assert_uniform looks)."""
    result = draw(ctx, random_texture, kind, seed=seed, **random_uses(1))
    numbers = np.column_stack([result["u"], result["spare"]])
    alone = {f"{i}": numbers[:, i] for i in range(5)}
    assert_uniform(alone | {f"{i}, {j}": numbers[:, [i, j]] for i in range(5) for j in range(i)})


@pytest.mark.parametrize("kind", KINDS)
def test_indices_may_be_any_word(ctx: moderngl.Context, random_texture: moderngl.Texture3D, kind: str) -> None:
    """Sample indices times light samples may pass 2^24, where floats have gaps, and 2^31."""
    high = np.repeat([0, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFF], 1 << 16)
    low = np.tile(np.arange(1 << 16), 6)
    body = "u = sampler_vec4(ivec2(pixel), (uint(index) << 16u) | uint(pixel.x), 3, spare);"
    pixel = np.column_stack([low, np.zeros(len(low))])
    result = draw(ctx, random_texture, kind, pixel, high, 0, body=body)
    assert_uniform({f"{i}": result["u"][:, i] for i in range(4)} | {"spare": result["spare"]})


# What two uses of randomness may differ in. Within a block the texture's points avoid each other
# on purpose, so samples are compared across blocks.
NEIGHBOURS = {
    "pixel x": {"pixel": (1, 0)},
    "pixel y": {"pixel": (0, 1)},
    "dimension": {"dimension": 1},
    "layer": {"dimension": LAYERS},
    "light": {"dimension": 0x10000},
    "block": {"index": BLOCK},
    "four blocks": {"index": 4 * BLOCK},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", NEIGHBOURS)
def test_neighbours_are_independent(
    ctx: moderngl.Context, random_texture: moderngl.Texture3D, kind: str, step: str
) -> None:
    """Pairs of the same number in two uses, and of two numbers, are uniform over the square."""
    uses = random_uses(5, 1 << 19)
    moved = uses | {name: uses[name] + np.asarray(by) for name, by in NEIGHBOURS[step].items()}
    here, there = (draw(ctx, random_texture, kind, **u) for u in (uses, moved))
    pairs = {f"{i}, {j}": np.column_stack([here["u"][:, i], there["u"][:, j]]) for i in range(4) for j in range(4)}
    assert_uniform(pairs | {"spare": np.column_stack([here["spare"], there["spare"]])})


@pytest.mark.parametrize("kind", KINDS)
def test_seeds_are_independent(ctx: moderngl.Context, random_texture: moderngl.Texture3D, kind: str) -> None:
    here, there = (draw(ctx, random_texture, kind, seed=seed, **random_uses(3, 1 << 19)) for seed in (7, 8))
    assert_uniform({f"{i}": np.column_stack([here["u"][:, i], there["u"][:, i]]) for i in range(4)})


@pytest.mark.parametrize("kind", KINDS)
def test_spare_of_one_pixel(ctx: moderngl.Context, random_texture: moderngl.Texture3D, kind: str) -> None:
    """It changes with every sample: uniform over time, unlike its predecessor and the four beside it."""
    for dimension in (0, 3):
        result = draw(ctx, random_texture, kind, (7, 11), np.arange(1 << 18), dimension)
        spare = result["spare"]
        pairs = {f"and {i}": np.column_stack([spare, result["u"][:, i]]) for i in range(4)}
        pairs |= {f"{lag} before": np.column_stack([spare[lag:], spare[:-lag]]) for lag in (1, 2, 64)}
        assert_uniform({"alone": spare} | pairs)
        assert len(np.unique(spare)) > 0.98 * len(spare)  # 2^18 of 2^23 values: 1.5 % meet by chance


@pytest.mark.parametrize("count", [16, 64, BLOCK])
def test_first_samples_are_stratified(ctx: moderngl.Context, random_texture: moderngl.Texture3D, count: int) -> None:
    """For each pixel and dimension, the first 2^k samples, and every aligned 2^k after them, have one
    in each interval of 2^-k of each coordinate, and one in each box of area 2^-k of the first two."""
    rng = np.random.default_rng(4)
    pixel = rng.integers(0, 4096, (32, 1, 1, 2))
    for start in (0, 3 * BLOCK, 5 * BLOCK - count):
        index = start + np.arange(count)
        uses = (pixel, index, np.array(DIMENSIONS)[:, None])
        u = draw(ctx, random_texture, "TEXTURE", *uses, seed=9)["u"].reshape(-1, count, 4)
        interval = np.sort((u * count).astype(int), axis=1)
        np.testing.assert_array_equal(interval, np.broadcast_to(np.arange(count)[:, None], interval.shape))
        for rows in (2**k for k in range(count.bit_length())):
            box = (u[..., 0] * rows).astype(int) * (count // rows) + (u[..., 1] * (count // rows)).astype(int)
            np.testing.assert_array_equal(np.sort(box, axis=1), np.broadcast_to(np.arange(count), box.shape))


def test_blocks_differ(ctx: moderngl.Context, random_texture: moderngl.Texture3D) -> None:
    """Later samples are new points, not the first ones again in another order."""
    u = draw(ctx, random_texture, "TEXTURE", (3, 5), np.arange(16 * BLOCK), 2)["u"]
    assert len(np.unique(u, axis=0)) == len(u)
    assert len(np.unique(u[:, 0])) > 0.99 * len(u)


# Integrands over several dimensions: the product of 2 u of each; its mean is 1. And the most of the variance of
# independent numbers that is left.
PRODUCTS = {
    "within one": ([(2, "x"), (2, "w")], 1e-3),
    "camera and vertex": ([(0, "x"), (1, "x")], 1e-3),
    "two vertices": ([(1, "y"), (2, "z")], 1e-3),
    "three vertices": ([(1, "x"), (2, "y"), (3, "z")], 0.05),
    "two groups": ([(1, "z"), (14, "x")], 0.75),
    "one layer": ([(1, "x"), (1 + LAYERS, "x")], 0.75),
}


def mean_errors(
    ctx: moderngl.Context, texture: moderngl.Texture3D, kind: str, factors: list[tuple[int, str]], pixels: int
) -> Floats:
    """Error of the mean over each block of samples, (pixels, 16)."""
    product = " * ".join(f"2.0 * sampler_vec4(ivec2(pixel), i, {d}, spare).{lane}" for d, lane in factors)
    body = f"""
        float spare;
        for (int row = 0; row < {WIDTH}; row++) {{
            float part = 0.0;
            for (int k = 0; k < {WIDTH}; k++) {{
                uint i = uint(index) * {BLOCK}u + uint(row * {WIDTH} + k);
                part += {product} - 1.0;
            }}
            sum += part;
        }}"""
    pixel = np.column_stack([np.arange(pixels) % 32, np.arange(pixels) // 32])[:, None]
    return draw(ctx, texture, kind, pixel, np.arange(16), 0, 1, body, {"sum": 1})["sum"].reshape(pixels, 16) / BLOCK


@pytest.mark.slow
@pytest.mark.parametrize("name", PRODUCTS)
def test_mean_converges_without_floor(ctx: moderngl.Context, random_texture: moderngl.Texture3D, name: str) -> None:
    """Up to 65,536 samples the error falls as that of independent blocks, the mean over all pixels is
    right, and the error is below that of a hash: a group of layers is one net, which integrates products
    of its dimensions almost exactly. The product of two groups is left to chance: of (2 u)(2 v) that is
    1/9 of 7/9 if two dimensions are paired wholly at random; the nested orders pair them a little less well."""
    pixels, (factors, most) = 1024, PRODUCTS[name]
    known_to = 5 * np.sqrt(2 / pixels)  # the mean of as many squares, where the errors are normal
    independent = (4 / 3) ** len(factors) - 1
    for kind in KINDS:
        error = mean_errors(ctx, random_texture, kind, factors, pixels).astype(np.float64)
        variance = (error**2).mean() * BLOCK
        mean = error.mean(axis=1)
        assert (mean**2).mean() * 16 * BLOCK == pytest.approx(variance, rel=known_to), kind
        assert abs(mean.mean()) < 4.5 * mean.std() / np.sqrt(pixels) + 3e-7, kind  # u has 23 digits
        if kind == "HASH":
            assert variance == pytest.approx(independent, rel=known_to / 4)
        else:
            assert variance < most * independent


def test_no_two_uses_share_a_dimension(ctx: moderngl.Context) -> None:
    """Of the camera, and of the vertices of a path of a thousand."""
    body = """
        int i = int(k);
        of_vertex = vec4(dimension_vertex(i), dimension_light(i), dimension_ambient(i), dimension_medium(i));
        of_camera = float(dimension_camera());"""
    found = probe(ctx, ["sampler/sampler.glsl"], body, {"k": np.arange(1000.0)}, {"of_vertex": 4, "of_camera": 1})
    dimensions = [*found["of_vertex"].ravel(), found["of_camera"][0]]
    assert len(set(dimensions)) == len(dimensions)
    assert min(dimensions) >= 0
