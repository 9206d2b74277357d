# SPDX-License-Identifier: MIT
"""Image files: what is written is read back, by us and by others, and nothing is lost or hidden on the way."""

import errno
import os
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from fragtracer.display import tone
from fragtracer.display.look import Look
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.films import SavedFilm
from fragtracer.io import images
from fragtracer.io.images import check_writable, read_image, read_metadata, rgbe, write_image
from fragtracer.io.textures import read_texture

METADATA = {"spp": "256", "scene": "three spheres", "note": 'naïve = "€"\nsecond line'}
FORMATS = [".exr", ".hdr", ".npy", ".png"]


@pytest.fixture
def image() -> npt.NDArray[np.float32]:
    """Radiances over twelve decades, one pixel black, with odd sides so that a transposition shows."""
    rng = np.random.default_rng(1)
    pixels = rng.random((13, 17, 3)) * 10 ** rng.uniform(-6, 6, (13, 17, 1))
    pixels[3, 5] = 0
    return pixels.astype(np.float32)


@pytest.mark.parametrize("suffix", [".exr", ".npy", ".EXR"])
def test_float_formats_keep_every_bit(tmp_path: Path, image: npt.NDArray[np.float32], suffix: str) -> None:
    image[0, 0] = (np.nan, np.inf, -np.inf)
    image[0, 1] = -1
    write_image(tmp_path / f"a{suffix}", image)
    read = read_image(tmp_path / f"a{suffix}")
    assert read.dtype == np.float32
    assert np.array_equal(read, image, equal_nan=True)


def test_hdr_keeps_eight_bits_of_the_brightest_channel(tmp_path: Path, image: npt.NDArray[np.float32]) -> None:
    write_image(tmp_path / "a.hdr", image)
    error = np.abs(read_image(tmp_path / "a.hdr") - image)
    assert np.all(error <= image.max(axis=2, keepdims=True) / 255)
    assert np.all(read_image(tmp_path / "a.hdr")[3, 5] == 0)


def test_hdr_at_the_ends_of_its_range(tmp_path: Path) -> None:
    values = np.array([3e38, 1.0, 255.9, 256.0, 0.99999, 1e-30, 1e-45, 0.0, -1.0], np.float32)
    write_image(tmp_path / "a.hdr", np.tile(values[None, :, None], (1, 1, 3)))
    expected = [rgbe.LARGEST, 1.0, 256.0, 256.0, 1.0, 1e-30, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(read_image(tmp_path / "a.hdr")[0, :, 0], expected, rtol=2**-8)


def test_hdr_is_read_by_mitsuba_and_mitsubas_by_us(tmp_path: Path, image: npt.NDArray[np.float32]) -> None:
    mi = pytest.importorskip("mitsuba")
    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    write_image(tmp_path / "ours.hdr", image, METADATA)
    ours = mi.Bitmap(str(tmp_path / "ours.hdr"))
    assert np.array_equal(np.array(ours), read_image(tmp_path / "ours.hdr"))
    ours.write(str(tmp_path / "theirs.hdr"))
    assert np.array_equal(read_image(tmp_path / "theirs.hdr"), np.array(ours))


def test_hdr_run_lengths_and_exposure_are_read(tmp_path: Path) -> None:
    row = bytes([2, 2, 0, 10]) + bytes([138, 128]) + bytes([2, 0, 64, 136, 32]) + bytes([138, 0]) + bytes([138, 129])
    header = b"#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nEXPOSURE=4\n\n-Y 2 +X 10\n"
    (tmp_path / "a.hdr").write_bytes(header + 2 * row)
    expected = np.zeros((2, 10, 3))
    expected[..., 0], expected[:, 1, 1], expected[:, 2:, 1] = 1 / 8, 1 / 16, 1 / 32
    assert np.array_equal(read_image(tmp_path / "a.hdr"), expected)


@pytest.mark.parametrize("kind", ["float32", "float16"])
def test_exr_of_others_is_read(tmp_path: Path, kind: str) -> None:
    import OpenEXR

    channels = {name: np.full((2, 3), value, kind) for name, value in zip("RGBAZ", range(5), strict=True)}
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(tmp_path / "a.exr"))
    assert np.array_equal(read_image(tmp_path / "a.exr"), np.broadcast_to([0.0, 1, 2], (2, 3, 3)))
    assert read_metadata(tmp_path / "a.exr") == {}


def test_png_shows_what_was_asked_for(tmp_path: Path) -> None:
    from PIL import Image

    grey = np.full((2, 4, 3), [[[0.18], [0.0], [1.0], [7.0]]], np.float32)
    write_image(tmp_path / "a.png", grey)
    assert np.asarray(Image.open(tmp_path / "a.png"))[0, :, 0].tolist() == [118, 0, 255, 255]
    write_image(tmp_path / "a.png", grey, exposure=-1, tonemap="reinhard")
    expected = [0.09 / 1.09, 0, 0.5 / 1.5, 3.5 / 4.5]
    np.testing.assert_allclose(read_image(tmp_path / "a.png")[1, :, 0], expected, atol=0.005)
    assert read_metadata(tmp_path / "a.png") == {"exposure": "-1", "tonemap": "reinhard"}


def test_row_0_is_the_top(tmp_path: Path) -> None:
    from PIL import Image

    image = np.zeros((2, 3, 3), np.float32)
    image[0, 2] = (0.0, 1.0, 0.0)
    for suffix in FORMATS:
        write_image(tmp_path / f"a{suffix}", image)
        assert np.array_equal(read_image(tmp_path / f"a{suffix}"), image)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.getpixel((2, 0)) == (0, 255, 0)


@pytest.mark.parametrize("curve", tone.TONE_CURVES)
def test_tone_curves_rise_from_black(curve: str) -> None:
    x = np.concatenate([[0.0], np.geomspace(1e-6, 3e38, 500)]).astype(np.float32)
    shown = Look(1.0, curve).show(np.tile(x[:, None, None], (1, 1, 3)))[:, 0, 0]
    assert shown.dtype == np.float32
    assert shown[0] == 0
    white = 0.99846 if curve == "agx" else 1  # the published fit of AgX ends below 1
    assert shown[-1] == pytest.approx(white, abs=1e-5 if curve == "agx" else 1e-6)
    assert np.all(np.diff(shown) >= -1e-6)


def test_tone_curves_have_their_published_values() -> None:
    x = np.array([0.5, 1.0, 4.0], np.float32)
    np.testing.assert_allclose(tone.reinhard(x), [1 / 3, 1 / 2, 4 / 5], rtol=1e-6)
    np.testing.assert_allclose(tone.aces(x), [0.6163, 0.8038, 0.9734], atol=1e-4)


def test_srgb_there_and_back() -> None:
    x = np.linspace(0, 1, 1001, dtype=np.float32)
    np.testing.assert_allclose(tone.srgb_decode(tone.srgb_encode(x)), x, atol=1e-6)
    assert tone.srgb_encode(np.float32([0.214041])) == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".png"])
def test_metadata_are_read_back(tmp_path: Path, image: npt.NDArray[np.float32], suffix: str) -> None:
    write_image(tmp_path / f"a{suffix}", image, METADATA)
    assert read_metadata(tmp_path / f"a{suffix}").items() >= METADATA.items()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("suffix", [".hdr", ".png"])
def test_a_pixel_that_is_not_finite_is_magenta(tmp_path: Path, suffix: str, bad: float) -> None:
    image = np.full((2, 2, 3), 4.0, np.float32)
    image[1, 0, 2] = bad
    before = image.copy()
    with pytest.warns(UserWarning, match=r"a\.\w+: 1 pixels are NaN or infinite and are drawn magenta"):
        write_image(tmp_path / f"a{suffix}", image, exposure=-20)
    read = read_image(tmp_path / f"a{suffix}")
    assert np.array_equal(image, before, equal_nan=True)
    assert np.array_equal(read[1, 0], (4, 0, 4) if suffix == ".hdr" else (1, 0, 1))
    assert np.all(read[0] == read[0, 0, 0])


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("interruption", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")])
def test_an_interrupted_write_loses_nothing(
    tmp_path: Path,
    image: npt.NDArray[np.float32],
    monkeypatch: pytest.MonkeyPatch,
    suffix: str,
    interruption: BaseException,
) -> None:
    def half(path: Path, *_: object) -> None:
        path.write_bytes(b"half a file")
        raise interruption

    path = tmp_path / f"a{suffix}"
    write_image(path, image)
    before = path.read_bytes()
    monkeypatch.setitem(images._WRITERS, suffix, half)
    expected = OutputError if isinstance(interruption, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as raised:
        write_image(path, image)
    assert isinstance(interruption, KeyboardInterrupt) or str(raised.value).endswith("No space left on device")
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_finds_no_room_says_why(tmp_path: Path, suffix: str) -> None:
    resource = pytest.importorskip("resource", reason="only POSIX limits the size of files")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10000, hard))
    try:
        with pytest.raises(OutputError, match=rf"a\{suffix}: cannot write: File too large$"):
            write_image(tmp_path / f"a{suffix}", np.random.default_rng(0).random((64, 64, 3)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_link_stays_a_link(tmp_path: Path, image: npt.NDArray[np.float32]) -> None:
    (tmp_path / "a.npy").symlink_to(tmp_path / "b.npy")
    write_image(tmp_path / "a.npy", image)
    assert (tmp_path / "a.npy").is_symlink()
    assert np.array_equal(read_image(tmp_path / "b.npy"), image)


def test_a_file_has_the_usual_permissions(tmp_path: Path, image: npt.NDArray[np.float32]) -> None:
    (tmp_path / "plain").touch()
    write_image(tmp_path / "a.npy", image)
    assert (tmp_path / "a.npy").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("a.jpg", "cannot write .jpg; choose from .exr, .hdr, .npy, .png"),
        ("a", "cannot write a file without an extension; choose from .exr"),
        ("missing/a.exr", "there is no folder"),
        ("file/a.exr", "there is no folder"),
        ("folder.exr", "this is a folder"),
        ("x" * 300 + ".exr", "name too long"),
        ("nul\0.exr", "null"),
    ],
)
def test_what_cannot_be_written_is_known_before(tmp_path: Path, path: str, message: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(OutputError) as raised:
        check_writable(tmp_path / path)
    assert str(tmp_path / path) in str(raised.value)
    assert message in str(raised.value)


@pytest.mark.parametrize(("closed", "message"), [("", "no permission to write in the folder"), ("a.exr", "protected")])
def test_permissions_are_known_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, closed: str, message: str
) -> None:
    (tmp_path / "a.exr").touch()
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path / closed)
    with pytest.raises(OutputError, match=message):
        check_writable(tmp_path / "a.exr")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_is_no_file_is_not_replaced(tmp_path: Path) -> None:
    """By a film either, which is written without a check before."""
    for path in (tmp_path / "a.exr", tmp_path / "a.npz"):
        os.mkfifo(path)
    write_film = SavedFilm({}, "", (), {}, {}, {}).write
    for write, path in ((check_writable, tmp_path / "a.exr"), (write_film, tmp_path / "a.npz")):
        with pytest.raises(OutputError, match=f"^{re.escape(str(path))}: this is a device, a pipe or the like"):
            write(path)
        assert path.is_fifo()
    assert len(list(tmp_path.iterdir())) == 2


def test_checking_leaves_no_trace(tmp_path: Path) -> None:
    check_writable(tmp_path / "a.exr")
    check_writable(str(tmp_path / "a.PNG"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("image", "options", "message"),
    [
        (np.zeros((4, 4)), {}, "(height, width, 3) numbers, got float64 (4, 4)"),
        (np.zeros((4, 4, 4)), {}, "(4, 4, 4)"),
        (np.zeros((0, 4, 3)), {}, "(0, 4, 3)"),
        (np.zeros((4, 4, 3), complex), {}, "complex128"),
        (np.zeros((4, 4, 3)), {"tonemap": "filmic"}, "'filmic'; choose from linear, reinhard, aces"),
        (np.zeros((4, 4, 3)), {"exposure": np.nan}, "between -64 and 64 stops, got nan"),
    ],
)
def test_images_and_settings_are_checked(
    tmp_path: Path, image: npt.NDArray[np.float64], options: dict[str, object], message: str
) -> None:
    with pytest.raises(OutputError) as raised:
        write_image(tmp_path / "a.png", image, **options)  # type: ignore[arg-type]
    assert message in str(raised.value)
    assert not list(tmp_path.iterdir())


def npy(shape: str, dtype: str = "<f4") -> bytes:
    """A .npy file of four pixels that says that it has others."""
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    header += " " * (-(len(header) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + bytes(48)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.exr", None, "No such file"),
        ("a.jpg", b"", "choose from .exr, .hdr, .npy, .png"),
        ("a.exr", b"no image", "not one"),
        ("a.hdr", b"no image", "not one"),
        ("a.hdr", b"#?RADIANCE\n\n+Y 2 +Y 2\n" + bytes(16), "no header with the size"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 2 +X 2\n" + bytes(15), "3 pixels where 4 are needed"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\x00\x09\x89\x01", "run-length"),
        ("a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + bytes(4), "32-bit_rle_xyze"),
        ("a.hdr", b"#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n" + bytes(4), "EXPOSURE"),
        ("a.npy", b"no image", "does not open with the header of an array"),
        ("a.npy", b"PK\3\4" + bytes(100), "does not open with the header of an array"),
        ("a.npy", npy("(100000, 100000, 3)"), "its header says (100000, 100000, 3) of float32, more than it has"),
        ("a.npy", npy("(1" + "0" * 19 + ", 1, 3)"), "more than it has"),
        ("a.npy", npy("(-1, 4, 3)"), "more than it has"),
        ("a.npy", npy("(1, 1, 3)", "|O"), "it holds Python objects"),
        ("a.png", b"no image", "not one"),
    ],
)
def test_what_cannot_be_read_is_said(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    for read in (read_image, read_texture):
        with pytest.raises(FragtracerError) as raised:
            read(tmp_path / name)
        assert str(tmp_path / name) in str(raised.value)
        assert message in str(raised.value) or name in ("a.jpg", "a.png")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes")
@pytest.mark.parametrize("suffix", [*FORMATS, ".jpg"])
def test_nobody_waits_for_a_pipe(tmp_path: Path, suffix: str) -> None:
    os.mkfifo(tmp_path / f"a{suffix}")
    for read in (read_image, read_texture):
        with pytest.raises(FragtracerError, match=r"it is not a regular file|choose from"):
            read(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_truncated_file_is_damaged(tmp_path: Path, image: npt.NDArray[np.float32], suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_image(path, image)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FragtracerError, match="damaged or not one"):
        read_image(path)


def test_pictures_beyond_the_limit_of_pillow_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, image: npt.NDArray[np.float32]
) -> None:
    """Up to that of what is rendered."""
    path = tmp_path / "a.png"
    write_image(path, image, METADATA)
    monkeypatch.setattr("PIL.Image.MAX_IMAGE_PIXELS", image[..., 0].size // 3)
    assert read_image(path).shape == image.shape
    assert METADATA.items() <= read_metadata(path).items()
    monkeypatch.setattr("fragtracer.io.images.exr_child.MOST_PIXELS", image[..., 0].size - 1)
    for read in (read_image, read_metadata):
        with pytest.raises(FragtracerError, match="pixels, more than"):
            read(path)


def test_other_arrays_and_channels_are_refused(tmp_path: Path) -> None:
    import OpenEXR

    np.save(tmp_path / "a.npy", np.zeros(3))
    with pytest.raises(FragtracerError, match=r"\(height, width, 3\)"):
        read_image(tmp_path / "a.npy")
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Z": np.zeros((2, 2), np.float32)}) as file:
        file.write(str(tmp_path / "a.exr"))
    with pytest.raises(FragtracerError, match="no channels R, G and B, only Z"):
        read_image(tmp_path / "a.exr")
