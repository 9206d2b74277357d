# SPDX-License-Identifier: MIT
"""What the scenarios share: a viewer that is open, and what it shows."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command import status_of
from hand import Hand
from imgui_bundle import imgui

import fragtracer as ft
from fragtracer.apps.viewer import compiler
from fragtracer.apps.viewer.app import Viewer
from fragtracer.apps.viewer.session import path_of
from fragtracer.gpu import tracer

GOLD = ("spheres", 1)


def opened(scene: str = "three-spheres", size: tuple[int, int] = (640, 400), guides: bool = False) -> Viewer:
    """A viewer that has shown a frame; without ``guides`` no process learns where light comes from, which takes longer
    than most scenarios."""
    viewer = Viewer(ft.load(scene), path_of(scene), size)
    if not guides:
        viewer.refiner._guider = None
    viewer.frame()
    return viewer


def make_maps(may_finish: Path | None = None, **sizes: int) -> None:
    """Of these sizes for the split sum, in this process and in the one that compiles: its own take longer than all
    else. That of an environment waits there until the file ``may_finish`` is there, if one is named."""
    chosen = tracer.MapSizes(**sizes)
    patch = f"from fragtracer.gpu import tracer; tracer._MAPS = tracer.{chosen}"
    if may_finish is not None:
        path = str(may_finish)
        waiting = f"any(os.path.exists({path!r}) or time.sleep(0.01) for _ in range(3000))"  # or what waits goes on
        patch += "; import os, time; made = tracer.environment_maps"
        patch += f"; tracer.environment_maps = lambda *words: ({waiting}, made(*words))[1]"
    tracer._MAPS = chosen
    compiler._COMMAND = (sys.executable, "-c", f"{patch}; from {compiler.__name__} import main; main()")


def run_command(*words: str) -> None:
    """``fragtracer`` and ``words``, in this process."""
    with pytest.MonkeyPatch.context() as patch:
        assert status_of(patch, *words) == 0


def picture(viewer: Viewer) -> Any:
    """The part of the window with the picture, without the panels that lie over it, in [0, 1]."""
    left, bottom, width, height = viewer.screen.rectangle
    top = viewer.screen.window.pixels[1] - bottom - height
    return viewer.grab()[top : top + height, left : left + width] / 255.0


def above_status_bar(viewer: Viewer) -> slice:
    """The rows of the picture that the status bar, whose lines are as many as its text needs, does not cover."""
    _, bottom, _, height = viewer.screen.rectangle
    bar = imgui.internal.find_window_by_name("##status")
    return slice(0, height + bottom - viewer.screen.window.pixels[1] + int(bar.pos.y))


def refined(viewer: Viewer, hand: Hand, spp: int) -> None:
    viewer.session.max_samples = spp
    hand.until(lambda: viewer.is_done and viewer.renderer.spp >= spp, f"{spp} samples")
    hand.until(lambda: viewer.refiner.held is None, "the fade")


def set_scene(viewer: Viewer, **fields: Any) -> None:
    """Edit the scene."""
    document = viewer.session.document
    viewer.session.edit(replace(document, scene=replace(document.scene, **fields)), f"{fields.keys()}")
    viewer.session.history.close()


def set_render(viewer: Viewer, **fields: Any) -> None:
    """Edit the settings of the scene."""
    set_scene(viewer, render=replace(viewer.session.document.scene.render, **fields))
