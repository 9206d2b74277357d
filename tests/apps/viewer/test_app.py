# SPDX-License-Identifier: MIT
"""The viewer's loop, without a window."""

from pathlib import Path
from types import SimpleNamespace

import fragtracer as ft
from fragtracer.apps.viewer.app import Viewer
from fragtracer.apps.viewer.session import Session


def viewer_of(session: Session) -> Viewer:
    """One without a window, whose picture rests after some samples."""
    viewer = object.__new__(Viewer)
    viewer.session = session
    viewer.refiner = SimpleNamespace(problem="", tracing_problem="")  # type: ignore[assignment]
    viewer.screen = SimpleNamespace(problem="")  # type: ignore[assignment]
    viewer.interface = SimpleNamespace(used_at=0.0)  # type: ignore[assignment]
    viewer._shader_problem = ""
    return viewer


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
