# SPDX-License-Identifier: MIT
"""What photons are sent to: areas, and which of them belong together."""

from dataclasses import replace

import numpy as np
import pytest
from mesh_shapes import ball, geometry
from test_light_tracing import FLOOR, LAMP, LENS, MATERIALS, grounds, meshes, shapes

from fragtracer.packing import pack
from fragtracer.packing.shapes import Kind
from fragtracer.packing.targets import Near, targets_of, too_many
from fragtracer.renderer import Renderer
from fragtracer.scene import Mesh, Part, RenderSettings, Scene, Sphere


def test_targets_have_the_area_of_their_shapes() -> None:
    """Of all narrow ones that are finite; of copies as they are stretched."""
    scene = replace(shapes(), spheres=[Sphere((0.0, 5.0, 0.0), 0.5, "mirror"), Sphere((0.0, 7.0, 0.0), 0.5, "floor")])
    for most_listed in (0, 64):
        packed = pack(scene, RenderSettings(), 8, 8, most_listed)
        targets = targets_of(packed, scene)
        areas = np.bincount(targets.record, targets.area)
        areas = areas[areas > 0]
        expected = [shape.area for shape in (*scene.rectangles[:2], *scene.disks, *scene.triangles)] + [np.pi]
        np.testing.assert_allclose(np.sort(areas), np.sort(expected), rtol=1e-4)
    scene = meshes()
    packed = pack(scene, RenderSettings(), 8, 8)
    targets = targets_of(packed, scene)
    expected = 0.0
    for mesh in scene.meshes[:2]:
        for matrix, part in mesh.placed():
            a, b, c = (part.geometry.positions[part.geometry.triangles] @ matrix[:3, :3].T).swapaxes(0, 1)
            expected += np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert targets.area.sum() == pytest.approx(expected, rel=1e-4)
    table = targets.texels(np.arange(1.0, len(targets) + 1))
    probability = table[1::2, 0].view(np.float32) * targets.area
    assert probability.sum() == pytest.approx(1, rel=1e-5)


def test_too_many_targets_are_none(ctx, monkeypatch) -> None:
    """Copies count, since each is sent photons of its own; what is matte does not."""
    scene = meshes()
    count = len(targets_of(pack(scene, RenderSettings(), 8, 8), replace(scene, planes=[])))
    monkeypatch.setattr("fragtracer.packing.targets._MOST", count)
    assert not too_many(scene)
    monkeypatch.setattr("fragtracer.packing.targets._MOST", count - 1)
    with Renderer(scene, (8, 8), context=ctx, guiding="on", light_tracing="on") as renderer:
        for name in ("guiding_decision", "light_tracing_decision"):
            expected = f"off: {count} triangles may scatter light narrowly, more than {count - 1}"
            assert renderer.metadata()[name] == expected


@pytest.mark.parametrize("count", [5, 600])
def test_each_shape_is_a_group(count: int) -> None:
    """Also where it is divided, as it is among few."""
    balls = [Sphere((float(i), 0.5, 0.0), 0.3, "gold") for i in range(count)]
    scene = Scene(LENS, MATERIALS, planes=[FLOOR], spheres=balls, lights=[LAMP])
    targets = targets_of(pack(scene, RenderSettings(), 8, 8), scene)
    assert (len(targets) > count) == (count == 5)
    assert len(np.unique(np.stack([targets.group, targets.record]), axis=1).T) == count
    assert len(np.unique(targets.group)) == count


def test_groups_of_triangles_are_pieces_of_meshes() -> None:
    """As many in each, which are near to each other."""
    mesh = Mesh((Part(geometry(ball(40, 20)), "gold"),))
    scene = Scene(LENS, MATERIALS, meshes=[mesh], lights=[LAMP])
    packed = pack(scene, RenderSettings(), 8, 8)
    targets = targets_of(packed, scene)
    _, records = (part.reshape(-1, 4, 4) for part in packed.tables["u_shapes"])
    corners = records[targets.record - packed.uniforms["u_bvh_root"], :3, :3].view(np.float32)
    middles = corners.mean(axis=1)
    groups, counts = np.unique(targets.group, return_counts=True)
    assert len(groups) == 16
    assert np.ptp(counts) <= 1
    spread = [middles[targets.group == group].var(axis=0).sum() for group in groups]
    assert np.mean(spread) < 0.3 * middles.var(axis=0).sum()


def test_a_speck_is_not_what_is_near() -> None:
    """Nor is what has no size, which parts of meshes may have that are a point."""
    balls = [Sphere((2.0 * i, 0.5, 0.0), 0.5, "gold") for i in range(5)]
    scene = Scene(LENS, MATERIALS, spheres=balls, lights=[LAMP])
    near = Near.of(scene, np.zeros(3))
    for speck in (Sphere((0.0, 0.5, 0.6), 1e-4, "gold"), Sphere((20.0, 0.0, 0.0), 100.0, "gold")):
        found = Near.of(replace(scene, spheres=[*balls, speck]), np.zeros(3))
        assert found.radius == pytest.approx(near.radius, rel=0.1)
    point = Mesh((Part(geometry((np.zeros((3, 3)), np.array([[0, 1, 2]]))), "gold"),))
    scene = replace(scene, spheres=balls[:1], meshes=[point])
    targets = targets_of(pack(scene, RenderSettings(), 8, 8), scene)
    assert targets.weights().sum() == pytest.approx(1)


def test_grounds_are_divided_by_distance() -> None:
    """Of any kind, with parts as small as what is near wants them there, and no more than that takes."""
    scene = grounds()
    packed = pack(scene, RenderSettings(), 8, 8)
    targets = targets_of(packed, scene)
    near = Near.of(scene, packed.origin)
    assert near.radius == pytest.approx(0.5 * np.sqrt(3))
    np.testing.assert_allclose(near.middle + packed.origin, (0.2, 0.5, 0.0), atol=1e-9)
    middle = targets.points(0.5, 0.5)
    corners = [targets.points(x, y) for x in (0.0, 1.0) for y in (0.0, 1.0)]
    size = np.max([np.linalg.norm(corner - middle, axis=1) for corner in corners], axis=0)
    distance = np.linalg.norm(middle - near.middle, axis=1)
    most = np.where(targets.kind == Kind.DISK, 1.0, 0.3)  # the shader counts no more rows around the middle of a disk
    assert (size < most * np.maximum(near.radius, distance)).all()
    assert len(targets) < 10_000
    area = np.bincount(targets.record, targets.area)
    expected = [2000**2, 1e6 * np.pi, 4e6 * np.pi, np.pi, 1800**2 / 2, 1800**2 / 2]
    np.testing.assert_allclose(np.sort(area[area > 0]), np.sort(expected), rtol=1e-4)
    assert (targets.worth == targets.area)[distance < near.radius].all()
    assert (targets.worth < targets.area)[distance > near.radius].all()
