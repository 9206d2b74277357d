# SPDX-License-Identifier: MIT
"""shape/intersect.glsl, shape.glsl, bvh.glsl and ray.glsl against all shapes one by one in float64."""

from dataclasses import replace
from functools import lru_cache

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu.specialise import Level
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.shapes import Kind
from fragtracer.scene import Camera, Disk, Material, Plane, Rectangle, Scene, Sphere, Triangle

from . import Floats, shape_oracle
from .directions import random_directions
from .scene_oracle import bounds, corners_of, is_culled, kind_of, plane_of, shapes_of
from .scene_probe import camera_on, random_scene, scene_probe, shape_records

COUNT = 1 << 12
MISS = 1e30
SCENE = ["shape/intersect.glsl"]
# Triangles, the most shapes of the short list, and how much is compiled in: the ways a scene is stored.
STORAGES = {
    "listed": (12, 10**6, Level.NOTHING),
    "listed, many": (300, 10**6, Level.NOTHING),
    "bvh": (12, 0, Level.NOTHING),
    "bvh, many": (300, 0, Level.NOTHING),
    "bvh, compiled in": (12, 0, Level.SCENE),
    "compiled in": (12, 10**6, Level.SCENE),
}
SCALES = [1e-3, 1.0, 1e4]
INTERSECT = (
    "Hit hit = scene_intersect(Ray(o, d), farthest, int(skipped), false); t = hit.distance; k = float(hit.primitive);"
)


def shape_numbers(scene: Scene, packed: PackedScene) -> NDArray[np.int64]:
    """The number of the shape (of shapes_of) of each record of u_shapes, -1 where that is no shape; each has one."""
    numbers, words = shape_records(packed)
    is_shape = words[:, 0, 3] >> 24 >= Kind.PLANE
    record, words = numbers[is_shape], words[is_shape]
    kinds, points = words[:, 0, 3] >> 24, words.view(np.float32)[:, :3, :3].astype(np.float64)
    flats = points[kinds >= Kind.RECTANGLE]
    middles = incenter(np.where((kinds == Kind.SINGLE_TRIANGLE)[:, None, None], points, np.eye(3)))
    near = 3e-6 * np.abs(flats).max(initial=0)  # by which flat shapes grow, and float32 rounds
    result = np.full(numbers.max() + 1, -1)
    for i, shape in enumerate(shapes_of(scene)):
        match shape:
            case Plane():
                there = np.abs(points[:, 0] - plane_of(shape)[1]).max(axis=1) < 1e-6
            case Sphere():
                place = np.subtract(shape.center, packed.origin)
                there = np.abs(points[:, 0] - place).max(axis=1) <= 1e-7 * np.abs(place).max()
            case Triangle():
                middle = incenter(corners_of(shape)) - packed.origin
                there = np.abs(middles - middle).max(axis=1) < near
            case _:
                there = np.abs(points[:, 0] - corners_of(shape)[0] + packed.origin).max(axis=1) < near
        there &= kinds == kind_of(shape)
        assert there.sum() == 1, shape
        result[record[there]] = i
    return result


def incenter(vertices: Floats) -> Floats:
    """Of triangles (..., 3, 3): it stays as they grow."""
    sides = np.linalg.norm(np.roll(vertices, -1, -2) - np.roll(vertices, -2, -2), axis=-1)
    middle: Floats = np.einsum("...v,...vx->...x", sides, vertices) / sides.sum(-1)[..., None]
    return middle


def crossing(triangles: int, scale: float, culled: bool) -> Scene:
    return random_scene(12, triangles, scale, 3 * scale, culled)


def crossing_rays(scale: float) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(1)
    local = (2 * scale * rng.normal(size=(COUNT, 3))).astype(np.float32)
    return local, random_directions(rng, COUNT).astype(np.float64)


@lru_cache(maxsize=4)
def all_bounds(triangles: int, scale: float, culled: bool, place: tuple[float, float, float]) -> tuple[Floats, Floats]:
    """Of each shape for each ray, (shapes, rays), with the origin of the rays at a ``place`` of the scene."""
    scene, (local, direction) = crossing(triangles, scale, culled), crossing_rays(scale)
    # Coordinates reach some 10 scales, of which float32 keeps 1e-7, and shapes are grown by 1e-6.
    origin, doubt = local.astype(np.float64) + place, 3e-5 * scale
    each = [bounds(s, origin, direction, doubt, is_culled(scene, s)) for s in shapes_of(scene)]
    low, high = (np.stack(b) for b in zip(*each, strict=True))
    return low, high


# Of the smallest and the largest scale, which decides over nothing but rounding, each storage with and without shapes
# that are culled in one of the two.
CLOSEST = [
    (storage, scale, culled)
    for i, scale in enumerate(SCALES)
    for j, storage in enumerate(STORAGES)
    for culled in (False, True)
    if scale == 1.0 or culled == (j % 2 == i // 2)
]


@pytest.mark.parametrize(("storage", "scale", "culled"), CLOSEST)
def test_closest_hit(ctx: moderngl.Context, storage: str, scale: float, culled: bool) -> None:
    """Of all shapes, of all but the one that was hit, and nearer or farther than that."""
    triangles, most_listed, level = STORAGES[storage]
    scene = crossing(triangles, scale, culled)
    packed = pack(scene, scene.render, 64, 64, most_listed)
    assert (packed.uniforms["u_bvh_root"] >= 0) == (most_listed == 0)
    rows, (local, direction) = np.arange(COUNT), crossing_rays(scale)
    low, high = (exact.copy() for exact in all_bounds(triangles, scale, culled, tuple(packed.origin.tolist())))
    number = shape_numbers(scene, packed)

    def trace(skipped: Floats, farthest: Floats) -> tuple[Floats, Floats]:
        inputs = {"o": local, "d": direction, "skipped": skipped, "farthest": farthest}
        result = scene_probe(ctx, packed, SCENE, INTERSECT, inputs, {"t": 1, "k": 1}, level)
        return result["t"], result["k"].astype(int)

    def check(t: Floats, record: Floats, low: Floats, high: Floats) -> None:
        closest = high.min(axis=0)
        hit = record >= 0
        k = number[record]
        assert (k[hit] >= 0).all()
        assert hit[np.isfinite(closest)].all()
        assert (t[~hit] == np.float32(MISS)).all()
        found = low[k, rows]
        assert (t <= closest)[hit].all()
        assert (t >= found)[hit].all()
        candidates = (low <= closest).sum(axis=0)
        only = np.isfinite(closest) & (candidates == 1)
        np.testing.assert_array_equal(k[only], low.argmin(axis=0)[only])
        assert only.sum() > 0.95 * hit.sum() > 0.3 * COUNT

    nobody, anywhere = np.full(COUNT, -1.0), np.full(COUNT, MISS)
    t, record = trace(nobody, anywhere)
    check(t, record, low, high)

    hit, k = record >= 0, number[record]
    low[k[hit], rows[hit]] = high[k[hit], rows[hit]] = np.inf
    check(*trace(record.astype(np.float64), anywhere), low, high)

    before, behind = np.where(hit, 0.999 * t, 1.0), np.where(hit, 1.001 * t, MISS)
    near_t, near_record = trace(nobody, before)
    assert (near_record[hit] == -1).all()
    np.testing.assert_array_equal(near_t[hit], before[hit].astype(np.float32))
    far_t, far_record = trace(nobody, behind)
    np.testing.assert_array_equal(far_record, record)
    np.testing.assert_array_equal(far_t[hit], t[hit])


# Each shape of the BVH by itself, by the function that the traversal uses.
SEARCH = """
    t = farthest;
    k = -1.0;
    BvhRay ray = bvh_ray(o, d);
    for (int record = int(first); record < int(end); record++) {
        uvec4 t0 = shape_texel(record, 0);
        uvec4 t1 = shape_texel(record, 1);
        uvec4 t2 = shape_texel(record, 2);
        vec2 barycentrics;
        bool front;
        float found = shape_intersect(t0, t1, t2, ray, barycentrics, front);
        bool there = front || (t0.w & SHAPE_CULLED) == 0u;
        if (found < t && there && record != int(skipped)) { t = found; k = float(record); }
    }
"""


@pytest.mark.parametrize("culled", [False, True])
@pytest.mark.parametrize("count", [1, 30, 700])
@pytest.mark.parametrize("scale", SCALES)
def test_traversal_finds_what_trying_every_shape_finds(
    ctx: moderngl.Context, scale: float, count: int, culled: bool
) -> None:
    """Bit for bit; spheres, rectangles, disks and triangles."""
    scene = replace(random_scene(4, count, scale, 3 * scale, culled), planes=())
    rng = np.random.default_rng(count)
    if count == 700:  # small ones, so that some boxes hold few of them
        small = [(3 * scale * rng.normal(size=3) + 3 * scale, 0.1 * scale * rng.random()) for _ in range(count)]
        names = [str(name) for name in rng.choice([*scene.materials], count)]
        balls = tuple(Sphere(p, r, name) for (p, r), name in zip(small, names, strict=True))
        disks = tuple(Disk(p[::-1], p - 3 * scale, r, name) for (p, r), name in zip(small, names, strict=True))
        scene = replace(scene, spheres=balls, disks=disks)
    packed = pack(scene, scene.render, 64, 64, 0)
    numbers, _ = shape_records(packed)
    local = (2 * scale * rng.normal(size=(COUNT, 3))).astype(np.float32)
    towards = 3 * scale + scale * rng.normal(size=(COUNT, 3)) - packed.origin - local
    direction = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    direction[: COUNT // 4] = np.eye(3)[rng.integers(0, 3, COUNT // 4)] * rng.choice([-1, 1], (COUNT // 4, 1))
    every = np.ones(COUNT)

    def trace(body: str, farthest: Floats, skipped: Floats, **inputs: Floats) -> tuple[Floats, Floats]:
        inputs |= {"o": local, "d": direction, "skipped": skipped, "farthest": farthest}
        result = scene_probe(ctx, packed, SCENE, body, inputs, {"t": 1, "k": 1})
        return result["t"], result["k"].astype(int)

    def search(farthest: Floats, skipped: Floats) -> tuple[Floats, Floats]:
        first, end = numbers.min() * every, (numbers.max() + 1) * every
        return trace(SEARCH, farthest, skipped, first=first, end=end)

    skipped = -every
    for _ in range(2):  # the second time passing over what was met
        t, k = trace(INTERSECT, MISS * every, skipped)
        every_t, every_k = search(MISS * every, skipped)
        np.testing.assert_array_equal(t, every_t)
        assert (k == every_k)[t < MISS].mean() > 0.99  # where two are met at the same distance, either is right
        assert ((k >= 0) == (every_k >= 0)).all()
        skipped = k.astype(np.float64)
    anything = INTERSECT.replace("false", "true")
    t, k = trace(INTERSECT, MISS * every, -every)
    assert (k >= 0).mean() > 0.2
    for share in (0.5, 1.0, 1.5):
        farthest = np.minimum(share * t, MISS)
        found = trace(anything, farthest, -every)[1] >= 0
        np.testing.assert_array_equal(found, t < farthest.astype(np.float32))


@pytest.mark.parametrize("scale", SCALES)
def test_listed_shapes_and_those_of_the_bvh_are_met_alike(ctx: moderngl.Context, scale: float) -> None:
    """But for rounding, and for rays that pass edges."""
    scene = random_scene(6, 40, scale, 3 * scale, culled=True)
    rng = np.random.default_rng(6)
    inputs = {"o": 2 * scale * rng.normal(size=(1 << 14, 3)), "d": random_directions(rng, 1 << 14)}
    inputs |= {"skipped": np.full(1 << 14, -1.0), "farthest": np.full(1 << 14, MISS)}
    found = []
    for most_listed, level in ((0, Level.NOTHING), (10**6, Level.NOTHING), (10**6, Level.SCENE)):
        packed = pack(scene, scene.render, 64, 64, most_listed)
        result = scene_probe(ctx, packed, SCENE, INTERSECT, inputs, {"t": 1, "k": 1}, level)
        record = result["k"].astype(int)
        found.append((result["t"], np.where(record >= 0, shape_numbers(scene, packed)[record], -1)))
    (tree_t, tree_k), *others = found
    for t, k in others:
        same = (k == tree_k) & (np.abs(t - tree_t) <= 1e-4 * np.maximum(t, 0.01 * scale))
        assert same.mean() > 0.999


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["uniforms", "compiled in"])
@pytest.mark.parametrize(("count", "waiting"), [(9, 1), (24, 6), (36, 10), (48, 14), (60, 18)])
def test_nothing_is_lost_on_the_way_through_deep_trees(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, count: int, waiting: int, level: Level
) -> None:
    """Spheres in a row, each a third larger than the one before, of which a ray along it meets all; the registers of
    the stack hold from 4 to 16 groups, and memory holds more."""
    monkeypatch.setattr("fragtracer.bvh.cluster.SWEPT", 1)  # no tree that is made top down is so deep
    balls = tuple(Sphere((1.3**i, 0.0, 0.0), 0.3 * 1.3**i, "m") for i in range(count))
    scene = Scene(camera=Camera((0.0, 0.0, 1.3**count), (0.0, 0.0, 0.0)), materials={"m": Material()}, spheres=balls)
    packed = pack(scene, scene.render, 64, 64, 0)
    assert packed.uniforms["u_bvh_stack"] == waiting
    rng = np.random.default_rng(7)
    end = rng.choice([-1.0, 2 * 1.3**count], COUNT)  # of the row, where a ray begins
    target = rng.integers(count, size=COUNT)
    d = 1.3 ** target[:, None] * (np.eye(3)[0] + 0.2 * rng.normal(size=(COUNT, 3))) - end[:, None] * np.eye(3)[0]
    inputs = {"o": end[:, None] * np.eye(3)[0] - packed.origin, "d": d / np.linalg.norm(d, axis=1, keepdims=True)}
    inputs |= {"skipped": np.full(COUNT, -1.0), "farthest": np.full(COUNT, MISS)}
    exact = scene_probe(ctx, pack(scene, scene.render, 64, 64, 10**6), SCENE, INTERSECT, inputs, {"t": 1, "k": 1})
    found = scene_probe(ctx, packed, SCENE, INTERSECT, inputs, {"t": 1, "k": 1}, level)
    assert (exact["k"] >= 0).mean() > 0.5
    np.testing.assert_array_equal(found["t"] < MISS, exact["t"] < MISS)
    np.testing.assert_allclose(found["t"], exact["t"], rtol=1e-6)
    anything = INTERSECT.replace("false", "true")
    met = scene_probe(ctx, packed, SCENE, anything, inputs, {"t": 1, "k": 1}, level)
    np.testing.assert_array_equal(met["k"] >= 0, exact["k"] >= 0)


def closed_mesh(scale: float) -> Scene:
    """An octahedron whose faces are cut in four three times, blown up to a ball: 512 triangles."""
    x, y, z = np.eye(3)
    faces = [np.array([x * a, y * b, z * c]) for a in (1, -1) for b in (1, -1) for c in (1, -1)]
    for _ in range(3):
        faces = [part for face in faces for part in quarters(*face)]
    balls = [scale * (face / np.linalg.norm(face, axis=1, keepdims=True) + 1.0) for face in faces]
    camera, materials = camera_on(scale, scale), {"m": Material()}
    return Scene(camera=camera, materials=materials, triangles=tuple(Triangle(tuple(b), "m") for b in balls))


def quarters(a: Floats, b: Floats, c: Floats) -> list[Floats]:
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return [np.array(part) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]


LISTED = {"listed": 10**6, "bvh": 0}


@pytest.mark.parametrize("where", LISTED)
@pytest.mark.parametrize("scale", SCALES)
def test_mesh_has_no_cracks(ctx: moderngl.Context, scale: float, where: str) -> None:
    """From inside, rays at the shared vertices and edges of a closed mesh all hit it."""
    scene = closed_mesh(scale)
    packed = pack(scene, scene.render, 64, 64, LISTED[where])
    rng = np.random.default_rng(2)
    vertices = np.array([t.vertices for t in scene.triangles]) - packed.origin
    edges = vertices + rng.random((len(vertices), 3, 1)) * (np.roll(vertices, 1, axis=1) - vertices)
    target = np.concatenate([vertices, edges, (vertices + np.roll(vertices, 1, axis=1)) / 2]).reshape(-1, 3)
    center = vertices.reshape(-1, 3).mean(axis=0)
    origin = (center + 0.5 * scale * random_directions(rng, len(target))).astype(np.float32)
    direction = target - origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    inputs = {"o": origin, "d": direction, "farthest": np.full(len(target), MISS), "skipped": -np.ones(len(target))}
    result = scene_probe(ctx, packed, SCENE, INTERSECT, inputs, {"t": 1, "k": 1})
    assert (result["k"] >= 0).all()
    np.testing.assert_allclose(result["t"], np.linalg.norm(target - origin, axis=1), atol=2e-5 * scale)


# Follows a ray to its hit and one that leaves from there, as the integrator does.
BOUNCE = """
    Ray ray = Ray(o, d);
    Hit hit = scene_intersect(ray, INFINITE_DISTANCE, NO_PRIMITIVE, false);
    k = float(hit.primitive);
    if (hit.primitive != NO_PRIMITIVE) {
        Surface s = surface_at(ray, hit);
        position = s.position; normal = s.normal;
        ids = vec2(float(s.material), float(s.light));
        vec3 side = dot(normal, d) > 0.0 ? -normal : normal;
        start = ray_offset_origin(position, side - d, s.extent);
        vec2 across = normalize(away.xy) * sqrt(1.0 - cosine * cosine);
        wi = frame_to_world(frame_from_normal(side), vec3(across, cosine));
        Hit next = scene_intersect(Ray(start, wi), INFINITE_DISTANCE, NO_PRIMITIVE, false);
        again = vec2(float(next.primitive), next.distance);
    }"""
BOUNCED = {"k": 1, "position": 3, "normal": 3, "ids": 2, "start": 3, "wi": 3, "again": 2}


@pytest.mark.parametrize("where", LISTED)
@pytest.mark.parametrize("shift", [0.0, 100.0])
@pytest.mark.parametrize("scale", SCALES)
def test_rays_leave_their_surface(ctx: moderngl.Context, scale: float, shift: float, where: str) -> None:
    """A hit is put onto its surface, with its normal, and rays that leave from there to the side the
    first one came from, at any angle, do not meet it again at once: at every scale and place."""
    scene = random_scene(3, 12, scale, shift * scale)
    packed = pack(scene, scene.render, 64, 64, LISTED[where])
    number = shape_numbers(scene, packed)
    rng, count = np.random.default_rng(3), 1 << 15
    inputs = {
        "o": 2 * scale * rng.normal(size=(count, 3)),
        "d": random_directions(rng, count),
        "away": random_directions(rng, count),
        "cosine": 10 ** rng.uniform(-4, 0, count),
    }
    result = scene_probe(ctx, packed, SCENE, BOUNCE, inputs, BOUNCED)
    inner = (result["normal"] * inputs["d"]).sum(1) > 0
    names = [*scene.materials, "light[0]", "light[2]"]
    met, met_again = (number[k.astype(int)] for k in (result["k"], result["again"][:, 0]))
    for k, shape in enumerate(shapes_of(scene)):
        hit = (result["k"] >= 0) & (met == k)
        position, normal = result["position"][hit] + packed.origin, result["normal"][hit]
        largest = np.abs(result["position"][hit]).max(initial=scale)
        rounding = 3e-7 * largest
        back = hit & (result["again"][:, 0] >= 0) & (met_again == k)
        assert (np.linalg.norm(result["start"] - result["position"], axis=1)[hit] < 2e-5 * largest).all()
        assert (result["ids"][hit, 0] == names.index(shape.material)).all()
        shines = shape.material not in scene.materials or scene.materials[shape.material].is_emissive
        assert ((result["ids"][hit, 1] >= 0) == shines).all()
        if isinstance(shape, Sphere):
            out = position - shape.center
            np.testing.assert_allclose(np.linalg.norm(out, axis=1), shape.radius, rtol=0, atol=rounding)
            np.testing.assert_allclose(normal, out / shape.radius, atol=1e-5 + 10 * rounding / shape.radius)
            assert not back[~inner].any()
            # Within, it meets the other side.
            start, wi = result["start"][back] + packed.origin, result["wi"][back]
            chord = shape_oracle.sphere(shape.center, shape.radius, start, wi)
            np.testing.assert_allclose(result["again"][back, 1], chord, rtol=0.1)
        else:
            point, expected = plane_of(shape)
            assert np.abs((position - point) @ expected).max(initial=0) < 2 * rounding
            np.testing.assert_allclose(normal, np.broadcast_to(expected, normal.shape), atol=1e-6)
            assert not back.any()
    assert (result["k"] >= 0).mean() > 0.4


def room(scale: float, shift: float, triangles: bool) -> Scene:
    """A closed box, turned against the axes."""
    axes, _ = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))
    middle, materials = np.full(3, shift * scale), {"m": Material()}
    walls = []
    for i in range(3):
        out, u, v = scale * np.roll(axes, -i, axis=0)
        walls += [(middle + sign * out - u - v, 2 * u, 2 * v) for sign in (-1, 1)]
    camera = camera_on(scale, shift * scale)
    if not triangles:
        return Scene(camera=camera, materials=materials, rectangles=tuple(Rectangle(*w, "m") for w in walls))
    halves = [(c, c + u, c + u + v) for c, u, v in walls] + [(c, c + u + v, c + v) for c, u, v in walls]
    return Scene(camera=camera, materials=materials, triangles=tuple(Triangle(h, "m") for h in halves))


@pytest.mark.parametrize("where", LISTED)
@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("shift", [0.0, 100.0])
@pytest.mark.parametrize("scale", SCALES)
def test_nothing_leaks_where_walls_meet(
    ctx: moderngl.Context, scale: float, shift: float, triangles: bool, where: str
) -> None:
    """In a closed room, from within 1e-8 to 1e-2 of its edges and corners, and into them."""
    scene = room(scale, shift, triangles)
    packed = pack(scene, scene.render, 64, 64, LISTED[where])
    rng, count = np.random.default_rng(4), 1 << 16
    middle, axes = (
        np.full(3, shift * scale) - packed.origin,
        np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0],
    )
    place = rng.choice([-1, 1], (count, 3)) * (1 - 10 ** rng.uniform(-8, -2, (count, 3)))
    along = rng.integers(0, 4, count)
    free = along < 3  # else in a corner
    place[free, along[free]] = rng.uniform(-1, 1, free.sum())
    target = middle + scale * place @ axes
    origin = (middle + 0.5 * scale * rng.uniform(-1, 1, (count, 3)) @ axes).astype(np.float32)
    direction = target - origin
    inputs = {
        "o": origin,
        "d": direction / np.linalg.norm(direction, axis=1, keepdims=True),
        "away": random_directions(rng, count),
        "cosine": rng.random(count) ** rng.choice([0.5, 4], count),
    }
    result = scene_probe(ctx, packed, SCENE, BOUNCE, inputs, BOUNCED)
    assert (result["k"] >= 0).all()
    leaked = result["again"][:, 0] < 0
    assert not leaked.any(), f"{leaked.sum()} of {count}"
