# SPDX-License-Identifier: MIT
"""The same picture, bit for bit, however the work is cut and wherever the scene is kept."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_shapes import ball
from rendering import list_at_most, rendered
from scene_builders import everything, lambert
from small_pictures import SCENES, SIZE, SPP, picture
from textured_scenes import mesh

from fragtracer.gpu import tracer
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import TracerProgram
from fragtracer.io.toml import load
from fragtracer.packing import pack
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Geometry, Material, Scene, Sphere


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
    image, other = picture(ctx, name, specialised=True), picture(ctx, name, specialised=False)
    assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 1e-5
    assert (np.abs(other - image) > 1e-4 * np.abs(image)).mean() < 0.01


@pytest.mark.parametrize("level", Level)
def test_however_much_is_compiled_in(ctx, monkeypatch, level):
    """Shapes, lights and materials of all kinds, in a list and in a BVH."""
    scene = everything()
    monkeypatch.setattr(Renderer, "_program", lambda _: TracerProgram("pathtracer.frag", {}, level))
    for most_listed in (0, 64):
        list_at_most(monkeypatch, most_listed)
        image = rendered(ctx, scene, SPP, SIZE)
        monkeypatch.setattr(Renderer, "_program", lambda _: TracerProgram("pathtracer.frag", {}, Level.NOTHING))
        same(rendered(ctx, scene, SPP, SIZE), image)
        monkeypatch.setattr(Renderer, "_program", lambda _: TracerProgram("pathtracer.frag", {}, level))


def same(image, other):
    """Where a ray meets a shape is computed in another way, so that a path or two in a million goes another way."""
    assert abs(other.mean(dtype=np.float64) / image.mean(dtype=np.float64) - 1) < 1e-4
    assert (np.abs(other - image) > 1e-4 * np.abs(image)).mean() < 0.01


@pytest.mark.parametrize("specialised", [False, True])
@pytest.mark.parametrize("name", [*SCENES, "everything"])
def test_one_by_one_or_by_a_bvh(ctx, monkeypatch, name, specialised):
    scene = everything() if name == "everything" else load(name)
    images = []
    for most_listed in (0, 10**6):
        list_at_most(monkeypatch, most_listed)
        images.append(rendered(ctx, scene, SPP, SIZE, specialised=specialised))
    same(*images)


def test_crossing_from_the_list_to_the_bvh(ctx, monkeypatch):
    """A renderer to whose scene shapes are added one at a time, and from which they are taken again."""
    list_at_most(monkeypatch, 10)
    scene = everything()
    settings = {"bounces": 3, "specialised": False}
    balls = [Sphere((0.4 * i - 1.4, 0.2, 1.2), 0.15, ("gold", "lamp", "matte")[i % 3]) for i in range(8)]
    scenes = [replace(scene, spheres=[*scene.spheres, *balls[:count]]) for count in range(9)]
    stored = [pack(s, s.render, 8, 8, 10).uniforms["u_bvh_root"] >= 0 for s in scenes]
    assert sorted(stored) == stored
    assert set(stored) == {False, True}
    with Renderer(scene, SIZE, context=ctx, **settings) as renderer:
        for edited, in_bvh in [*zip(scenes, stored, strict=True), *zip(scenes[::-1], stored[::-1], strict=True)]:
            renderer.reset(edited)
            renderer.sample(4)
            list_at_most(monkeypatch, 10**6 if in_bvh else 0)
            other = rendered(ctx, edited, 4, SIZE, **settings)
            same(renderer.image(), other)
            list_at_most(monkeypatch, 10)


@pytest.mark.parametrize("in_grid", [False, True], ids=["bvh", "grid"])
def test_many_shapes(ctx, monkeypatch, in_grid):
    """600 spheres and a mesh. Some spheres shine: too many for a grid of the others, or not."""
    rng = np.random.default_rng(5)
    materials = {"ball": Material(albedo=(0.7, 0.4, 0.2), roughness=0.4), "lamp": lambert(0.0, 2.0)}
    balls = [
        Sphere(rng.uniform(-1, 1, 3), 0.06, "lamp" if i % (100 if in_grid else 50) == 0 else "ball") for i in range(600)
    ]
    points, triangles = ball()
    middle = mesh(Geometry(0.5 * points, triangles), "ball")
    scene = Scene(Camera((0.0, 0.0, 4.0)), materials, spheres=balls, meshes=[middle], ambient=Ambient(0.3))
    assert pack(scene, scene.render, 8, 8).flags["u_has_sphere_grid"] == in_grid
    images = []
    for most_listed in (0, 10**6):
        list_at_most(monkeypatch, most_listed)
        specialised = in_grid and not most_listed
        images.append(rendered(ctx, scene, 4, SIZE, bounces=3, specialised=specialised))
    assert images[0].mean() > 0.1
    same(*images)
