# SPDX-License-Identifier: MIT
"""Which scenes are open: those from which many rays escape. Pictures do not depend on it (tests/apps/bench)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from fragtracer.io.toml import bundled, load
from fragtracer.packing import pack
from fragtracer.scene import (
    Ambient,
    Camera,
    Disk,
    Geometry,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    Rectangle,
    Scene,
    Sphere,
)

MATTE = {"matte": Material()}


def _is_open(scene: Scene, most_listed: int = 64) -> bool:
    return pack(scene, scene.render, 16, 16, most_listed).flags["u_is_open"] == 1


def _room(walls: int) -> Scene:
    """A cube of that many walls, seen from within, with a ball in it."""
    corners = [-2.0 * np.ones(3), 2.0 * np.ones(3)]
    sides = [(corner, axis) for corner, axis in product(corners, range(3))]
    rectangles = []
    for corner, axis in sides[:walls]:
        u, v = (np.roll(-np.sign(corner) * (4.0, 0.0, 0.0), axis + i) for i in (1, 2))
        rectangles.append(Rectangle(tuple(corner), tuple(u), tuple(v), "matte"))
    ball = Sphere((0.0, -1.5, 0.0), 0.5, "matte")
    return Scene(Camera(), materials=MATTE, rectangles=tuple(rectangles), spheres=(ball,), ambient=Ambient(1.0))


@pytest.mark.parametrize("most_listed", [0, 64], ids=["bvh", "list"])
def test_room_is_open_where_walls_are_missing(most_listed: int) -> None:
    assert not _is_open(_room(6), most_listed)
    assert not _is_open(_room(5), most_listed)  # a sixth of the directions, from its middle
    assert _is_open(_room(3), most_listed)
    assert _is_open(_room(0), most_listed)


def test_room_of_planes() -> None:
    planes = [
        Plane(tuple(2.0 * side * np.eye(3)[axis]), tuple(-side * np.eye(3)[axis]), "matte")
        for side, axis in product((-1.0, 1.0), range(3))
    ]
    scene = replace(_room(0), planes=tuple(planes))
    assert not _is_open(scene)
    assert _is_open(replace(scene, planes=tuple(planes[:2])))


def _room_full_of_small_triangles() -> Geometry:
    walls = [np.array([r.corner, r.edge_u, r.edge_v]) for r in _room(6).rectangles]
    positions = np.concatenate([[c, c + u, c + u + v, c + v] for c, u, v in walls])
    first = 4 * np.arange(6)[:, None, None]
    large = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    dust = np.random.default_rng(1).normal(0, 0.01, (3000, 3))
    return Geometry(
        np.concatenate([positions, dust]).astype(np.float32),
        np.concatenate([24 + np.arange(3000).reshape(-1, 3), large]).astype(np.int32),
    )


def test_room_of_a_mesh() -> None:
    mesh = Mesh((Part(_room_full_of_small_triangles(), "matte"),))
    assert not _is_open(replace(_room(0), meshes=(mesh,)))


def test_small_instances_of_a_room_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their triangles lie in a space of their own, where they are large."""
    monkeypatch.setattr("fragtracer.packing.instances.MOST_REPEATED", 1)
    places = tuple(Placement((x, 0.0, 0.0), scale=(0.05,) * 3) for x in (-1.0, 1.0))
    mesh = Mesh((Part(_room_full_of_small_triangles(), "matte"),), places)
    scene = replace(_room(0), meshes=(mesh,))
    assert pack(scene, scene.render, 16, 16).features["HAS_INSTANCES"] == 1
    assert _is_open(scene)


def test_scene_of_anything() -> None:
    assert _is_open(Scene(Camera()))
    disk = Disk((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, "matte")
    assert _is_open(Scene(Camera(), materials=MATTE, disks=(disk,)))
    assert _is_open(Scene(Camera(), materials=MATTE, planes=(Plane((0, 0, 0), (0, 1, 0), "matte"),)))


@pytest.mark.parametrize("name", bundled())
def test_bundled_scenes(name: str) -> None:
    assert _is_open(load(name)) == (name not in ("cornell-box", "furnace", "fog", "window"))
