# SPDX-License-Identifier: MIT
"""The display chain of the window (shaders/display/) against that of picture files (display/look.py)."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import moderngl
import numpy as np
import numpy.typing as npt
import pytest

from fragtracer.apps.viewer import actions, programs
from fragtracer.apps.viewer.bloom import Bloom
from fragtracer.apps.viewer.display import Display, DisplaySettings
from fragtracer.apps.viewer.meter import Meter
from fragtracer.apps.viewer.programs import Programs
from fragtracer.display.bloom import quarter
from fragtracer.display.exposure import automatic_exposure
from fragtracer.display.look import Look
from fragtracer.errors import ShaderError
from fragtracer.resources import folder

Pixels = npt.NDArray[np.float32]
SIZES = [(1, 1), (3, 2), (15, 17), (16, 16), (33, 70), (96, 64), (101, 57), (257, 130)]


def picture(size: tuple[int, int], seed: int = 1, bad: bool = True) -> Pixels:
    """Radiances over six decades, with single pixels that are very bright, and some that are not finite."""
    width, height = size
    rng = np.random.default_rng(seed)
    pixels = rng.random((height, width, 3)) * 10 ** rng.uniform(-4, 1, (height, width, 1))
    pixels[rng.random((height, width)) < 0.02] *= 1000
    if bad and width * height > 4:
        for value in (np.nan, np.inf, -np.inf):
            pixels[rng.integers(height), rng.integers(width), rng.integers(3)] = value
        pixels[rng.integers(height), rng.integers(width)] = -1
    return pixels.astype(np.float32)


class FakeFilm:
    """What a display needs of a film."""

    def __init__(self, ctx: moderngl.Context, pixels: Pixels) -> None:
        height, width, _ = pixels.shape
        self.size = (width, height)
        rows = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)[::-1].astype(np.float32)
        self.textures = tuple(ctx.texture(self.size, 4, rows.tobytes(), dtype="f4") for _ in range(3))
        self.is_uneven = False

    def release(self) -> None:
        for texture in self.textures:
            texture.release()


def shown(
    ctx: moderngl.Context, pixels: Pixels, settings: DisplaySettings, size: tuple[int, int] | None = None
) -> Pixels:
    """What a window would show, of the size of the film or another, as float32."""
    width, height = size or pixels.shape[1::-1]
    film, display = FakeFilm(ctx, pixels), Display(ctx)
    texture = ctx.texture((width, height), 4, dtype="f4")
    target = ctx.framebuffer([texture])
    display.draw(target, film, (0, 0, width, height), settings, 1)
    result = np.frombuffer(texture.read(), np.float32).reshape(height, width, 4)[::-1, :, :3]
    display.release()
    ctx.detect_framebuffer(0).use()
    for resource in (target, texture, film):
        resource.release()
    return result


LOOKS = [
    DisplaySettings(),
    DisplaySettings(exposure=-2.0, tone_curve="reinhard", gamma=1.4),
    DisplaySettings(exposure=1.5, tone_curve="aces", bloom=True, bloom_strength=0.3),
    DisplaySettings(tone_curve="agx", auto_exposure=True, bloom=True, bloom_threshold=0.0),
    DisplaySettings(view="bloom", bloom_strength=2.0, bloom_threshold=0.5),
]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("look", range(len(LOOKS)))
def test_window_and_files_show_the_same(ctx: moderngl.Context, size: tuple[int, int], look: int) -> None:
    settings, pixels = LOOKS[look], picture(size)
    expected = Look(**actions.look(settings)).show(pixels)
    np.testing.assert_allclose(shown(ctx, pixels, settings), expected, atol=1e-4)


def test_a_picture_is_all_of_the_film_as_it_is_shown(ctx: moderngl.Context) -> None:
    """Also where another picture is beside it in the window."""
    settings, pixels = DisplaySettings(view="standard error"), picture((33, 70), bad=False)
    film, display = FakeFilm(ctx, pixels), Display(ctx)
    display.compare_with(np.zeros_like(pixels))
    found = display.picture(film, settings, 1)
    assert found.dtype == np.uint8
    np.testing.assert_allclose(found / 255, shown(ctx, pixels, settings), atol=0.51 / 255)
    assert len(np.unique(found)) > 20
    display.release()
    film.release()


def test_errors_are_relative(ctx: moderngl.Context) -> None:
    """A film of two samples and a variance that is its mean: the relative error of x is its inverse root."""
    errors = np.array([0.19, 0.15, 0.1, 0.05, 0.01])
    film = np.repeat(errors[None, :, None] ** -2, 3, axis=2).astype(np.float32)
    halved, whole = (shown(ctx, film, DisplaySettings(view="standard error", error_range=x))[0] for x in (0.2, 0.4))
    assert len(np.unique(halved.round(3), axis=0)) == len(errors)
    twice = np.repeat(errors[None, :, None] ** -2 / 4, 3, axis=2).astype(np.float32)
    np.testing.assert_allclose(
        shown(ctx, twice, DisplaySettings(view="standard error", error_range=0.4))[0], halved, atol=1e-5
    )
    assert np.abs(halved - whole).max() > 0.1


@pytest.mark.parametrize("size", SIZES)
def test_glare_has_the_same_numbers(ctx: moderngl.Context, size: tuple[int, int]) -> None:
    pixels = picture(size)
    film, compiled = FakeFilm(ctx, pixels), Programs(ctx)
    glare = Bloom(ctx, compiled)
    film.textures[0].use(0)
    glare.draw(size, {"FILM_FITS": 1}, {"u_exposure": 2.0}, 0.7)
    texels = np.frombuffer(glare.result.read(), np.float32).reshape(glare.result.height, glare.result.width, 4)
    finite = np.where(np.isfinite(pixels).all(axis=2, keepdims=True), pixels, 0)
    expected = quarter(2 * np.maximum(finite, 0), 0.7)
    np.testing.assert_allclose(texels[..., :3], expected, rtol=1e-5, atol=1e-6 * expected.max())
    for resource in (glare, compiled, film):
        resource.release()


@pytest.mark.parametrize("size", SIZES)
def test_meters_agree(ctx: moderngl.Context, size: tuple[int, int]) -> None:
    """A cell at the edge of a bin of 1/16 stop may fall on its other side: by so much of the cells' share."""
    pixels = picture(size)
    film, compiled = FakeFilm(ctx, pixels), Programs(ctx)
    assert Meter(ctx, compiled).measure(film) == pytest.approx(automatic_exposure(pixels), abs=1e-3)
    compiled.release()
    film.release()


def test_a_film_smaller_than_the_window_glares_as_widely(ctx: moderngl.Context) -> None:
    """One bright block of a coarse film: within a tenth of what the fine film of the same picture gives."""
    coarse = np.zeros((40, 64, 3), np.float32)
    coarse[18:22, 30:34] = 50
    fine = coarse.repeat(4, axis=0).repeat(4, axis=1)
    results = []
    for pixels, fits in ((fine, 1), (coarse, 0)):
        film, compiled = FakeFilm(ctx, pixels), Programs(ctx)
        glare = Bloom(ctx, compiled)
        film.textures[0].use(0)
        glare.draw((256, 160), {"FILM_FITS": fits}, {"u_exposure": 1.0}, 1.0)
        results.append(np.frombuffer(glare.result.read(), np.float32))
        for resource in (glare, compiled, film):
            resource.release()
    np.testing.assert_allclose(results[1], results[0], atol=1e-5 * results[0].max())


def test_a_small_film_is_enlarged_with_its_glare(ctx: moderngl.Context) -> None:
    """As while something moves: nearly what a film of the size of the window shows."""
    coarse = picture((64, 40), bad=False)
    fine = coarse.repeat(4, axis=0).repeat(4, axis=1)
    settings = DisplaySettings(view="bloom", bloom_strength=0.2, bloom_threshold=0.1)
    expected = shown(ctx, fine, settings)
    found = shown(ctx, coarse, settings, (256, 160))
    assert expected.std() > 0.05
    assert np.abs(found - expected).mean() < 0.01 * expected.mean()


def test_exposure_follows_a_change_in_a_moment(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr("fragtracer.apps.viewer.meter.time.perf_counter", lambda: clock.now)
    compiled = Programs(ctx)
    meter = Meter(ctx, compiled)
    films = [FakeFilm(ctx, np.full((8, 8, 3), value, np.float32)) for value in (0.18, 0.72, 0.0)]
    assert meter.follow(films[2]) == 0
    meter.forget()
    assert meter.follow(films[0]) == pytest.approx(0, abs=1 / 16)
    passed = []
    for clock.now in np.arange(0.1, 2, 0.05):
        passed.append(meter.follow(films[1]))
    assert passed == sorted(passed, reverse=True)
    assert -1.5 < passed[1] < -0.1
    assert passed[-1] == pytest.approx(-2, abs=1 / 16)
    clock.now = 3.0
    assert meter.follow(films[2]) == pytest.approx(-2, abs=1 / 16), "a black film says nothing"
    for resource in (compiled, *films):
        resource.release()


class Window:
    """A display that enlarges a film, and shader files that may be changed."""

    def __init__(self, ctx: moderngl.Context, root: Path) -> None:
        self.display, self._film, self._root = Display(ctx), FakeFilm(ctx, picture((40, 24))), root
        self._texture = ctx.texture((96, 60), 4, dtype="f4")
        self.target = ctx.framebuffer([self._texture])

    def draw(self, settings: DisplaySettings) -> Pixels:
        """What it shows, (60, 96, 3)."""
        self.target.clear()
        self.display.draw(self.target, self._film, (0, 0, *self.target.size), settings, 1)
        return np.frombuffer(self._texture.read(), np.float32).reshape(60, 96, 4)[..., :3]

    def change(self, file: str, old: str, new: str) -> None:
        """Write ``new`` for ``old`` in a file of the folder display."""
        path = self._root / "display" / file
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new), "utf-8")

    def release(self) -> None:
        for resource in (self.display, self.target, self._texture, self._film):
            resource.release()


@pytest.fixture
def window(ctx: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Window]:
    root = tmp_path / "shaders"
    shutil.copytree(folder("shaders"), root)
    monkeypatch.setattr(programs, "folder", lambda _: root)
    window = Window(ctx, root)
    yield window
    ctx.detect_framebuffer(0).use()
    window.release()


AUTOMATIC = DisplaySettings(auto_exposure=True)
GLARE = DisplaySettings(bloom=True, bloom_threshold=0.1)
IN_MAIN = "void main() {"
BROKEN = [
    ("display.frag", "#if HAS_GAMMA"),
    ("bloom.frag", IN_MAIN),
    ("meter.frag", IN_MAIN),
    ("enlarge.frag", IN_MAIN),
]


@pytest.mark.parametrize(("file", "line"), BROKEN)
def test_a_broken_file_keeps_every_program_that_was_used(window: Window, file: str, line: str) -> None:
    """Also that of a look that is not the last one."""
    looks = [DisplaySettings(gamma=1.4), GLARE, AUTOMATIC, DisplaySettings()]
    before = [window.draw(look) for look in looks]
    window.change(file, line, f"{line}\n broken")
    with pytest.raises(ShaderError, match=rf"display/{file}:\d"):
        window.display.reload_shaders()
    for look, pixels in zip(looks, before, strict=True):
        np.testing.assert_array_equal(window.draw(look), pixels)
    window.change(file, f"{line}\n broken", line)
    window.display.reload_shaders()
    np.testing.assert_array_equal(window.draw(looks[0]), before[0])


CHANGED = [
    ("display.frag", "vec4(view(place, mean), 1.0)", "vec4(0.2)", DisplaySettings(), 0.2),
    ("bloom.frag", "out_level = ", "out_level = 0.0 * ", replace(GLARE, view="bloom"), 0.0),
    ("meter.frag", "out_luminance = ", "out_luminance = vec4(1e20); //", AUTOMATIC, 0.0),
    ("enlarge.frag", "texture(", "0.2 + 0.0 * texture(", DisplaySettings(), 0.2),
]


@pytest.mark.parametrize(("file", "old", "new", "look", "expected"), CHANGED)
def test_a_changed_file_is_used(
    window: Window, file: str, old: str, new: str, look: DisplaySettings, expected: float
) -> None:
    before = window.draw(look)
    window.change(file, old, new)
    np.testing.assert_array_equal(window.draw(look), before)
    window.display.reload_shaders()
    assert np.median(window.draw(look)) == pytest.approx(expected)


def test_a_program_that_does_not_compile_when_it_is_needed_leaves_the_others(window: Window) -> None:
    line = "#elif BLOOM_PASS == BLOOM_HALF"
    window.change("bloom.frag", line, f"{line}\n broken")
    with pytest.raises(ShaderError, match=r"display/bloom.frag:\d"):
        window.draw(GLARE)
    assert window.draw(DisplaySettings()).any()
    window.change("bloom.frag", f"{line}\n broken", line)
    assert window.draw(GLARE).any()
