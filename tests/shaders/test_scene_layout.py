# SPDX-License-Identifier: MIT
"""packing.py and generated/scene_layout.glsl: what is packed is what the shader reads, from all storages."""

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.packing import PackedScene, pack
from fragtracer.packing.records import RECORDS
from fragtracer.scene import Scene
from fragtracer.shader_composer import CONSTANTS

from . import Floats
from .includes import CORE
from .scene_probe import random_scene, scene_probe

LAYOUT = [*CORE, "generated/scene_layout.glsl"]
WIDTHS = {"int": 1, "float": 1, "vec3": 3, "vec4": 4}
Table = dict[str, Floats]

# Triangles, and whether the scene is baked: the last fills more than one row of the texture.
STORAGES = {"uniform block": (12, False), "baked": (12, True), "texture": (1100, False)}


@pytest.fixture(autouse=True)
def _triangles_stay_single(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fragtracer.packing.gather.MOST_TRIANGLES", 10**6)


@pytest.fixture(params=STORAGES)
def stored(request: pytest.FixtureRequest) -> tuple[Scene, PackedScene]:
    triangles, baked = STORAGES[request.param]
    scene = random_scene(triangles=triangles, shift=3.0)
    packed = pack(scene, scene.render, 64, 64, baked)
    assert packed.defines["SCENE_IN_UNIFORMS"] == int(request.param != "texture")
    assert ("BAKED_SCENE" in packed.layout) == baked
    assert (len(packed.texels) > 4096) == (request.param == "texture")
    return scene, packed


def read(ctx: moderngl.Context, packed: PackedScene, record: str, count: int, way: str) -> Table:
    """All fields of all records of one kind, by x_load or by x_select."""
    load = f"for (int k = 0; k < {count}; k++) if (k == int(row)) r = {record.lower()}_load(k);"
    select = f"r = {record.lower()}_select(int(row));"
    table: Table = {}
    fields = RECORDS[record]
    for some in (fields[:8], fields[8:]):  # as many as a probe has results
        if some:
            body = f"{record} r; {load if way == 'load' else select}\n"
            body += "\n".join(f"{name} = {'float' if kind == 'int' else kind}(r.{name});" for name, kind in some)
            outputs = {name: WIDTHS[kind] for name, kind in some}
            table |= scene_probe(ctx, packed, LAYOUT, body, {"row": np.arange(count)}, outputs)
    return table


def expect(table: Table, field: str, values: Sequence[Any]) -> None:
    np.testing.assert_allclose(table[field], np.array(values, np.float64), rtol=2e-7, atol=1e-37, err_msg=field)


@pytest.mark.parametrize("way", ["load", "select"])
def test_records_are_read_as_packed(ctx: moderngl.Context, stored: tuple[Scene, PackedScene], way: str) -> None:
    scene, packed = stored
    names = [*scene.materials, "light[0]", "light[2]"]  # the round lights become spheres of their own
    round_lights = [scene.lights[0], scene.lights[2]]

    spheres = read(ctx, packed, "Sphere", 7, way)
    centers = [s.center for s in scene.spheres] + [light.position for light in round_lights]
    expect(spheres, "center", np.subtract(centers, packed.origin))
    expect(spheres, "radius", [s.radius for s in scene.spheres] + [light.radius for light in round_lights])
    expect(spheres, "material", [names.index(s.material) for s in scene.spheres] + [10, 11])

    planes = read(ctx, packed, "Plane", len(scene.planes), way)
    normals = np.array([p.normal for p in scene.planes])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    expect(planes, "normal", normals)
    expect(planes, "offset", (normals * (np.array([p.point for p in scene.planes]) - packed.origin)).sum(1))
    expect(planes, "material", [names.index(p.material) for p in scene.planes])

    for kind, shapes in (("Rectangle", scene.rectangles), ("Triangle", scene.triangles)):
        table = read(ctx, packed, kind, len(shapes), way)
        expect(table, "material", [names.index(s.material) for s in shapes])
        corners = np.array([flat_corners(s) for s in shapes]) - packed.origin
        check_flat(table, corners)

    materials = read(ctx, packed, "Material", len(names), way)
    for field, source in (
        ("diffuse", "diffuse_albedo"),
        ("alpha", "alpha"),
        ("f0", "specular_f0"),
        ("f90", "specular_f90"),
        ("emission", "emission"),
    ):
        table = {field: materials[field][:10]}
        expect(table, field, [getattr(m, source) for m in scene.materials.values()])
    for row, light in ((10, round_lights[0]), (11, round_lights[1])):
        expect({"emission": materials["emission"][row]}, "emission", light.surface_radiance)
        assert not materials["diffuse"][row].any()
        assert not materials["f0"][row].any()
        assert not materials["f90"][row].any()


def flat_corners(shape: Any) -> Floats:
    """The point with coordinates (0, 0) and those with (1, 0) and (0, 1)."""
    if hasattr(shape, "vertices"):
        return np.array(shape.vertices)
    return np.add(shape.corner, [np.zeros(3), shape.edge_u, shape.edge_v])


def check_flat(table: Table, corners: Floats) -> None:
    """The plane holds the corners, and the rows give them their coordinates, but for a millionth of the
    scene: shapes are grown by that much to close cracks."""
    extent = np.abs(corners).max()
    sides = corners[:, [1, 2, 2]] - corners[:, [0, 0, 1]]
    normal = np.cross(sides[:, 0], sides[:, 1])
    smallest_height = np.linalg.norm(normal, axis=1) / np.linalg.norm(sides, axis=2).max(1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(table["plane"][:, :3], normal, atol=1e-6)
    height = np.einsum("sx,scx->sc", table["plane"][:, :3], corners) - table["plane"][:, 3:]
    assert np.abs(height).max() < 1e-6 * extent
    for row, coordinates in (("u_row", (0, 1, 0)), ("v_row", (0, 0, 1))):
        found = np.einsum("sx,scx->sc", table[row][:, :3], corners) + table[row][:, 3:]
        assert (np.abs(found - coordinates).max(1) <= 5e-6 * extent / smallest_height).all(), row


@pytest.mark.parametrize("way", ["load", "select"])
def test_lights_are_read_as_packed(ctx: moderngl.Context, stored: tuple[Scene, PackedScene], way: str) -> None:
    """Every emitter is a light, and it and its shape know each other."""
    scene, packed = stored
    count = packed.defines["LIGHT_COUNT"]
    table = read(ctx, packed, "Light", count, way)
    shapes = [*scene.spheres, scene.lights[0], scene.lights[2], *scene.planes, *scene.rectangles, *scene.triangles]
    numbers = {id(s): i for i, s in enumerate(shapes)}
    emitting = [s for s in shapes if s in scene.lights or scene.materials[s.material].is_emissive]
    assert count == len(emitting) + 1  # the point light is no shape
    assert table["primitive"].tolist() == [*(numbers[id(s)] for s in emitting), -1]

    kinds = [{"Rectangle": "RECTANGLE", "Triangle": "TRIANGLE"}.get(type(s).__name__, "SPHERE") for s in emitting]
    assert table["kind"].tolist() == [CONSTANTS[f"LIGHT_{kind}"] for kind in [*kinds, "POINT"]]
    for row, (shape, kind) in enumerate(zip(emitting, kinds, strict=True)):
        one = {field: values[row] for field, values in table.items()}
        radiance = shape.surface_radiance if shape in scene.lights else scene.materials[shape.material].emission
        expect(one, "radiance", radiance)
        if kind == "SPHERE":
            expect(one, "radius", shape.radius)
            expect(one, "position", getattr(shape, "position", getattr(shape, "center", None)) - packed.origin)
            continue
        corner, u, v = flat_corners(shape)
        expect(one, "position", corner - packed.origin)
        expect(one, "edge_u", u - corner)
        expect(one, "edge_v", v - corner)
        expect(one, "area", shape.area)
        cross = np.cross(u - corner, v - corner)
        expect(one, "normal", cross / np.linalg.norm(cross))
    last = {field: values[-1] for field, values in table.items()}
    expect(last, "radiance", scene.lights[1].intensity)
    expect(last, "position", np.subtract(scene.lights[1].position, packed.origin))

    assert (table["probability"] > 0).all()
    assert table["probability"].sum() == pytest.approx(1, abs=1e-5)
    np.testing.assert_allclose(table["cumulative"], np.cumsum(table["probability"]), atol=1e-5)
    assert table["cumulative"][-1] == pytest.approx(1, abs=1e-6)

    for kind, first in (("Sphere", 0), ("Rectangle", 9), ("Triangle", 14)):
        back = read(ctx, packed, kind, packed.defines[f"{kind.upper()}_COUNT"], way)["light"]
        for i, light in enumerate(back.astype(int)):
            assert (first + i in table["primitive"]) == (light >= 0)
            assert light < 0 or table["primitive"][light] == first + i
