# SPDX-License-Identifier: MIT
"""Drivers that stop a shader after so many rounds of loops (llvmpipe of Mesa 22.3: 65,535) lose no path for that."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_shapes import ball, geometry, mesh_scene
from rendering import ends_loops, list_at_most

from fragtracer.errors import DeviceError
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, Material, RenderSettings, Scene


def crowd() -> Scene:
    """700 spheres that shine: without a BVH each vertex goes through all of them twice."""
    scene = load("furnace")
    ball = scene.spheres[0]
    places = [(0.1 * i % 2 - 1, 0.1 * (i // 20) - 1.7, -1.0) for i in range(700)]
    balls = tuple(replace(ball, center=place, radius=0.04) for place in places)
    return replace(scene, spheres=balls, render=RenderSettings(bounces=20, russian_roulette=False, estimator="bsdf"))


@pytest.mark.parametrize("most_listed", [0, 10**6], ids=["bvh", "list"])
def test_every_sample_is_taken(ctx, monkeypatch, most_listed):
    list_at_most(monkeypatch, most_listed)
    # Where 700 shapes are compiled in there are no loops, but a compiler takes a minute.
    with Renderer(crowd(), (8, 8), context=ctx, rays=64, specialised=False) as renderer:
        renderer.sample(64)
        image = renderer.image()
    # Le / (1 - albedo) less what comes after the last bounce.
    np.testing.assert_allclose(image, 0.5 * (1 - 0.8**21), rtol=1e-5)


@pytest.fixture
def ending(ctx):
    """A context whose driver ends loops."""
    if not ends_loops(ctx):
        pytest.skip("this driver ends no loops")
    return ctx


def test_a_path_that_a_driver_would_end_is_an_error(ending, monkeypatch):
    list_at_most(monkeypatch, 10**6)
    monkeypatch.setattr("fragtracer.gpu.tracer._MAX_ROUNDS", 10**9)
    with Renderer(crowd(), (8, 8), context=ending, rays=512, specialised=False) as renderer:
        renderer.sample(512)
        with pytest.raises(DeviceError, match="fewer bounces"):
            renderer.image()


def test_shapes_in_a_bvh_take_every_sample_however_many_rounds_that_is(ctx, monkeypatch):
    """As a mesh does, below: nobody knows how many that is before."""
    list_at_most(monkeypatch, 0)
    with Renderer(crowd(), (8, 8), context=ctx, rays=8) as renderer:
        renderer.sample(512)
        image = renderer.image()
    monkeypatch.setattr("fragtracer.gpu.tracer._MAX_ROUNDS", 10**9)
    with Renderer(crowd(), (8, 8), context=ctx, rays=512) as renderer:
        assert renderer._tracer.max_rays >= 512
        renderer.sample(512)
        if ends_loops(ctx):
            assert renderer._tracer.max_rays < 512
        np.testing.assert_array_equal(renderer.image(), image)


def test_a_path_among_shapes_in_a_bvh_that_cannot_be_finished_is_an_error(ending, monkeypatch):
    list_at_most(monkeypatch, 0)
    with (
        Renderer(crowd(), (8, 8), context=ending, bounces=10_000) as renderer,
        pytest.raises(DeviceError, match="fewer bounces"),
    ):
        renderer.sample(1)


def hollow() -> Scene:
    """Within a closed mesh that shines to its inside, so that the answer is known."""
    points, triangles = ball(64, 32)
    settings = RenderSettings(bounces=20, russian_roulette=False, estimator="bsdf")
    material = Material(albedo=0.8, specular=0.0, emission=0.1)
    inward = geometry((points, triangles[:, ::-1]))
    return mesh_scene(inward, material=material, camera=Camera((0.0, 0.0, 0.5), (0.0, 0.0, 0.0)), render=settings)


def test_a_mesh_takes_every_sample_however_many_rounds_that_is(ctx, monkeypatch):
    with Renderer(hollow(), (8, 8), context=ctx, rays=8) as renderer:
        renderer.sample(512)
        image = renderer.image()
    np.testing.assert_allclose(image, 0.5 * (1 - 0.8**21), rtol=1e-5)
    monkeypatch.setattr("fragtracer.gpu.tracer._MAX_ROUNDS", 10**9)
    with Renderer(hollow(), (8, 8), context=ctx, rays=512) as renderer:
        renderer.sample(512)
        assert (renderer._tracer.max_rays < 512) == ends_loops(ctx)
        np.testing.assert_array_equal(renderer.image(), image)


def test_a_path_through_a_mesh_that_cannot_be_finished_is_an_error(ending):
    with (
        Renderer(hollow(), (8, 8), context=ending, bounces=5000) as renderer,
        pytest.raises(DeviceError, match="fewer bounces"),
    ):
        renderer.sample(1)
