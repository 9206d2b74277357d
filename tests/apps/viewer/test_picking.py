# SPDX-License-Identifier: MIT
"""What lies under the mouse, and how it is edited."""

import numpy as np
import pytest

import fragtracer as ft
from fragtracer.apps.viewer import actions, camera, picking
from fragtracer.apps.viewer.document import Document, materials_of
from fragtracer.apps.viewer.input import Click
from fragtracer.apps.viewer.panels import materials, objects
from fragtracer.apps.viewer.session import Session
from fragtracer.scene import Camera, Light, Material, Scene, Sphere, SpotLight

from .models import stage, tetrahedra


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


def test_pick_finds_the_nearest_of_many_spheres_that_is_visible() -> None:
    rng = np.random.default_rng(5)
    spheres = [Sphere(tuple(center), 0.2, "a") for center in rng.uniform(-2, 2, (500, 3))]
    document = Document(Scene(Camera((0.0, 0.0, 9.0), (0.0, 0.0, 0.0)), {"a": Material()}, spheres=spheres))
    for x, y in rng.uniform(0.35, 0.65, (20, 2)):
        origin, direction = camera.ray(document.scene.camera, x, y, 1.0)
        distances = [sphere.intersect(origin, direction) for sphere in spheres]
        for index in np.argsort(distances)[:2]:
            found = picking.pick(document, origin, direction)
            if np.isinf(distances[index]):
                assert found is None
            else:
                assert found == (("spheres", index), distances[index])
            document = document.with_hidden(("spheres", int(index)), True)
        document = Document(document.scene)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_light_is_framed_in_a_part_of_what_was_looked_at(size: float) -> None:
    """Or all of it, if it is larger."""
    lights = Light((0.0, size, 0.0), power=1.0), Light((0.0, 0.0, 0.0), 0.5 * size, power=1.0)
    spot = SpotLight((size, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    session = Session.of(Scene(Camera((0.0, 0.0, 2 * size), (0.0, 0.0, 0.0)), lights=lights, spot_lights=(spot,)))
    for part, radius in ((("lights", 0), 0.2), (("lights", 1), 0.5), (("spot_lights", 0), 0.2)):
        session.camera, session.selected = session.home, part
        actions.look_at_selected(session)
        assert session.camera.target == pytest.approx(session.document.part(part).position)
        expected = camera.distance(camera.frame(session.home, (0.0, 0.0, 0.0), radius * size))
        assert camera.distance(session.camera) == pytest.approx(expected)


def test_pick_finds_the_lamp_and_the_walls_of_the_cornell_box() -> None:
    scene = ft.load("cornell-box")
    found = picking.pick(Document(scene), *camera.ray(scene.camera, 0.5, 0.05, 1.0))
    assert found is not None
    assert scene.rectangles[found[0][1]].material in ("lamp", "white")
    left = picking.pick(Document(scene), *camera.ray(scene.camera, 0.03, 0.5, 1.0))
    assert left is not None
    assert scene.rectangles[left[0][1]].material == "red"


def test_pick_finds_every_instance_of_a_mesh_where_it_is() -> None:
    scene = tetrahedra()
    mesh, rng = scene.meshes[0], np.random.default_rng(2)
    for instance in mesh.instances:
        geometry = mesh.parts[0].geometry
        for corners in geometry.positions[geometry.triangles]:
            inside = instance.matrix[:3, :3] @ (rng.dirichlet((1, 1, 1)) @ corners) + instance.matrix[:3, 3]
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
    assert materials_of(mesh) == ["a"]
    shifted = objects.moved(mesh, (1.0, -2.0, 3.0))
    for before, after in zip(mesh.instances, shifted.instances, strict=True):
        np.testing.assert_allclose(after.matrix - before.matrix, [[0, 0, 0, 1], [0, 0, 0, -2], [0, 0, 0, 3], [0] * 4])
    assert document.with_hidden(("meshes", 0), True).visible.meshes == ()
    assert document.without_part(("meshes", 0)).scene.meshes == ()
    golden = materials.with_preset(document.scene.materials["a"], "gold")
    assert golden.albedo_texture == document.scene.materials["a"].albedo_texture, "a preset leaves textures"


def test_pick_finds_a_disk_up_to_its_edge() -> None:
    scene = stage()
    disk, origin = scene.disks[0], np.asarray(scene.camera.position)
    normal = np.asarray(disk.normal) / np.linalg.norm(disk.normal)
    u = np.cross(normal, (0.0, 1.0, 0.0))
    u, v = u / np.linalg.norm(u), np.cross(normal, u / np.linalg.norm(u))
    for angle in np.linspace(0, 2 * np.pi, 12):
        for radius in (0.0, 0.99, 1.01):
            point = disk.center + radius * disk.radius * (np.cos(angle) * u + np.sin(angle) * v)
            distance = float(np.linalg.norm(point - origin))
            found = picking.pick(Document(scene), origin, (point - origin) / distance)
            if radius > 1:
                assert found is None
            else:
                assert found is not None
                assert found[0] == ("disks", 0)
                assert found[1] == pytest.approx(distance)
    away = picking.pick(Document(scene), origin, np.array((0.0, 0.0, 1.0)))
    assert away is None, "it lies behind"


def test_click_on_a_mark_selects_the_light_under_it() -> None:
    session, aspect = Session.of(stage()), 1.5
    for part in (("lights", 0), ("spot_lights", 0)):
        place = camera.project(session.camera, session.document.part(part).position, aspect)
        assert place is not None
        for offset, expected in ((0.9 * picking.MARK, part), (1.1 * picking.MARK, None)):
            beside = Click(place[0] + offset / aspect, place[1], focuses=False)
            actions.click(session, beside, aspect, has_marks=True)
            assert session.selected == expected
        actions.click(session, Click(*place, focuses=False), aspect)
        assert session.selected is None, "without marks there is nothing to be seen"
        session.edit(session.document.with_hidden(part, True), "hide")
        actions.click(session, Click(*place, focuses=False), aspect, has_marks=True)
        assert session.selected is None


def test_bounds_hold_what_has_a_place() -> None:
    scene = stage()
    assert picking.bounds(scene.disks[0]) == ((1.0, 0.0, 0.0), 1.0)
    ball = picking.bounds(scene.spot_lights[0])
    assert ball is not None
    assert ball[0] == scene.spot_lights[0].position
    assert picking.bounds(scene.directional_lights[0]) is None


@pytest.mark.parametrize("kind", ["disks", "spot_lights", "directional_lights"])
def test_every_kind_is_hidden_removed_and_called_by_a_name(kind: str) -> None:
    document, part = Document(stage()), (kind, 0)
    assert getattr(document.with_hidden(part, True).visible, kind) == ()
    assert getattr(document.without_part(part).scene, kind) == ()
    twice = document.with_added(kind, document.part(part))
    assert twice.part((kind, 1)) == document.part(part)
    name = {"disks": "Disk 2", "spot_lights": "Spot light 2", "directional_lights": "Directional light 2"}[kind]
    assert objects.title(twice.scene, (kind, 1)) == name
    assert materials_of(document.part(part)) == (["a"] if kind == "disks" else [])


@pytest.mark.parametrize("kind", ["spheres", "planes", "rectangles", "disks", "lights", "spot_lights"])
def test_move_shifts_by_the_step(kind: str) -> None:
    scenes = {"rectangles": "cornell-box"}
    scene = stage() if kind in ("disks", "spot_lights") else ft.load(scenes.get(kind, "three-spheres"))
    part = getattr(scene, kind)[0]
    names = {"spheres": "center", "planes": "point", "rectangles": "corner", "disks": "center"}
    name = names.get(kind, "position")
    shifted = getattr(objects.moved(part, (1.0, -2.0, 3.0)), name)
    np.testing.assert_allclose(np.subtract(shifted, getattr(part, name)), (1, -2, 3))
