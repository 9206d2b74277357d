# SPDX-License-Identifier: MIT
"""Which spheres are in a grid, and in which of its cells."""

import moderngl
import numpy as np
import pytest
from scene_builders import lambert

from fragtracer.gpu import tracer
from fragtracer.gpu.specialise import Level
from fragtracer.io.toml import load
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.shapes import Shapes, shape_records
from fragtracer.packing.sphere_grid import SphereGrid, pack_sphere_grid
from fragtracer.scene import Material, Rectangle, Scene, Sphere

MATERIALS = {"matte": lambert(0.5), "lamp": lambert(0.0, 1.0), "front": Material(double_sided=False)}
BALLS = [Sphere((float(x), 0.1 * (x % 3), float(z)), 0.3, "matte") for x in range(8) for z in range(6)]


def records(spheres: list[Sphere]) -> tuple[Shapes, float]:
    extent = float(np.max([np.abs(s.center).max() + s.radius for s in spheres]))
    index = dict.fromkeys(MATERIALS, 0)
    return shape_records(spheres, MATERIALS, index, np.full(len(spheres), -1), np.zeros(3), extent, 1.0), extent


def spheres_of(grid: SphereGrid) -> list[set[int]]:
    """Those of each cell."""
    count = int(grid.size.prod()) * grid.capacity
    ends = grid.texels[:count, 3].view(np.float32).reshape(-1, grid.capacity) <= 0
    members = grid.texels[count:].reshape(-1)[:count].reshape(-1, grid.capacity)
    is_empty = grid.texels[: count : grid.capacity, 3] == 0
    lengths = np.where(is_empty, 0, ends.argmax(axis=1) + 1)
    return [set(row[:n].tolist()) for row, n in zip(members, lengths, strict=True)]


@pytest.mark.parametrize(("count", "flat"), [(200, 1.0), (1000, 1.0), (1000, 0.0)])
def test_a_sphere_is_in_the_cells_that_it_touches(count: int, flat: float) -> None:
    rng = np.random.default_rng(count)
    centers, radii = rng.uniform(-1, 1, (count, 3)) * (1.0, flat, 1.0), rng.uniform(0.02, 0.06, count)
    spheres = [Sphere(c, r, "matte") for c, r in zip(map(tuple, centers.tolist()), radii.tolist(), strict=True)]
    grid = pack_sphere_grid(*records(spheres))
    assert grid is not None
    assert len(grid.members) == count
    found = spheres_of(grid)
    normals = rng.normal(size=(100, count, 3))
    normals *= rng.uniform(size=(100, count, 1)) ** 0.3 / np.linalg.norm(normals, axis=2, keepdims=True)
    places = np.floor((centers + radii[:, None] * normals - grid.low) / grid.cell).astype(int)
    assert ((places >= 0) & (places < grid.size)).all()
    cells = (places[..., 2] * grid.size[1] + places[..., 1]) * grid.size[0] + places[..., 0]
    assert all(i in found[cell] for row in cells.tolist() for i, cell in enumerate(row))
    pairs = np.array([(cell, i) for cell, some in enumerate(found) for i in some])
    place = np.stack(np.unravel_index(pairs[:, 0], grid.size[::-1])[::-1], axis=1)
    center = centers[grid.members[pairs[:, 1]]]
    nearest = np.clip(center, grid.low + place * grid.cell, grid.low + (place + 1) * grid.cell)
    assert (np.linalg.norm(nearest - center, axis=1) < 1.001 * radii[pairs[:, 1]]).all()


def packed(*others: Sphere, balls: list[Sphere] = BALLS, walls: int = 0) -> PackedScene:
    rectangles = [Rectangle((0.0, -1.0 - i, 0.0), (8.0, 0.0, 0.0), (0.0, 0.0, 8.0), "matte") for i in range(walls)]
    scene = Scene(materials=MATERIALS, spheres=[*balls, *others], rectangles=rectangles)
    return pack(scene, scene.render, 8, 8)


BESIDE = [
    Sphere((0.0, -1000.0, 0.0), 999.0, "matte"),
    Sphere((0.0, 3.0, 0.0), 0.3, "lamp"),
    Sphere((0.0, 4.0, 0.0), 0.3, "front"),
]


def test_lights_single_sided_and_large_spheres_are_beside_it() -> None:
    found = packed(*BESIDE, walls=5)
    assert found.flags["u_has_sphere_grid"] == 1
    assert (found.uniforms["u_sphere_count"], found.uniforms["u_flat_count"]) == (3, 5)
    assert found.uniforms["u_first_grid_sphere"] == len(found.listed) == 8
    assert found.uniforms["u_bvh_root"] == -1


def test_where_there_is_none() -> None:
    """With more beside it, with few spheres, and where they lie in crowds far from each other."""
    crowds = [Sphere((100.0 * (i % 2) + i % 5, i % 3, i % 7), 0.3, "matte") for i in range(48)]
    for found in (packed(*BESIDE, walls=6), packed(balls=BALLS[:31]), packed(balls=crowds)):
        assert found.flags["u_has_sphere_grid"] == 0
        assert found.uniforms["u_bvh_root"] >= 0
    assert packed(balls=BALLS[:32]).flags["u_has_sphere_grid"] == 1


@pytest.mark.parametrize("name", ["weekend", "sphere-field", "roughness-grid", "spheres-49"])
def test_fields_of_spheres_are_in_grids(name: str) -> None:
    """Of 49 spheres where that is asked for; meshes are in a BVH beside it."""
    scene = load(name)
    assert pack(scene, scene.render, 8, 8, 64).flags["u_has_sphere_grid"] == (len(scene.spheres) > 64)
    found = pack(scene, scene.render, 8, 8, 64, most_outside_grid=31)
    assert found.flags["u_has_sphere_grid"] == 1
    assert (found.uniforms["u_bvh_root"] >= 0) == bool(scene.meshes)


@pytest.mark.parametrize("skips", [False, True])
def test_where_no_list_is_a_tree_of_balls_fewer_spheres_are_in_a_grid(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, skips: bool
) -> None:
    monkeypatch.setattr(tracer, "skips_branches", lambda _: skips)
    assert tracer.most_outside_grid(ctx, Level.SCENE) == (64 if skips else 31)
    assert tracer.most_outside_grid(ctx, Level.NOTHING) > 10**9
