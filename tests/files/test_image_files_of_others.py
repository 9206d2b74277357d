# SPDX-License-Identifier: MIT
"""Radiance and OpenEXR files as other programs write them, and as accidents leave them."""

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.images import exr_child, read_image, read_layers, write_image

OpenEXR = pytest.importorskip("OpenEXR")
DAMAGED = Path(__file__).parents[3] / "shared" / "data" / "malformed" / "exr"
PIXELS = np.ldexp(np.random.default_rng(0).integers(128, 256, (5, 9, 3)), -6).astype(np.float32)


def rgbe(pixels: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Values from 2 to 4, as :data:`PIXELS`, with the exponent of them all."""
    return np.concatenate([pixels * 64, np.full((*pixels.shape[:2], 1), 130)], axis=-1).astype(np.uint8)


def hdr(path: Path, body: bytes, size: str = "-Y 5 +X 9", header: str = "") -> Path:
    path.write_bytes(f"#?RGBE\nFORMAT=32-bit_rle_rgbe\n{header}\n{size}\n".encode() + body)
    return path


def packed(channel: NDArray[np.uint8]) -> bytes:
    """Run-length encoded: runs of equal bytes, and others one by one."""
    coded, at = b"", 0
    while at < len(channel):
        end = at + 1
        while end < len(channel) and channel[end] == channel[at] and end - at < 127:
            end += 1
        coded += bytes((128 + end - at, channel[at])) if end - at > 1 else bytes((1, channel[at]))
        at = end
    return coded


def newer(pixels: NDArray[np.uint8]) -> bytes:
    return b"".join(
        struct.pack(">BBH", 2, 2, len(row)) + b"".join(packed(channel) for channel in row.T) for row in pixels
    )


@pytest.mark.parametrize("encode", [newer, bytes])
@pytest.mark.parametrize("y", ["-Y", "+Y"])
@pytest.mark.parametrize("x", ["+X", "-X"])
@pytest.mark.parametrize("columns", [False, True])
def test_scanlines_run_in_any_order(tmp_path, encode, y, x, columns):
    pixels = np.concatenate([PIXELS, PIXELS[::-1, ::-1]])  # shorter lines than 8 are never encoded
    stored = rgbe(pixels)[:: -1 if y == "+Y" else 1, :: -1 if x == "-X" else 1]
    size = f"{x} 9 {y} 10" if columns else f"{y} 10 {x} 9"
    stored = np.ascontiguousarray(stored.swapaxes(0, 1) if columns else stored)
    body = stored.tobytes() if encode is bytes else encode(stored)
    np.testing.assert_array_equal(read_image(hdr(tmp_path / "a.hdr", body, size)), pixels)


def test_older_repeats_are_counted(tmp_path):
    """A pixel, 3 times more; another, 2 + 256 times more."""
    first, second = bytes((200, 100, 50, 129)), bytes((10, 20, 30, 128))
    body = first + bytes((1, 1, 1, 3)) + second + bytes((1, 1, 1, 2)) + bytes((1, 1, 1, 1))
    found = read_image(hdr(tmp_path / "a.hdr", body, "-Y 1 +X 263"))
    assert (found[0, :4] == np.ldexp(np.float32((200, 100, 50)), -7)).all()
    assert (found[0, 4:] == np.ldexp(np.float32((10, 20, 30)), -8)).all()


def test_exposure_and_color_correction_are_divided_out(tmp_path):
    header = "EXPOSURE= 2\nCOLORCORR= 1 2 4\nEXPOSURE=0.5\nPIXASPECT=1\n"
    found = read_image(hdr(tmp_path / "a.hdr", rgbe(PIXELS).tobytes(), header=header))
    np.testing.assert_allclose(found, PIXELS / (1, 2, 4), rtol=1e-6)


LONG = newer(rgbe(np.repeat(PIXELS, 3, axis=1)))
LIES = {
    "cut short": (LONG[:-1], "-Y 5 +X 27", ""),
    "cut in a marker": (LONG[: len(LONG) // 2], "-Y 5 +X 27", ""),
    "more rows than there are": (LONG, "-Y 6 +X 27", ""),
    "other width": (LONG, "-Y 5 +X 28", ""),
    "far too many pixels": (LONG, "-Y 999999999 +X 999999999", ""),
    "many rows": (LONG, "-Y 4000000 +X 27", ""),
    "no pixels": (LONG, "-Y 0 +X 27", ""),
    "negative size": (LONG, "-Y -5 +X 27", ""),
    "a run past the end of its row": (struct.pack(">BBH", 2, 2, 9) + bytes((255, 0)) * 5, "-Y 1 +X 9", ""),
    "a code of 0": (struct.pack(">BBH", 2, 2, 9) + bytes(64), "-Y 1 +X 9", ""),
    "a repeat of nothing": (bytes((1, 1, 1, 9)) * 4, "-Y 1 +X 3", ""),
    "a repeat past the end": (bytes((9, 9, 9, 9, 1, 1, 1, 255, 1, 1, 1, 255, 1, 1, 1, 255)), "-Y 1 +X 7", ""),
    "exposure 0": (bytes(180), "-Y 5 +X 9", "EXPOSURE=0\n"),
    "exposure in words": (bytes(180), "-Y 5 +X 9", "EXPOSURE=bright\n"),
    "two numbers of three": (bytes(180), "-Y 5 +X 9", "COLORCORR=1 2\n"),
}


@pytest.mark.parametrize("name", LIES)
def test_damaged_radiance_files_have_one_message(tmp_path, name):
    path = hdr(tmp_path / "a.hdr", *LIES[name])
    with pytest.raises(FragtracerError) as error:
        read_image(path)
    assert str(error.value).startswith(f"{path}: this .hdr file is damaged or not one: ")
    assert "\n" not in str(error.value)


def exr(path: Path, channels: dict[str, NDArray[np.floating]], **header: object) -> Path:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))
    return path


def window(left: int, top: int, right: int, bottom: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    return np.array((left, top), np.int32), np.array((right, bottom), np.int32)


def test_tiles_and_half_floats(tmp_path):
    pixels = np.random.default_rng(1).random((70, 90, 3)).astype(np.float16)
    path = exr(tmp_path / "a.exr", {"RGB": pixels}, type=OpenEXR.tiledimage, tiles=OpenEXR.TileDescription())
    found = read_image(path)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, pixels)


@pytest.mark.parametrize("shift", [(0, 0), (-20, 7)])
def test_data_window_lies_in_the_display_window(tmp_path, shift):
    """Where there are no data it is black, and data beyond it are left out."""
    x, y = shift
    inside = exr(
        tmp_path / "a.exr",
        {"RGB": PIXELS},
        dataWindow=window(2 + x, 1 + y, 10 + x, 5 + y),
        displayWindow=window(x, y, 15 + x, 7 + y),
    )
    expected = np.zeros((8, 16, 3))
    expected[1:6, 2:11] = PIXELS
    np.testing.assert_array_equal(read_image(inside), expected)
    beyond = exr(
        tmp_path / "b.exr",
        {"RGB": PIXELS},
        dataWindow=window(x, y, 8 + x, 4 + y),
        displayWindow=window(3 + x, 1 + y, 11 + x, 2 + y),
    )
    expected = np.zeros((2, 9, 3))
    expected[:, :6] = PIXELS[1:3, 3:]
    np.testing.assert_array_equal(read_image(beyond), expected)


def test_grey_and_layers(tmp_path):
    grey = PIXELS[..., 0].copy()
    np.testing.assert_array_equal(read_image(exr(tmp_path / "a.exr", {"Y": grey}))[..., 2], grey)
    layers = {f"view.{name}": PIXELS[..., i].copy() for i, name in enumerate("RGB")} | {"depth.Z": grey}
    np.testing.assert_array_equal(read_image(exr(tmp_path / "b.exr", layers)), PIXELS)
    with pytest.raises(FragtracerError, match="no channels R, G and B, only Z"):
        read_image(exr(tmp_path / "c.exr", {"Z": grey}))


@pytest.mark.parametrize("names", ["R", "roughness", "view.Y", "YA"])
def test_a_single_channel_is_grey(tmp_path, names):
    grey = PIXELS[..., 0].copy()
    channels = dict.fromkeys(names if names == "YA" else [names], grey)
    np.testing.assert_array_equal(read_image(exr(tmp_path / "a.exr", channels)), np.stack([grey] * 3, axis=-1))


def luminance_chroma(pixels: NDArray[np.floating], weights: NDArray[np.floating]) -> dict[str, OpenEXR.Channel]:
    """The channels of a picture, its chroma that of every second pixel and row.

    The library writes the first samples of what it is given, as many as it needs.
    """
    y = pixels @ weights
    channels = {"Y": OpenEXR.Channel(y.astype(np.float32))}
    for name, color in (("RY", 0), ("BY", 2)):
        chroma = (pixels[..., color] - y) / y
        few = np.resize(chroma[::2, ::2], chroma.shape).astype(np.float32)
        channels[name] = OpenEXR.Channel(few, 2, 2)
    return channels


DISPLAY_P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329)


@pytest.mark.parametrize(
    ("header", "weights"),
    [({}, (0.2126, 0.7152, 0.0722)), ({"chromaticities": DISPLAY_P3}, (0.2290, 0.6917, 0.0793))],
)
def test_luminance_and_chroma(tmp_path, header, weights):
    """Chroma that changes slowly comes back, the luminance of every pixel exactly."""
    weights = np.divide(weights, np.sum(weights))
    y, x = np.mgrid[0:40, 0:60]
    brightness = np.random.default_rng(3).uniform(0.1, 2, y.shape)
    colors = np.stack([1 + 0.5 * np.sin(x / 9), 1 + 0.3 * np.cos(y / 7), np.full(y.shape, 0.4)], axis=-1)
    pixels = brightness[..., None] * colors
    found = read_image(exr(tmp_path / "a.exr", luminance_chroma(pixels, weights), **header))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found @ weights, pixels @ weights, rtol=1e-3)
    inner = np.s_[14:-14, 14:-14]  # beyond it the filter reaches over the border
    np.testing.assert_allclose(found[inner], pixels[inner], rtol=2e-3)
    np.testing.assert_allclose(found, pixels, rtol=0.15)


def deep() -> NDArray[np.object_]:
    samples = np.empty((5, 9), object)
    for index in np.ndindex(samples.shape):
        samples[index] = np.ones(2, np.float32)
    return samples


@pytest.mark.parametrize(
    ("channels", "header", "message"),
    [
        (dict.fromkeys("RGBZ", deep()), {"type": OpenEXR.deepscanline}, "it is a deep image, of many samples a pixel"),
        ({"Z": PIXELS[..., 0]}, {}, "it has no channels R, G and B, only Z"),
        ({"u": PIXELS[..., 0], "v": PIXELS[..., 1]}, {}, "it has no channels R, G and B, only u, v"),
        ({"Y": PIXELS[..., 0], "RY": PIXELS[..., 0]}, {}, "it has no channels R, G and B, only RY, Y"),
        (
            {name: OpenEXR.Channel(np.ones((4, 6), np.float32), 2, 2) for name in "RGB"},
            {},
            "its channels R, G, B have fewer samples than pixels",
        ),
    ],
)
def test_kinds_that_are_not_read_are_not_called_damaged(tmp_path, channels, header, message):
    channels = {name: item.copy() if isinstance(item, np.ndarray) else item for name, item in channels.items()}
    path = exr(tmp_path / "a.exr", channels, compression=OpenEXR.ZIPS_COMPRESSION, **header)
    with pytest.raises(FragtracerError) as error:
        read_image(path)
    assert str(error.value).startswith(f"{path}: cannot read this kind of .exr file: {message}")
    assert "damaged" not in str(error.value)


def test_non_finite_values_are_kept(tmp_path):
    pixels = PIXELS.copy()
    pixels[0, 0], pixels[1, 1] = np.nan, -np.inf
    np.testing.assert_array_equal(read_image(exr(tmp_path / "a.exr", {"RGB": pixels})), pixels)


def test_a_header_that_claims_too_much_is_refused(tmp_path):
    path = tmp_path / "a.exr"
    write_image(path, PIXELS)
    content = path.read_bytes()
    old, new = struct.pack("<4i", 0, 0, 8, 4), struct.pack("<4i", 0, 0, 2**30, 2**30)
    assert content.count(old) == 2
    path.write_bytes(content.replace(old, new))
    with pytest.raises(FragtracerError, match=r"a\.exr: this \.exr file is damaged or not one"):
        read_image(path)


@pytest.mark.parametrize("seed", range(12))
def test_changed_bytes_never_end_the_process(tmp_path, seed):
    rng = np.random.default_rng(seed)
    path = tmp_path / "a.exr"
    write_image(path, np.tile(PIXELS, (8, 8, 1)))
    content = bytearray(path.read_bytes())
    for at in rng.integers(8, len(content) if seed % 2 else 400, 6):
        content[at] = rng.integers(256)
    path.write_bytes(content[: rng.integers(100, len(content))] if seed % 3 == 0 else content)
    message = ""
    try:
        read_image(path)
    except FragtracerError as error:
        message = str(error)
    assert not message or (str(path) in message and "\n" not in message)


def test_only_what_is_asked_for_is_held_in_memory(tmp_path, monkeypatch):
    """Of a file of more layers than there is memory for."""
    pages = "int(open('/proc/self/statm').read().split()[0])"
    source = Path(exr_child.__file__).read_text()
    assert source.count("_MOST_BYTES = 2**33\n") == 1
    room = f"import OpenEXR, resource\n_MOST_BYTES = {pages} * resource.getpagesize() + 2**26\n"
    (tmp_path / "child.py").write_text(source.replace("_MOST_BYTES = 2**33\n", room))
    monkeypatch.setattr("fragtracer.io.images.formats.exr_child.__file__", str(tmp_path / "child.py"))
    image = np.full((512, 1024, 3), 0.5, np.float32)
    layers = {f"l{number}": image for number in range(20)}
    write_image(tmp_path / "a.exr", image, {"key": "value"}, layers=layers)
    (pixels, layer), metadata = read_layers(tmp_path / "a.exr", ["l7"])
    assert metadata == {"key": "value"}
    assert (pixels == 0.5).all()
    assert (layer == 0.5).all()
    with pytest.raises(FragtracerError, match=r"cannot read this kind of \.exr file: it needs more than .* of memory"):
        read_layers(tmp_path / "a.exr", list(layers))


def test_a_crash_of_the_library_is_a_message(tmp_path, monkeypatch):
    child = tmp_path / "child.py"
    child.write_text("import os\nos.abort()\n")
    monkeypatch.setattr("fragtracer.io.images.formats.exr_child.__file__", str(child))
    write_image(tmp_path / "a.exr", PIXELS)
    with pytest.raises(FragtracerError, match="the OpenEXR library crashed on it"):
        read_image(tmp_path / "a.exr")


@pytest.mark.skipif(not DAMAGED.is_dir(), reason="the damaged files of others are not here (shared/data)")
def test_damaged_files_of_others(tmp_path):
    files = sorted(path for path in DAMAGED.iterdir() if path.name != "LICENSE")
    assert files
    for file in files:
        path = tmp_path / f"{file.name[:60]}.exr"
        path.write_bytes(file.read_bytes())
        with pytest.raises(FragtracerError) as error:
            read_image(path)
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)
