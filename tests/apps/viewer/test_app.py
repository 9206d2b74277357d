# SPDX-License-Identifier: MIT
"""The viewer's loop, without a window."""

import math
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

import fragtracer as ft
from fragtracer.apps.viewer import run
from fragtracer.apps.viewer.app import Viewer
from fragtracer.apps.viewer.session import Session
from fragtracer.apps.viewer.statistics import LAG


class Refiner(SimpleNamespace):
    """Of a picture that rests and has 100 samples per pixel; each frame adds one."""

    def __init__(self) -> None:
        super().__init__(problem="", tracing_problem="", is_moving=False, is_fading=False, is_deciding=False, held=None)
        self.size, self.is_preparing, self.resolution = (3, 2), False, SimpleNamespace(overhead=0.0)
        self.renderer = SimpleNamespace(spp=100, begun=1, image=lambda: np.ones((2, 3, 3)), metadata=dict)

    def frame(self, _: int | None) -> float:
        self.renderer.spp += 1
        return 0.01

    def fade(self, limit: int) -> None:
        assert limit == 0


def viewer_of(session: Session) -> Any:
    """One without a window, that nobody has used lately."""
    viewer: Any = object.__new__(Viewer)
    viewer.session, viewer.refiner, viewer._shader_problem = session, Refiner(), ""
    window = SimpleNamespace(was_touched=False)
    viewer.screen = SimpleNamespace(problem="", window=window, display=SimpleNamespace(is_adapted=True))
    viewer.interface, viewer.wipe = SimpleNamespace(used_at=0.0), SimpleNamespace(is_on=False, wants_pictures=False)
    viewer.film_statistics = SimpleNamespace(relative_error=0.01, forget=lambda: forget(viewer.film_statistics))
    viewer._begun, viewer._still, viewer._presented, viewer._presented_at = 1, 0, (), -math.inf
    viewer._awaited_image = ""
    return viewer


def forget(statistics: Any) -> None:
    statistics.relative_error = None


@pytest.fixture
def viewer() -> Any:
    return viewer_of(Session.of(ft.load("mirror")))


def test_refining_ends_at_the_first_limit_and_by_default_at_none(viewer: Any) -> None:
    session = viewer.session
    assert not viewer.is_done
    for error, samples, why in (
        (0.01, 0, "error below 1 %"),
        (0.0, 100, "100 samples"),
        (0.005, 100, "100 samples"),
        (0.005, 101, ""),
    ):
        session.target_error, session.max_samples = error, samples
        assert viewer._limit == why
        assert viewer.is_done == (why != "")
        viewer.refiner.is_deciding = True
        assert not viewer.is_done, "light may be found in a better way"
        viewer.refiner.is_deciding = False
    session.max_samples = 100
    viewer.refiner.is_moving = True
    assert not viewer.is_done


def test_a_pause_waits_for_a_picture_that_is_no_preview(viewer: Any) -> None:
    viewer.session.paused = True
    for moving, spp, done in ((True, 1, False), (False, 0, False), (False, 1, True)):
        viewer.refiner.is_moving, viewer.renderer.spp = moving, spp
        assert viewer.is_done == done
    viewer.refiner.is_deciding = True
    assert viewer.is_done


def test_an_image_is_saved_once_the_picture_is_no_preview(
    viewer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for moving, spp in ((True, 1), (False, 0)):
        viewer.refiner.is_moving, viewer.renderer.spp = moving, spp
        viewer.do("image exr")
        assert not list(tmp_path.iterdir())
        assert viewer._awaited_image == "exr"
    viewer.session.open("lamp")
    viewer.renderer.spp = 1
    viewer.save_image(viewer._awaited_image)
    assert viewer._awaited_image == ""
    assert viewer.session.toast == f"Saved radiance to {tmp_path / 'lamp.exr'}", "of the scene that is shown by then"
    viewer.session.display = replace(viewer.session.display, view="samples")
    shown = np.random.default_rng(1).integers(0, 256, (2, 3, 3), np.uint8)
    viewer.renderer.film, viewer.screen.display.picture = None, lambda *_: shown
    viewer.do("image png")
    assert viewer.session.toast == f"Saved samples to {tmp_path / 'lamp.png'}"
    with Image.open(tmp_path / "lamp.png") as saved:
        assert np.array_equal(saved, shown), "as it is shown"


def test_a_picture_that_is_done_is_drawn_until_all_that_is_shown_with_it_rests(viewer: Any) -> None:
    viewer.session.max_samples = 100
    viewer._presented = viewer._on_screen()
    for _ in range(LAG):
        assert not viewer._shows_nothing_new(time.perf_counter())
        viewer._refine()
    assert viewer._shows_nothing_new(time.perf_counter())
    display = replace(viewer.session.display, auto_exposure=True)
    for owner, name, value in (
        (viewer.refiner, "held", object()),
        (viewer.refiner, "is_moving", True),
        (viewer.screen.window, "was_touched", True),
        (viewer.interface, "used_at", time.perf_counter()),
        (viewer.wipe, "is_on", True),
        (viewer.session, "file_problem", "a file is broken"),
        (viewer.session, "display", display),
    ):
        before = getattr(owner, name)
        setattr(owner, name, value)
        assert not viewer._shows_nothing_new(time.perf_counter()), name
        setattr(owner, name, before)
        assert viewer._shows_nothing_new(time.perf_counter())
    viewer.session.display, viewer.screen.display.is_adapted = display, False
    viewer._presented = viewer._on_screen()
    assert not viewer._shows_nothing_new(time.perf_counter())
    viewer.screen.display.is_adapted = True
    assert viewer._shows_nothing_new(time.perf_counter())
    viewer.session.max_samples = 101
    viewer._refine()
    viewer._presented = viewer._on_screen()
    assert viewer.is_done
    assert not viewer._shows_nothing_new(time.perf_counter()), "there is another sample"


def test_a_picture_that_begins_anew_has_no_error_yet(viewer: Any) -> None:
    viewer._refine()
    assert viewer.film_statistics.relative_error == 0.01
    viewer.renderer.begun += 1
    viewer._refine()
    assert viewer.film_statistics.relative_error is None


@pytest.mark.parametrize(("frames", "limits"), [(None, (4096, 0.005)), (1, (0, 0.0))])
def test_refining_has_limits_where_somebody_looks(
    monkeypatch: pytest.MonkeyPatch, frames: int | None, limits: tuple[int, float]
) -> None:
    """They are remembered, and none is one of them."""

    class Window(nullcontext[Any]):
        times, session, is_open = SimpleNamespace(), Session.of(ft.load("mirror")), False

        def __init__(self, *_: object) -> None:
            super().__init__(self)

        def frame(self) -> None:
            found.append((self.session.max_samples, self.session.target_error))
            self.session.max_samples = 0

    found: list[tuple[int, float]] = []
    monkeypatch.setattr(run, "Viewer", Window)
    for _ in range(2):
        run.view(Window.session.document.scene, frames=frames)
    assert found == [limits, (0, limits[1])]


def test_a_message_stays_until_its_cause_is_gone_or_it_is_dismissed(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    ft.save(ft.load("mirror"), file)
    viewer = viewer_of(Session.of(ft.load(file), file))
    good = file.read_text("utf-8")
    file.write_text("[camera", "utf-8")
    viewer.do("reload")
    for action in ("pause", "dismiss", "home"):
        viewer.do(action)
        assert "not a TOML file" in viewer.problem, "of the file, which is still broken"
    viewer.do("open no-such-scene")
    assert "no such file or bundled scene" in viewer.problem
    viewer.do("dismiss")
    assert "not a TOML file" in viewer.problem
    file.write_text(good, "utf-8")
    viewer.do("reload")
    assert not viewer.problem
    viewer.do("open no-such-scene")
    viewer.do("dismiss")
    assert not viewer.problem
