# SPDX-License-Identifier: MIT
"""The parts of the viewer that need no window."""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import fragtracer as ft
from fragtracer.compare.verdict import Means, scale_means
from fragtracer.errors import FragtracerError
from fragtracer.materials import DIELECTRIC_F0, METAL_F0
from fragtracer.scene import (
    Camera,
    Environment,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Placement,
    Scene,
    Sphere,
    Texture,
)
from fragtracer.scene import Part as MeshPart
from fragtracer.viewer import actions, camera, picking, run, settings
from fragtracer.viewer.display import DisplaySettings
from fragtracer.viewer.document import Document, History
from fragtracer.viewer.finding import judged
from fragtracer.viewer.governor import Governor
from fragtracer.viewer.panels import lights, materials, objects
from fragtracer.viewer.session import Session
from fragtracer.viewer.statistics import FilmStatistics
from fragtracer.viewer.watch import Watch, scene_files

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


def test_governor_fits_one_sample_per_pixel_into_the_budget() -> None:
    governor = Governor(target=0.033, overhead=0.013)
    for rate in (1e5, 1e6, 1e7, 1e8, 1e9):
        width, height = governor.size((1280, 720), rate)
        assert width * height <= rate * 0.02 * 1.01 or width == 80
    assert governor.size((1280, 720), 1e9) == (1280, 720)
    assert governor.rays((1280, 720), 1e9, 16) == 16


def test_governor_does_not_flicker_between_two_sizes() -> None:
    governor = Governor(target=0.033, overhead=0.013)
    rng = np.random.default_rng(1)
    sizes = [governor.size((1280, 720), 5e6 * rng.uniform(0.93, 1.07)) for _ in range(200)]
    changes = sum(a != b for a, b in pairwise(sizes))
    assert changes <= 2


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


def test_history_merges_a_drag_and_forgets_the_future() -> None:
    first = Document(ft.load("mirror"))
    history = History(first)
    for name in "abc":
        history.edit(replace(first, scene=replace(first.scene, description=name)), "drag")
    history.close()
    history.edit(replace(first, scene=replace(first.scene, description="d")), "drag")
    assert len(history.past) == 2
    assert history.undo()
    assert history.now.scene.description == "c"
    assert history.undo()
    assert history.now == first
    assert not history.undo()
    assert history.redo()
    assert history.now.scene.description == "c"
    history.edit(first, "other")
    assert not history.redo()


def test_removing_a_part_keeps_the_others_hidden() -> None:
    document = Document(ft.load("three-spheres"), frozenset({("spheres", 2), ("lights", 0)}))
    after = document.without_part(("spheres", 0))
    assert after.hidden == {("spheres", 1), ("lights", 0)}
    assert len(after.visible.spheres) == 1
    assert after.visible.lights == ()


@pytest.mark.parametrize("preset", [*DIELECTRIC_F0, *METAL_F0])
def test_presets_have_the_reflectance_of_the_table(preset: str) -> None:
    before = Material(albedo=(0.2, 0.3, 0.4), roughness=0.3)
    made = materials.with_preset(before, preset)
    expected = METAL_F0.get(preset) or (DIELECTRIC_F0[preset],) * 3
    assert made.specular_f0 == pytest.approx(expected)
    assert made.roughness == 0.3
    if preset not in ("glass", "ruby"):  # the table has their values under another name first
        assert materials.preset_of(made) == preset
    assert materials.with_preset(made, "custom").metal is None


def test_light_in_other_unit_is_the_same_light() -> None:
    light = Light((0.0, 1.0, 0.0), 0.2, power=(10.0, 20.0, 30.0))
    there = lights.in_unit(light, "radiance")
    assert there.power is None
    assert there.surface_radiance == pytest.approx(light.surface_radiance)
    assert lights.in_unit(there, "power").power == pytest.approx(light.power)


@pytest.mark.parametrize("kind", ["spheres", "planes", "rectangles", "lights"])
def test_move_shifts_by_the_step(kind: str) -> None:
    part = getattr(ft.load("cornell-box" if kind == "rectangles" else "three-spheres"), kind)[0]
    name = {"spheres": "center", "planes": "point", "rectangles": "corner", "lights": "position"}[kind]
    shifted = getattr(objects.moved(part, (1.0, -2.0, 3.0)), name)
    np.testing.assert_allclose(np.subtract(shifted, getattr(part, name)), (1, -2, 3))


def test_saved_scene_has_the_camera_of_the_view(tmp_path: Path) -> None:
    session = Session.of(ft.load("mirror"))
    session.camera = camera.orbit(session.camera, 0.5, 0.0)
    session.save(tmp_path / "new.toml")
    assert ft.load(tmp_path / "new.toml").camera == session.camera


def test_bundled_scene_is_not_overwritten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session.of(ft.load("mirror"))
    session.open("mirror")
    assert actions.save_path(session) == tmp_path / "mirror.toml"


def test_a_model_is_saved_as_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.obj").write_text("mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")
    (tmp_path / "x.mtl").write_text("newmtl red\nKd 1 0 0\n")
    session = Session.of(ft.load("mirror"))
    session.open(tmp_path / "x.obj")
    files = scene_files(session.document.scene, session.path)
    assert set(files) == {tmp_path / "x.obj", tmp_path / "x.mtl"}
    assert actions.save_path(session) == tmp_path / "x.toml"
    session.save(tmp_path / "x.toml")
    assert ft.load(tmp_path / "x.toml") == session.document.scene


def test_edits_survive_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    session = Session.of(ft.load("mirror"))
    session.edit(session.document.without_part(("spheres", 0)), "remove")
    expected = session.document.scene.spheres
    with pytest.raises(FragtracerError, match=r"driver gave up.*rescued-mirror.toml"), run.rescue(FakeViewer(session)):
        raise RuntimeError("driver gave up")
    assert ft.load(tmp_path / "fragtracer" / "rescued-mirror.toml").spheres == expected


def test_display_is_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert settings.remembered_display() == DisplaySettings()
    settings.remember_display(DisplaySettings(exposure=1.5, tone_curve="agx"))
    assert settings.remembered_display() == DisplaySettings(exposure=1.5, tone_curve="agx")
    (tmp_path / "fragtracer" / "viewer.json").write_text("{", "utf-8")
    assert settings.remembered_display() == DisplaySettings()


@dataclass
class FakeViewer:
    session: Session


def test_render_command_takes_an_edited_scene_along(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sphere = Scene(materials={"a": Material()}, spheres=(Sphere((0, 0, 0), 1.0, "a"),), name="ball")
    session = Session.of(sphere)
    edited = replace(session.settings, bounces=9, estimator="nee")
    session.edit(replace(session.document, scene=replace(sphere, render=edited)), "x")
    session.camera = camera.orbit(session.camera, 0.5, 0.0)
    words = actions.render_command(session, (300, 200), 64)
    assert words == "fragtracer render ball.toml -o ball.png --size 300x200 --spp 64"
    written = ft.load("ball.toml")
    assert written.render == edited
    assert written.camera == session.camera


def test_another_scene_begins_with_nothing_selected_and_no_environment_of_before() -> None:
    session = Session.of(ft.load("three-spheres"))
    session.selected, session.environment, session.material = ("spheres", 1), Environment(radiance=1.0), "gold"
    session.open("mirror")
    assert (session.selected, session.environment, session.material) == (None, None, "")


class FakeFilm:
    """Every pixel has the same mean and variance; those of the upper half are not all finite."""

    size = (4, 64)

    def __init__(self, spp: int, mean: float, variance: float) -> None:
        self._pixels = np.array([mean] * 3 + [spp]), np.array([variance] * 3 + [0])

    def read_rows(self, bottom: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
        mean, variance = (np.tile(p.astype(np.float32), (rows, 4, 1)) for p in self._pixels)
        variance[np.arange(bottom, bottom + rows) >= 32, :, 3] = 2
        return mean, variance


@pytest.mark.parametrize(("spp", "mean", "error"), [(0, 0.0, None), (1, 1.0, None), (101, 2.0, 0.05), (9, 0.0, None)])
def test_film_statistics_are_those_of_the_film(spp: int, mean: float, error: float | None) -> None:
    found = FilmStatistics()
    for _ in range(15):
        found.look(FakeFilm(spp, mean, 1.0))
    assert found.relative_error is None, "not before all of it was read"
    found.look(FakeFilm(spp, mean, 1.0))
    assert found.relative_error == (None if error is None else pytest.approx(error))
    assert found.non_finite == 2 * 4 * 32


def test_governor_lowers_light_samples_before_resolution_and_nothing_where_all_fits() -> None:
    full, budget = (1000, 500), Governor(target=0.033, overhead=0.013).budget
    needed = 500_000 / budget  # paths per second for one per pixel
    assert Governor(overhead=0.013).choose(full, 2 * needed, 7, 8) == (full, 8), "fast enough for all"
    half = Governor(overhead=0.013, level=0)
    assert half.choose(full, needed / 2, 8, 8) == (full, 3), "(1 + 8) / 2 rays a vertex are affordable"
    size, light_samples = Governor(overhead=0.013).choose(full, needed / 45, 8, 8)
    assert light_samples == 1
    assert size[0] < full[0]


def test_governor_does_not_flicker_between_two_numbers_of_light_samples() -> None:
    governor, rng, chosen = Governor(target=0.033, overhead=0.013), np.random.default_rng(1), 8
    counts = []
    for _ in range(200):  # rays per second for four light samples, more or less
        rate = 5 * 500_000 / governor.budget * rng.uniform(0.93, 1.07) / (1 + chosen)
        _, chosen = governor.choose((1000, 500), rate, chosen, 8)
        counts.append(chosen)
    assert sum(a != b for a, b in pairwise(counts)) <= 2


def batches(rng: np.random.Generator, level: float = 1.0) -> list[Means]:
    """Means of noisy pictures of one brightness, but ``level`` times that in one block."""
    pictures = rng.gamma(2.0, 0.5, (16, 48, 48, 3))
    pictures[:, 8:12, 4:8] *= level
    return [scale_means(picture[None]) for picture in pictures]


def test_finding_says_where_pictures_differ() -> None:
    rng = np.random.default_rng(3)
    found = judged(batches(rng, 1.8), batches(rng))
    rows, columns, _ = np.nonzero(found.differs)
    assert {(int(r), int(c)) for r, c in zip(rows, columns, strict=True)} == {(2, 1)}
    assert found.outcome == "disagreement"
    assert found.z[2, 1].min() > 0, "ours is brighter"
    assert np.all(np.abs(found.z[found.differs]) >= found.critical)
    assert np.all(np.abs(found.z[~found.differs]) < found.critical)


def test_finding_is_none_too_often_in_equal_pictures() -> None:
    """At the level of 1 % for all looks together, forty comparisons find next to nothing."""
    rng = np.random.default_rng(4)
    assert sum(judged(batches(rng), batches(rng)).differing > 0 for _ in range(40)) <= 1


def tetrahedra() -> Scene:
    """Two copies of a tetrahedron, one turned and stretched, behind a small sphere."""
    corners = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
    geometry = Geometry(corners, [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    copies = (Placement((-3.0, 0.0, 0.0)), Placement((3.0, 0.5, -1.0), (10.0, 40.0, 70.0), (0.5, 1.5, 1.0)))
    mesh = Mesh((MeshPart(geometry, "a"),), copies, name="two of them")
    texture = Texture(Image(np.zeros((2, 3, 3), np.uint8), file="wood.png"))
    materials = {"a": Material(albedo_texture=texture), "b": Material()}
    camera = Camera((0.0, 0.5, 9.0), (0.0, 0.0, 0.0))
    return Scene(camera, materials, spheres=(Sphere((3.0, 0.5, 3.0), 0.01, "b"),), meshes=(mesh,))


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


def test_watch_sees_the_files_of_a_scene_and_not_that_the_list_changes(tmp_path: Path) -> None:
    path, scene = tmp_path / "a.toml", tetrahedra()
    (tmp_path / "wood.png").write_bytes(b"1")
    assert list(scene_files(scene, path)) == [path, tmp_path / "wood.png"]
    shown = [scene]
    watch = Watch(lambda: scene_files(shown[0], path))

    def changed() -> bool:
        watch._looked_at = 0.0
        return watch.changed()

    assert not changed()
    (tmp_path / "wood.png").write_bytes(b"22")
    assert changed()
    assert not changed()
    shown[0] = replace(scene, materials={"a": Material(), "b": Material()})
    assert not changed()
    path.write_text("", "utf-8")
    assert changed(), "it has come"


def test_viewpoints_are_remembered_for_each_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    scene, path = ft.load("mirror"), tmp_path / "a.toml"
    session = Session.of(scene, path)
    session.camera = camera.orbit(session.camera, 0.5, 0.1)
    session.keep_viewpoint(3)
    assert Session.of(scene, path).viewpoints == {3: session.camera}
    assert Session.of(scene, tmp_path / "b.toml").viewpoints == {}
    session.save(tmp_path / "b.toml")
    assert Session.of(scene, tmp_path / "b.toml").viewpoints == {3: session.camera}
    (tmp_path / "fragtracer" / "viewpoints.json").write_text('{"x": 1', "utf-8")
    assert Session.of(scene, path).viewpoints == {}
