# SPDX-License-Identifier: MIT
"""camera/camera.glsl with the uniforms of packing/camera.py, against a camera built from vectors in float64."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from fragtracer.packing.camera import camera_uniforms
from fragtracer.probe import probe
from fragtracer.scene import Camera

from . import Floats
from .chi_square import assert_fits, fit
from .domains import Disk

ORIGIN = np.array([0.25, -1.5, 3.0])  # of the packed scene
CORNERS = np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)], np.float64)
SIZES = [(64, 64), (160, 90), (90, 160), (1000, 1)]
CAMERAS = {
    "default": Camera(),
    "level": Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), fov_degrees=90.0),
    "down": Camera((1.0, 50.0, 2.0), (1.5, 0.0, 1.0), fov_degrees=10.0),
    "tilted": Camera((-3.0, 1.0, -2.0), (4.0, 2.0, 7.0), (0.3, 1.0, -0.2), fov_degrees=120.0),
    "narrow": Camera((0.0, 1.0, 100.0), (0.0, 1.0, 0.0), fov_degrees=0.5),
}


def axes(camera: Camera) -> tuple[Floats, Floats, Floats]:
    """Right, up and forward."""
    forward = np.subtract(camera.target, camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def through(camera: Camera, size: tuple[int, int], ndc: Floats) -> Floats:
    """From the position to points of the image plane at distance 1, (n, 3)."""
    right, up, forward = axes(camera)
    half = np.tan(np.radians(camera.fov_degrees) / 2)
    return forward + half * size[0] / size[1] * ndc[:, :1] * right + half * ndc[:, 1:] * up


def camera_rays(
    ctx: moderngl.Context, camera: Camera, size: tuple[int, int], ndc: Floats, lens: Floats
) -> tuple[Floats, Floats]:
    """Origins in the world, and directions, in float64."""
    uniforms = camera_uniforms(camera, ORIGIN, *size)
    body = "Ray ray = camera_ray_at(ndc, lens); o = ray.origin; d = ray.direction;"
    inputs = {"ndc": ndc, "lens": lens}
    result = probe(ctx, ["camera/camera.glsl"], body, inputs, {"o": 3, "d": 3}, uniforms=uniforms)
    return result["o"].astype(np.float64) + ORIGIN, result["d"].astype(np.float64)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", CAMERAS)
def test_pinhole(ctx: moderngl.Context, name: str, size: tuple[int, int]) -> None:
    camera = CAMERAS[name]
    ndc = np.concatenate([CORNERS, np.random.default_rng(1).uniform(-1, 1, (1000, 2))]).astype(np.float32)
    origin, direction = camera_rays(ctx, camera, size, ndc, np.zeros((len(ndc), 2)))
    expected = through(camera, size, ndc.astype(np.float64))
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(direction, expected, rtol=0, atol=5e-7)
    np.testing.assert_allclose(origin, np.broadcast_to(camera.position, origin.shape), rtol=2e-7, atol=1e-6)
    assert np.abs(np.linalg.norm(direction, axis=1) - 1).max() < 3e-7


@pytest.mark.parametrize("focus_distance", [0.7, 5.0, None])
@pytest.mark.parametrize("aperture_radius", [0.01, 0.4])
def test_lens(ctx: moderngl.Context, aperture_radius: float, focus_distance: float | None) -> None:
    """The rays of a place in the image leave from all over the lens and meet in the plane in focus,
    where the pinhole sees it."""
    camera = Camera((-3.0, 1.0, -2.0), (4.0, 2.0, 7.0), (0.3, 1.0, -0.2), 50.0, aperture_radius, focus_distance)
    depth = focus_distance or np.linalg.norm(np.subtract(camera.target, camera.position))
    assert camera.focal_distance == pytest.approx(depth)
    right, up, forward = axes(camera)
    lens = np.random.default_rng(2).random((1 << 16, 2), np.float32)
    for place in (CORNERS[4], CORNERS[0], CORNERS[8], np.array([0.3, -0.8])):
        ndc = np.broadcast_to(place.astype(np.float32), lens.shape)
        origin, direction = camera_rays(ctx, camera, (160, 90), ndc, lens)
        assert np.abs(np.linalg.norm(direction, axis=1) - 1).max() < 3e-7
        off_axis = origin - camera.position
        assert np.abs(off_axis @ forward).max() < 1e-6
        on_lens = np.stack([off_axis @ right, off_axis @ up], -1) / aperture_radius
        if aperture_radius > 0.1:  # float32 resolves a small lens too coarsely for cells
            assert_fits({"lens": fit(Disk(), on_lens, lambda points: np.full(len(points), 1 / np.pi))})
        assert np.linalg.norm(on_lens, axis=1).max() < 1 + 1e-6 / aperture_radius
        reach = (depth - off_axis @ forward) / (direction @ forward)
        met = origin + reach[:, None] * direction
        expected = camera.position + depth * through(camera, (160, 90), ndc[:1].astype(np.float64))
        np.testing.assert_allclose(met, np.broadcast_to(expected, met.shape), rtol=0, atol=1e-6 * (depth + 3))


def test_pixels_are_the_squares_of_the_image(ctx: moderngl.Context) -> None:
    """Place u.xy of a pixel, (0, 0) its lower left corner, row 0 at the bottom; u.zw is the place on the lens."""
    camera = Camera((-3.0, 1.0, -2.0), (4.0, 2.0, 7.0), (0.3, 1.0, -0.2), 50.0, 0.4, 5.0)
    size = (160, 90)
    rng = np.random.default_rng(3)
    pixel, u = rng.integers(0, size, (1000, 2)), rng.random((1000, 4), np.float32)
    body = "Ray ray = camera_ray(ivec2(pixel), u); o = ray.origin; d = ray.direction;"
    uniforms = camera_uniforms(camera, ORIGIN, *size)
    outputs = {"o": 3, "d": 3}
    found = probe(ctx, ["camera/camera.glsl"], body, {"pixel": pixel, "u": u}, outputs, uniforms=uniforms)
    origin, direction = camera_rays(ctx, camera, size, 2 * (pixel + u[:, :2]) / size - 1, u[:, 2:])
    np.testing.assert_allclose(found["o"] + ORIGIN, origin, atol=1e-6)
    np.testing.assert_allclose(found["d"], direction, atol=1e-6)


@pytest.mark.parametrize("aperture_radius", [0.0, 0.4])
@pytest.mark.parametrize("name", CAMERAS)
def test_views_are_rays_the_other_way_round(ctx: moderngl.Context, name: str, aperture_radius: float) -> None:
    """A point on a ray is seen where the ray begins, and fills as much of a pixel as the ray's solid angle says."""
    camera, size = replace(CAMERAS[name], aperture_radius=aperture_radius), (160, 90)
    rng = np.random.default_rng(4)
    ndc, lens = rng.uniform(-1, 1, (1000, 2)).astype(np.float32), rng.random((1000, 2), np.float32)
    far = rng.uniform(0.5, 2, 1000).astype(np.float32) * camera.focal_distance
    body = """Ray ray = camera_ray_at(ndc, lens);
        CameraView view = camera_view(ray.origin + far * ray.direction, lens);
        place = view.position; distance = view.distance; weight = view.weight; off = view.origin - ray.origin;
        turn = view.direction - ray.direction; behind = camera_view(ray.origin - far * ray.direction, lens).weight;"""
    outputs = {"place": 2, "distance": 1, "weight": 1, "off": 3, "turn": 3, "behind": 1}
    inputs = {"ndc": ndc, "lens": lens, "far": far}
    uniforms = camera_uniforms(camera, ORIGIN, *size)
    found = probe(ctx, ["camera/view.glsl"], body, inputs, outputs, uniforms=uniforms)
    steep = 1 / np.tan(np.radians(camera.fov_degrees) / 2)
    np.testing.assert_allclose(found["place"], (ndc + 1) / 2 * size, rtol=0, atol=1e-4 * max(1, steep))
    np.testing.assert_allclose(found["distance"], far, rtol=1e-5)
    assert np.abs(found["off"]).max() < 1e-6
    assert np.abs(found["turn"]).max() < 1e-5
    np.testing.assert_array_equal(found["behind"], 0)
    cosine = camera_rays(ctx, camera, size, ndc, lens)[1] @ axes(camera)[2]
    solid_angle = (2 / (steep * size[1])) ** 2 * cosine**3
    np.testing.assert_allclose(found["weight"], 1 / (far.astype(np.float64) ** 2 * solid_angle), rtol=2e-5)
