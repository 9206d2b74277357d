# SPDX-License-Identifier: MIT
"""The atlas: every image whole, at its own place, and made smaller only with a warning and by means over areas."""

import re
import tracemalloc

import numpy as np
import pytest

from fragtracer.packing.atlas import COLUMNS, ROWS, Atlas, build_atlas
from fragtracer.resources import folder
from fragtracer.scene import Image

RNG = np.random.default_rng(2)
TEXT = (folder("shaders") / "scene" / "texture.glsl").read_text("utf-8")
SRGB, FLOAT = (int(re.search(rf"const int TEXTURE_{name} = (\d+);", TEXT)[1]) for name in ("SRGB", "FLOAT"))


def random_image(height: int, width: int, color_space: str = "linear") -> Image:
    return Image(RNG.integers(0, 256, (height, width, 4), np.uint8), color_space)


def region_of(atlas: Atlas, image: Image) -> np.ndarray:
    r = atlas.regions[image]
    texels = (atlas.floats if r.flags & FLOAT else atlas.bytes).reshape(-1, 4)
    return texels[r.first : r.first + r.width * r.height].reshape(r.height, r.width, 4)


@pytest.mark.parametrize("max_side", [4096, 64])
def test_every_image_is_whole(max_side: int) -> None:
    images = [random_image(*RNG.integers(1, 65, 2)) for _ in range(60)]
    images += [Image(RNG.random((9, 5, 3)), "linear"), random_image(3, 64, "srgb")]
    atlas = build_atlas([*images, images[0]], max_side)
    assert set(atlas.regions) == set(images)
    for image in images[:60]:
        assert np.array_equal(region_of(atlas, image), image.pixels)
    assert np.array_equal(region_of(atlas, images[60])[..., :3], images[60].pixels)
    assert [atlas.regions[image].flags for image in images[59:]] == [0, FLOAT, SRGB]


def test_images_of_any_sizes_leave_no_gap() -> None:
    """But for the last row of few texels, and the last layer of many."""
    images = [random_image(*size) for size in ((1300, 700), (600, 1500), (33, 7), (4000, 3), (1, 1))]
    count = sum(image.pixels.shape[0] * image.pixels.shape[1] for image in images)
    atlas = build_atlas(images)
    assert atlas.bytes.shape == (2, ROWS, COLUMNS, 4)
    assert ROWS * COLUMNS < count < 2 * ROWS * COLUMNS
    for image in images:
        assert np.array_equal(region_of(atlas, image), image.pixels)
    assert build_atlas(images[2:4]).bytes.shape == (1, 3, COLUMNS, 4)


def test_the_shader_finds_texels_there() -> None:
    text = (folder("shaders") / "texture" / "texture.glsl").read_text("utf-8")
    assert f"i & {COLUMNS - 1}, (i >> {COLUMNS.bit_length() - 1}) & {ROWS - 1}" in text
    assert f"i >> {(COLUMNS * ROWS).bit_length() - 1}" in text


def test_no_image_of_a_kind_is_no_layer() -> None:
    atlas = build_atlas([random_image(2, 2)])
    assert (len(atlas.bytes), len(atlas.floats)) == (1, 0)


def test_the_same_images_are_laid_out_once() -> None:
    images = [random_image(4, 4), random_image(4, 5)]
    again = [Image(image.pixels.copy(), "linear") for image in images]
    assert build_atlas(images) is build_atlas(again)


@pytest.mark.parametrize("color_space", ["srgb", "linear"])
def test_too_large_an_image_becomes_means_of_light(color_space: str) -> None:
    pixels = np.kron(RNG.integers(0, 256, (16, 8, 4)), np.ones((4, 4, 1))).astype(np.uint8)
    image = Image(pixels, color_space, file="big.png")
    with pytest.warns(UserWarning, match=r"big\.png is made smaller, from 32x64 to 8x16: a texture may be 16"):
        atlas = build_atlas([image], 16)
    assert np.array_equal(region_of(atlas, image), pixels[::4, ::4])


def test_means_over_parts_of_texels() -> None:
    pixels = RNG.random((7, 6, 4)).astype(np.float32)
    image = Image(pixels, "linear")
    with pytest.warns(UserWarning, match="from 6x7 to 4x5"):
        found = region_of(build_atlas([image], 5), image)
    fine = np.kron(pixels, np.ones((5, 4, 1)))  # 35 x 24 texels, of which 7 x 6 make a new one
    np.testing.assert_allclose(found, fine.reshape(5, 7, 4, 6, 4).mean(axis=(1, 3)), rtol=1e-6)


def test_black_and_white_average_to_half_the_light() -> None:
    checker = np.indices((8, 8)).sum(axis=0)[..., None] % 2 * np.full(3, 255)
    image = Image(checker.astype(np.uint8), "srgb")
    with pytest.warns(UserWarning, match="made smaller"):
        found = region_of(build_atlas([image], 4), image)
    assert (found[..., :3] == 188).all()


def test_what_takes_too_much_memory_is_made_smaller() -> None:
    images = [random_image(64, 64), random_image(32, 32)]
    with pytest.warns(UserWarning, match="from 64x64 to 32x32: textures may take"):
        atlas = build_atlas(images, max_bytes=10000)
    assert np.array_equal(region_of(atlas, images[1]), images[1].pixels)


@pytest.mark.parametrize("max_side", [512, 500])
def test_a_large_image_is_made_smaller_in_little_memory(max_side: int) -> None:
    """A .glb of a megabyte can hold several of 8192 x 8192; all at once as floats they would take 4 GiB each."""
    pixels = np.broadcast_to(np.uint8(100), (4096, 4096, 3)).copy()
    image = Image(pixels)
    tracemalloc.start()
    with pytest.warns(UserWarning, match=f"from 4096x4096 to {max_side}x{max_side}"):
        atlas = build_atlas([image], max_side=max_side)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * 4096 * 4096 * 4
    assert (region_of(atlas, image)[..., :3] == 100).all()
