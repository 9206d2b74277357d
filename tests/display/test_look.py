# SPDX-License-Identifier: MIT
"""The display chain of picture files: glare, automatic exposure, gamma, and the commands that use them."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from command import status_of

from fragtracer.display.bloom import bloom, bright_parts, weights
from fragtracer.display.exposure import automatic_exposure, cells
from fragtracer.display.look import Look
from fragtracer.errors import OutputError
from fragtracer.io.images import read_image, read_metadata, write_image

Pixels = npt.NDArray[np.float32]


def picture(width: int = 96, height: int = 64) -> Pixels:
    rng = np.random.default_rng(1)
    pixels = rng.random((height, width, 3)) * 0.5
    pixels[rng.random((height, width)) < 0.01] = (30.0, 20.0, 10.0)
    return pixels.astype(np.float32)


def test_weights_are_those_of_a_gaussian() -> None:
    for taps in (5, 9, 11):
        one_side = weights(taps)
        assert len(one_side) == taps // 2 + 1
        assert 2 * sum(one_side) - one_side[0] == pytest.approx(1)
        sigma = (taps + 1) / 6
        assert one_side[2] / one_side[1] == pytest.approx(np.exp(-(2**2 - 1) / (2 * sigma**2)))


@pytest.mark.parametrize("threshold", [0.0, 0.3, 1.0, 10.0])
def test_bloom_adds_the_mean_of_the_bright_parts(threshold: float) -> None:
    """With strength s the mean grows by s times theirs: every step keeps it, and mirrored borders lose nothing."""
    image = picture()
    bright = bright_parts(image, threshold)
    np.testing.assert_allclose(bloom(image, threshold).mean((0, 1)), bright.mean((0, 1)), rtol=1e-5)
    if threshold == 0:
        np.testing.assert_array_equal(bright, image)


def test_bloom_of_a_grey_image_is_grey_at_any_size() -> None:
    for height, width in ((1, 1), (5, 40), (16, 16), (33, 100)):
        np.testing.assert_allclose(bloom(np.full((height, width, 3), 3.0, np.float32), 1.0), 2.0, rtol=1e-5)


def test_bright_parts_begin_at_the_threshold_and_keep_their_colour() -> None:
    image = np.array([[[1.0, 1.0, 1.0], [0.99, 0.99, 0.99], [3.0, 3.0, 3.0], [8.0, 4.0, 2.0]]], np.float32)
    bright = bright_parts(image, 1.0)[0]
    assert not bright[:2].any()
    assert bright[2] == pytest.approx(2.0)
    assert bright[3] / bright[3, 0] == pytest.approx([1.0, 0.5, 0.25])


def test_glare_of_a_point_is_smooth_symmetric_and_as_wide_as_stated() -> None:
    """One bright block in the middle: no stairs, the same in all four directions, ends where the definition says."""
    image = np.zeros((320, 320, 3), np.float32)
    image[152:168, 152:168] = 10.0
    glare = bloom(image, 1.0)[..., 0]
    for turned in (glare[::-1], glare[:, ::-1], glare.T):
        np.testing.assert_allclose(turned, glare, atol=1e-5 * glare.max())
    row = glare[160, 160:]
    assert (np.diff(row) <= 1e-6).all()
    assert -np.diff(row).min() < 0.1 * row[0]  # enlarged without interpolation it would fall by 0.36 at once
    assert row[40] > 0.01 * row[0]
    reach = 16 * (5 + 1) + 8 * (4 + 1) + 4 * (2 + 1)  # taps to one side and interpolation, at each level
    assert row[8 + reach - 12] > 0
    assert row[8 + reach :].max() == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_pixels_that_are_not_finite_reach_nothing(bad: float) -> None:
    """They are magenta; all others are as if these were black, and the exposure as if they were not there."""
    image, black = picture(), picture()
    image[20, 30, 1] = bad
    black[20, 30] = 0
    look = Look(bloom=0.5, tonemap="agx")
    shown, expected = look.show(image), look.show(black)
    assert shown[20, 30].tolist() == [1, 0, 1]
    expected[20, 30] = shown[20, 30]
    np.testing.assert_array_equal(shown, expected)
    card = np.full((8, 8, 3), 0.18, np.float32)
    card[0, 0] = bad
    assert automatic_exposure(card) == pytest.approx(automatic_exposure(np.full((8, 8, 3), 0.18, np.float32)))


@pytest.mark.parametrize("stops", [-20.0, -3.3, 0.0, 7.0])
def test_automatic_exposure_brings_grey_to_18_percent(stops: float) -> None:
    """Within half a bin of 1/16 stop."""
    image = np.full((9, 13, 3), 0.18 * 2.0**-stops, np.float32)
    assert automatic_exposure(image) == pytest.approx(stops, abs=1 / 32 + 1e-6)


def test_automatic_exposure_leaves_out_a_tenth_at_each_end_and_what_is_black() -> None:
    image = np.full((40, 40, 3), 0.18, np.float32)
    image[:3], image[-3:] = 1e-6, 1e4
    image[:, :8] = 0
    assert automatic_exposure(image) == pytest.approx(automatic_exposure(np.full((4, 4, 3), 0.18, np.float32)))
    image[:20] = 0.18 / 16
    assert -0.01 > -automatic_exposure(image) > -4
    assert automatic_exposure(np.zeros((8, 8, 3), np.float32)) == 0


def test_cells_are_means_of_4_by_4_pixels_from_the_lower_left() -> None:
    image = np.arange(6 * 5 * 3, dtype=np.float32).reshape(6, 5, 3)
    luminance = image.astype(np.float64) @ [0.2126, 0.7152, 0.0722]
    found = cells(image)
    assert found.shape == (2, 2)
    np.testing.assert_allclose(found[0, 0], luminance[2:, :4].mean())
    np.testing.assert_allclose(found[1, 1], luminance[:2, 4:].mean())


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".npy"])
def test_files_of_radiance_stay_as_they_are(tmp_path: Path, suffix: str) -> None:
    write_image(tmp_path / f"plain{suffix}", picture())
    options = {"exposure": "auto", "tonemap": "agx", "gamma": 2.0, "bloom": 1.0, "bloom_threshold": 0.1}
    write_image(tmp_path / f"look{suffix}", picture(), **options)  # type: ignore[arg-type]
    assert np.array_equal(read_image(tmp_path / f"look{suffix}"), read_image(tmp_path / f"plain{suffix}"))
    assert read_metadata(tmp_path / f"look{suffix}") == {}


def test_a_png_says_how_it_was_made_and_is_so(tmp_path: Path) -> None:
    image = picture()
    write_image(tmp_path / "a.png", image, exposure="auto", gamma=1.5, bloom=0.25, bloom_threshold=2.0)
    said = read_metadata(tmp_path / "a.png")
    assert said.pop("exposure_mode") == "auto"
    assert float(said["exposure"]) == pytest.approx(automatic_exposure(image), abs=1e-4)
    assert said | {"exposure": ""} == {
        "exposure": "",
        "tonemap": "linear",
        "gamma": "1.5",
        "bloom": "0.25",
        "bloom_threshold": "2",
    }
    write_image(tmp_path / "b.png", image, exposure=float(said["exposure"]), gamma=1.5, bloom=0.25, bloom_threshold=2.0)
    assert np.array_equal(read_image(tmp_path / "a.png"), read_image(tmp_path / "b.png"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"exposure": "bright"}, 'must be "auto" or lie between'),
        ({"gamma": 0.0}, "gamma must be above 0"),
        ({"bloom": -1.0}, "bloom must lie between 0"),
        ({"bloom": 1.0, "bloom_threshold": float("nan")}, "bloom_threshold must lie between 0"),
        ({"bloom_alone": True}, "give its strength too"),
    ],
)
def test_a_wrong_look_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(OutputError, match=message):
        Look(**options)  # type: ignore[arg-type]


def command(*words: str | Path) -> subprocess.CompletedProcess[str]:
    arguments = [sys.executable, "-m", "fragtracer", *map(str, words)]
    return subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False)


def test_develop_makes_the_picture_that_render_makes(tmp_path: Path) -> None:
    look = ["--exposure", "auto", "--tonemap", "agx", "--bloom", "0.5", "--bloom-threshold", "0.8", "--gamma", "1.2"]
    scene = ["three-spheres", "--size", "40x30", "--spp", "4"]
    assert command("render", *scene, "-o", tmp_path / "a.exr").returncode == 0
    assert command("render", *scene, "-o", tmp_path / "a.png", *look).returncode == 0
    done = command("develop", tmp_path / "a.exr", "-o", tmp_path / "b.png", *look)
    assert done.returncode == 0, done.stderr
    assert "stops" in done.stdout
    assert np.array_equal(read_image(tmp_path / "a.png"), read_image(tmp_path / "b.png"))
    assert read_metadata(tmp_path / "b.png") == read_metadata(tmp_path / "a.png")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.exr", "-o", "a.png"], "missing.exr: cannot read"),
        (["a.png", "-o", "b.png"], "a.png: this is a picture already"),
        (["a.exr", "-o", "a.exr"], "cannot write .exr; choose from .png"),
        (["a.exr", "-o", "a.png", "--exposure", "bright"], "--exposure bright: give a number of stops, or auto"),
        (["a.exr", "-o", "a.png", "--bloom-alone"], "give its strength too"),
        (["a.exr", "-o", "a.png", "--gamma", "-1"], "gamma must be above 0"),
    ],
)
def test_develop_says_what_is_wrong(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_image("a.exr", picture(8, 8))
    before = Path("a.exr").read_bytes()
    assert status_of(monkeypatch, "develop", *words) == 2
    assert message in capsys.readouterr().err
    assert Path("a.exr").read_bytes() == before
