# SPDX-License-Identifier: MIT
"""Files that are opened, dropped, changed and written."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from common import above_status_bar, opened, picture, refined, set_scene
from hand import Hand

import fragtracer as ft
from fragtracer import resources
from fragtracer.apps.viewer import app, programs
from fragtracer.display.look import Look
from fragtracer.gpu import tracer
from fragtracer.io.images import read_image, read_metadata
from fragtracer.scene import Ambient


def reloads_shaders() -> None:
    """A broken shader file keeps the picture and shows where the mistake is; mended, all goes on."""
    shutil.copytree(resources.folder("shaders"), "shaders")
    for module in (tracer, programs, app):
        module.folder = lambda _: Path("shaders").resolve()  # type: ignore[attr-defined]
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
        dark = good.replace("direct *= throughput;", "direct *= 0.0;")
        assert dark != good
        file.write_text(dark, "utf-8")
        hand.until(lambda: not viewer.problem, "recovery")
        refined(viewer, hand, 8)
        viewer.session.max_samples = 0
        assert picture(viewer)[100:-60].mean() < 0.5 * before[100:-60].mean(), "the new program is in use"
        compiler = viewer.refiner._compiler
        assert compiler is not None
        done, compiler.is_done = compiler.is_done, lambda _: False  # type: ignore[method-assign]
        file.write_text(good, "utf-8")
        hand.until(lambda: viewer.refiner._shaders is not None, "the change")
        spp = viewer.renderer.spp
        hand.until(lambda: viewer.renderer.spp > spp + 8, "samples by the program of before")
        compiler.is_done = done  # type: ignore[method-assign]
        hand.until(lambda: viewer.renderer.spp < spp, "the program that was compiled elsewhere")


def survives_a_broken_display() -> None:
    """Broken files of the display keep the picture, and a look that they make impossible goes without one."""
    shutil.copytree(resources.folder("shaders"), "shaders")
    for module in (programs, app):
        module.folder = lambda _: Path("shaders").resolve()  # type: ignore[attr-defined]
    with opened(size=(420, 260)) as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 4)
        before, session = picture(viewer), viewer.session
        lines = {"display.frag": "void main() {", "bloom.frag": "#elif BLOOM_PASS == BLOOM_HALF"}
        files = [Path("shaders/display") / name for name in lines]
        good = [file.read_text("utf-8") for file in files]
        for file, text, line in zip(files, good, lines.values(), strict=True):
            assert line in text
            file.write_text(text.replace(line, f"{line}\n broken"), "utf-8")
        hand.until(lambda: bool(viewer.problem), "the message")
        assert "display/display.frag:" in viewer.problem
        assert np.abs(picture(viewer) - before)[100:-60].mean() < 0.05, "the last good program goes on"
        session.display = replace(session.display, bloom=True)
        hand.frames(3)
        assert "display/bloom.frag:" in viewer.screen.problem
        assert picture(viewer)[100:-60].mean() < 0.5 * before[100:-60].mean(), "there is none with glare"
        assert viewer.grab().max() > 200, "the panels are drawn where they belong"
        for file, text in zip(files, good, strict=True):
            file.write_text(text, "utf-8")
        hand.until(lambda: not viewer.problem, "recovery")
        session.say("", 0.0)  # no message lies over the picture
        hand.frames(3)
        assert picture(viewer)[100:-60].mean() > 0.9 * before[100:-60].mean()


def opens_and_reloads_files() -> None:
    """A file dropped on the window is opened, and read again when it changes; a mistake is shown."""
    with opened() as viewer:
        hand = Hand(viewer)
        viewer.screen.window.dropped.append("no-such-file.toml")
        hand.frames(2)
        assert "no such file" in viewer.problem
        scene = ft.load("mirror")
        ft.save(scene, "mine.toml")
        viewer.screen.window.dropped.append("mine.toml")
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
        viewer.session.display = replace(viewer.session.display, view="samples")
        viewer.do("image png")
        assert viewer.session.toast == f"Saved samples to {Path('three-spheres-2.png').resolve()}"
        assert read_metadata("three-spheres-2.png")["view"] == "samples"
        viewer.session.display = replace(viewer.session.display, view="radiance")
        viewer.session.paused = True
        set_scene(viewer, ambient=Ambient(0.5))
        viewer.frame()
        hand.key("F12")
        hand.until(lambda: Path("three-spheres-3.png").exists(), "the picture after the preview")
        hand.until(lambda: viewer.is_done and viewer.refiner.held is None, "the rest")
        hand.frames(1)
        assert viewer.renderer.spp > 0
        assert viewer.renderer.size == viewer.refiner.size
        free = above_status_bar(viewer)
        saved = Look().show(read_image("three-spheres-3.png"))
        viewer.session.say("")
        viewer.frame()
        assert np.abs(saved - picture(viewer))[free].max() < 1.6 / 255
        viewer.do("copy command")
        assert "fragtracer render" in viewer.session.toast


def is_lit_by_a_dropped_picture() -> None:
    """An .exr file dropped on the window becomes the environment; it is turned, undone and saved."""
    with opened(size=(420, 260)) as viewer:
        hand = Hand(viewer)
        ft.write_image("sky.exr", np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1)))
        viewer.screen.window.dropped.append("sky.exr")
        hand.until(lambda: viewer.renderer.scene.environment is not None, "the picture of it")
        assert not viewer.problem
        refined(viewer, hand, 4)
        np.testing.assert_allclose(viewer.renderer.image()[0, 0], (0.2, 0.5, 0.9), rtol=1e-5)
        environment = viewer.session.document.scene.environment
        assert environment is not None
        turned = replace(environment, rotation_degrees=30.0, visible=False)
        scene = replace(viewer.session.document.scene, environment=turned)
        viewer.session.edit(replace(viewer.session.document, scene=scene), "turn")
        hand.until(lambda: viewer.renderer.scene.environment == turned, "the turned one")
        refined(viewer, hand, 4)
        assert not viewer.renderer.image()[0, 0].any(), "hidden from the camera"
        Path("damaged.exr").write_bytes(Path("sky.exr").read_bytes()[:200])
        viewer.screen.window.dropped.append("damaged.exr")
        hand.frames(2)
        assert "damaged.exr: this .exr file is damaged" in viewer.problem
        hand.key("ctrl+s")
        assert ft.load("three-spheres.toml").environment == turned
        hand.key("ctrl+z")
        hand.key("ctrl+z")
        assert viewer.session.document.scene.environment is None
