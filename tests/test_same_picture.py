# SPDX-License-Identifier: MIT
"""The same picture, bit for bit, however the work is cut and wherever the scene is kept."""

import numpy as np
import pytest
from rendering import rendered
from scene_builders import lambert
from small_pictures import SCENES, SIZE, SPP, picture

from fragtracer.gpu import tracer
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Material, Scene, Sphere


@pytest.mark.parametrize("sampler", ["texture", "hash"])
@pytest.mark.parametrize("name", SCENES)
def test_same_seed_same_picture(ctx, name, sampler):
    image = picture(ctx, name, sampler=sampler)
    np.testing.assert_array_equal(picture(ctx, name, sampler=sampler), image)
    other = picture(ctx, name, sampler=sampler, seed=1)
    assert (other != image).any(-1).mean() > 0.5
    assert other.mean() == pytest.approx(image.mean(), rel=0.1)


@pytest.mark.parametrize("name", SCENES)
def test_cut_into_passes(ctx, name):
    image = picture(ctx, name)
    for rays in (1, 3, 8):
        np.testing.assert_array_equal(picture(ctx, name, rays=rays), image)
    with Renderer(load(name), SIZE, context=ctx) as renderer:
        for _ in range(SPP):
            renderer.sample(1)
        assert renderer.spp == SPP
        np.testing.assert_array_equal(renderer.image(), image)


@pytest.mark.parametrize("name", SCENES)
def test_cut_into_bands(ctx, monkeypatch, name):
    """As on a machine so slow that it draws a row at a time, or a few."""
    image = picture(ctx, name)
    for rows in (1, 7):
        monkeypatch.setattr(tracer.Tracer, "_rows", lambda *_, rows=rows: rows)
        np.testing.assert_array_equal(picture(ctx, name, rays=5), image)


def test_bands_keep_the_budget(ctx, monkeypatch):
    """A draw that took longer than its budget is followed by smaller ones."""
    bands = []
    with Renderer(load("three-spheres"), (64, 64), context=ctx) as renderer:
        renderer.sample(16)
        for name in ("DRAW_BUDGET", "_SOFTWARE_DRAW_BUDGET"):
            monkeypatch.setattr(tracer, name, 1e-6)
        monkeypatch.setattr(tracer, "_FIRST_BAND", 1)
        renderer.sample(1, bands.append)
    assert len(bands) > 32
    assert bands[-1] == 17


@pytest.mark.parametrize("name", SCENES)
def test_compiled_in_or_not(ctx, name):
    """Bit for bit on the drivers known so far; one that folds constants with other rounding may let a path
    in a million go another way."""
    image, other = picture(ctx, name, baked=True), picture(ctx, name, baked=False)
    assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 1e-5
    assert (np.abs(other - image) > 1e-4 * np.abs(image)).mean() < 0.01


def test_stored_in_a_texture(ctx, monkeypatch):
    """A scene too large for the uniform block, and the same one as if the block were larger."""
    rng = np.random.default_rng(5)
    materials = {"ball": Material(albedo=(0.7, 0.4, 0.2), roughness=0.4), "lamp": lambert(0.0, 2.0)}
    balls = [Sphere(rng.uniform(-1, 1, 3), 0.06, "lamp" if i % 50 == 0 else "ball") for i in range(600)]
    scene = Scene(Camera((0.0, 0.0, 4.0)), materials, spheres=balls, ambient=Ambient(0.3))
    images = []
    for most in (1024, 1 << 16):
        monkeypatch.setattr("fragtracer.packing._MAX_UNIFORM_TEXELS", most)
        images.append(rendered(ctx, scene, 4, SIZE, bounces=3))
    assert images[0].mean() > 0.1
    np.testing.assert_array_equal(*images)
    small = load("three-spheres-ambient")
    inside = rendered(ctx, small, 8, SIZE, baked=False)
    monkeypatch.setattr("fragtracer.packing._MAX_UNIFORM_TEXELS", 0)
    np.testing.assert_array_equal(rendered(ctx, small, 8, SIZE, baked=False), inside)


def test_paths_that_wait_for_their_neighbours(ctx):
    """Without regeneration a pixel's paths begin together; they are the same paths."""
    image = picture(ctx, "cornell-box")
    with Renderer(load("cornell-box"), SIZE, context=ctx, defines={"PATH_REGENERATION": 0}) as renderer:
        renderer.sample(SPP)
        np.testing.assert_allclose(renderer.image(), image, rtol=1e-4, atol=1e-6)
