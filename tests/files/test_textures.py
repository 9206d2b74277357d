# SPDX-License-Identifier: MIT
"""Image files as textures: every bit of the pixels, their channels, and one clear message for what is wrong."""

import io
import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import png
import pytest
from PIL import Image as Picture

from fragtracer.errors import FragtracerError
from fragtracer.io.images import read_image, write_image
from fragtracer.io.textures import read_texture

RNG = np.random.default_rng(1)


def file_of(picture: Picture.Image, kind: str, **options: object) -> bytes:
    buffer = io.BytesIO()
    picture.save(buffer, kind, **options)
    return buffer.getvalue()


@pytest.mark.parametrize("kind", ["PNG", "BMP", "TGA", "WEBP"])
def test_lossless_kinds_keep_every_bit(tmp_path: Path, kind: str) -> None:
    pixels = RNG.integers(0, 256, (5, 7, 3), np.uint8)
    path = tmp_path / f"a.{kind.lower()}"
    path.write_bytes(file_of(Picture.fromarray(pixels), kind, **({"lossless": True} if kind == "WEBP" else {})))
    read = read_texture(path)
    assert np.array_equal(read.pixels, pixels)
    assert (read.color_space, read.file) == ("srgb", str(path))


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("interlace", [False, True])
def test_png_of_each_depth(channels: int, bits: int, interlace: bool) -> None:
    pixels = RNG.integers(0, 2**bits, (6, 5, channels))
    buffer = io.BytesIO()
    writer = png.Writer(5, 6, greyscale=channels < 3, alpha=channels in (2, 4), bitdepth=bits, interlace=interlace)
    writer.write(buffer, pixels.reshape(6, -1).tolist())
    read = read_texture(buffer.getvalue(), "linear", "a.png").pixels
    assert read.dtype == (np.uint8 if bits == 8 else np.float32)
    np.testing.assert_allclose(read * (1 if bits == 8 else 65535.0), pixels, atol=0.01)


@pytest.mark.parametrize("key", [(300,), (300, 2, 65535)])
@pytest.mark.parametrize("bits", [8, 16])
def test_the_transparent_colour_of_a_png(key: tuple[int, ...], bits: int) -> None:
    """One pixel of it, one that differs in a channel, which of 16 bits is in the lower byte alone."""
    pixels = np.array([[key, (*key[:-1], key[-1] ^ 1)]]) % 2**bits
    buffer = io.BytesIO()
    transparent = tuple(pixels[0, 0].tolist())
    writer = png.Writer(2, 1, greyscale=len(key) == 1, bitdepth=bits, transparent=transparent)
    writer.write(buffer, pixels.reshape(1, -1).tolist())
    read = read_texture(buffer.getvalue()).pixels
    scale = 1 if bits == 8 else 65535
    np.testing.assert_allclose(read[..., -1] * scale, [[0, 2**bits - 1]])
    np.testing.assert_allclose(read[..., : len(key)] * scale, pixels, rtol=1e-6)


def test_palette_with_and_without_transparency() -> None:
    picture = Picture.new("P", (2, 1))
    picture.putpalette([10, 20, 30, 200, 150, 100])
    picture.putdata([0, 1])
    assert read_texture(file_of(picture, "PNG")).pixels.tolist() == [[[10, 20, 30], [200, 150, 100]]]
    read = read_texture(file_of(picture, "PNG", transparency=0)).pixels.tolist()
    assert read == [[[10, 20, 30, 0], [200, 150, 100, 255]]]


def test_black_and_white_and_print_colours_become_grey_and_rgb() -> None:
    assert read_texture(file_of(Picture.new("1", (2, 2), 1), "PNG")).pixels.tolist() == [[[255]] * 2] * 2
    read = read_texture(file_of(Picture.new("CMYK", (8, 8), (0, 255, 255, 0)), "JPEG")).pixels
    assert read.shape == (8, 8, 3)
    np.testing.assert_allclose(read[0, 0], (255, 0, 0), atol=3)


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".npy"])
def test_floats_are_linear(tmp_path: Path, suffix: str) -> None:
    pixels = np.full((3, 4, 3), 2.5, np.float32)
    write_image(tmp_path / f"a{suffix}", pixels)
    read = read_texture(tmp_path / f"a{suffix}", "srgb")
    assert np.array_equal(read.pixels, pixels)
    assert read.color_space == "linear"


def test_alpha_of_floats_is_kept(tmp_path: Path) -> None:
    """Of .exr files where it belongs to the colours that are read, and of .npy files."""
    pixels = RNG.random((3, 4, 4)).astype(np.float32)
    np.save(tmp_path / "a.npy", pixels)
    for suffix, layer in (("npy", ""), ("exr", ""), ("exr", "view.")):
        channels = {f"{layer}{name}": pixels[..., i].copy() for i, name in enumerate("RGBA")}
        if suffix == "exr":
            with OpenEXR.File({}, channels) as file:
                file.write(str(tmp_path / "a.exr"))
        assert np.array_equal(read_texture(tmp_path / f"a.{suffix}").pixels, pixels)
    assert np.array_equal(read_image(tmp_path / "a.exr"), pixels[..., :3])
    with OpenEXR.File({}, {"Y": pixels[..., 0].copy(), "A": pixels[..., 3].copy()}) as file:
        file.write(str(tmp_path / "a.exr"))
    assert np.array_equal(read_texture(tmp_path / "a.exr").pixels, pixels[..., [0, 0, 0, 3]])


def png_header(width: int, height: int, bits: int = 8) -> bytes:
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)
    end = b"IDAT" + zlib.compress(b"\0" * 10)
    parts = [struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in (chunk, end, b"IEND")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


WHOLE = file_of(Picture.fromarray(RNG.integers(0, 256, (64, 64, 3), np.uint8)), "PNG")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "empty"),
        (b"hello", "none of"),
        (WHOLE[:1000], "trunc"),
        (WHOLE[:30], ""),
        (png_header(2**31 - 1, 2**31 - 1), "pixels; make it smaller"),
        (png_header(10000, 8000), "10000x8000"),
        (png_header(12000, 10000), "pixels; make it smaller"),
        (png_header(20000, 20000, 16), "pixels; make it smaller"),
        (png_header(64, 64, 16), ""),
        (file_of(Picture.new("RGB", (64, 64)), "JPEG")[:200], ""),
    ],
)
def test_a_bad_file_is_one_clear_error(data: bytes, reason: str) -> None:
    with pytest.raises(FragtracerError, match=rf"^wood\.png: cannot read this texture: .*{reason}"):
        read_texture(data, name="wood.png")


def test_numbers_that_are_none_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.full((2, 2, 3), np.nan, np.float32))
    with pytest.raises(FragtracerError, match=r"a\.npy: cannot read this texture: .*must be finite"):
        read_texture(tmp_path / "a.npy")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FragtracerError, match=r"none\.png: cannot read this texture: No such file"):
        read_texture(tmp_path / "none.png")
