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
from fragtracer.apps.viewer.merge import merged
from fragtracer.apps.viewer.session import Session, path_of
from fragtracer.apps.viewer.settings import Limits
from fragtracer.apps.viewer.watch import Watch, scene_files, shader_files
from fragtracer.errors import FragtracerError
from fragtracer.resources import folder
from fragtracer.scene import Environment, Material, Placement, Scene, Sphere

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


LAMP = """# lengths from the drawing
[environment]
file = "sky.hdr"
[material.clay]
[[mesh]]
file = "x.obj"
material = "clay"
[[sphere]]
center = [0, 1, 0]
radius = 0.5
material = "clay"
[[sphere]]
center = [2, 1, 0]
radius = 0.5
material = "clay"
"""


def sky(path: Path, blue: float) -> None:
    ft.write_image(path, np.tile(np.float32((0.25, 0.5, blue)), (4, 8, 1)))


def triangle(path: Path, height: float) -> None:
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 {height} 0\nf 1 2 3\n", "utf-8")


@pytest.fixture
def lamp(tmp_path: Path) -> Session:
    """A scene file, whose panorama and mesh are files, too."""
    sky(tmp_path / "sky.hdr", 1.0)
    triangle(tmp_path / "x.obj", 1.0)
    path = tmp_path / "lamp.toml"
    path.write_text(LAMP, "utf-8")
    return Session.of(ft.load(path), path)


def rescued(name: str = "rescued-lamp") -> Scene:
    return ft.load(settings.config_folder() / f"{name}.toml")


def test_opening_another_scene_rescues_what_was_edited(lamp: Session, tmp_path: Path) -> None:
    lamp.open("mirror")
    assert lamp.toast == "Opened mirror"
    for name, left in (("rescued-mirror", 1), ("rescued-mirror-2", 0)):
        while len(lamp.document.scene.spheres) > left:
            lamp.edit(lamp.document.without_part(("spheres", 0)), "remove")
        expected = lamp.document.scene.spheres
        with pytest.raises(FragtracerError):
            lamp.open("no-such-scene")
        assert not lamp.is_saved
        actions.take(lamp, path_of("mirror"))
        assert lamp.toast.endswith(f"the edits that were not saved are in {settings.config_folder() / name}.toml")
        assert rescued(name).spheres == expected
        assert lamp.is_saved
        assert lamp.path == path_of("mirror")
    with pytest.raises(FragtracerError, match=r"\.hdr or \.exr"):
        actions.take(lamp, tmp_path / "sky.png")


def test_files_behind_a_scene_are_read_again_and_edits_stay(lamp: Session, tmp_path: Path) -> None:
    """Also a panorama that was dropped on the window, and in all that undo returns to."""
    before = lamp.document.scene
    lamp.follow({tmp_path / "sky.hdr"})
    assert lamp.is_saved
    shifted = replace(before.meshes[0], instances=(Placement(translation=(1.0, 0.0, 0.0)),))
    lamp.edit(lamp.document.with_part(("meshes", 0), shifted), "move")
    lamp.edit(lamp.document.without_part(("spheres", 0)).with_hidden(("spheres", 0), True), "remove")
    triangle(tmp_path / "x.obj", 2.0)
    sky(tmp_path / "sky.hdr", 0.25)
    lamp.follow({tmp_path / "sky.hdr", tmp_path / "x.obj"})
    now = lamp.document.scene
    assert lamp.toast == "Reloaded sky.hdr, x.obj"
    assert lamp.document.hidden == {("spheres", 0)}
    assert now.spheres == before.spheres[1:]
    assert now.meshes[0].instances == shifted.instances
    assert now.meshes[0].parts[0].geometry.positions.max() == 2.0
    assert now.environment is not None
    assert now.environment.image is not None
    assert now.environment.image.pixels[0, 0, 2] == np.float32(0.25)
    assert not lamp.is_saved
    sky(tmp_path / "other.hdr", 0.5)
    lamp.light_by(tmp_path / "other.hdr")
    sky(tmp_path / "other.hdr", 0.75)
    lamp.follow({tmp_path / "other.hdr"})
    light = lamp.document.scene.environment
    assert light is not None
    assert light.image is not None
    assert light.image.pixels[0, 0, 2] == np.float32(0.75)
    while lamp.history.past:
        lamp.undo()
    assert lamp.document.scene.meshes[0].parts[0].geometry.positions.max() == 2.0
    assert lamp.document.scene.environment == now.environment
    assert lamp.is_saved
    (tmp_path / "sky.hdr").unlink()
    lamp.follow({tmp_path / "sky.hdr"})
    assert "sky.hdr" in lamp.file_problem
    assert lamp.document.scene.environment == now.environment


def test_changes_of_both_sides_are_merged_by_parts_and_ours_stay_where_there_are_none() -> None:
    base = Scene(
        materials={"a": Material(), "b": Material(), "c": Material()},
        spheres=(Sphere((0, 0, 0), 1.0, "a"), Sphere((1, 0, 0), 1.0, "a")),
        name="base",
    )
    rough, red, gold = Material(roughness=0.1), Material(albedo=(1, 0, 0)), Material(metal="gold")
    first, second = base.spheres
    ours = replace(
        base,
        materials={"a": rough, "b": gold, "ours": gold},
        spheres=(replace(first, radius=2.0), replace(second, radius=2.0)),
        name="ours",
    )
    theirs = replace(
        base,
        materials={"a": red, "b": red, "c": Material(), "theirs": red},
        spheres=(first, replace(second, radius=3.0, center=(5, 0, 0))),
        name="theirs",
        description="theirs",
    )
    found = merged(base, ours, theirs)
    assert found.materials == {
        "a": replace(rough, albedo=(1, 0, 0)),
        "b": gold,  # which has no albedo
        "ours": gold,
        "theirs": red,
    }
    assert found.spheres == (ours.spheres[0], Sphere((5, 0, 0), 2.0, "a"))
    assert (found.name, found.description) == ("ours", "theirs")
    without = replace(base, spheres=(second,))
    assert merged(base, without, theirs).spheres == (second,)
    assert merged(base, without, replace(base, name="theirs")).spheres[0] is second
    with pytest.raises(ValueError, match="no material"):
        merged(base, replace(base, spheres=(replace(first, material="b"), second)), replace(base, materials={"a": red}))


def test_a_changed_scene_file_takes_the_place_of_edits_that_are_rescued(lamp: Session, tmp_path: Path) -> None:
    assert lamp.path is not None
    lamp.edit(lamp.document.without_part(("spheres", 0)), "remove")
    edited = lamp.document.scene
    lamp.edit(replace(lamp.document, hidden=frozenset({("spheres", 0), ("meshes", 0)})), "hide")
    lamp.path.write_text("[camera", "utf-8")
    lamp.follow({lamp.path})
    assert "not a TOML file" in lamp.file_problem
    assert lamp.document.scene == edited
    for radius in (0.6, 0.7, 0.8):
        lamp.path.write_text(LAMP[: LAMP.rindex("[[sphere]]")].replace("0.5", str(radius)), "utf-8")
        lamp.follow({lamp.path})
        lamp.history.close()
        assert not lamp.file_problem
        assert [sphere.radius for sphere in lamp.document.scene.spheres] == [radius]
        assert lamp.document.hidden == {("spheres", 0), ("meshes", 0)}
        assert lamp.is_saved
    assert rescued().spheres == edited.spheres
    assert not (tmp_path / "config" / "fragtracer" / "rescued-lamp-2.toml").exists()
    assert len(lamp.history.past) == 3, "what is read again, and again, is one step"
    lamp.undo()
    assert lamp.document.scene == edited


def test_what_is_asked_for_in_each_frame_is_made_anew_only_where_it_changes() -> None:
    session = Session.of(ft.load("three-spheres"))
    shown = session.shown
    assert session.shown is shown
    assert session.users("gold") == 1
    session.camera = camera.orbit(session.camera, 0.5, 0.0)
    assert session.shown.camera == session.camera
    session.edit(session.document.with_hidden(("spheres", 0), True), "hide")
    assert len(session.shown.spheres) == 2
    golden = replace(session.document.part(("spheres", 0)), material="gold")
    session.edit(session.document.with_part(("spheres", 0), golden), "gold")
    assert session.users("gold") == 2


def test_undo_keeps_the_object_selected_where_others_come_back() -> None:
    session = Session.of(ft.load("three-spheres"))
    first, second, _ = session.document.scene.spheres
    session.edit(session.document.without_part(("spheres", 0)), "remove")
    session.selected = ("spheres", 0)
    session.undo()
    assert session.selected == ("spheres", 1)
    assert session.document.part(session.selected) is second
    session.selected = ("spheres", 0)
    session.redo()
    assert session.selected is None
    session.undo()
    session.edit(session.document.with_part(("spheres", 0), replace(first, radius=0.1)), "radius")
    session.selected = ("spheres", 0)
    session.undo()
    assert session.selected == ("spheres", 0)


def test_a_file_that_is_written_for_the_first_time_is_kept(lamp: Session, tmp_path: Path) -> None:
    """Whoever wrote it: it may have comments."""
    assert lamp.path is not None
    for _ in range(2):
        actions.carry_out(lamp, "save")
        assert (tmp_path / "lamp.toml~").read_text("utf-8") == LAMP
        assert "#" not in lamp.path.read_text("utf-8")
        lamp.edit(lamp.document.without_part(("spheres", 0)), "remove")
    assert lamp.toast == f"Saved {lamp.path}"
    lamp.file_problem = "the file is broken"
    actions.carry_out(lamp, "save")
    assert not lamp.file_problem


def test_names_of_scenes_become_names_of_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session.of(replace(ft.load("mirror"), name="a/../b: c"))
    session.edit(session.document.without_part(("spheres", 0)), "remove")
    assert session.rescue() == settings.config_folder() / "rescued-a-..-b- c.toml"
    assert actions.save_path(session) == tmp_path / "a-..-b- c.toml"
    assert "--size 3x2" in actions.render_command(session, (3, 2), 1)
    assert actions.save_path(Session.of(replace(ft.load("mirror"), name=""))) == tmp_path / "scene.toml"


def test_display_and_limits_are_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert settings.remembered_display() == DisplaySettings()
    assert settings.remembered_limits() == Limits(4096, 0.005)
    settings.remember(DisplaySettings(exposure=1.5, tone_curve="agx"), Limits(0, 0.01))
    assert settings.remembered_display() == DisplaySettings(exposure=1.5, tone_curve="agx")
    assert settings.remembered_limits() == Limits(0, 0.01)
    for text in ("{", '{"exposure": "x", "limits": {"samples": -1}}', '{"limits": 3}', "3"):
        (tmp_path / "fragtracer" / "viewer.json").write_text(text, "utf-8")
        assert settings.remembered_display() == DisplaySettings()
        assert settings.remembered_limits() == Limits()


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
