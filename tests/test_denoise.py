# SPDX-License-Identifier: MIT
"""Denoising: it lowers the error, keeps the radiance as it was, says what it did, and refuses what it cannot do."""

import sys

import moderngl
import numpy as np
import pytest
from rendering import rendered

from fragtracer.aov import DENOISING
from fragtracer.apps import cli
from fragtracer.apps.compare.relative_error import relative_weight
from fragtracer.denoising import denoise
from fragtracer.errors import FragtracerError
from fragtracer.io.images import read_image, read_layers, read_metadata, write_image
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.sampling.pixels import Pixels

pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")


def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """The exit status of a command in this process, and what it printed as an error."""
    monkeypatch.setattr(sys, "argv", ["fragtracer", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        cli.main()
    return int(end.value.code or 0), capsys.readouterr().err


def test_the_error_falls(ctx: moderngl.Context) -> None:
    """By more than a factor of 4 in the square, over a Cornell box; and with its layers further than without."""
    size = (64, 64)
    reference = rendered(ctx, load("cornell-box"), 1024, size, seed=1, adaptive="off")
    with Renderer(load("cornell-box"), size, context=ctx, guiding="off") as renderer:
        renderer.sample(16)
        image, guides = renderer.image(), [renderer.aov(name) for name in DENOISING]
    before = image.copy()

    def error(picture: np.ndarray) -> float:
        return float(((picture - reference) ** 2 * relative_weight(reference)).mean())

    guided = denoise(image, *guides)
    assert guided.dtype == np.float32
    assert guided.shape == image.shape
    assert error(guided) < min(error(image) / 4, error(denoise(image)))
    np.testing.assert_array_equal(image, before)


@pytest.mark.parametrize(("size", "radiance"), [((1, 1), 1e3), ((1, 7), 1e-3), ((33, 2), 0.0), ((33, 2), 1e3)])
def test_sizes_of_all_kinds_and_brightnesses(size: tuple[int, int], radiance: float) -> None:
    """A picture without noise stays as it is, from dim to brighter than white."""
    image = np.full((*size[::-1], 3), radiance)
    np.testing.assert_allclose(denoise(image, image * 0 + 0.5, image * 0 + (0, 0, 1)), image, rtol=0.05, atol=1e-6)


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_better_of_the_two_counts(noise: float) -> None:
    """A texture that the denoiser takes for noise stays, where two halves of the samples have it; their noise goes."""
    random = np.random.default_rng(5)
    texture = np.repeat(0.5 + 0.2 * random.standard_normal((48, 64, 1)).clip(-2, 2), 3, axis=2)
    flat = np.full_like(texture, 0.5)
    truth = flat if noise else texture
    halves = [truth + noise * random.standard_normal((48, 64, 3)).clip(-1.6, 1.6) for _ in range(2)]
    image, half_difference = (halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2
    standard_error = np.full_like(image, noise / np.sqrt(2) + 1e-3)

    def error(picture: np.ndarray) -> float:
        return float(np.sqrt(((picture - truth) ** 2).mean()))

    alone = error(denoise(image))
    mixed = error(denoise(image, half_difference=half_difference, standard_error=standard_error))
    unknown = denoise(image, half_difference=half_difference, standard_error=np.full_like(image, np.inf))
    np.testing.assert_array_equal(unknown, denoise(image))
    assert mixed < 0.1 * (error(image) if noise else alone)
    assert alone > 0.02 or noise


def test_rare_bright_light_leaves_no_dark_pixels() -> None:
    """A pixel that has not met it is dark and shows little variance: it is not taken to be better than its guess."""
    size, random = (48, 64), np.random.default_rng(0)
    shading = np.linspace(0.2, 1, size[1])[None, :, None] * np.ones((size[0], 1, 3))
    samples = np.where(random.random((16, *size, 1)) < 0.01, 25.0, 0.25) * shading
    truth = (0.99 * 0.25 + 0.01 * 25.0) * shading
    film = [samples.mean(0), samples.var(0), (samples[::2] - samples[1::2]).mean(0) / 2]
    counts = np.full((*size, 1), 16.0), np.zeros((*size, 1))
    mean, variance = (np.concatenate(parts, axis=2).astype(np.float32) for parts in zip(film[:2], counts, strict=True))
    standard_error = Pixels(mean, variance, film[2].astype(np.float32)).standard_error()

    def error(picture: np.ndarray) -> float:
        return float(np.sqrt((((picture - truth) / truth) ** 2).mean()))

    mixed = denoise(film[0], half_difference=film[2], standard_error=standard_error)
    assert error(mixed) < 2 * error(denoise(film[0]))


def test_what_it_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    image = np.ones((4, 4, 3), np.float32)
    spoilt = image.copy()
    spoilt[1, 2, 0], spoilt[3, 3] = np.nan, np.inf
    with pytest.raises(FragtracerError, match=r"^image: 2 pixels are NaN or infinite, which a denoiser would spread"):
        denoise(spoilt)
    with pytest.raises(FragtracerError, match=r"^normal: 2 pixels are NaN"):
        denoise(image, image, spoilt)
    with pytest.raises(FragtracerError, match=r"^image is to be an array of .* numbers, got float32 \(4, 4\)"):
        denoise(image[..., 0])
    with pytest.raises(FragtracerError, match=r"^albedo has the shape \(3, 4, 3\), the image \(4, 4, 3\)"):
        denoise(image, image[:3])
    with pytest.raises(FragtracerError, match=r"^to denoise by the layer normal, albedo is needed too"):
        denoise(image, None, image)
    with pytest.raises(FragtracerError, match=r"^to denoise by the layer emission, clean_emission is needed too"):
        denoise(image, image, image, image)
    with pytest.raises(FragtracerError, match=r"^to denoise by the layer clean_emission, emission is needed too"):
        denoise(image, clean_emission=image)
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(FragtracerError, match=r"needs Open Image Denoise; pip install 'fragtracer\[denoise\]'"):
        denoise(image)


def test_the_radiance_stays_in_the_file(tmp_path, monkeypatch, capsys) -> None:
    """Beside the denoised layer, of which a picture shows the same as one developed from the layers; each says so."""
    options = ("--size", "24x16", "--spp", 4, "--aov", "denoising")
    render = ("render", "cornell-box", "-o")
    assert command(monkeypatch, capsys, *render, tmp_path / "raw.exr", *options)[0] == 0
    assert command(monkeypatch, capsys, *render, tmp_path / "a.exr", *options, "--denoise")[0] == 0
    assert command(monkeypatch, capsys, *render, tmp_path / "a.png", *options[:4], "--denoise")[0] == 0
    raw = read_image(tmp_path / "raw.exr")
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), raw)
    (_, clean), metadata = read_layers(tmp_path / "a.exr", ["denoised"])
    assert np.abs(clean - raw).max() > 0
    assert metadata["denoised_layer"].startswith("Open Image Denoise")
    assert "denoised" not in metadata
    develop = ("develop", tmp_path / "raw.exr", "-o")
    assert command(monkeypatch, capsys, *develop, tmp_path / "b.png", "--denoise")[0] == 0
    assert command(monkeypatch, capsys, *develop, tmp_path / "raw.png")[0] == 0
    np.testing.assert_array_equal(read_image(tmp_path / "b.png"), read_image(tmp_path / "a.png"))
    for name in ("a.png", "b.png"):
        assert read_metadata(tmp_path / name)["denoised"].startswith("Open Image Denoise")
    assert "denoised" not in read_metadata(tmp_path / "raw.png")

    write_image(tmp_path / "old.exr", raw, layers={name: np.ones_like(raw) for name in ("albedo", "normal")})
    develop = ("develop", tmp_path / "old.exr", "-o", tmp_path / "old.png", "--denoise")
    assert command(monkeypatch, capsys, *develop)[0] == 0  # with what there is

    status, message = command(monkeypatch, capsys, "compare", tmp_path / "a.png")
    assert (status, "this is a denoised picture, and compare renders the scene itself" in message) == (2, True)
    status, message = command(monkeypatch, capsys, "compare", tmp_path / "raw.exr")
    assert (status, "this is a picture, and compare renders the scene itself" in message) == (2, True)


def test_commands_that_cannot_denoise(tmp_path, monkeypatch, capsys) -> None:
    write_image(tmp_path / "bare.exr", np.ones((2, 2, 3)))
    write_image(tmp_path / "bare.npy", np.ones((2, 2, 3)))
    render = ("render", "furnace", "--size", "8x8", "--spp", 1)
    cases: dict[tuple[object, ...], str] = {
        (*render, "-o", tmp_path / "a.npy", "--denoise"): "only .exr files keep the radiance beside a denoised layer",
        (*render, "-o", tmp_path / "a.png", "--aov", "albedo"): "a.png: only .exr files have layers; give a.exr",
        (*render, "-o", tmp_path / "a.exr", "--aov", "albedos"): "no layer 'albedos'; the layers are: albedo, ",
        ("develop", tmp_path / "bare.exr", "-o", tmp_path / "a.png", "--denoise"): "render it with --aov denoising",
        ("develop", tmp_path / "bare.npy", "-o", tmp_path / "a.png", "--denoise"): "render it with --aov denoising",
        ("compare", "furnace", "--denoise"): "compare tests the mean of samples, and a denoised picture is none",
    }
    for arguments, expected in cases.items():
        status, message = command(monkeypatch, capsys, *arguments)
        assert (status, expected in message) == (2, True), message
        assert len(message.strip().splitlines()) == 1
    assert not list(tmp_path.glob("a.*"))
