# SPDX-License-Identifier: MIT
"""shape/intersect.glsl, surface.glsl and ray.glsl against all shapes one by one in float64."""

import moderngl
import numpy as np
import pytest

from fragtracer.packing import pack
from fragtracer.scene import Material, Rectangle, Scene, Sphere, Triangle

from . import Floats, shape_oracle
from .directions import random_directions
from .includes import SHAPE
from .scene_oracle import bounds, plane_of, shapes_of
from .scene_probe import camera_on, random_scene, scene_probe

COUNT = 1 << 12
MISS = 1e30
# Triangles, and whether baked: the three ways a scene is stored.
STORAGES = {"uniform block": (12, False), "baked": (12, True), "texture": (300, False)}


@pytest.fixture(autouse=True)
def _triangles_stay_single(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fragtracer.packing.gather.MOST_TRIANGLES", 10**6)


SCALES = [1e-3, 1.0, 1e4]
INTERSECT = (
    "Hit hit = scene_intersect(Ray(o, d), farthest, int(skipped), false); t = hit.distance; k = float(hit.primitive);"
)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("scale", SCALES)
def test_closest_hit(ctx: moderngl.Context, storage: str, scale: float) -> None:
    """Of all shapes, of all but the one that was hit, and nearer or farther than that."""
    triangles, baked = STORAGES[storage]
    scene = random_scene(2, triangles, scale, shift=3 * scale)
    packed = pack(scene, scene.render, 64, 64, baked)
    rng, rows = np.random.default_rng(1), np.arange(COUNT)
    local = (2 * scale * rng.normal(size=(COUNT, 3))).astype(np.float32)
    direction = random_directions(rng, COUNT).astype(np.float64)
    # Coordinates reach some 10 scales, of which float32 keeps 1e-7, and shapes are grown by 1e-6.
    each = [bounds(s, local.astype(np.float64) + packed.origin, direction, 3e-5 * scale) for s in shapes_of(scene)]
    low, high = (np.stack(b) for b in zip(*each, strict=True))

    def trace(skipped: Floats, farthest: Floats) -> tuple[Floats, Floats]:
        inputs = {"o": local, "d": direction, "skipped": skipped, "farthest": farthest}
        result = scene_probe(ctx, packed, SHAPE, INTERSECT, inputs, {"t": 1, "k": 1})
        return result["t"], result["k"].astype(int)

    def check(t: Floats, k: Floats, low: Floats, high: Floats) -> None:
        closest = high.min(axis=0)
        hit = k >= 0
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
    t, k = trace(nobody, anywhere)
    check(t, k, low, high)

    hit = k >= 0
    low[k[hit], rows[hit]] = high[k[hit], rows[hit]] = np.inf
    check(*trace(k.astype(np.float64), anywhere), low, high)

    before, behind = np.where(hit, 0.999 * t, 1.0), np.where(hit, 1.001 * t, MISS)
    near_t, near_k = trace(nobody, before)
    assert (near_k[hit] == -1).all()
    np.testing.assert_array_equal(near_t[hit], before[hit].astype(np.float32))
    far_t, far_k = trace(nobody, behind)
    np.testing.assert_array_equal(far_k, k)
    np.testing.assert_array_equal(far_t[hit], t[hit])


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


@pytest.mark.parametrize("scale", SCALES)
def test_mesh_has_no_cracks(ctx: moderngl.Context, scale: float) -> None:
    """From inside, rays at the shared vertices and edges of a closed mesh all hit it."""
    scene = closed_mesh(scale)
    packed = pack(scene, scene.render, 64, 64)
    rng = np.random.default_rng(2)
    vertices = np.array([t.vertices for t in scene.triangles]) - packed.origin
    edges = vertices + rng.random((len(vertices), 3, 1)) * (np.roll(vertices, 1, axis=1) - vertices)
    target = np.concatenate([vertices, edges, (vertices + np.roll(vertices, 1, axis=1)) / 2]).reshape(-1, 3)
    center = vertices.reshape(-1, 3).mean(axis=0)
    origin = (center + 0.5 * scale * random_directions(rng, len(target))).astype(np.float32)
    direction = target - origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    inputs = {"o": origin, "d": direction, "farthest": np.full(len(target), MISS), "skipped": -np.ones(len(target))}
    result = scene_probe(ctx, packed, SHAPE, INTERSECT, inputs, {"t": 1, "k": 1})
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


@pytest.mark.parametrize("shift", [0.0, 100.0])
@pytest.mark.parametrize("scale", SCALES)
def test_rays_leave_their_surface(ctx: moderngl.Context, scale: float, shift: float) -> None:
    """A hit is put onto its surface, with its normal, and rays that leave from there to the side the
    first one came from, at any angle, do not meet it again at once: at every scale and place."""
    scene = random_scene(3, 12, scale, shift * scale)
    packed = pack(scene, scene.render, 64, 64)
    rng, count = np.random.default_rng(3), 1 << 15
    inputs = {
        "o": 2 * scale * rng.normal(size=(count, 3)),
        "d": random_directions(rng, count),
        "away": random_directions(rng, count),
        "cosine": 10 ** rng.uniform(-4, 0, count),
    }
    result = scene_probe(ctx, packed, SHAPE, BOUNCE, inputs, BOUNCED)
    inner = (result["normal"] * inputs["d"]).sum(1) > 0
    names = [*scene.materials, "light[0]", "light[2]"]
    for k, shape in enumerate(shapes_of(scene)):
        hit = result["k"] == k
        position, normal = result["position"][hit] + packed.origin, result["normal"][hit]
        largest = np.abs(result["position"][hit]).max(initial=scale)
        rounding = 3e-7 * largest
        back = hit & (result["again"][:, 0] == k)
        assert (np.linalg.norm(result["start"] - result["position"], axis=1)[hit] < 2e-5 * largest).all()
        assert (result["ids"][hit, 0] == (names.index(shape.material) if shape.material else 10 + k - 5)).all()
        assert ((result["ids"][hit, 1] >= 0) == (k in (5, 6) or scene.materials[shape.material].is_emissive)).all()
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


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("shift", [0.0, 100.0])
@pytest.mark.parametrize("scale", SCALES)
def test_nothing_leaks_where_walls_meet(ctx: moderngl.Context, scale: float, shift: float, triangles: bool) -> None:
    """In a closed room, from within 1e-8 to 1e-2 of its edges and corners, and into them."""
    scene = room(scale, shift, triangles)
    packed = pack(scene, scene.render, 64, 64)
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
    result = scene_probe(ctx, packed, SHAPE, BOUNCE, inputs, BOUNCED)
    assert (result["k"] >= 0).all()
    leaked = result["again"][:, 0] < 0
    assert not leaked.any(), f"{leaked.sum()} of {count}"
