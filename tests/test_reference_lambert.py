# SPDX-License-Identifier: MIT
"""Lambert scenes agree with Mitsuba's own path tracer and diffuse material, without any plugin of ours."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from agreement import assert_agree
from fast_mitsuba import need_fast_mitsuba
from rendering import Image, Planter, batches
from scene_builders import all_lambert

from fragtracer.io.toml import load
from fragtracer.reference.translate import to_mitsuba
from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene import Scene

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
pytestmark = pytest.mark.slow

SIZE = (48, 32)
SEEDS = 16
SPP = {"three-spheres": 128, "cornell-box": 448}  # of Mitsuba, of each seed
OURS = {"three-spheres": 128, "cornell-box": 256}
RESOLUTION = {"three-spheres": 0.005, "cornell-box": 0.009}  # detectable bias of the image mean, at most


def scene_of(name: str) -> Scene:
    scene = all_lambert(load(name))
    return replace(scene, render=replace(scene.render, bounces=3))


@cache
def reference(name: str) -> Image:
    with mitsuba_variant("llvm_ad_rgb"), TemporaryDirectory() as folder:
        import mitsuba as mi

        scene = scene_of(name)
        scene = replace(scene, render=replace(scene.render, width=SIZE[0], height=SIZE[1]))
        world = mi.load_dict(to_mitsuba(scene, Path(folder), plugins=False))
        return np.stack([np.array(mi.render(world, spp=SPP[name], seed=seed)) for seed in range(100, 100 + SEEDS)])


@pytest.fixture(autouse=True)
def _fast_reference() -> None:
    need_fast_mitsuba()


@pytest.mark.parametrize("name", SPP)
def test_lambert_scene_agrees(ctx, name):
    """In the whole picture, and in each of 16 blocks, in each colour."""
    assert_agree(batches(ctx, scene_of(name), OURS[name], range(SEEDS), size=SIZE), reference(name), RESOLUTION[name])


def test_a_planted_error_is_found(ctx, monkeypatch, tmp_path):
    """A lobe 1 % too bright."""
    text = "b.diffuse * (wi.z * INVERSE_PI)"
    Planter(monkeypatch, tmp_path)("bsdf/diffuse.glsl", text, text.replace("wi.z", "1.01 * wi.z"))
    with pytest.raises(AssertionError, match="regions differ"):
        test_lambert_scene_agrees(ctx, "cornell-box")
