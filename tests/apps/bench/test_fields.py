# SPDX-License-Identifier: MIT
"""Fields of shapes cover the same part of the picture whatever their number, and their tables have all rows."""

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fragtracer.apps.bench import fields, lights, shapes, spheres
from fragtracer.apps.bench.cold import cold_scene, compile_seconds, first_picture_seconds
from fragtracer.apps.bench.fields import COVER, KINDS, LIGHT_KINDS, SIDE, Kind, light_field, shape_field
from fragtracer.apps.bench.plan import Plan
from fragtracer.apps.bench.sphere_field import sphere_field
from fragtracer.apps.bench.statistics import Estimate
from fragtracer.apps.bench.tables import Table
from fragtracer.apps.bench.work import Work
from fragtracer.errors import FragtracerError
from fragtracer.reference.variant import find_llvm
from fragtracer.renderer import Renderer
from fragtracer.scene import RenderSettings, Scene

RENDER = RenderSettings(width=96, height=96, bounces=0)
QUICK = Plan(size=(16, 9), runs=2, seconds=0.01, sampler="independent")


def _run(benchmark: Any) -> Table:
    table: Table = benchmark.table(QUICK)
    benchmark.run(QUICK, table, lambda share, text: None)
    return table


def _area(scene: Scene) -> float:
    """Of all shapes, as the camera sees them."""
    area = sum(np.pi * sphere.radius**2 for sphere in scene.spheres) + sum(r.area for r in scene.rectangles)
    for mesh in scene.meshes:
        (part,) = mesh.parts
        a, b, c = part.geometry.positions[part.geometry.triangles].transpose(1, 0, 2)
        area += np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return float(area)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [1, 10, 1000])
def test_shapes_of_every_field_have_the_same_area(kind: Kind, count: int) -> None:
    field = shape_field(kind, count, RENDER)
    assert _area(field.scene) == pytest.approx(COVER * SIDE**2)
    assert len(field.scene.spheres) + len(field.scene.rectangles) in (0, count)
    assert field.bounds.shape == (6, count)
    assert (field.bounds[:3] <= -field.bounds[3:]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_fields_fill_the_same_part_of_the_picture(kind: Kind) -> None:
    def depth(scene: Scene) -> Any:
        with Renderer(scene, program="auxiliary.frag", defines={"AUXILIARY": "AUXILIARY_DEPTH"}, sampler="hash") as one:
            return one.render(1)[..., 0]

    scenes = [shape_field(kind, count, RENDER).scene for count in (10, 100, 1000)]
    plane = depth(replace(scenes[0], spheres=(), rectangles=(), meshes=()))
    fill = [float((depth(scene) < plane - 1e-4).mean()) for scene in scenes]
    assert min(fill) > 0.1
    assert max(fill) < 1.15 * min(fill)


def test_lights_of_every_field_give_the_same_light() -> None:
    settings = RenderSettings(width=16, height=16, bounces=1)
    means = []
    for count in (10, 100):
        with Renderer(light_field(count, settings, "spheres")) as renderer:
            means.append(renderer.render(256).mean())
    assert means[0] == pytest.approx(means[1], rel=0.1)


def test_rows_of_shapes_with_the_step_from_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    count, known = shapes.count_work, dict[tuple[bool, bool], Work]()

    def counted(scene: Scene, spp: int) -> Work:
        """By one program for each kind of shapes: the rays of a field of a few stand for those of many."""
        kind = bool(scene.spheres), bool(scene.meshes)
        if kind not in known:
            known[kind] = count(scene, spp)
        return known[kind]

    monkeypatch.setattr(shapes, "count_work", counted)
    monkeypatch.setattr(shapes, "COUNTS", (10, 300, 1000))
    monkeypatch.setenv("FRAGTRACER_CACHE", before := os.environ["FRAGTRACER_CACHE"])
    table = _run(shapes.BENCHMARK)
    assert os.environ["FRAGTRACER_CACHE"] == before
    most = shapes.most_listed()
    for kind in KINDS:
        rows = [row for row in table.rows if row["shapes"] == kind]
        counts = [row["count"] for row in rows]
        if kind == "mesh triangles":
            assert counts == [10, 300, 1000]
            assert {row["traversal"] for row in rows} == {"BVH"}
        else:
            threshold = most[kind]
            assert counts == sorted({10, 300, 1000, threshold, threshold + 1})
            structure = "grid" if kind == "spheres" else "BVH"
            expected = ["one by one" if count <= threshold else structure for count in counts]
            assert [row["traversal"] for row in rows] == expected
            (step,) = (row for row in rows if "step" in row)
            assert step["count"] == threshold + 1
        assert "±" in str(rows[-1]["growth"])
        for row in rows:
            assert all(isinstance(row[name], Estimate) for name in ("ns", "build"))
    assert sum("the aim of less than 1.5 is" in note for note in table.notes) == 2


def test_rows_of_lights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lights, "COUNTS", (10, 100))
    monkeypatch.setattr(fields, "MOST_LIGHTS", 200)
    rows = _run(lights.BENCHMARK).rows
    assert [(row["kind"], row["lights"]) for row in rows] == [(kind, n) for kind in LIGHT_KINDS for n in (10, 100)]
    for few, many in zip(rows[::2], rows[1::2], strict=True):
        assert few["rays"] == pytest.approx(many["rays"], rel=0.2)
    some = light_field(10, RENDER, "some of 10,000 spheres")
    assert (len(some.lights), len(some.spheres)) == (10, 9 + 190)


@pytest.mark.skipif(find_llvm() is None, reason="scalar_rgb is too slow for these tests")
def test_rows_of_spheres(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spheres, "COUNTS", (10,))
    monkeypatch.setattr(spheres, "_COLD_RUNS", 1)
    rows = _run(spheres.BENCHMARK).rows
    assert [row["spheres"] for row in rows] == [10]
    for row in rows:
        for name in ("fragtracer", "mitsuba", "ratio", "compile", "first"):
            assert row[name].value > 0  # type: ignore[union-attr]


def test_a_cold_start_begins_without_caches() -> None:
    with cold_scene(sphere_field(3)) as path:
        assert 0 < compile_seconds(path, (16, 9)) < first_picture_seconds(path, (16, 9))
        with pytest.raises(FragtracerError, match="failed"):
            first_picture_seconds(path.with_name("none.toml"), (16, 9))
