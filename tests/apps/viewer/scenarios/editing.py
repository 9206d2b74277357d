# SPDX-License-Identifier: MIT
"""Editing what is selected."""

import tempfile
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from common import GOLD, make_maps, opened, picture, refined, set_render, set_scene
from hand import Hand

import fragtracer as ft
from fragtracer.apps.viewer.panels import widgets
from fragtracer.scene import Disk, Light
from fragtracer.scene import environment as environments


def edits_a_material() -> None:
    """A click selects the gold sphere; its roughness slider makes it another picture, from no samples."""
    rows: dict[str, tuple[Any, Any]] = {}
    slider = widgets.slider

    def watched(text: str, *rest: Any, **options: Any) -> float:
        value = slider(text, *rest, **options)
        rows[text] = (widgets.imgui.get_item_rect_min(), widgets.imgui.get_item_rect_max())
        return value

    widgets.slider = watched
    with opened(size=(660, 720)) as viewer:
        hand = Hand(viewer)
        center = viewer.session.document.part(GOLD).center
        hand.click(*hand.place_of(center))
        assert viewer.session.selected == GOLD
        refined(viewer, hand, 12)
        before = picture(viewer)
        low, high = rows["Roughness"]
        y = (low.y + high.y) / 2
        hand.drag((low.x + 0.35 * (high.x - low.x), y), (low.x + 0.95 * (high.x - low.x), y))
        gold = viewer.session.document.scene.materials["gold"]
        assert gold.roughness > 0.8
        assert gold.metal == "gold"
        assert len(viewer.session.history.past) == 1, "a drag is one step"
        assert viewer.renderer.spp < 12, "refining began again"
        viewer.session.max_samples = 0
        refined(viewer, hand, 12)
        change = np.abs(picture(viewer) - before).mean(axis=-1)
        x, y = hand.place_of(center)
        left, bottom, _, height = viewer.screen.rectangle
        column, row = round(x - left), round(y - (720 - bottom - height))
        assert change[row - 20 : row + 20, column - 20 : column + 20].mean() > 0.08
        assert change[:40].mean() < 0.02, "and nothing else is"
        hand.key("ctrl+z")
        assert viewer.session.document.scene.materials["gold"].roughness == 0.35
        hand.key("ctrl+shift+z")
        assert viewer.session.document.scene.materials["gold"].roughness > 0.8


def drags_a_gizmo() -> None:
    """The red arrow on the selected sphere takes it along x, as one step; a view of normals shows them."""
    with opened() as viewer:
        hand = Hand(viewer)
        before = viewer.session.document.part(GOLD)
        hand.click(*hand.place_of(before.center))
        hand.frames(2)
        x, y = hand.place_of(before.center)
        hand.drag((x + 30, y), (x + 90, y))
        after = viewer.session.document.part(GOLD)
        assert after.center[0] > before.center[0] + 0.05
        assert after.center[1:] == before.center[1:]
        assert len(viewer.session.history.past) == 1
        hand.key("ctrl+z")
        assert viewer.session.document.part(GOLD) == before
        viewer.session.display = replace(viewer.session.display, view="normals")
        hand.frames(2)
        hand.until(lambda: viewer.renderer.spp >= 4 and not viewer.refiner.is_moving, "normals")
        floor = viewer.renderer.image()[-1, 0]
        np.testing.assert_allclose(floor, (0.5, 1.0, 0.5), atol=1e-6)
        viewer.session.display = replace(viewer.session.display, view="albedo")
        hand.frames(2)
        hand.until(lambda: viewer.renderer.spp >= 4 and not viewer.refiner.is_moving, "albedo")
        np.testing.assert_allclose(viewer.renderer.image()[-1, 0], 0.5, atol=1e-6)


def adds_and_moves_lights() -> None:
    """Each kind of light is added in the menu's way, selected by its mark, and moved by its arrow; F frames a disk."""
    with opened() as viewer:
        hand = Hand(viewer)
        disk = Disk((0.0, 1.4, 0.0), (0.0, 1.0, 1.0), 0.2, "gold")
        set_scene(viewer, disks=(disk,), lights=(Light((-0.6, 1.3, 0.0), power=10.0),))
        session = viewer.session
        for kind in ("spot_lights", "directional_lights"):
            viewer.do(f"add {kind}")
            hand.frames(3)
            assert session.selected == (kind, 0)
        assert viewer.problem == ""
        (added,) = session.document.scene.spot_lights
        set_scene(viewer, spot_lights=(replace(added, position=(0.6, 1.3, 0.0)),))  # from above the picture into it
        hand.click(*hand.place_of(disk.center))
        assert session.selected == ("disks", 0)
        hand.key("f")
        assert session.camera.target == disk.center
        hand.key("Home")
        for part in (("spot_lights", 0), ("lights", 0)):
            before = session.document.part(part)
            x, y = hand.place_of(before.position)
            hand.click(x, y)
            assert session.selected == part
            hand.frames(2)
            hand.drag((x + 30, y), (x + 90, y))
            after = session.document.part(part)
            assert after.position[0] > before.position[0] + 0.05
            assert after.position[1:] == before.position[1:]
        hand.key("Delete")
        assert session.document.scene.lights == ()


def answers_while_a_sky_is_made() -> None:
    """The sun is moved step by step, and no sky is finished before the last step: no frame waits for one, nor then for
    the maps of the split sum, and the state says so; the picture ends as that of the last step."""
    may_finish = threading.Event()

    def held(turbidity: float, elevation: float, azimuth: float, albedo: float) -> np.ndarray:
        may_finish.wait()
        return np.tile(np.float32((0.2, 0.5, 0.5 + elevation)), (8, 16, 1))

    maps_may_finish = Path(tempfile.mkdtemp()) / "maps may finish"
    maps_may_finish.touch()
    make_maps(maps_may_finish, samples=64, brdf=64)
    environments.sky_pixels = held
    may_finish.set()
    with opened("sun-sky", (420, 260)) as viewer:
        hand = Hand(viewer)
        for integrator in ("path", "split-sum"):
            set_render(viewer, integrator=integrator)
            hand.until(lambda: not viewer.refiner.is_preparing, integrator)
            may_finish.clear()
            for step in range(4):
                environment = viewer.session.document.scene.environment
                assert environment is not None
                sky = replace(environment.sky, sun_elevation_degrees=10.0 + 0.5 * step + 20 * (integrator == "path"))
                set_scene(viewer, environment=replace(environment, sky=sky))
                hand.frames(2)
                assert viewer.figures.state == "preparing"
            if integrator == "split-sum":
                maps_may_finish.unlink()
                may_finish.set()
                hand.frames(8)
                assert viewer.figures.state == "preparing", "of the maps, too"
                maps_may_finish.touch()
            may_finish.set()
            hand.until(lambda: not viewer.refiner.is_preparing, "the last sky")
            assert viewer.renderer.scene.environment == viewer.session.document.scene.environment
            refined(viewer, hand, 16)
            ours = viewer.renderer.image()
            wanted = ft.render(viewer.session.shown, ours.shape[1::-1], 16)
            assert ours.mean() == pytest.approx(wanted.mean(), rel=0.01)
            viewer.session.max_samples = 0
