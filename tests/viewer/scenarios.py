# SPDX-License-Identifier: MIT
"""What a person does with the viewer, and what should be seen then.

Each function is run by test_viewer.py in a process of its own, in an empty folder.
"""

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import glfw
import moderngl
import numpy as np
import pytest
from hand import Hand
from imgui_bundle import imgui
from PIL import Image
from x11 import say_density, say_state

import fragtracer as ft
from fragtracer import resources
from fragtracer.compare.pictures import diverging, enlarged
from fragtracer.errors import FragtracerError
from fragtracer.images import read_image, read_metadata
from fragtracer.images.look import Look
from fragtracer.images.tone import TONE_CURVES
from fragtracer.viewer import app, display, picking, run
from fragtracer.viewer.app import Viewer
from fragtracer.viewer.display import DisplaySettings
from fragtracer.viewer.panels import difference, widgets
from fragtracer.viewer.panels import significance as panel
from fragtracer.viewer.session import path_of
from fragtracer.viewer.window import Window

GOLD = ("spheres", 1)


def opened(scene: str = "three-spheres", size: tuple[int, int] = (800, 500)) -> Viewer:
    viewer = Viewer(ft.load(scene), path_of(scene), size)
    viewer.frame()
    return viewer


def picture(viewer: Viewer) -> Any:
    """The part of the window with the picture, without the panels that lie over it, in [0, 1]."""
    left, bottom, width, height = viewer.rectangle
    top = viewer.window.pixels[1] - bottom - height
    return viewer.grab()[top : top + height, left : left + width] / 255.0


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


def converges() -> None:
    """The picture is that of ``fragtracer render``, and is shown by the curves of images/tone.py."""
    with opened(size=(560, 340)) as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 128)
        width, height = viewer.renderer.size
        image, error = viewer.renderer.image(), viewer.renderer.standard_error()
        for curve in TONE_CURVES:
            viewer.session.display = replace(viewer.session.display, tone_curve=curve, exposure=0.5)
            viewer.frame()
            expected = Look(0.5, curve).show(image)
            free = slice(0, height - 60)  # above the status bar
            assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255, curve
        viewer.session.display = DisplaySettings(bloom=True, bloom_strength=0.5, gamma=1.2)
        viewer.frame()
        expected = Look(bloom=0.5, gamma=1.2).show(image)
        assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255, "bloom"
    size = f"{width}x{height}"
    command = ["-m", "fragtracer", "render", "three-spheres", "-o", "r.exr", "--size", size, "--spp", "128"]
    subprocess.run([sys.executable, *command, "--seed", "7"], check=True)
    difference = image - read_image("r.exr")
    seen = error > 0
    z = difference[seen] / (np.sqrt(2) * error[seen])
    assert abs(np.median(np.abs(z))) < 0.75, "more than the error bars allow"
    assert abs(difference.mean(dtype=np.float64)) < 5 * np.sqrt(2 * (error.astype(np.float64) ** 2).mean() / image.size)


def orbits() -> None:
    """What is nearer than the target follows the hand to the right; turning does not change the distance."""
    with opened() as viewer:
        hand = Hand(viewer)
        hand.key("Tab")
        front = (0.0, 0.5, 0.5)
        before, camera = hand.place_of(front), viewer.session.camera
        hand.drag((300, 100), (360, 100))
        after = hand.place_of(front)
        assert after[0] > before[0] + 5
        distances = [np.linalg.norm(np.subtract(c.position, c.target)) for c in (camera, viewer.session.camera)]
        assert np.isclose(*distances)
        left = picture(viewer)
        hand.drag((300, 100), (300, 140))
        assert viewer.session.camera.position[1] > camera.position[1], "drawn down, the scene shows its top"
        assert np.abs(picture(viewer) - left).mean() > 0.01, "the picture has moved too"
        hand.move(300, 200)
        hand._do("click", "4")
        hand.frames(2)
        nearer = np.linalg.norm(np.subtract(viewer.session.camera.position, viewer.session.camera.target))
        assert nearer < distances[0], "the wheel moves nearer"
        hand.key("Home")
        assert viewer.session.camera == camera
        hand.drag((300, 200), (360, 200), button=2)
        hand._do("keydown", "w")
        hand.frames(4)
        hand._do("keyup", "w")
        hand.frames(2)
        assert not np.allclose(viewer.session.camera.target, camera.target), "flying takes the target along"


def edits_a_material() -> None:
    """A click selects the gold sphere; its roughness slider makes it another picture, from no samples."""
    rows: dict[str, tuple[Any, Any]] = {}
    slider = widgets.slider

    def watched(text: str, *rest: Any, **options: Any) -> float:
        value = slider(text, *rest, **options)
        rows[text] = (widgets.imgui.get_item_rect_min(), widgets.imgui.get_item_rect_max())
        return value

    widgets.slider = watched
    with opened(size=(760, 720)) as viewer:
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
        column, row = round(x - viewer.rectangle[0]), round(y - (720 - viewer.rectangle[1] - viewer.rectangle[3]))
        assert change[row - 20 : row + 20, column - 20 : column + 20].mean() > 0.08
        assert change[:40].mean() < 0.02, "and nothing else is"
        hand.key("ctrl+z")
        assert viewer.session.document.scene.materials["gold"].roughness == 0.35
        hand.key("ctrl+shift+z")
        assert viewer.session.document.scene.materials["gold"].roughness > 0.8


def reloads_shaders() -> None:
    """A broken shader file keeps the picture and shows where the mistake is; mended, all goes on."""
    shutil.copytree(resources.folder("shaders"), "shaders")
    for module in ("fragtracer.gpu.tracer", "fragtracer.viewer.display", "fragtracer.viewer.app"):
        sys.modules[module].folder = lambda _: Path("shaders").resolve()  # type: ignore[attr-defined]
    assert display is not None
    with opened() as viewer:
        hand = Hand(viewer)
        file = Path("shaders/integrator/path.glsl")
        good = file.read_text("utf-8")
        line = good[: good.index("Path path_begin")].count("\n") + 1
        refined(viewer, hand, 4)
        before = picture(viewer)
        file.write_text(good.replace("Path path_begin", "Path! path_begin"), "utf-8")
        hand.until(lambda: bool(viewer.problem), "the message")
        assert f"integrator/path.glsl:{line}" in viewer.problem
        refined(viewer, hand, 8)
        assert np.abs(picture(viewer) - before)[100:-60].mean() < 0.05, "the last good program goes on"
        dark = good.replace("path.radiance += path.throughput * direct", "path.radiance += 0.0 * direct")
        assert dark != good
        file.write_text(dark, "utf-8")
        hand.until(lambda: not viewer.problem, "recovery")
        viewer.session.max_samples = 0
        refined(viewer, hand, 8)
        assert picture(viewer)[100:-60].mean() < 0.5 * before[100:-60].mean(), "the new program is in use"


def opens_and_reloads_files() -> None:
    """A file dropped on the window is opened, and read again when it changes; a mistake is shown."""
    with opened() as viewer:
        hand = Hand(viewer)
        viewer.window.dropped.append("no-such-file.toml")
        hand.frames(2)
        assert "no such file" in viewer.problem
        scene = ft.load("mirror")
        ft.save(scene, "mine.toml")
        viewer.window.dropped.append("mine.toml")
        hand.frames(2)
        assert viewer.session.document.scene.name == "mine"
        assert not viewer.problem
        first = next(iter(scene.materials))
        edited = {**scene.materials, first: ft.Material(albedo=(0.9, 0.1, 0.1))}
        ft.save(replace(scene, materials=edited), "mine.toml")
        hand.until(lambda: viewer.session.document.scene.materials == edited, "reload")
        hand.until(lambda: viewer.renderer.scene.materials == edited, "the picture of it")
        Path("mine.toml").write_text("[camera\n", "utf-8")
        hand.until(lambda: "not a TOML file" in viewer.problem, "the message")
        assert viewer.session.document.scene.materials == edited
        hand.key("ctrl+s")
        hand.until(lambda: not viewer.problem, "saving mends the file")
        assert dict(ft.load("mine.toml").materials) == edited


def saves_images() -> None:
    """F12 writes the picture with what made it."""
    with opened() as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 4)
        hand.key("F12")
        assert read_metadata("three-spheres.png")["spp"] == "4"
        viewer.do("image exr")
        assert np.array_equal(read_image("three-spheres.exr"), viewer.renderer.image())
        viewer.do("copy command")
        assert "fragtracer render three-spheres" in viewer.session.toast


def stops_at_a_target_error() -> None:
    """Refining ends when the error is as small as was asked for, and not before."""
    with opened("mirror", (560, 340)) as viewer:
        hand = Hand(viewer)
        viewer.session.target_error = 0.05
        hand.until(lambda: viewer.is_done, "the target")
        assert viewer.renderer.relative_error() <= 0.05
        assert viewer.renderer.spp >= 4


def survives_sizes() -> None:
    """Small and large windows, from one pixel to 4K."""
    with opened() as viewer:
        hand = Hand(viewer)
        for width, height in ((1, 1), (40, 700), (3840, 2160), (640, 400)):
            viewer.window.set_size(width, height)
            hand.until(lambda size=(width, height): viewer.window.pixels == size, "resize")  # type: ignore[misc]
            hand.frames(3)
            assert viewer.refiner.size == viewer.rectangle[2:]
            hand.until(
                lambda: not viewer.refiner.is_moving and viewer.renderer.size == viewer.refiner.size, "a picture"
            )
            assert width < 100 or picture(viewer).mean() > 0.05, "not black, before the first pass is done either"
            turns = 0
            while width == 3840 and viewer.renderer.spp == 0 and turns < 4:
                viewer.frame()
                turns += 1
            assert width != 3840 or turns == 4, "a pass over so many pixels takes several turns of the loop"
        hand.until(lambda: viewer.renderer.spp >= 1, "samples")
        assert viewer.context.error == "GL_NO_ERROR"


def survives_being_minimised() -> None:
    """While the window is minimised nothing is drawn, an edit waits, and then it shows."""
    with opened() as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 4)
        window = glfw.get_x11_window(viewer.window._handle)
        say_state(window, 3)
        hand.until(lambda: viewer.window.is_minimised, "minimised")
        frames = len(viewer.times.recent)
        viewer.session.camera = replace(viewer.session.camera, fov_degrees=60.0)
        for _ in range(3):
            viewer.frame()
        assert len(viewer.times.recent) == frames
        assert viewer.renderer.scene.camera.fov_degrees != 60.0
        say_state(window, 1)
        viewer.session.max_samples = 0
        hand.until(lambda: viewer.renderer.scene.camera.fov_degrees == 60.0, "the edit")
        refined(viewer, hand, 4)
        assert picture(viewer).mean() > 0.05


def goes_to_a_monitor_of_high_density() -> None:
    """There the window opens twice as large, text is twice as large, and a click meets what is under it."""
    say_density(192)
    try:
        viewer = opened()
    finally:
        say_density(96)
    with viewer:
        hand = Hand(viewer)
        assert viewer.window.scale == 2.0
        assert viewer.window.pixels == (1600, 1000)
        assert imgui.get_style().font_scale_dpi == 2.0
        side = viewer.window.pixels[0] - viewer.rectangle[2]
        hand.click(*hand.place_of(viewer.session.document.part(GOLD).center))
        assert viewer.session.selected == GOLD
        Window.scale = property(lambda _: 1.0)  # type: ignore[assignment]
        hand.frames(3)
        assert imgui.get_style().font_scale_dpi == 1.0, "taken to another monitor"
        assert viewer.window.pixels[0] - viewer.rectangle[2] == pytest.approx(side / 2, rel=0.1)
        hand.key("Escape")
        hand.click(*hand.place_of(viewer.session.document.part(("spheres", 0)).center))
        assert viewer.session.selected == ("spheres", 0)


def draws_more_pixels_than_the_window_has_units() -> None:
    """On macOS and Wayland the picture has more pixels than the window has units, and fills them."""
    size = glfw.get_framebuffer_size
    glfw.get_framebuffer_size = lambda handle: tuple(2 * n for n in size(handle))
    with opened() as viewer:
        hand = Hand(viewer)
        assert viewer.window.pixels_per_unit == 2.0
        refined(viewer, hand, 2)
        left, bottom, width, height = viewer.rectangle
        assert (left, bottom + height) == (0, 1000 - 2 * imgui.get_frame_height())
        assert viewer.renderer.size == (width, height)
        assert width > 800
        expected = Look().show(viewer.renderer.image())
        free = slice(0, 400), slice(0, 780)  # imgui draws the panels over the rest, as large as X11's pixels
        assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255


def runs_out_of_memory() -> None:
    """A film that does not fit ends with a message, and the edited scene is kept."""
    make = moderngl.Context.framebuffer

    def full(self: Any, textures: Any = (), **options: Any) -> Any:
        if textures and textures[0].size[0] > 700:
            raise moderngl.Error("the framebuffer is not complete")
        return make(self, textures, **options)

    def grow(viewer: Viewer) -> None:
        viewer.session.edit(viewer.session.document.without_part(GOLD), "remove")
        viewer.window.set_size(1200, 700)

    moderngl.Context.framebuffer = full  # type: ignore[method-assign]
    ends_with_the_scene_kept(grow, "no memory for an image")


def loses_its_context() -> None:
    """A driver that gave up ends with a message, and the edited scene is kept."""

    def lose(viewer: Viewer) -> None:
        viewer.session.edit(viewer.session.document.without_part(GOLD), "remove")
        viewer.context = Lost(viewer.context)

    ends_with_the_scene_kept(lose, "lost the window's context")


class Lost:
    """A context that says what one says after a reset."""

    error = "GL_UNKNOWN_ERROR"

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)


def ends_with_the_scene_kept(harm: Any, message: str) -> None:
    """Run the viewer as the command does, and do ``harm`` in the fourth frame."""
    turned, frame = 0, Viewer.frame

    def counted(self: Viewer) -> None:
        nonlocal turned
        turned += 1
        if turned == 4:
            harm(self)
        frame(self)

    Viewer.frame = counted  # type: ignore[method-assign]
    with pytest.raises(FragtracerError, match=message) as caught:
        run.view("three-spheres", (640, 400), frames=600)
    assert turned < 400
    kept = Path(os.environ["XDG_CONFIG_HOME"]) / "fragtracer" / "rescued-three-spheres.toml"
    assert str(kept) in str(caught.value)
    assert len(ft.load(kept).spheres) == 2


def shows_help_and_hides() -> None:
    """F1 shows the keys; H hides what is selected and Alt+H shows it again; Delete removes; numbers are viewpoints."""
    with opened() as viewer:
        hand = Hand(viewer)
        hand.key("F1")
        assert viewer.help_shown
        hand.key("F1")
        hand.click(*hand.place_of(viewer.session.document.part(GOLD).center))
        hand.key("f")
        assert viewer.session.camera.target == viewer.session.document.part(GOLD).center
        hand.key("ctrl+3")
        kept = viewer.session.camera
        hand.key("Home")
        assert viewer.session.camera != kept
        hand.key("3")
        assert viewer.session.camera == kept
        hand.key("h")
        hand.until(lambda: len(viewer.renderer.scene.spheres) == 2, "hidden")
        hand.key("alt+h")
        hand.until(lambda: len(viewer.renderer.scene.spheres) == 3, "shown")
        hand.key("Delete")
        assert len(viewer.session.document.scene.spheres) == 2
        hand.key("space")
        assert viewer.session.paused
        left, bottom, width, height = viewer.rectangle
        hand._do("keydown", "ctrl")
        hand.click(left + width / 2, viewer.window.pixels[1] - bottom - height * 0.2)
        hand._do("keyup", "ctrl")
        hand.frames(1)
        assert viewer.session.camera.focus_distance is not None


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


def is_lit_by_a_dropped_picture() -> None:
    """An .exr file dropped on the window becomes the environment; it is turned, undone and saved."""
    with opened(size=(900, 700)) as viewer:
        hand = Hand(viewer)
        ft.write_image("sky.exr", np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1)))
        viewer.window.dropped.append("sky.exr")
        hand.until(lambda: viewer.renderer.scene.environment is not None, "the picture of it")
        assert not viewer.problem
        refined(viewer, hand, 8)
        np.testing.assert_allclose(viewer.renderer.image()[0, 0], (0.2, 0.5, 0.9), rtol=1e-5)
        environment = viewer.session.document.scene.environment
        assert environment is not None
        turned = replace(environment, rotation_degrees=30.0, visible=False)
        scene = replace(viewer.session.document.scene, environment=turned)
        viewer.session.edit(replace(viewer.session.document, scene=scene), "turn")
        hand.until(lambda: viewer.renderer.scene.environment == turned, "the turned one")
        refined(viewer, hand, 8)
        assert not viewer.renderer.image()[0, 0].any(), "hidden from the camera"
        Path("damaged.exr").write_bytes(Path("sky.exr").read_bytes()[:200])
        viewer.window.dropped.append("damaged.exr")
        hand.frames(2)
        assert "damaged.exr: this .exr file is damaged" in viewer.problem
        hand.key("ctrl+s")
        assert ft.load("three-spheres.toml").environment == turned
        hand.key("ctrl+z")
        hand.key("ctrl+z")
        assert viewer.session.document.scene.environment is None


def works_with_meshes() -> None:
    """A model that is dropped is opened, picked, moved, undone, lit by a dropped picture and saved; the command that is
    copied makes the picture of the window: of the model as it is, and as it was edited."""
    folder, mesh = Path("my models"), ("meshes", 0)
    folder.mkdir()
    model = folder / "a knot.glb"
    shutil.copy(resources.folder("scenes") / "meshes" / "knot.glb", model)
    ft.write_image(folder / "sky ü.exr", np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1)))
    with opened(size=(700, 420)) as viewer:
        hand = Hand(viewer)
        hand.click(*hand.place_of(viewer.session.document.part(GOLD).center))
        assert viewer.session.selected == GOLD
        hand.drop(model)
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
        hand.drag((x + 30, y), (x + 70, y))
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


def the_command_makes_the_picture(viewer: Viewer, hand: Hand) -> str:
    """Copy the command, run it, and compare; returns it."""
    refined(viewer, hand, 8)
    viewer.do("copy command")
    assert not viewer.problem
    command = imgui.get_clipboard_text()
    words = shlex.split(command)
    subprocess.run([sys.executable, "-m", *words], check=True, capture_output=True)
    with Image.open(words[words.index("-o") + 1]) as image:
        made = np.asarray(image) / 255.0
    free = slice(0, len(made) - 60)  # above the status bar
    assert np.abs(picture(viewer)[free] - made[free]).mean() < 0.02, command
    viewer.session.max_samples = 0
    return command


def answers_while_a_sky_is_made() -> None:
    """The sun is moved step by step: no frame waits for the sky, nor for the maps of the split sum, and the state
    says so; the picture ends as that of the last step."""
    with opened("sun-sky", (560, 340)) as viewer:
        hand = Hand(viewer)
        for integrator in ("path", "split-sum"):
            set_render(viewer, integrator=integrator)
            hand.until(lambda: not viewer.refiner.is_preparing, integrator, 60)
            states, slowest = set(), 0.0
            for step in range(40):
                environment = viewer.session.document.scene.environment
                assert environment is not None
                sky = replace(environment.sky, sun_elevation_degrees=20.0 + 0.5 * step + (integrator == "path"))
                set_scene(viewer, environment=replace(environment, sky=sky))
                viewer.frame()
                states.add(viewer.figures.state)
                slowest = max(slowest, viewer.times.recent[-1])
            assert "preparing" in states
            assert slowest < 0.4, "making a sky takes twice as long, its maps six times"
            hand.until(lambda: not viewer.refiner.is_preparing, "the last sky", 60)
            assert viewer.renderer.scene.environment == viewer.session.document.scene.environment
            refined(viewer, hand, 16)
            ours = viewer.renderer.image()
            wanted = ft.render(viewer.session.shown, ours.shape[1::-1], 16)
            assert ours.mean() == pytest.approx(wanted.mean(), rel=0.01)
            viewer.session.max_samples = 0


def compares_with_mitsuba() -> None:
    """Mitsuba's picture of the scene comes up beyond the wipe, and goes when the scene changes."""
    pytest.importorskip("mitsuba")
    with opened(size=(560, 340)) as viewer:
        hand = Hand(viewer)
        hand.key("m")
        assert viewer.wipe.is_on
        slowest = 0.0
        while not viewer.display.compares:
            viewer.frame()
            slowest = max(slowest, viewer.times.recent[-1])
            assert not viewer.problem
        refined(viewer, hand, 64)
        ours, both = viewer.renderer.image(), viewer.wipe.image
        assert both is not None
        assert abs(both.mean() / ours.mean() - 1) < 0.1
        hand.key("m")
        hand.until(lambda: viewer.wipe.significance.finding is not None, "enough pictures", 60)
        finding = viewer.wipe.significance.finding
        assert finding is not None
        assert finding.pictures >= 8
        assert finding.outcome != "disagreement"
        hand.frames(1)
        seen = (255 * picture(viewer)).round().astype(np.uint8)
        expected = enlarged(diverging(panel.clearest(finding), 6.0), seen.shape[1::-1])
        part = slice(240, 270), slice(seen.shape[1] * 3 // 4, None)  # below the legend
        assert np.median(np.abs(seen[part].astype(int) - expected[part])) <= 1, "the blocks are where they were tested"
        viewer.session.camera = replace(viewer.session.camera, fov_degrees=50.0)
        hand.frames(2)
        assert not viewer.wipe.is_on
        assert not viewer.display.compares
        assert slowest < 2.0, "the window did not wait for Mitsuba"


def compares_split_sum_with_the_truth() -> None:
    """The approximation left of the line, the path-traced picture right of it, then the map of its error."""
    with opened("overcast", (560, 340)) as viewer:
        hand = Hand(viewer)
        scene = viewer.session.document.scene
        settings = replace(scene.render, integrator="split-sum", background="irradiance")
        viewer.session.edit(replace(viewer.session.document, scene=replace(scene, render=settings)), "integrator")
        viewer.session.max_samples = 16
        hand.until(lambda: viewer.is_done and viewer.renderer.spp >= 16, "the maps", 120)
        smooth = picture(viewer)
        settings = replace(settings, background="environment")
        viewer.session.edit(replace(viewer.session.document, scene=replace(scene, render=settings)), "background")
        hand.frames(2)
        refined(viewer, hand, 16)
        assert np.abs(picture(viewer) - smooth)[:60].mean() > 0.01, "the background is another one"
        ours = viewer.renderer.image()
        hand.key("m")
        hand.until(lambda: viewer.display.compares, "the truth", 60)
        hand.until(lambda: viewer.wipe._shown >= 64, "samples", 60)
        truth = viewer.wipe.image
        assert truth is not None
        expected = ft.render(viewer.session.shown, truth.shape[1::-1], 64, integrator="path")
        assert truth.mean() == pytest.approx(expected.mean(), rel=0.01)
        assert abs(ours.mean() / truth.mean() - 1) > 0.01
        hand.key("m")
        hand.until(lambda: viewer.wipe._batches is not None and len(viewer.wipe._batches.means) >= 4, "pictures", 60)
        assert viewer.wipe._batches is not None
        assert viewer.wipe._reference is not None
        values = difference.relative_blocks(viewer.wipe._batches.means, viewer.wipe._reference.means)
        assert values.max() > 0.05, "the approximation sees the sky through the balls"
        hand.frames(2)
        if "SHOT" in os.environ:
            Image.fromarray(viewer.grab()).save(os.environ["SHOT"])
        hand.key("m")
        assert not viewer.wipe.is_on


if __name__ == "__main__":
    assert app is not None
    globals()[sys.argv[1]]()
