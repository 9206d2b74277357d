# SPDX-License-Identifier: MIT
"""Cameras that are moved by hand."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.apps.viewer import camera
from fragtracer.packing import pack
from fragtracer.scene import Camera

from .models import tetrahedra

CAMERA = Camera(position=(1.0, 2.0, 5.0), target=(0.2, 0.5, -0.3), fov_degrees=50.0)


def distance(c: Camera) -> float:
    return float(np.linalg.norm(np.subtract(c.position, c.target)))


def test_orbit_keeps_target_and_distance_and_comes_back() -> None:
    turned = camera.orbit(CAMERA, 0.4, 0.2)
    assert turned.target == CAMERA.target
    assert distance(turned) == pytest.approx(distance(CAMERA))
    back = camera.orbit(turned, -0.4, -0.2)
    np.testing.assert_allclose(back.position, CAMERA.position, atol=1e-12)


@pytest.mark.parametrize("down", [-50.0, 50.0])
def test_orbit_stops_before_the_pole(down: float) -> None:
    turned = camera.orbit(CAMERA, 0.0, down)
    up = camera.axes(turned)[1]
    assert up[1] > 0
    assert distance(turned) == pytest.approx(distance(CAMERA))


def test_pan_by_the_height_of_the_picture_moves_the_target_that_far() -> None:
    shifted = camera.pan(CAMERA, 0.25, 0.1)
    place = camera.project(shifted, CAMERA.target, 1.5)
    assert place == pytest.approx((0.5 + 0.25 / 1.5, 0.6))


def test_look_around_turns_in_place() -> None:
    turned = camera.look_around(CAMERA, 0.3, 0.0)
    assert turned.position == CAMERA.position
    place = camera.project(turned, CAMERA.target, 1.0)
    assert place is not None
    assert place[0] < 0.5, "the camera turns right, so the scene goes left"


def test_ray_and_project_are_inverse() -> None:
    origin, direction = camera.ray(CAMERA, 0.3, 0.8, 1.7)
    assert camera.project(CAMERA, tuple(origin + 4.2 * direction), 1.7) == pytest.approx((0.3, 0.8))


def test_frame_fits_a_ball_into_the_picture() -> None:
    framed = camera.frame(CAMERA, (3.0, 1.0, -2.0), 0.7)
    top = np.add((3.0, 1.0, -2.0), 0.7 * camera.axes(framed)[1])
    place = camera.project(framed, tuple(top), 1.0)
    assert place is not None
    assert 0.0 < place[1] < 0.25


STARTS = [
    (Camera((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)), 1e-8),
    (Camera((4e6 + 1.0, 102.0, 3.0 - 6e6), (4e6, 100.0, -6e6)), 1e-3),
    (Camera((2e30, 1e30, 1e30), (1e30, 0.0, 0.0)), 1e5),
]


@pytest.mark.parametrize(("start", "near"), STARTS)
@pytest.mark.parametrize("factor", [0.88, 1 / 0.88])
def test_the_wheel_stops_before_there_is_no_camera(start: Camera, near: float, factor: float) -> None:
    """And goes back from there."""
    moved = start
    for _ in range(4000):
        moved = camera.dolly(moved, factor)
    there = distance(moved)
    assert there < near if factor < 1 else there > 1e12
    np.testing.assert_allclose(camera.axes(moved), camera.axes(start), atol=1e-4)
    assert distance(camera.dolly(moved, 1 / factor)) == pytest.approx(there / factor, rel=1e-4)
    scene = replace(tetrahedra(), camera=moved)
    assert "u_vertices" in pack(scene, scene.render, 40, 24).tables, "so far away, there is still a scene"


@pytest.mark.parametrize("radius", [0.0, 1e-300, 1e37])
def test_what_has_hardly_any_size_or_too_much_is_framed(radius: float) -> None:
    framed = camera.frame(CAMERA, (3.0, 1.0, -2.0), radius)
    assert framed.target == (3.0, 1.0, -2.0)
    assert distance(framed) > 0
    np.testing.assert_allclose(camera.axes(framed), camera.axes(CAMERA), atol=1e-4)
