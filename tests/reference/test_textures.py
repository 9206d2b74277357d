# SPDX-License-Identifier: MIT
"""Textures in Mitsuba: what they show where, against numpy."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.reference.plugins import register
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import Image, Texture
from fragtracer.scene.texture import four_channels, srgb_to_linear

PIXELS = np.random.default_rng(1).integers(0, 256, (5, 7, 4), np.uint8)
UVS = np.random.default_rng(2).uniform(-2.5, 3.5, (4000, 2)).astype(np.float32)


def lookup(mi, tree, uvs=UVS):
    """The colours that Mitsuba finds at ``uvs``, (n, 3)."""
    import drjit as dr

    register()
    si = dr.zeros(mi.SurfaceInteraction3f, len(uvs))
    si.uv = mi.Point2f(uvs.T)
    loadable = {k: mi.ScalarTransform4f(v) if isinstance(v, np.ndarray) else v for k, v in tree.items()}
    return mi.load_dict(loadable).eval(si).numpy().T


def expected(texture, uvs=UVS):
    """The texture's colours as glTF 2.0 defines them, in float64."""
    c, s = np.cos(texture.rotation), np.sin(texture.rotation)
    x, y = (uvs.astype(float) * texture.scale).T
    u, v = c * x + s * y + texture.offset[0], c * y - s * x + texture.offset[1]
    values = four_channels(texture.image.pixels)[..., :3]
    values = values / 255 if values.dtype == np.uint8 else values.astype(float)
    if texture.image.color_space == "srgb":
        values = srgb_to_linear(values)
    height, width, _ = values.shape
    if texture.filter == "nearest":
        rows, columns = np.floor(v * height).astype(int), np.floor(u * width).astype(int)
        return values[wrapped(rows, height, texture.wrap_v), wrapped(columns, width, texture.wrap_u)]
    x, y = u * width - 0.5, v * height - 0.5
    left, upper = np.floor(x).astype(int), np.floor(y).astype(int)
    total = 0
    for row, wy in ((upper, 1 - (y - upper)), (upper + 1, y - upper)):
        for column, wx in ((left, 1 - (x - left)), (left + 1, x - left)):
            texel = values[wrapped(row, height, texture.wrap_v), wrapped(column, width, texture.wrap_u)]
            total = total + (wx * wy)[:, None] * texel
    return total


def wrapped(i, size, wrap):
    if wrap == "clamp":
        return np.clip(i, 0, size - 1)
    if wrap == "repeat":
        return i % size
    i = i % (2 * size)
    return np.where(i < size, i, 2 * size - 1 - i)


def worst(mi, texture, folder):
    """The largest difference, of a nearest filter but for the few points that lie between two texels."""
    error = np.abs(lookup(mi, TextureFolder(folder).exact(texture, "color")) - expected(texture)).max(axis=1)
    return np.quantile(error, 0.998) if texture.filter == "nearest" else error.max()


@pytest.mark.parametrize("wrap_u", ["repeat", "mirror", "clamp"])
@pytest.mark.parametrize("wrap_v", ["repeat", "mirror", "clamp"])
@pytest.mark.parametrize("kind", ["linear", "nearest"])
def test_wraps_and_filters(mi, tmp_path, wrap_u, wrap_v, kind):
    texture = Texture(Image(PIXELS[..., :3]), wrap_u, wrap_v, kind)
    assert worst(mi, texture, tmp_path) < 3e-5


def test_it_is_turned_and_scaled_as_khr_texture_transform_says(mi, tmp_path):
    texture = Texture(Image(PIXELS[..., :3]), offset=(0.3, -0.2), rotation=0.7, scale=(1.5, 0.8))
    assert worst(mi, texture, tmp_path) < 3e-5
    # The extension's own example: the lower left quadrant of the image.
    quadrant = replace(texture, offset=(0.0, 1.0), rotation=np.pi / 2, scale=(0.5, 0.5), filter="nearest")
    image = Image(np.arange(4, dtype=np.float32).reshape(2, 2), "linear")
    found = lookup(mi, TextureFolder(tmp_path).exact(replace(quadrant, image=image), "color"), np.array([[0.4, 0.6]]))
    assert found[0, 0] == pytest.approx(2)


@pytest.mark.parametrize("color_space", ["srgb", "linear"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_pixels_of_all_kinds(mi, tmp_path, color_space, channels, kind):
    pixels = PIXELS[..., :channels] if kind == np.uint8 else (PIXELS[..., :channels] / 200).astype(kind)
    texture = Texture(Image(pixels, color_space))
    assert worst(mi, texture, tmp_path) < 5e-5


@pytest.mark.parametrize("use", ["r", "g", "b", "a"])
def test_one_channel(mi, tmp_path, use):
    texture = Texture(Image(PIXELS, "linear"), filter="nearest")
    found = lookup(mi, TextureFolder(tmp_path).exact(texture, use), np.array([[0.5, 0.5]]))
    assert found[0] == pytest.approx([PIXELS[2, 3, "rgba".index(use)] / 255] * 3)


def test_alpha_is_never_encoded(mi, tmp_path):
    found = lookup(mi, TextureFolder(tmp_path).exact(Texture(Image(PIXELS), filter="nearest"), "a"), np.zeros((1, 2)))
    assert found[0, 0] == pytest.approx(PIXELS[0, 0, 3] / 255)


def test_a_factor_multiplies(mi, tmp_path):
    texture = Texture(Image(PIXELS[..., :3]))
    for tree in (
        TextureFolder(tmp_path).exact(texture, "color", (2.0, 1.0, 0.5)),
        TextureFolder(tmp_path / "..").nearest(texture, "color", (2.0, 1.0, 0.5)),
    ):
        np.testing.assert_allclose(lookup(mi, tree), expected(texture) * (2, 1, 0.5), atol=1e-4)


def test_mitsubas_own_bitmap_lies_the_same_way(mi, tmp_path):
    texture = Texture(Image(PIXELS[..., :3]), "mirror", "mirror", offset=(0.3, -0.2), rotation=0.7, scale=(1.5, 0.8))
    np.testing.assert_allclose(
        lookup(mi, TextureFolder(tmp_path).nearest(texture, "color")), expected(texture), atol=1e-4
    )


def test_an_image_is_written_once(tmp_path):
    folder, texture = TextureFolder(tmp_path), Texture(Image(PIXELS))
    folder.exact(texture, "color")
    folder.exact(replace(texture, wrap_u="clamp"), "color")
    folder.exact(texture, "a")
    assert len(list(tmp_path.iterdir())) == 2
