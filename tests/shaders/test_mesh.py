# SPDX-License-Identifier: MIT
"""shape/bvh.glsl with meshes: against float64, against trying every triangle, and where neighbours meet."""

from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest
from mesh_shapes import Arrays, ball, field, geometry, mesh_scene, smooth, soup
from rendering import Planter

from fragtracer.apps.bench import meshes as bench_meshes
from fragtracer.packing import PackedScene, hierarchy, instances, pack
from fragtracer.scene import Geometry, Material, Mesh, Part, Placement, Plane, Scene, Sphere

from . import Floats, shape_oracle
from .directions import random_directions
from .scene_probe import camera_on, scene_probe, shape_records, triangles_of

MISS = 1e30
SCENE = ["shape/intersect.glsl"]
TRACE = """
    Hit hit = scene_intersect(Ray(o, d), farthest, int(skipped), any_hit > 0.5);
    t = hit.distance;
    k = float(hit.primitive);
"""
SEARCH = """
    t = farthest;
    k = -1.0;
    BvhRay ray = bvh_ray(o, d);
    for (int record = int(first); record < int(end); record++) {
        if (shape_texel(record, 0).w >> 24u != KIND_TRIANGLE) continue;
        Triangle other = triangle_load(record);
        bool inside;
        float found = triangle_intersect(other.a, other.b, other.c, ray, inside).x;
        if (inside && found < t && record != int(skipped)) { t = found; k = float(record); }
    }
"""
# A scale, and a shift in units of it.
PLACES = [(1.0, 0.0), (1e-3, 50.0), (1e4, 5.0)]


def packed_mesh(arrays: Arrays, scale: float = 1.0, shift: float = 0.0, **fields: object) -> PackedScene:
    scene = mesh_scene(
        geometry((scale * (arrays[0] + shift), arrays[1])), camera=camera_on(scale, shift * scale), **fields
    )
    return pack(scene, scene.render, 64, 64)


def trace(
    ctx: moderngl.Context,
    packed: PackedScene,
    origin: Floats,
    direction: Floats,
    farthest: float | Floats = MISS,
    skipped: float | Floats = -1.0,
    any_hit: bool = False,
    body: str = TRACE,
    only: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Distance, and the record that was met or -1; the body SEARCH may try ``only`` one record for each ray."""
    numbers, _ = shape_records(packed)
    rows = np.ones(len(origin))
    inputs = {"o": origin, "d": direction, "farthest": farthest * rows, "skipped": skipped * rows}
    inputs |= {"any_hit": any_hit * rows}
    if body == SEARCH:
        first, end = (numbers.min() * rows, (numbers.max() + 1) * rows) if only is None else (only, only + 1)
        inputs |= {"first": first, "end": end}
    result = scene_probe(ctx, packed, SCENE, body, inputs, {"t": 1, "k": 1})
    return result["t"], result["k"].astype(int)


def rays(kind: str, vertices: Floats, count: int, seed: int = 1) -> tuple[Floats, Floats]:
    """Float32 origins and unit directions towards triangles (n, 3, 3)."""
    rng = np.random.default_rng(seed)
    extent = np.ptp(vertices.reshape(-1, 3), axis=0).max()
    chosen = vertices[rng.integers(0, len(vertices), count)]
    weights = rng.dirichlet([1, 1, 1], count)
    away = random_directions(rng, count).astype(np.float64)
    match kind:
        case "vertices":
            weights = np.eye(3)[rng.integers(0, 3, count)]
        case "edges":
            weights[np.arange(count), rng.integers(0, 3, count)] = 0
            weights /= weights.sum(axis=1, keepdims=True)
        case "grazing":
            normal = np.cross(chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0])
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            slope = (away * normal).sum(axis=1, keepdims=True)
            away += (slope * 10 ** rng.uniform(-5, -1, (count, 1)) - slope) * normal
        case "axis-parallel":
            away = np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1.0, 1.0], (count, 1))
            weights = np.eye(3)[rng.integers(0, 3, count)]  # the ray runs within sides of boxes
        case "axis planes":
            away[np.arange(count), rng.integers(0, 3, count)] = 0
    target = (weights[..., None] * chosen).sum(axis=1)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    origin = (target + away * extent * rng.uniform(0.01, 2, (count, 1))).astype(np.float32)
    if kind == "axis-parallel":
        return origin.astype(np.float64), -away
    direction = target - origin
    if kind == "axis planes":
        direction[away == 0] = 0
    return origin.astype(np.float64), direction / np.linalg.norm(direction, axis=1, keepdims=True)


KINDS = ["anywhere", "vertices", "edges", "grazing", "axis-parallel", "axis planes"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("scale", "shift"), PLACES)
def test_closest_hit(ctx: moderngl.Context, scale: float, shift: float, kind: str) -> None:
    """No triangle that rays surely meet is missed, and none is met that they surely miss."""
    packed = packed_mesh(soup(250, size=0.4), scale, shift)
    place, vertices = triangles_of(packed)
    origin, direction = rays(kind, vertices, 4096)
    t, k = trace(ctx, packed, origin, direction)

    extent = np.abs(np.concatenate([vertices.reshape(-1, 3), origin])).max()
    doubt = 3e-6 * extent
    corners = vertices[:, None]
    normal = unit(np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]))
    # What is not known of the ray, along the triangle and along itself.
    slack = doubt / np.maximum(np.abs(np.einsum("...x,...x->...", normal, direction)), 1e-9)
    distance, margin = shape_oracle.triangle_margin(corners, origin, direction)
    larger, smaller = (np.where(margin >= -e, distance, np.inf) for e in (slack, -slack))
    closest = (smaller + slack).min(axis=0)
    sure = np.isfinite(closest)
    assert (k[sure] >= 0).all()
    assert (t <= closest)[sure].all()
    hit = k >= 0
    assert (t[~hit] == np.float32(MISS)).all()
    row = np.full(place.max() + 1, -1)
    row[place] = np.arange(len(place))
    there = (larger - slack)[row[k[hit]], np.flatnonzero(hit)]
    assert (there <= t[hit]).all()
    assert hit.mean() > (0.9 if kind in ("anywhere", "axis-parallel") else 0.4)


@pytest.mark.parametrize("name", ["soup", "field", "ball", "leaf"])
def test_traversal_finds_what_trying_every_triangle_finds(ctx: moderngl.Context, name: str) -> None:
    arrays = {"soup": soup(700), "field": field(20), "ball": ball(), "leaf": soup(2, size=1.0)}[name]
    packed = packed_mesh(arrays)
    _, vertices = triangles_of(packed)
    for seed, kind in enumerate(KINDS):
        origin, direction = rays(kind, vertices, 2048, seed)
        t, k = trace(ctx, packed, origin, direction)
        every_t, every_k = trace(ctx, packed, origin, direction, body=SEARCH)
        np.testing.assert_array_equal(t, every_t)
        np.testing.assert_array_equal(k < 0, every_k < 0)
        # Where two are met at the same distance, either is right: the one found is met at that distance.
        hit = k >= 0
        alone = trace(ctx, packed, origin[hit], direction[hit], body=SEARCH, only=k[hit])
        np.testing.assert_array_equal(alone, (t[hit], k[hit]))
        # Passing over what was met, and no further than it.
        np.testing.assert_array_equal(
            trace(ctx, packed, origin, direction, MISS, k)[0],
            trace(ctx, packed, origin, direction, MISS, k, body=SEARCH)[0],
        )
        for share in (0.5, 1.0, 1.5):
            farthest = np.minimum(share * t, MISS)
            found = trace(ctx, packed, origin, direction, farthest, any_hit=True)[1] >= 0
            np.testing.assert_array_equal(found, every_t < farthest.astype(np.float32))


def test_any_hit_and_closest_hit_among_other_shapes(ctx: moderngl.Context) -> None:
    scene = mesh_scene(
        smooth(ball()),
        spheres=(Sphere((0.5, 0.2, 0.1), 0.8, "mesh"),),
        planes=(Plane((0.0, -0.5, 0.0), (0.1, 1.0, 0.0), "mesh"),),
    )
    both = pack(scene, scene.render, 64, 64)
    others = pack(replace(scene, meshes=()), scene.render, 64, 64)
    mesh = pack(replace(scene, spheres=(), planes=()), scene.render, 64, 64)
    rng = np.random.default_rng(3)
    origin, direction = rng.uniform(-2, 2, (8192, 3)).astype(np.float32), random_directions(rng, 8192)

    def distance(packed: PackedScene, any_hit: bool = False, farthest: float = MISS) -> Floats:
        body = "t = scene_intersect(Ray(o, d), farthest, NO_PRIMITIVE, any_hit > 0.5).distance;"
        inputs = {"o": origin + scene_origin(packed), "d": direction, "any_hit": np.full(8192, any_hit)}
        return scene_probe(ctx, packed, SCENE, body, inputs | {"farthest": np.full(8192, farthest)}, {"t": 1})["t"]

    def scene_origin(packed: PackedScene) -> Floats:
        return (both.origin - packed.origin).astype(np.float32)

    expected = np.minimum(distance(others), distance(mesh))
    np.testing.assert_allclose(distance(both), expected, rtol=2e-4, atol=1e-5)
    np.testing.assert_array_equal(distance(both, True, 1.0) < 1, distance(both) < 1)


@pytest.mark.parametrize(("scale", "shift"), PLACES)
def test_nothing_leaks_through_a_closed_mesh(ctx: moderngl.Context, scale: float, shift: float) -> None:
    """From inside, at vertices, edges and anywhere, along axes too."""
    packed = packed_mesh(ball(48, 24), scale, shift)
    _, vertices = triangles_of(packed)
    middle = (vertices.max(axis=(0, 1)) + vertices.min(axis=(0, 1))) / 2
    rng = np.random.default_rng(1)
    for kind in ("anywhere", "vertices", "edges", "axis-parallel"):
        origin, direction = rays(kind, vertices, 1 << 15)
        if kind == "axis-parallel":  # from between two vertices that the ray passes exactly
            origin -= direction * ((origin - middle) * direction).sum(axis=1, keepdims=True)
            origin = origin.astype(np.float32).astype(np.float64)
        else:
            target = origin + direction * trace(ctx, packed, origin, direction)[0][:, None]
            origin = (middle + 0.6 * scale * rng.uniform(-1, 1, (1 << 15, 3))).astype(np.float32).astype(np.float64)
            direction = target - origin
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        inside = np.linalg.norm(origin - middle, axis=1) < 0.97 * scale
        _, k = trace(ctx, packed, origin, direction)
        assert (k[inside] >= 0).all(), f"{kind}: {(k[inside] < 0).sum()} of {inside.sum()}"
        assert inside.mean() > 0.5


def test_nothing_leaks_through_a_grid(ctx: moderngl.Context) -> None:
    """Straight down and slanting, exactly on the vertices and along the edges of a flat grid."""
    points, triangles = field(64)
    packed = packed_mesh((points * [1, 0, 1], triangles))
    _, vertices = triangles_of(packed)
    inner = vertices.reshape(-1, 3)
    inner = inner[np.abs(points).max() - np.abs(inner + packed.origin)[:, [0, 2]].max(axis=1) > 0.01]
    for slant in ((0, 0, 0), (0.25, 0, 0), (0, 0, -0.5), (0.3, 0, 0.7)):
        away = np.array([0, 1, 0]) + slant
        origin = (inner + away).astype(np.float32).astype(np.float64)
        direction = np.broadcast_to(-away / np.linalg.norm(away), origin.shape)
        assert (trace(ctx, packed, origin, direction)[1] >= 0).all()


@pytest.mark.parametrize("contracts", [False, True])
def test_triangles_without_area_are_never_met_and_make_no_nan(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, contracts: bool
) -> None:
    """Also where a driver ``contracts`` a product and a difference, so that the sides of a triangle are no longer
    rounded alike."""
    if contracts:
        product = "(first + 1e-7 * vec3(1.0, 0.0, -1.0) * first)"
        Planter(monkeypatch, tmp_path, ["probe"])("shape/triangle.glsl", "first - second", f"{product} - second")
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-1, 1, (2, 200, 3))
    third = np.concatenate([a[:50], b[50:100], ((a + b) / 2)[100:150], a[150:]])
    b[150:] = a[150:]
    points = np.stack([a, b, third], axis=1).astype(np.float32).astype(np.float64)
    exact = np.concatenate([points[:100], points[150:]])  # whose sides run exactly into each other
    packed = packed_mesh((exact.reshape(-1, 3), np.arange(len(exact) * 3).reshape(-1, 3)))
    _, vertices = triangles_of(packed)
    for kind in ("vertices", "edges"):
        weights = {"vertices": [1.0, 0, 0], "edges": [0.5, 0.5, 0]}[kind]
        target = np.einsum("nvx,v->nx", vertices, weights).repeat(50, axis=0)
        origin = (target + random_directions(rng, len(target))).astype(np.float32).astype(np.float64)
        direction = target - origin
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        t, k = trace(ctx, packed, origin, direction)
        assert (k == -1).all()
        assert (t == np.float32(MISS)).all()


def test_huge_and_tiny_triangles_together(ctx: moderngl.Context) -> None:
    """A ball of a millimetre on a ground of ten kilometres, seen from close by."""
    ground = np.array([[-1e4, 0, -1e4], [0, 0, 1e4], [1e4, 0, -1e4]])
    points, triangles = ball(16, 8)
    small = 1e-3 * points + [0, 2e-3, 0]
    scene = mesh_scene(geometry((ground, np.array([[0, 1, 2]]))), geometry((small, triangles)))
    packed = pack(replace(scene, camera=camera_on(1e-2, 0.0)), scene.render, 64, 64)
    rng = np.random.default_rng(1)
    direction = random_directions(rng, 4096).astype(np.float64)
    origin = np.broadcast_to(np.array([0, 2e-3, 0]) - packed.origin, (4096, 3)).astype(np.float32).astype(np.float64)
    t, k = trace(ctx, packed, origin, direction)
    assert (k >= 0).all()
    reach = np.abs(triangles_of(packed)[1]).max() * 3e-7  # what float32 knows of places that far off
    assert (np.abs(t - 1e-3) < 1e-3 + reach).all()


SURFACE = """
    Hit hit = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false);
    Surface s = surface_at(Ray(o, d), hit);
    place = vec4(s.position, float(hit.primitive == NO_PRIMITIVE ? -1 : s.material));
    normal = vec4(s.normal, s.extent);
    shading = s.shading_normal;
    uvs = s.uv;
    tangent = s.tangent;
    color = s.color;
"""
SURFACES = {"place": 4, "normal": 4, "shading": 3, "uvs": 4, "tangent": 4, "color": 4}


def decorated(outward: float = 1.0) -> Geometry:
    """A ball with every attribute, none of them regular; ``outward`` is 1, or −1 where its normals point inwards."""
    points, triangles = ball(12, 6)
    rng = np.random.default_rng(2)
    size = len(points)
    return Geometry(
        points + 0.3,
        triangles,
        normals=outward * (points + 0.2 * rng.normal(size=(size, 3))),
        uvs=rng.random((size, 2)),
        uvs_1=rng.random((size, 2)),
        tangents=np.column_stack([random_directions(rng, size), np.full(size, -1.0)]),
        colors=rng.random((size, 4)),
    )


def placed_scene() -> Scene:
    """Copies that are turned, stretched, mirrored, each of two materials; every attribute is asked for. The normals of
    the second are at odds with its triangles."""
    from fragtracer.scene import Image, Texture

    image = Image(np.zeros((1, 1, 3), np.uint8))
    materials = {
        "bumpy": Material(normal_texture=Texture(image), albedo_texture=Texture(image, coordinates=1)),
        "other": Material(),
    }
    placements = (
        Placement((0.0, 0.0, 0.0)),
        Placement((4.0, 0.0, 1.0), (10.0, 50.0, -70.0), (1.0, 0.5, 0.8)),
        Placement((-4.0, 0.5, 0.0), (100.0, 0.0, 30.0), (-0.7, 1.2, 0.9)),
    )
    move = ((1.0, 0.3, 0.0, 0.0), (0.0, 1.0, 0.0, 4.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    parts = (Part(decorated(), "bumpy"), Part(decorated(outward=-1.0), "other", move))
    return Scene(materials=materials, meshes=(Mesh(parts, placements),), camera=camera_on(5.0, 0.0))


@pytest.mark.parametrize("most_repeated", [10**6, 0], ids=["one space", "instances"])
def test_surface(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, most_repeated: int) -> None:
    """Attributes at a hit, against the matrices and weights of float64, through mirrors and shears."""
    monkeypatch.setattr(instances, "MOST_REPEATED", most_repeated)
    hierarchy.pack_bvh.cache_clear()
    scene = placed_scene()
    packed = pack(scene, scene.render, 64, 64)
    hierarchy.pack_bvh.cache_clear()
    assert packed.features["HAS_INSTANCES"] == (most_repeated == 0)
    copies = [(matrix, part) for matrix, part in scene.meshes[0].placed()]
    rng = np.random.default_rng(5)
    for matrix, part in copies:
        g = part.geometry
        linear, move = matrix[:3, :3], matrix[:3, 3] - packed.origin
        chosen = g.triangles[rng.integers(0, len(g.triangles), 500)]
        weights = rng.dirichlet([2, 2, 2], 500)
        corners = g.positions[chosen] @ linear.T + move
        target = np.einsum("nv,nvx->nx", weights, corners)
        covector = np.linalg.inv(linear)  # rows times this: normals
        a, b, c = g.positions[chosen].swapaxes(0, 1)
        normal = unit(np.cross(b - a, c - a) @ covector)
        origin = (target + 0.05 * normal).astype(np.float32)  # from outside, nothing else in between
        inputs = {"o": origin, "d": unit(target - origin)}
        found = scene_probe(ctx, packed, SCENE, SURFACE, inputs, SURFACES)
        np.testing.assert_allclose(found["place"][:, :3], target, atol=1e-5)
        assert (found["place"][:, 3] == list(scene.materials).index(part.material)).all()
        np.testing.assert_allclose(found["normal"][:, :3], normal, atol=2e-5)
        assert (found["normal"][:, 3] >= np.abs(corners).max(axis=(1, 2)) * 0.999).all()

        def mixed(values: np.ndarray, chosen: np.ndarray = chosen, weights: Floats = weights) -> Floats:
            return np.einsum("nv,nvx->nx", weights, values[chosen].astype(np.float64))

        shading = unit(mixed(unit(g.normals @ covector)))
        shading *= np.sign((shading * normal).sum(axis=1, keepdims=True))
        if most_repeated == 0:  # mixed before the matrix, not after
            assert ((shading * found["shading"]).sum(axis=1) > 0.9).all()
        else:
            np.testing.assert_allclose(found["shading"], shading, atol=1e-4)
            tangent = unit(mixed(unit(g.tangents[:, :3] @ linear.T)))
            np.testing.assert_allclose(found["tangent"][:, :3], tangent, atol=1e-3)
        assert (found["tangent"][:, 3] == (-1 if np.linalg.det(linear) > 0 else 1)).all()
        np.testing.assert_allclose(found["uvs"], np.column_stack([mixed(g.uvs), mixed(g.uvs_1)]), atol=2e-4)
        np.testing.assert_allclose(found["color"], mixed(g.colors), atol=2e-4)


KNOT, BALL = bench_meshes.knot(70_000), geometry(ball())
CROWD = (
    Placement(),
    Placement((2.5, 0.3, 0.0), (20.0, 40.0, 60.0), (0.7, 1.2, -0.5)),  # mirrored
    Placement((-2.5, 0.0, 1.0), (0.0, 90.0, 10.0), (0.005, 0.005, 0.005)),
)


@pytest.mark.parametrize(("part", "placements"), [(KNOT, CROWD[:1]), (BALL, CROWD)], ids=["70k triangles", "instances"])
def test_no_triangle_is_missed(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, part: Geometry, placements: tuple[Placement, ...]
) -> None:
    """A short ray to every triangle, from just outside of it, meets the triangle or something before it."""
    scene = mesh_scene(meshes=(Mesh((Part(part, "mesh"),), placements),))
    monkeypatch.setattr(instances, "MOST_REPEATED", 0)
    hierarchy.pack_bvh.cache_clear()
    packed = pack(scene, scene.render, 64, 64)
    hierarchy.pack_bvh.cache_clear()
    assert packed.features["HAS_INSTANCES"] == (len(placements) > 1)
    corners = np.concatenate(
        [
            (part.geometry.positions[part.geometry.triangles] @ matrix[:3, :3].T + matrix[:3, 3])
            for mesh in scene.meshes
            for matrix, part in mesh.placed()
        ]
    )
    sides = corners[:, 1:] - corners[:, :1]
    size = np.linalg.norm(sides, axis=2).max(axis=1, keepdims=True)
    normal = unit(np.cross(sides[:, 0], sides[:, 1]))
    height = np.maximum(0.05 * size, 2e-4 * size.max())
    start = corners.mean(axis=1) + height * normal - packed.origin
    t, k = trace(ctx, packed, start.astype(np.float32), -normal.astype(np.float32))
    assert (k >= 0).all()
    excess = t / height[:, 0] - 1
    assert excess.max() < 0.05, np.flatnonzero(excess >= 0.05)
    assert (excess > -0.05).mean() > 0.9


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.mark.parametrize("most_repeated", [10**6, 0], ids=["one space", "instances"])
def test_one_sided_triangles_are_not_there_from_behind(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, most_repeated: int
) -> None:
    monkeypatch.setattr(instances, "MOST_REPEATED", most_repeated)
    hierarchy.pack_bvh.cache_clear()
    g = geometry(ball())
    materials = {"one": Material(double_sided=False), "two": Material()}
    places = (Placement((0.0, 0.0, 0.0)), Placement((3.0, 0.0, 0.0), scale=(-1.0, 1.0, 1.0)))
    scene = Scene(
        materials=materials,
        meshes=(Mesh((Part(g, "one"),), places), Mesh((Part(g, "two"),), (Placement((6.0, 0.0, 0.0)),))),
    )
    packed = pack(scene, scene.render, 64, 64)
    hierarchy.pack_bvh.cache_clear()
    assert packed.features["HAS_INSTANCES"] == (most_repeated == 0)
    rng = np.random.default_rng(1)
    direction = random_directions(rng, 1000)
    for x, is_there in ((0.0, False), (3.0, False), (6.0, True)):
        middle = np.array([x, 0, 0]) - packed.origin
        outside = middle - 1.3 * direction
        # 0.3 to the front; from within, only a ball of two sides is met before another one.
        t, _ = trace(ctx, packed, outside, direction)
        assert (np.abs(t - 0.32) < 0.05).all()
        t, _ = trace(ctx, packed, np.broadcast_to(middle, direction.shape), direction, 1.2)
        assert ((t < 1.1) == is_there).all()
