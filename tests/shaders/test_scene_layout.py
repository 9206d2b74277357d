# SPDX-License-Identifier: MIT
"""scene/, light/ and shape/: what is packed is what the shader reads, from textures and compiled in.

That both have the same fields in the same places is what tests/packing/test_records.py says.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from mesh_shapes import ball, geometry

from fragtracer.gpu.specialise import Level
from fragtracer.packing import PackedScene, instances, matte_names, pack
from fragtracer.packing.lights import FEW_LIGHTS, LIGHT_RECORDS, MESH_LIGHT, LightKind
from fragtracer.packing.records import MATERIAL_RECORDS, MEDIUM_RECORDS, SIZES, Words, places, texel_count
from fragtracer.packing.shapes import FLATS, SHAPE_RECORDS, STORED, Kind
from fragtracer.scene import (
    LIGHTS,
    SHAPES,
    Density,
    DirectionalLight,
    Environment,
    Fog,
    Image,
    Light,
    Material,
    Medium,
    Mesh,
    Part,
    Placement,
    Scene,
    Sky,
    Sphere,
    SpotLight,
    Texture,
)

from . import Floats
from .scene_oracle import Shape, corners_of, kind_of, plane_of, shapes_of
from .scene_probe import camera_on, light_numbers, random_scene, scene_probe, shape_records, snake

SCENE = [f"scene/{name}.glsl" for name in ("material", "texture", "vertex")]
SCENE += ["shape/shape.glsl", "medium/medium.glsl", "light/light.glsl"]
SCENE_RECORDS = MATERIAL_RECORDS | MEDIUM_RECORDS | LIGHT_RECORDS
RECORDS = SCENE_RECORDS | SHAPE_RECORDS | {"MeshLight": MESH_LIGHT}
Table = dict[str, Floats]
WHOLE = ("int", "uint", "uvec2", "uvec3")
MOST_OUTPUTS = 8  # of a probe

# Most shapes of the short list, how many triangles, and how much is compiled in.
STORAGES = {
    "listed": (10**6, 12, Level.NOTHING),
    "listed, many": (10**6, 1100, Level.NOTHING),  # more than a row of the texture
    "compiled in": (10**6, 12, Level.SCENE),
    "bvh": (0, 12, Level.NOTHING),
    "bvh, many": (0, 1100, Level.NOTHING),
    "bvh, compiled in": (0, 12, Level.SCENE),
}


@pytest.fixture(params=STORAGES)
def stored(request: pytest.FixtureRequest) -> tuple[Scene, PackedScene, Level]:
    most_listed, triangles, level = STORAGES[request.param]
    scene = random_scene(triangles=triangles, shift=3.0, culled=True)
    return scene, pack(scene, scene.render, 64, 64, most_listed), level


def read(
    ctx: moderngl.Context, packed: PackedScene, record: str, rows: Sequence[int] | Floats, level: Level = Level.NOTHING
) -> Table:
    """All fields of some records of one kind, as the shader loads them; whole numbers exactly."""
    return read_all(ctx, packed, {record: rows}, level)[record]


def read_all(
    ctx: moderngl.Context, packed: PackedScene, rows: Mapping[str, Sequence[int] | Floats], level: Level
) -> dict[str, Table]:
    """Those of several kinds, by one program."""
    loads, columns = [], []
    for number, (record, of_record) in enumerate(rows.items()):
        load = f"{record} r = {snake(record)}_load(int(row));"
        if record == "Node":
            load = "Node r = node_of(shape_texel(int(row), 0), shape_texel(int(row), 1), shape_texel(int(row), 2));"
        loads += [f"if (int(kind) == {number}) {{", load]
        # Each value has an output, a whole number two, since a float has 24 bits; where there are more than a probe has
        # outputs, further rows have the next ones.
        values = values_of(record)
        for n, (_, size, value) in enumerate(values):
            padding = ", 0.0" * (4 - size)
            loads.append(f"if (int(part) == {n // MOST_OUTPUTS}) out{n % MOST_OUTPUTS} = vec4({value}{padding});")
        loads.append("}")
        parts = -(-len(values) // MOST_OUTPUTS)
        column = np.tile(np.asarray(of_record), parts), np.repeat(np.arange(parts), len(of_record))
        columns.append(np.stack([*column, np.full(parts * len(of_record), number)]))
    row, part, kind = np.concatenate(columns, axis=1)
    outputs = {f"out{n}": 4 for n in range(MOST_OUTPUTS)}
    shown = scene_probe(ctx, packed, SCENE, "\n".join(loads), {"row": row, "part": part, "kind": kind}, outputs, level)
    return {
        record: table_of(record, {name: values[kind == number] for name, values in shown.items()}, len(of_record))
        for number, (record, of_record) in enumerate(rows.items())
    }


def values_of(record: str) -> list[tuple[str, int, str]]:
    """The name, the size and the expression of each value that tells of the fields of a record."""
    values: list[tuple[str, int, str]] = []
    for name, kind in RECORDS[record]:
        size = SIZES[kind]
        if kind in WHOLE:
            vector, cast = (f"uvec{size}(r.{name})", f"vec{size}") if size > 1 else (f"uint(r.{name})", "float")
            values += [
                (f"low {name}", size, f"{cast}({vector} & 0xffffu)"),
                (f"high {name}", size, f"{cast}({vector} >> 16u)"),
            ]
        else:
            values.append((name, size, f"r.{name}"))
    return values


def table_of(record: str, shown: Mapping[str, Floats], count: int) -> Table:
    """The fields of so many records, from what was shown of them."""
    found: Table = {}
    for n, (name, size, _) in enumerate(values_of(record)):
        part = shown[f"out{n % MOST_OUTPUTS}"].reshape(-1, count, 4)[n // MOST_OUTPUTS]
        found[name] = part[:, 0] if size == 1 else part[:, :size]
    table: Table = {}
    for name, kind in RECORDS[record]:
        value = found[f"high {name}"] * 65536 + found[f"low {name}"] if kind in WHOLE else found[name]
        table[name] = np.where(value >= 2**31, value - 2**32, value) if kind == "int" else value
    return table


def decoded(record: str, words: Words) -> Table:
    """The fields of records (n, texels, 4), by the table."""
    flat = words.reshape(len(words), -1)
    table: Table = {}
    for name, kind, place in places(RECORDS[record]):
        size = SIZES[kind]
        bits = np.ascontiguousarray(flat[:, place : place + size])
        types = {"int": np.int32, "uint": np.uint32, "uvec2": np.uint32, "uvec3": np.uint32}
        values = bits.view(types.get(kind, np.float32)).astype(np.float64)
        table[name] = values[:, 0] if size == 1 else values
    return table


def full_scene() -> Scene:
    """With records of every kind."""
    scene = random_scene(2, 5, culled=True)
    rng = np.random.default_rng(1)
    image = Image(rng.integers(0, 256, (3, 4, 4), np.uint8))
    bumpy = Material(
        albedo_texture=Texture(image, wrap_u="mirror", scale=(2.0, 3.0), rotation=0.4, offset=(0.1, 0.2)),
        roughness_texture=Texture(image, channel="g", filter="nearest", coordinates=1),
        normal_texture=Texture(Image(rng.random((5, 2, 3)), "linear"), wrap_v="clamp"),
        emission=(1.0, 2.0, 3.0),
        alpha_mode="mask",
        alpha_cutoff=0.3,
    )
    body = geometry(ball(8, 4), uvs=rng.random((len(ball(8, 4)[0]), 2)))
    places = tuple(Placement((3.0 * i, 0.0, 5.0), (10.0 * i, 5.0, 0.0), (1.0, 0.5, -2.0)) for i in range(3))
    grid = Density(rng.random((2, 3, 4)))
    others = {
        "glass": Material(model="dielectric", attenuation_color=(0.5, 0.6, 0.7), abbe_number=30.0),
        "pane": Material(model="thin-dielectric", ior=1.7, transmittance=(0.2, 0.3, 0.4)),
        "metal": Material(model="conductor", metal="gold", anisotropy=0.5),
        "varnish": Material(model="plastic", nonlinear=False),
        "satin": Material(model="rough-plastic"),
        "lacquer": Material(
            coat=0.7,
            coat_roughness=0.2,
            coat_ior=1.4,
            coat_texture=Texture(image, channel="b"),
            coat_normal_texture=Texture(image),
            coat_normal_scale=0.5,
            sheen_color=(0.2, 0.4, 0.6),
            sheen_roughness=0.3,
            sheen_color_texture=Texture(image),
            sheen_roughness_texture=Texture(image, channel="a"),
            iridescence=0.7,
            iridescence_ior=1.7,
            iridescence_thickness=350.0,
            iridescence_thickness_minimum=50.0,
            iridescence_texture=Texture(image),
            iridescence_thickness_texture=Texture(image, channel="g"),
        ),
        "leaf": Material(
            metallic=0.2,
            metallic_texture=Texture(image, channel="b"),
            diffuse_transmission=0.3,
            diffuse_transmission_color=(0.2, 0.4, 0.6),
            diffuse_transmission_texture=Texture(image, channel="a"),
            diffuse_transmission_color_texture=Texture(image),
        ),
        "cloud": Material(model="null", interior="haze", priority=1),
    }
    bumpy = replace(bumpy, blend="glass", blend_weight=0.7, blend_weight_texture=Texture(image, channel="g"))
    return replace(
        scene,
        materials=scene.materials | others | {"bumpy": bumpy, "plain": Material(alpha_mode="blend", opacity=0.4)},
        media={"haze": Medium(extinction=(1.0, 2.0, 3.0), g=0.5, density=grid, bounds=((-1, 0, -1), (1, 2, 1)))},
        fog=Fog("haze"),
        meshes=(Mesh((Part(body, "plain"),), places), Mesh((Part(body, "bumpy"),), places[:1])),
        environment=Environment(sky=Sky(sun_elevation_degrees=30.0)),
        lights=(*scene.lights, *(Light((0.3 * i, 2.0, 0.1 * i), power=1.0 + i) for i in range(FEW_LIGHTS))),
    )


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
@pytest.mark.parametrize("most_listed", [0, 10**6], ids=["bvh", "listed"])
def test_every_field_is_read_as_packed(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, most_listed: int, level: Level
) -> None:
    """Bit for bit, of every record of every kind."""
    monkeypatch.setattr(instances, "MOST_REPEATED", 0)
    scene = full_scene()
    packed = pack(scene, scene.render, 64, 64, most_listed)
    rows: dict[str, Any] = {}
    exact: dict[str, list[Table]] = {}
    for record in SCENE_RECORDS:
        words = packed.scene_records[record]
        assert len(words), record
        rows[record], exact[record] = np.arange(len(words)), [decoded(record, words)]
    numbers, words = shape_records(packed)
    flat = [kind for kind, _ in FLATS.values()]
    for kind in Kind:
        chosen = words[:, 0, 3] >> 24 == kind
        record = "Flat" if kind in flat else kind.name.capitalize()
        assert record in SHAPE_RECORDS
        assert chosen.any(), kind
        rows[record] = np.append(rows.get(record, []), numbers[chosen])
        exact.setdefault(record, []).append(decoded(record, words[chosen][:, : texel_count(RECORDS[record])]))
    (table,) = packed.tables["u_mesh_lights"]
    assert len(table) == packed.uniforms["u_mesh_light_count"] > 0
    rows["MeshLight"], exact["MeshLight"] = np.arange(len(table)), [decoded("MeshLight", table.reshape(-1, 1, 4))]
    found = read_all(ctx, packed, rows, level)
    assert set(found) == set(RECORDS)
    for record, tables in exact.items():
        check(found[record], {name: np.concatenate([t[name] for t in tables]) for name in tables[0]}, record)


def check(found: Mapping[str, Floats], exact: Mapping[str, Floats], record: str) -> None:
    assert set(found) == set(exact)
    for name, values in exact.items():
        np.testing.assert_array_equal(found[name], values, err_msg=f"{record}.{name}")


def expect(table: Mapping[str, Floats], field: str, values: Any) -> None:
    np.testing.assert_allclose(table[field], np.array(values, np.float64), rtol=2e-7, atol=1e-37, err_msg=field)


def numbers_of(packed: PackedScene, *kinds: Kind) -> Floats:
    numbers, words = shape_records(packed)
    return numbers[np.isin(words[:, 0, 3] >> 24, kinds)]


def row_of(places: Floats, place: Floats, doubt: float) -> int:
    """The one of ``places`` that is this one."""
    (row,) = np.flatnonzero(np.abs(places - place).reshape(len(places), -1).max(axis=1) <= doubt)
    return int(row)


def test_shapes_are_read_as_the_scene_has_them(ctx: moderngl.Context, stored: tuple[Scene, PackedScene, Level]) -> None:
    scene, packed, level = stored
    names = [*scene.materials, "light[0]", "light[2]"]  # the round lights become spheres of their own

    def expect_material(table: Table, row: int, shape: Shape) -> None:
        stored = 0 if isinstance(shape, tuple(FLATS)) else STORED
        assert table["material"][row] - stored == names.index(shape.material)
        culled = shape.material in scene.materials and not scene.materials[shape.material].double_sided
        assert int(table["kind"][row]) & 1 == culled
        kind, place = matte_names(scene)[0][(int(table["kind"][row]) & 0xFFFFFF) >> 1].rstrip("]").split("[")
        found = getattr(scene, f"{kind}s")[int(place)]
        assert found.position == shape.center if kind == "light" else found is shape

    of_kind: dict[type, list[Any]] = {}
    for shape in shapes_of(scene):
        of_kind.setdefault(type(shape), []).append(shape)
    planes = read(ctx, packed, "Plane", numbers_of(packed, Kind.PLANE), level)
    normals = np.array([plane_of(p)[1] for p in scene.planes])
    expect(planes, "normal", normals)
    expect(planes, "offset", (normals * (np.array([p.point for p in scene.planes]) - packed.origin)).sum(1))
    for row, plane in enumerate(scene.planes):
        expect_material(planes, row, plane)

    spheres = read(ctx, packed, "Sphere", numbers_of(packed, Kind.SPHERE), level)
    assert len(spheres["radius"]) == 7
    for sphere in of_kind[Sphere]:
        place = np.subtract(sphere.center, packed.origin)
        row = row_of(spheres["center"], place, 1e-6)
        expect({"center": spheres["center"][row]}, "center", place)
        expect({"radius": spheres["radius"][row]}, "radius", sphere.radius)
        expect_material(spheres, row, sphere)

    # Flat shapes are grown by a millionth of the scene, to close cracks.
    extent = np.abs(shape_records(packed)[1].view(np.float32)[numbers_mask(packed), :3, :3]).max()
    for kind, (number, _) in FLATS.items():
        table = read(ctx, packed, "Flat", numbers_of(packed, number), level)
        assert len(table["a"]) == len(of_kind[kind])
        corners = np.stack([table[name] for name in "abc"], axis=1)
        for shape in of_kind[kind][:100]:
            exact = corners_of(shape) - packed.origin
            row = row_of(corners, exact, 3e-6 * extent * slenderness(exact))
            assert_grown(corners[row], exact, kind, extent)
            expect_material(table, row, shape)

    materials = read(ctx, packed, "Material", np.arange(len(names)), level)
    fields = {"diffuse": "diffuse_albedo", "alpha": "alpha", "f0": "specular_f0", "f90": "specular_f90"}
    for field, source in (fields | {"emission": "emission"}).items():
        table = {field: materials[field][: len(scene.materials)]}
        expect(table, field, [getattr(m, source) for m in scene.materials.values()])
    for row, light in ((-2, scene.lights[0]), (-1, scene.lights[2])):
        expect({"emission": materials["emission"][row]}, "emission", light.surface_radiance)
        assert not materials["diffuse"][row].any()
        assert not materials["f0"][row].any()
        assert not materials["f90"][row].any()


def numbers_mask(packed: PackedScene) -> np.ndarray:
    return shape_records(packed)[1][:, 0, 3] >> 24 >= Kind.RECTANGLE


def slenderness(corners: Floats) -> float:
    """How much farther the corner of a triangle moves than its sides."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, 0), axis=1)
    area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / 2
    return float(sides.max() * sides.sum() / (2 * area))


def assert_grown(found: Floats, exact: Floats, kind: type, extent: float) -> None:
    """In its plane, and with the coordinates of its corners, but for a millionth of the scene."""
    normal = np.cross(exact[1] - exact[0], exact[2] - exact[0])
    size = np.linalg.norm(normal)
    normal /= size
    smallest_height = size / np.linalg.norm(exact - np.roll(exact, 1, 0), axis=1).max()
    turned = np.cross(found[1] - found[0], found[2] - found[0])
    np.testing.assert_allclose(turned / np.linalg.norm(turned), normal, atol=1e-6 * max(1, extent / smallest_height))
    assert np.abs((exact - found[0]) @ normal).max() < 1e-6 * extent
    rows = np.linalg.pinv(np.stack([found[1] - found[0], found[2] - found[0]], axis=1))
    coordinates = (exact - found[0]) @ rows.T
    assert (np.abs(coordinates - [(0, 0), (1, 0), (0, 1)]).max() <= 5e-6 * extent / smallest_height).all()


def test_every_emitter_is_a_light_and_they_know_each_other(
    ctx: moderngl.Context, stored: tuple[Scene, PackedScene, Level]
) -> None:
    scene, packed, level = stored
    count = packed.uniforms["u_light_count"]
    choices = read(ctx, packed, "LightChoice", np.arange(count), level)
    spheres = [*scene.spheres, scene.lights[0], scene.lights[2]]
    shapes = [*spheres, *(s for kind in SHAPES if kind not in ("planes", "spheres") for s in getattr(scene, kind))]
    emitting = [s for s in shapes if s in scene.lights or scene.materials[s.material].is_emissive]
    own = [light for kind in LIGHTS for light in getattr(scene, kind) if light not in spheres]
    assert count == len(emitting) + len(own)
    kinds = [LightKind.SPHERE if isinstance(s, Sphere | Light) else LightKind.AREA for s in emitting]
    nouns = [type(light).__name__.removesuffix("Light").upper() or "POINT" for light in own]
    every = [*kinds, *(LightKind[noun] for noun in nouns)]
    number_of = light_numbers(packed)
    numbers_of_lights = [number_of[kind, every[:i].count(kind)] for i, kind in enumerate(every)]
    assert sorted(numbers_of_lights) == list(range(count))
    assert (choices["probability"] > 0).all()
    assert choices["probability"].sum() == 1
    np.testing.assert_array_equal(choices["cumulative"], np.cumsum(choices["probability"]) - choices["probability"])

    of_spheres = read(ctx, packed, "SphereLight", np.arange(kinds.count(LightKind.SPHERE)), level)
    of_areas = read(ctx, packed, "AreaLight", np.arange(kinds.count(LightKind.AREA)), level)
    numbers, words = shape_records(packed)
    back = {}  # the shape of each light
    for kind in Kind:
        if kind in {kind_of(shape) for shape in shapes_of(scene)} - {Kind.PLANE}:
            chosen = words[:, 0, 3] >> 24 == kind
            table = read(ctx, packed, "Sphere" if kind == Kind.SPHERE else "Flat", numbers[chosen], level)
            lights = table["light"].astype(int) - (STORED if kind == Kind.SPHERE else 0)
            for number, light in zip(numbers[chosen], lights, strict=True):
                if light > 0:
                    assert light - 1 not in back
                    back[light - 1] = (number, kind)
    assert sorted(back) == sorted(numbers_of_lights[: len(emitting)])

    for i, shape, kind in zip(numbers_of_lights, emitting, kinds, strict=False):
        table = of_spheres if kind == LightKind.SPHERE else of_areas
        one = {field: values[int(choices["record"][i])] for field, values in table.items()}
        radiance = shape.surface_radiance if shape in scene.lights else scene.materials[shape.material].emission
        expect(one, "radiance", radiance)
        record, record_kind = back[i]
        assert one["primitive"] == record
        if kind == LightKind.SPHERE:
            assert record_kind == Kind.SPHERE
            expect(one, "radius", shape.radius)
            center = shape.position if isinstance(shape, Light) else shape.center
            expect(one, "center", np.subtract(center, packed.origin))
            continue
        assert one["kind"] == record_kind == kind_of(shape)
        corner, u, v = corners_of(shape)
        expect(one, "a", corner - packed.origin)
        np.testing.assert_allclose(one["edge_u"], u - corner, rtol=2e-7, atol=1e-12)
        np.testing.assert_allclose(one["edge_v"], v - corner, rtol=2e-7, atol=1e-12)
        expect(one, "area", shape.area)
        np.testing.assert_allclose(one["normal"], plane_of(shape)[1], rtol=2e-7, atol=1e-12)

    point = read(ctx, packed, "PointLight", [0], level)
    expect(point, "intensity", [scene.lights[1].intensity])
    expect(point, "position", [np.subtract(scene.lights[1].position, packed.origin)])
    (lamp,), spot = scene.spot_lights, read(ctx, packed, "SpotLight", [0], level)
    assert isinstance(lamp, SpotLight)
    expect(spot, "position", [np.subtract(lamp.position, packed.origin)])
    expect(spot, "intensity", [lamp.intensity])
    np.testing.assert_allclose(spot["direction"][0], lamp.direction / np.linalg.norm(lamp.direction), rtol=2e-7)
    (far,), parallel = scene.directional_lights, read(ctx, packed, "DirectionalLight", [0], level)
    assert isinstance(far, DirectionalLight)
    np.testing.assert_allclose(parallel["wi"][0], -np.array(far.direction) / np.linalg.norm(far.direction), rtol=2e-7)
    expect(parallel, "irradiance", [far.irradiance])


def test_attributes_of_vertices_are_read_as_packed(ctx: moderngl.Context) -> None:
    """A table of each kind, one after the other, over more than a row of the texture."""
    rng = np.random.default_rng(2)
    points, triangles = ball(100, 50)
    size = len(points)
    image = Image(np.zeros((1, 1, 3), np.uint8))
    attributes = {
        "normals": points,
        "uvs": rng.random((size, 2)),
        "uvs_1": rng.random((size, 2)),
        "tangents": np.column_stack([np.roll(points, 1, axis=1), np.ones(size)]),
        "colors": rng.random((size, 4)),
    }
    whole = geometry((points, triangles), **attributes)
    materials = {"m": Material(normal_texture=Texture(image))}
    scene = Scene(materials=materials, meshes=(Mesh((Part(whole, "m"),)),), camera=camera_on(1.0, 0.0))
    packed = pack(scene, scene.render, 64, 64)
    assert size > 4096
    expected = {
        "normal": points / np.linalg.norm(points, axis=1, keepdims=True),
        "uv": np.column_stack([attributes["uvs"], attributes["uvs_1"]]),
        "tangent": attributes["tangents"],
        "color": attributes["colors"],
    }
    for level in (Level.NOTHING, Level.SCENE):
        for name, values in expected.items():
            has = f"vertices_have(ATTRIBUTE_{name.upper()})"
            body = f"value = {has} ? vertex_texel(u_first_{name} + int(row)) : vec4(-9.0);"
            found = scene_probe(ctx, packed, SCENE, body, {"row": np.arange(size)}, {"value": 4}, level)["value"]
            np.testing.assert_allclose(found[:, : values.shape[1]], values, atol=1e-6, err_msg=name)
