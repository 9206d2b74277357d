# SPDX-License-Identifier: MIT
"""What is open: its history, its files, and what is remembered."""

import signal
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

import fragtracer as ft
from fragtracer.apps.viewer import actions, camera, run, settings
from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.apps.viewer.document import Document, History
from fragtracer.apps.viewer.session import Session
from fragtracer.apps.viewer.watch import Watch, scene_files, shader_files
from fragtracer.errors import FragtracerError
from fragtracer.resources import folder
from fragtracer.scene import Environment, Material, Scene, Sphere

from .models import tetrahedra


def test_history_merges_a_drag_and_forgets_the_future() -> None:
    first = Document(ft.load("mirror"))
    history = History(first)
    for name in "abc":
        history.edit(replace(first, scene=replace(first.scene, description=name)), "drag")
    history.close()
    history.edit(replace(first, scene=replace(first.scene, description="d")), "drag")
    assert len(history.past) == 2
    assert history.undo()
    assert history.now.scene.description == "c"
    assert history.undo()
    assert history.now == first
    assert not history.undo()
    assert history.redo()
    assert history.now.scene.description == "c"
    history.edit(first, "other")
    assert not history.redo()


def test_removing_a_part_keeps_the_others_hidden() -> None:
    document = Document(ft.load("three-spheres"), frozenset({("spheres", 2), ("lights", 0)}))
    after = document.without_part(("spheres", 0))
    assert after.hidden == {("spheres", 1), ("lights", 0)}
    assert len(after.visible.spheres) == 1
    assert after.visible.lights == ()


def test_saved_scene_has_the_camera_of_the_view(tmp_path: Path) -> None:
    session = Session.of(ft.load("mirror"))
    session.camera = camera.orbit(session.camera, 0.5, 0.0)
    session.save(tmp_path / "new.toml")
    assert ft.load(tmp_path / "new.toml").camera == session.camera


def test_bundled_scene_is_not_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session.of(ft.load("mirror"))
    session.open("mirror")
    assert actions.save_path(session) == tmp_path / "mirror.toml"


def test_a_model_is_saved_as_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.obj").write_text("mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")
    (tmp_path / "x.mtl").write_text("newmtl red\nKd 1 0 0\n")
    session = Session.of(ft.load("mirror"))
    session.open(tmp_path / "x.obj")
    files = scene_files(session.document.scene, session.path)
    assert set(files) == {tmp_path / "x.obj", tmp_path / "x.mtl"}
    assert actions.save_path(session) == tmp_path / "x.toml"
    session.save(tmp_path / "x.toml")
    assert ft.load(tmp_path / "x.toml") == session.document.scene


@dataclass
class FakeViewer:
    session: Session


def test_edits_survive_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    session = Session.of(ft.load("mirror"))
    session.edit(session.document.without_part(("spheres", 0)), "remove")
    expected = session.document.scene.spheres
    with pytest.raises(FragtracerError, match=r"driver gave up.*rescued-mirror.toml"), run.rescue(FakeViewer(session)):
        raise RuntimeError("driver gave up")
    assert ft.load(tmp_path / "fragtracer" / "rescued-mirror.toml").spheres == expected


def test_an_interrupted_viewer_writes_its_window(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Window(nullcontext[Any]):
        is_open, times, session, drawn = True, SimpleNamespace(), Session.of(ft.load("mirror")), 0

        def __init__(self, *_: object) -> None:
            super().__init__(self)

        def frame(self) -> None:
            signal.raise_signal(signal.SIGINT)
            self.drawn += 1

        def grab(self) -> np.ndarray:
            return np.full((1, 1, 3), self.drawn, np.uint8)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored in the background
    monkeypatch.setattr(run, "Viewer", Window)
    try:
        with pytest.raises(KeyboardInterrupt):
            run.view(Window.session.document.scene, frames=3, screenshot=tmp_path / "a.png")
    finally:
        signal.signal(signal.SIGINT, before)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.getpixel((0, 0)) == (1, 1, 1)


def test_display_is_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert settings.remembered_display() == DisplaySettings()
    settings.remember_display(DisplaySettings(exposure=1.5, tone_curve="agx"))
    assert settings.remembered_display() == DisplaySettings(exposure=1.5, tone_curve="agx")
    (tmp_path / "fragtracer" / "viewer.json").write_text("{", "utf-8")
    assert settings.remembered_display() == DisplaySettings()


def test_render_command_takes_an_edited_scene_along(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sphere = Scene(materials={"a": Material()}, spheres=(Sphere((0, 0, 0), 1.0, "a"),), name="ball")
    session = Session.of(sphere)
    edited = replace(session.settings, bounces=9, estimator="nee")
    session.edit(replace(session.document, scene=replace(sphere, render=edited)), "x")
    session.camera = camera.orbit(session.camera, 0.5, 0.0)
    words = actions.render_command(session, (300, 200), 64)
    assert words == "fragtracer render ball.toml -o ball.png --size 300x200 --spp 64"
    written = ft.load("ball.toml")
    assert written.render == edited
    assert written.camera == session.camera


def test_another_scene_begins_with_nothing_selected_and_no_environment_of_before() -> None:
    session = Session.of(ft.load("three-spheres"))
    session.selected, session.environment, session.material = ("spheres", 1), Environment(radiance=1.0), "gold"
    session.open("mirror")
    assert (session.selected, session.environment, session.material) == (None, None, "")


def test_watch_sees_the_files_of_a_scene_and_not_that_the_list_changes(tmp_path: Path) -> None:
    path, scene = tmp_path / "a.toml", tetrahedra()
    (tmp_path / "wood.png").write_bytes(b"1")
    assert list(scene_files(scene, path)) == [path, tmp_path / "wood.png"]
    shown = [scene]
    watch = Watch(lambda: scene_files(shown[0], path))

    def changed() -> bool:
        watch._looked_at = 0.0
        return watch.changed()

    assert not changed()
    (tmp_path / "wood.png").write_bytes(b"22")
    assert changed()
    assert not changed()
    shown[0] = replace(scene, materials={"a": Material(), "b": Material()})
    assert not changed()
    path.write_text("", "utf-8")
    assert changed(), "it has come"


def test_every_shader_file_is_watched() -> None:
    root = folder("shaders")
    files = {path for path in root.rglob("*.*") if path.suffix != ".md"}
    assert root / "display" / "display.frag" in files
    assert set(shader_files(root)) == files


def test_viewpoints_are_remembered_for_each_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    scene, path = ft.load("mirror"), tmp_path / "a.toml"
    session = Session.of(scene, path)
    session.camera = camera.orbit(session.camera, 0.5, 0.1)
    session.keep_viewpoint(3)
    assert Session.of(scene, path).viewpoints == {3: session.camera}
    assert Session.of(scene, tmp_path / "b.toml").viewpoints == {}
    session.save(tmp_path / "b.toml")
    assert Session.of(scene, tmp_path / "b.toml").viewpoints == {3: session.camera}
    (tmp_path / "fragtracer" / "viewpoints.json").write_text('{"x": 1', "utf-8")
    assert Session.of(scene, path).viewpoints == {}
