# SPDX-License-Identifier: MIT
"""Looking at a scene from everywhere until it is fine."""

from dataclasses import replace

import numpy as np
from common import GOLD, above_status_bar, opened, picture, refined, run_command
from hand import Hand

from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.display.look import Look
from fragtracer.display.tone import TONE_CURVES
from fragtracer.io.images import read_image


def converges() -> None:
    """The picture is that of ``fragtracer render``, and is shown by the curves of display/tone.py."""
    with opened(size=(480, 280)) as viewer:
        hand = Hand(viewer)
        refined(viewer, hand, 64)
        width, height = viewer.renderer.size
        image, error = viewer.renderer.image(), viewer.renderer.standard_error()
        for curve in TONE_CURVES:
            viewer.session.display = replace(viewer.session.display, tone_curve=curve, exposure=0.5)
            viewer.frame()
            expected = Look(0.5, curve).show(image)
            free = above_status_bar(viewer)
            assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255, curve
        viewer.session.display = DisplaySettings(bloom=True, bloom_strength=0.5, gamma=1.2)
        viewer.frame()
        free = above_status_bar(viewer)
        expected = Look(bloom=0.5, gamma=1.2).show(image)
        assert np.abs(picture(viewer)[free] - expected[free]).max() < 1.6 / 255, "bloom"
    size = f"{width}x{height}"
    run_command("render", "three-spheres", "-o", "r.exr", "--size", size, "--spp", "64", "--seed", "7")
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


def stops_at_a_target_error() -> None:
    """Refining ends when the error is as small as was asked for, and not before, nor while something is learned."""
    with opened("mirror", (420, 260), guides=True) as viewer:
        hand = Hand(viewer)
        guider = viewer.refiner._guider
        assert guider is not None
        guider.has_answered = lambda *_: False  # type: ignore[method-assign]
        viewer.session.target_error = 0.05
        hand.until(lambda: viewer._limit != "", "the error")
        assert viewer.figures.state == "refining"
        viewer.refiner._guider = None
        guider.close()
        hand.until(lambda: viewer.is_done, "the target")
        assert viewer.renderer.relative_error() <= 0.05
        assert viewer.renderer.spp >= 4


def shows_help_and_hides() -> None:
    """F1 shows the keys; H hides what is selected and Alt+H shows it again; Delete removes; numbers are viewpoints."""
    with opened() as viewer:
        hand = Hand(viewer)
        hand.key("F1")
        assert viewer.interface.help_shown
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
        left, bottom, width, height = viewer.screen.rectangle
        hand._do("keydown", "ctrl")
        hand.click(left + width / 2, viewer.screen.window.pixels[1] - bottom - height * 0.2)
        hand._do("keyup", "ctrl")
        hand.frames(1)
        assert viewer.session.camera.focus_distance is not None
