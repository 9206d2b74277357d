# SPDX-License-Identifier: MIT
"""A model that is opened, edited, saved and rendered by the command."""

import shlex
import shutil
from pathlib import Path

import numpy as np
from common import GOLD, above_status_bar, opened, picture, refined, run_command
from hand import Hand
from imgui_bundle import imgui
from moving_model import model
from PIL import Image

import fragtracer as ft
from fragtracer import resources
from fragtracer.apps.viewer import picking
from fragtracer.apps.viewer.app import Viewer


def works_with_meshes() -> None:
    """A model that is dropped is opened, picked, moved, undone, lit by a dropped picture and saved; the command that is
    copied makes the picture of the window: of the model as it is, and as it was edited."""
    folder, mesh = Path("my models"), ("meshes", 0)
    folder.mkdir()
    knot = folder / "a knot.glb"
    shutil.copy(resources.folder("scenes") / "meshes" / "knot.glb", knot)
    ft.write_image(folder / "sky ü.exr", np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1)))
    with opened(size=(600, 360)) as viewer:
        hand = Hand(viewer)
        hand.click(*hand.place_of(viewer.session.document.part(GOLD).center))
        assert viewer.session.selected == GOLD
        hand.drop(knot)
        hand.until(lambda: bool(viewer.renderer.scene.meshes), "the model")
        assert not viewer.problem
        assert viewer.session.selected is None, "what was selected is gone"
        assert "/my models/a knot.glb'" in the_command_makes_the_picture(viewer, hand)
        before = viewer.session.document.part(mesh)
        corners = before.parts[0].geometry.positions[before.parts[0].geometry.triangles]
        middles = corners.mean(axis=1) @ before.instances[0].matrix[:3, :3].T + before.instances[0].matrix[:3, 3]
        nearest = np.linalg.norm(middles - viewer.session.camera.position, axis=1).argmin()
        hand.click(*hand.place_of(tuple(middles[nearest])))
        assert viewer.session.selected == mesh
        ball = picking.bounds(before)
        assert ball is not None
        x, y = hand.place_of(ball[0])
        hand.drag((x + 20, y), (x + 60, y))
        hand.frames(3)
        moved = viewer.session.document.part(mesh)
        assert moved.instances != before.instances
        assert len(viewer.session.history.past) == 1
        hand.drop(folder / "sky ü.exr")
        hand.until(lambda: viewer.renderer.scene.environment is not None, "the picture of it")
        assert "'a knot.toml'" in the_command_makes_the_picture(viewer, hand)
        hand.key("ctrl+z")
        hand.key("ctrl+z")
        assert viewer.session.document.part(mesh) == before
        assert viewer.session.document.scene.environment is None
        hand.key("ctrl+shift+z")
        hand.until(lambda: viewer.renderer.scene.meshes == (moved,), "the moved one again")
        hand.key("ctrl+s")
        assert viewer.session.path is not None
        assert ft.load(viewer.session.path).meshes == (moved,)


def plays_animations() -> None:
    """P moves the model, again and again, without a step to undo; the command renders the moment that is shown."""
    path = model(Path("x.glb").resolve())
    with opened(str(path), size=(600, 360)) as viewer:
        hand = Hand(viewer)
        session = viewer.session
        hand.until(lambda: bool(session.playback.names), "the names of the animations")
        session.animate(0, "rise")
        hand.key("p")
        seen: set[float] = set()

        def has_moved() -> bool:
            (shown,) = viewer.renderer.scene.meshes
            seen.add(shown.parts[0].geometry.positions[2, 1])
            return len(seen) > 6

        hand.until(has_moved, "six poses")
        hand.key("p")
        assert not session.playback.plays
        assert len(session.history.past) == 1
        session.playback.time = 0.5
        hand.until(lambda: viewer.renderer.scene.meshes[0].pose == ft.Pose("rise", 0.5), "the moment")
        assert not viewer.problem
        assert " x.toml " in the_command_makes_the_picture(viewer, hand)


def the_command_makes_the_picture(viewer: Viewer, hand: Hand) -> str:
    """Copy the command, run it, and compare; returns it."""
    viewer.session.say("", 0.0)  # no message lies over the picture
    refined(viewer, hand, 4)
    viewer.do("copy command")
    assert not viewer.problem
    command = imgui.get_clipboard_text()
    words = shlex.split(command)
    assert words[0] == "fragtracer"
    run_command(*words[1:])
    with Image.open(words[words.index("-o") + 1]) as image:
        made = np.asarray(image) / 255.0
    free = above_status_bar(viewer)
    assert np.abs(picture(viewer)[free] - made[free]).mean() < 0.02, command
    viewer.session.max_samples = 0
    return command
