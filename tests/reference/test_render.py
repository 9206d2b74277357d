# SPDX-License-Identifier: MIT
"""The reference renderer: batches, seeds, passes and progress."""

import signal
from dataclasses import replace

import numpy as np
import pytest
from agreement import assert_agree

from fragtracer.io.toml import load
from fragtracer.reference import render
from fragtracer.scene import Ambient, Camera, Fog, Light, Material, Medium, Plane, RenderSettings, Scene, Sphere

SCENE = Scene(
    Camera((0.0, 1.0, 4.0), (0.0, 0.5, 0.0)),
    {"floor": Material(albedo=0.5), "copper": Material(metal="copper", roughness=0.3)},
    spheres=[Sphere((0.0, 0.5, 0.0), 0.5, "copper")],
    planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor")],
    lights=[Light((2.0, 3.0, 1.0), 0.3, power=100.0)],
    ambient=Ambient(0.1),
    render=RenderSettings(width=12, height=8, spp=10),
)


def test_batches_are_independent_estimates(mi):
    matt = Material(specular=0.0)  # no caustics: their noise hides everything else
    images = render.render_reference(replace(SCENE, materials={"floor": matt, "copper": matt}), (24, 16), 64, 3, 4)
    assert images.shape == (4, 16, 24, 3)
    assert images.dtype == np.float32
    noise = [images[i] - images.mean(axis=0) for i in range(4)]
    assert all(np.abs(np.corrcoef(noise[0].ravel(), noise[i].ravel())[0, 1] + 1 / 3) < 0.2 for i in (1, 2, 3))
    assert images.mean(axis=(1, 2, 3)) == pytest.approx(np.full(4, images.mean()), rel=0.1)


@pytest.mark.parametrize("name", ["set_variant", "load_dict", "render"])
def test_signals_wait_while_mitsuba_works(mi, monkeypatch, name):
    """It calls Python, and makes other errors of an exception from there."""
    work, done = getattr(mi, name), []

    def interrupted(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        found = work(*arguments, **options)
        done.append(name)
        return found

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored in the background
    monkeypatch.setattr(mi, name, interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            render.render_reference(SCENE, (4, 4), 1)
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == [name]


@pytest.mark.parametrize(
    "changes",
    [
        {"camera": replace(SCENE.camera, aperture_radius=0.2)},
        {"media": {"haze": Medium(extinction=0.02)}, "fog": Fog("haze"), "ambient": Ambient(0.5)},
    ],
)
def test_batches_side_by_side_are_those_that_follow_each_other(mi, monkeypatch, changes):
    """Also through a lens and in fog; and there are fewer renderings of them."""
    matt = {name: Material(albedo=0.5, specular=0.0) for name in SCENE.materials}
    scene, found, passes = replace(SCENE, materials=matt, **changes), [], []
    for most in (2**21, 12 * 8):
        monkeypatch.setattr(render, "MAX_PATHS", most)
        with render.ReferenceRenderer(scene) as renderer:
            renderer.passes_of = 256
            done = []
            found.append(renderer.batches(8, 256, 3, done.append))
            passes.append(done)
    assert passes == [[8 * 256], [256] * 8]
    assert_agree(*found, 0.02)


def test_a_seed_gives_the_same_picture_again_and_another_one_does_not(mi):
    first, again, other = (render.render_reference(SCENE, (8, 8), 4, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_passes_are_bounded_and_their_mean_is_the_picture(mi, monkeypatch):
    done = []
    monkeypatch.setattr(render, "MAX_PATHS", 8 * 8 * 10)
    split = render.render_reference(SCENE, (8, 8), 2 * 256, batches=2, progress=lambda *step: done.append(step))
    assert len(done) == 2 * 26
    assert done[-1] == (512, 512)
    monkeypatch.undo()
    whole = render.render_reference(SCENE, (8, 8), 2 * 256, seed=9, batches=2)
    assert split.mean() == pytest.approx(whole.mean(), rel=0.02)


def test_the_scene_says_what_the_call_leaves_out(mi):
    done = []
    images = render.render_reference(SCENE, batches=4, progress=lambda *step: done.append(step))
    assert images.shape == (4, 8, 12, 3)
    assert done[-1] == (12, 12)


def test_samples_must_divide_into_batches():
    with pytest.raises(ValueError, match="multiple of batches"):
        render.render_reference(SCENE, (8, 8), 10, batches=4)


def test_scalar_variant_renders_the_same_scene(mi):
    fast = render.render_reference(SCENE, (6, 4), 4096)[0]
    slow = render.render_reference(SCENE, (6, 4), 256, variant="scalar_rgb")[0]
    assert slow.mean() == pytest.approx(fast.mean(), rel=0.05)
    assert mi.variant() == "llvm_ad_rgb"


@pytest.mark.parametrize("name", ["mirror", "grille", "glass"])
def test_scalar_variant_renders_bundled_scenes(mi, name):
    """Its numbers are Python's, whose divisions by 0 are errors."""
    picture = render.render_reference(load(name), (16, 12), 4, variant="scalar_rgb")
    assert np.isfinite(picture).all()
    assert picture.mean() > 0
