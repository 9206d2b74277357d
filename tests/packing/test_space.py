# SPDX-License-Identifier: MIT
"""The coordinates of the shader stay while a scene is edited, and are chosen anew where they would lose precision."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.packing.space import space_of
from fragtracer.scene import Camera, Light, Material, Scene, Sphere

MATERIALS = {"a": Material(), "sun": Material(emission=(1.0, 1.0, 1.0))}
SCENE = Scene(Camera((104.0, 0.0, 0.0), (100.0, 0.0, 0.0)), MATERIALS, spheres=(Sphere((100.0, 0.0, 0.0), 1.0, "a"),))


def moved(x: float, radius: float = 1.0) -> Scene:
    return replace(SCENE, spheres=(Sphere((x, 0.0, 0.0), radius, "a"),))


def seen_from(x: float) -> Scene:
    return replace(SCENE, camera=Camera((x, 0.0, 0.0), (100.0, 0.0, 0.0)))


def test_origin_is_the_middle_of_what_is_finite_however_far_the_camera_is() -> None:
    space = space_of(SCENE)
    np.testing.assert_allclose(space.origin, (100.0, 0.0, 0.0))
    assert space.extent == 4.0
    far = replace(
        SCENE, spheres=(*SCENE.spheres, Sphere((1e6, 0.0, 0.0), 1.0, "sun")), lights=(Light((0, 1e9, 0), power=1.0),)
    )
    assert space_of(far).extent == 4.0, "what emits is not looked at closely"
    assert space_of(Scene()).extent > 0
    planes_alone = Scene(Camera((0.0, 3.0, 4.0), (0.0, 0.0, 0.0)))
    assert space_of(planes_alone).extent == 5.0, "as far as the target"


def test_origin_is_among_what_is_small_where_something_is_wide_or_far_away() -> None:
    """What is 64 times as far away as most lies apart takes the precision from it otherwise."""
    near = [Sphere((x, 0.0, 0.0), 1.0, "a") for x in (99.0, 100.0, 101.5)]
    for other in (Sphere((1e4, 0.0, 0.0), 1.0, "a"), Sphere((100.0, -1e3, 0.0), 1e3, "a")):
        space = space_of(replace(SCENE, spheres=(*near, other)))
        assert np.abs(space.origin - (100.0, 0.0, 0.0)).max() < 1.5
        assert space.extent >= np.abs(np.subtract(other.center, space.origin)).max()
    even = [Sphere((x, 0.0, 0.0), 1.0, "a") for x in (0.0, 10.0, 90.0, 100.0)]
    np.testing.assert_allclose(
        space_of(replace(SCENE, spheres=(*even, Sphere((300.0, 0, 0), 1.0, "a")))).origin[0], 150.0
    )


def test_nothing_but_planes_is_seen_from_all_sides() -> None:
    before = space_of(Scene(Camera((104.0, 0.0, 0.0), (100.0, 0.0, 0.0))))
    assert before.serves(Camera((100.0, 0.0, 4.0), (100.0, 0.0, 0.0)))
    assert before.serves(Camera((96.0, 0.0, 0.0), (100.0, 0.0, 0.0)))
    assert not before.serves(Camera((1e6, 0.0, 0.0), (1e6 + 1, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("scene", "stays"),
    [
        (moved(98.0), True),
        (moved(106.9), True),
        (moved(92.9), False),
        (moved(1e6), False),
        (seen_from(107.0), True),
        (seen_from(131.0), True),
        (seen_from(133.0), False),
        (seen_from(101.1), True),
        (replace(moved(100.0, 0.01), camera=Camera((100.2, 0.0, 0.0), (100.0, 0.0, 0.0))), False),
    ],
)
def test_origin_stays_while_it_serves(scene: Scene, stays: bool) -> None:
    before = space_of(SCENE)
    after = space_of(scene, before)
    assert ((after.origin == before.origin).all() and after.extent == before.extent) == stays
    if scene.spheres == SCENE.spheres:
        assert before.serves(scene.camera) == stays
    if not stays:
        assert after.extent == space_of(scene).extent
    assert after.serves(scene.camera)
