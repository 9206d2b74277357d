# SPDX-License-Identifier: MIT
"""Animations that play in a window: which moment is shown, and what becomes of edits and files meanwhile."""

import time
from dataclasses import replace
from pathlib import Path

import pytest
from moving_model import model

import fragtracer as ft
from fragtracer.apps.viewer import actions
from fragtracer.apps.viewer.panels import animation as panel
from fragtracer.apps.viewer.playback import Playback, Player
from fragtracer.apps.viewer.session import Session
from fragtracer.errors import FragtracerError
from fragtracer.io.toml import load
from fragtracer.packing import instances, pack
from fragtracer.scene import Placement, Scene


@pytest.fixture
def glb(tmp_path: Path) -> Path:
    return model(tmp_path / "x.glb")


def until_posed(session: Session, player: Player) -> None:
    """Until the models are those of the time that the playback has now."""
    end = time.monotonic() + 60
    player.update(session.playback, session.document.scene)
    while player._coming is not None and time.monotonic() < end:
        player.update(session.playback, session.document.scene)
    assert player._coming is None


def height(scene: Scene, mesh: int = 0) -> float:
    """Of the end of the strip."""
    return float(scene.meshes[mesh].parts[0].geometry.positions[2, 1])


def test_time_passes_while_it_plays() -> None:
    playback = Playback(duration=2.0)
    playback.advance(0.4)
    assert playback.time == 0
    playback.plays = True
    for _ in range(6):
        playback.advance(0.4)
    assert playback.time == pytest.approx(0.4)
    playback.advance(3600.0)  # the computer slept
    assert playback.time == pytest.approx(0.9)
    still = Playback(plays=True)
    still.advance(1.0)
    assert still.time == 0, "nothing has a duration"


def test_models_are_shown_at_the_moment(glb: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lights go with a model; edits stay and go where the mesh is; what is saved plays, and a command holds."""
    session, player = Session.of(load(glb, animation="rise"), glb, "rise"), Player()
    playback = session.playback
    assert playback.plays
    playback.plays = False
    until_posed(session, player)
    assert playback.names == {str(glb): ("rise", "turn")}
    assert playback.duration == 1
    assert session.posed is session.document, "the beginning is there already"
    playback.time = 0.5
    until_posed(session, player)
    assert height(session.shown) == 3
    assert session.shown.lights == load(glb, animation="rise", time=0.5).lights != session.document.scene.lights
    assert height(session.document.scene) == 1
    assert session.is_saved
    mesh = session.document.scene.meshes[0]
    moved = session.document.with_part(("meshes", 0), replace(mesh, instances=(Placement((1.0, 0.0, 0.0)),)))
    session.edit(moved, "move")
    assert height(session.shown) == 3
    assert session.shown.meshes[0].instances == moved.scene.meshes[0].instances
    monkeypatch.chdir(tmp_path)
    words = actions.render_command(session, (4, 3), 1).split()
    held = load(words[2])
    assert held.meshes[0].pose == ft.Pose("rise", 0.5)
    assert height(held) == 3
    session.save(tmp_path / "saved.toml")
    assert load(tmp_path / "saved.toml").meshes[0].pose == ft.Pose("rise")
    player.close()


@pytest.mark.filterwarnings("ignore:.*none is chosen")
def test_another_animation_is_an_edit(glb: Path) -> None:
    session, player = Session.of(load(glb), glb), Player()
    until_posed(session, player)
    assert panel.can_move(session) == [0]
    rest = session.document
    session.animate(0, "rise")
    session.playback.time = 0.25
    until_posed(session, player)
    assert height(session.shown) == 2
    session.undo()
    assert session.document == rest
    until_posed(session, player)
    assert height(session.shown) == 1
    session.redo()
    session.animate(0, None)
    assert session.document == rest
    with pytest.raises(FragtracerError, match=r"x\.glb.*no animation.*leap"):
        session.animate(0, "leap")
    player.close()


def test_a_file_that_changes_is_read_again(glb: Path, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('[ambient]\nradiance = 1\n[[mesh]]\nfile = "x.glb"\nanimation = "rise"\n')
    session, player = Session.of(load(tmp_path / "s.toml"), tmp_path / "s.toml"), Player()
    session.playback.time = 0.5
    until_posed(session, player)
    assert height(session.shown) == 3
    model(glb, rise=8)
    session.follow([glb])
    assert height(session.shown) == 1, "until it is posed again"
    until_posed(session, player)
    assert height(session.shown) == 5
    glb.write_bytes(b"glTF")
    session.playback = Playback(plays=True, time=0.75)
    with pytest.raises(FragtracerError, match=r"x\.glb"):
        until_posed(session, player)
    assert not session.playback.plays
    assert height(session.shown) == 1
    player.close()


def test_where_nothing_plays_nothing_moves() -> None:
    """And the window can rest."""
    session = Session.of(load("mirror"))
    actions.carry_out(session, "play")
    assert not session.playback.plays
    assert "Nothing plays here" in session.toast
    assert not Playback(plays=True).moves


def test_a_model_with_other_parts_is_not_shown(glb: Path) -> None:
    session, player = Session.of(load(glb, animation="rise"), glb), Player()
    session.playback.time = 0.5
    until_posed(session, player)
    mesh = session.document.scene.meshes[0]
    session.edit(session.document.with_part(("meshes", 0), replace(mesh, parts=mesh.parts[:1])), "fewer")
    assert session.shown.meshes == session.document.scene.meshes
    player.close()


def test_poses_share_a_bvh(glb: Path) -> None:
    session, player = Session.of(load(glb, animation="rise"), glb), Player()
    scene = session.document.scene
    pack(scene, scene.render, 4, 3)
    session.playback.time = 0.5
    until_posed(session, player)
    before, after = (made.meshes[0].parts[0].geometry for made in (scene, session.shown))
    assert before != after
    assert instances._topologies[after] is instances._topologies[before]
    player.close()


@pytest.mark.filterwarnings("ignore:.*none is chosen")
def test_a_moment_is_chosen_in_the_panel(glb: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, player = Session.of(load(glb), glb), Player()
    until_posed(session, player)
    rows: dict[str, object] = {}
    shown: list[str] = []

    def row(text: str, value: object, *_: object, **__: object) -> object:
        shown.append(text)
        return rows.get(text, value)

    for name in ("choice", "check", "slider", "pair"):
        monkeypatch.setattr(panel.widgets, name, row)
    for name in ("push_id", "pop_id"):
        monkeypatch.setattr(panel.imgui, name, lambda *_: None)
    panel.edit(session)
    assert shown == ["x"]
    rows["x"] = "rise"
    panel.edit(session)
    assert session.document.scene.meshes[0].pose == ft.Pose("rise")
    until_posed(session, player)
    rows["Play"] = True
    panel.edit(session)
    assert session.playback.plays
    rows["Time"] = 0.75
    panel.edit(session)
    assert (session.playback.plays, session.playback.time) == (False, 0.75)
    until_posed(session, player)
    assert height(session.shown) == 4
    rows = {"x": "none"}
    panel.edit(session)
    assert session.document.scene.meshes[0].pose is None
    player.close()
