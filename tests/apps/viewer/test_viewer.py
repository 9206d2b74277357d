# SPDX-License-Identifier: MIT
"""The viewer under real events, on a display of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

pytestmark = pytest.mark.slow
NAMES = (
    "looking.converges",
    "looking.orbits",
    "looking.stops_at_a_target_error",
    "looking.shows_help_and_hides",
    "editing.edits_a_material",
    "editing.drags_a_gizmo",
    "editing.adds_and_moves_lights",
    "editing.answers_while_a_sky_is_made",
    "disk.reloads_shaders",
    "disk.survives_a_broken_display",
    "disk.opens_and_reloads_files",
    "disk.saves_images",
    "disk.is_lit_by_a_dropped_picture",
    "models.works_with_meshes",
    "models.plays_animations",
    "windows.says_that_a_gpu_compiles",
    "windows.survives_sizes",
    "windows.survives_being_minimised",
    "windows.goes_to_a_monitor_of_high_density",
    "windows.draws_more_pixels_than_the_window_has_units",
    "failing.runs_out_of_memory",
    "failing.loses_its_context",
    "comparing.compares_with_mitsuba",
    "comparing.compares_split_sum_with_the_truth",
)


@pytest.mark.parametrize("name", NAMES)
def test_scenario(play: Callable[[str], None], name: str) -> None:
    play(name)


def command(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "fragtracer", *words],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_command_writes_screenshot_and_figures(display: str, tmp_path: Path) -> None:
    picture, figures = tmp_path / "window.png", tmp_path / "figures.json"
    words = ("view", "mirror", "--size", "640x360", "--frames", "40", "--orbit")
    places = {"DISPLAY": display, "XDG_CONFIG_HOME": str(tmp_path)}
    done = command(*words, "--screenshot", str(picture), "--stats", str(figures), **places)
    assert done.returncode == 0, done.stderr
    assert not done.stderr, "the edits of the measurement are nobody's to rescue"
    with Image.open(picture) as image:
        assert image.size == (640, 360)
        assert len(image.getcolors(2**18) or range(2**18)) > 100
    found = json.loads(figures.read_text("utf-8"))
    assert found["frame_milliseconds"]["frames"] == 40
    assert 0 < found["frame_milliseconds"]["p50"] <= found["frame_milliseconds"]["p99"]


def test_without_display_the_other_command_is_named() -> None:
    done = command("view", "mirror", DISPLAY="", WAYLAND_DISPLAY="")
    assert done.returncode == 2
    assert "there is no display" in done.stderr
    assert "fragtracer render" in done.stderr
    assert "Traceback" not in done.stderr
