# SPDX-License-Identifier: MIT
"""What lies under the mouse, and how it is edited."""

import numpy as np
import pytest

import fragtracer as ft
from fragtracer.apps.viewer import camera, picking
from fragtracer.apps.viewer.document import Document
from fragtracer.apps.viewer.panels import materials, objects

from .models import tetrahedra


def test_pick_finds_what_is_in_front() -> None:
    scene = ft.load("three-spheres")
    document = Document(scene)
    for index, sphere in enumerate(scene.spheres):
        place = camera.project(scene.camera, sphere.center, 1.5)
        assert place is not None
        found = picking.pick(document, *camera.ray(scene.camera, *place, 1.5))
        assert found is not None
        assert found[0] == ("spheres", index)
    hidden = document.with_hidden(("spheres", 1), True)
    place = camera.project(scene.camera, scene.spheres[1].center, 1.5)
    assert place is not None
    behind = picking.pick(hidden, *camera.ray(scene.camera, *place, 1.5))
    assert behind is not None
    assert behind[0][0] == "planes"


def test_pick_finds_the_lamp_and_the_walls_of_the_cornell_box() -> None:
    scene = ft.load("cornell-box")
    found = picking.pick(Document(scene), *camera.ray(scene.camera, 0.5, 0.05, 1.0))
    assert found is not None
    assert scene.rectangles[found[0][1]].material in ("lamp", "white")
    left = picking.pick(Document(scene), *camera.ray(scene.camera, 0.03, 0.5, 1.0))
    assert left is not None
    assert scene.rectangles[left[0][1]].material == "red"


def test_pick_finds_every_copy_of_a_mesh_where_it_is() -> None:
    scene = tetrahedra()
    mesh, rng = scene.meshes[0], np.random.default_rng(2)
    for copy in mesh.instances:
        geometry = mesh.parts[0].geometry
        for corners in geometry.positions[geometry.triangles]:
            inside = copy.matrix[:3, :3] @ (rng.dirichlet((1, 1, 1)) @ corners) + copy.matrix[:3, 3]
            direction = np.subtract(inside, scene.camera.position)
            distance = float(np.linalg.norm(direction))
            found = picking.pick(Document(scene), np.asarray(scene.camera.position), direction / distance)
            assert found is not None
            assert found[0] == ("meshes", 0)
            assert found[1] <= distance * (1 + 1e-12), "this point, or one before it"
    away = picking.pick(Document(scene), np.asarray(scene.camera.position), np.array((0.0, 1.0, 0.0)))
    assert away is None
    ball = picking.bounds(mesh)
    assert ball is not None
    places = np.concatenate([geometry.positions @ c.matrix[:3, :3].T + c.matrix[:3, 3] for c in mesh.instances])
    assert np.linalg.norm(places - ball[0], axis=1).max() <= ball[1]


def test_mesh_is_edited_like_other_objects() -> None:
    document = Document(tetrahedra())
    mesh = document.part(("meshes", 0))
    assert objects.title(document.scene, ("meshes", 0)) == "two of them"
    assert objects.materials_of(mesh) == ["a"]
    shifted = objects.moved(mesh, (1.0, -2.0, 3.0))
    for before, after in zip(mesh.instances, shifted.instances, strict=True):
        np.testing.assert_allclose(after.matrix - before.matrix, [[0, 0, 0, 1], [0, 0, 0, -2], [0, 0, 0, 3], [0] * 4])
    assert document.with_hidden(("meshes", 0), True).visible.meshes == ()
    assert document.without_part(("meshes", 0)).scene.meshes == ()
    golden = materials.with_preset(document.scene.materials["a"], "gold")
    assert golden.albedo_texture == document.scene.materials["a"].albedo_texture, "a preset leaves textures"


@pytest.mark.parametrize("kind", ["spheres", "planes", "rectangles", "lights"])
def test_move_shifts_by_the_step(kind: str) -> None:
    part = getattr(ft.load("cornell-box" if kind == "rectangles" else "three-spheres"), kind)[0]
    name = {"spheres": "center", "planes": "point", "rectangles": "corner", "lights": "position"}[kind]
    shifted = getattr(objects.moved(part, (1.0, -2.0, 3.0)), name)
    np.testing.assert_allclose(np.subtract(shifted, getattr(part, name)), (1, -2, 3))
