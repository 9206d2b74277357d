# SPDX-License-Identifier: MIT
"""Another picture of the scene beside ours."""

from dataclasses import replace

import numpy as np
import pytest
from common import make_maps, opened, picture, refined
from hand import Hand

import fragtracer as ft
from fragtracer.apps.compare.pictures import diverging, enlarged
from fragtracer.apps.viewer import significance as pictures
from fragtracer.apps.viewer.panels import difference
from fragtracer.apps.viewer.panels import significance as panel


def compares_with_mitsuba() -> None:
    """Mitsuba's picture of the scene comes up beyond the wipe, and goes when the scene changes."""
    pytest.importorskip("mitsuba")
    pictures._SLICES = 2  # a picture takes as many frames
    # Without guiding, whose paths find light that Mitsuba's do not meet in so few samples (docs/correctness.md).
    with opened(size=(460, 340)) as viewer:
        hand = Hand(viewer)
        viewer.session.max_samples = 16  # leaves the processor to Mitsuba
        hand.key("m")
        assert viewer.wipe.is_on
        before = viewer.screen.frames
        while not viewer.screen.display.compares:
            viewer.frame()
            assert not viewer.problem
        assert viewer.screen.frames > before + 10, "the window did not wait for Mitsuba"
        refined(viewer, hand, 16)
        ours, both = viewer.renderer.image(), viewer.wipe.image
        assert both is not None
        assert abs(both.mean() / ours.mean() - 1) < 0.1
        hand.key("m")
        hand.until(lambda: viewer.wipe.significance.finding is not None, "enough pictures")
        finding = viewer.wipe.significance.finding
        assert finding is not None
        assert finding.pictures >= 8
        assert finding.outcome != "disagreement"
        hand.frames(1)
        seen = (255 * picture(viewer)).round().astype(np.uint8)
        expected = enlarged(diverging(panel.clearest(finding), 6.0), seen.shape[1::-1])
        part = slice(172, 228), slice(seen.shape[1] * 3 // 4, None)  # below the legend, above the status bar
        assert np.median(np.abs(seen[part].astype(int) - expected[part])) <= 1, "the blocks are where they were tested"
        viewer.session.camera = replace(viewer.session.camera, fov_degrees=50.0)
        hand.frames(2)
        assert not viewer.wipe.is_on
        assert not viewer.screen.display.compares


def compares_split_sum_with_the_truth() -> None:
    """The approximation left of the line, the path-traced picture right of it, then the map of its error."""
    make_maps(prefiltered=64, samples=64, irradiance=16, brdf=64)
    pictures._SLICES = 2
    with opened("overcast", (420, 260)) as viewer:
        hand = Hand(viewer)
        scene = viewer.session.document.scene
        settings = replace(scene.render, integrator="split-sum", background="irradiance")
        viewer.session.edit(replace(viewer.session.document, scene=replace(scene, render=settings)), "integrator")
        viewer.session.max_samples = 16
        hand.until(lambda: viewer.is_done and viewer.renderer.spp >= 16, "the maps")
        smooth = picture(viewer)
        settings = replace(settings, background="environment")
        viewer.session.edit(replace(viewer.session.document, scene=replace(scene, render=settings)), "background")
        hand.frames(2)
        refined(viewer, hand, 16)
        assert np.abs(picture(viewer) - smooth)[:60].mean() > 0.01, "the background is another one"
        ours = viewer.renderer.image()
        hand.key("m")
        hand.until(lambda: viewer.screen.display.compares, "the truth")
        hand.until(lambda: viewer.wipe._shown >= 64, "samples")
        truth = viewer.wipe.image
        assert truth is not None
        expected = ft.render(viewer.session.shown, truth.shape[1::-1], 64, integrator="path")
        assert truth.mean() == pytest.approx(expected.mean(), rel=0.01)
        assert abs(ours.mean() / truth.mean() - 1) > 0.01
        hand.key("m")
        hand.until(lambda: viewer.wipe._batches is not None and len(viewer.wipe._batches.means) >= 4, "pictures")
        assert viewer.wipe._batches is not None
        assert viewer.wipe._reference is not None
        values = difference.relative_blocks(viewer.wipe._batches.means, viewer.wipe._reference.means)
        assert values.max() > 0.05, "the approximation sees the sky through the balls"
        hand.frames(2)
        hand.key("m")
        assert not viewer.wipe.is_on
