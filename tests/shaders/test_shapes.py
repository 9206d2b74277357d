# SPDX-License-Identifier: MIT
"""shape/sphere.glsl, plane.glsl and flat.glsl, and triangle.glsl, against float64, on hard rays.

Tolerances are in units of the numbers that take part: a float32 sum of numbers of size s is known
to about 1e-7 s, so a shape of radius r at distance d is known to a few 1e-7 (r + d).
"""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from . import Floats, shape_oracle
from .directions import random_directions

SHAPES = ["shape/intersect.glsl"]
COUNT = 1 << 14
MISS = 1e30


def unit(v: Floats) -> Floats:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def rounded(*columns: Floats) -> list[Floats]:
    """What the shader will see, in float64."""
    return [np.asarray(c, np.float32).astype(np.float64) for c in columns]


# Radius, distance of the origin from the centre in radii, distance of the ray from the centre in radii.
SPHERE_RAYS = {
    "outside": (1.0, (1.1, 10.0), (0.0, 1.5)),
    "inside": (1.0, (0.0, 0.999), (0.0, 0.999)),
    "just outside": (1.0, (1.0001, 1.01), (0.0, 1.0)),
    "tangent": (1.0, (1.5, 10.0), (0.999, 1.001)),
    "far": (1.0, (0.9e4, 1.1e4), (0.0, 1.5)),
    "very far": (1.0, (0.9e6, 1.1e6), (0.0, 1.5)),
    "tiny": (1e-4, (1.1, 1e4), (0.0, 1.5)),
    "huge": (1e6, (1.000001, 1.1), (0.0, 1.0)),
    "inside a huge one": (1e6, (0.0, 0.99999), (0.0, 0.99999)),
}


@pytest.mark.parametrize("name", SPHERE_RAYS)
def test_sphere(ctx: moderngl.Context, name: str) -> None:
    rng = np.random.default_rng(1)
    size, distances, misses = SPHERE_RAYS[name]
    radius = np.full(COUNT, size)
    away = random_directions(rng, COUNT).astype(np.float64)
    center = size * rng.normal(size=(COUNT, 3))
    # From the origin towards a point at the wanted distance from the centre, across the line of sight.
    origin = center + (size * rng.uniform(*distances, COUNT))[:, None] * away
    across = unit(np.cross(away, random_directions(rng, COUNT)))
    direction = unit(center + (size * rng.uniform(*misses, COUNT))[:, None] * across - origin)
    direction[: COUNT // 8] *= -1  # some look away
    center, radius, origin, direction = rounded(center, radius, origin, direction)

    inputs = {"center": center, "radius": radius, "o": origin, "d": direction}
    body = "bool front; t = sphere_intersect(center, radius, o, d, front); is_front = float(front);"
    result = probe(ctx, SHAPES, body, inputs, {"t": 1, "is_front": 1})
    t, is_front = result["t"].astype(np.float64), result["is_front"] > 0
    offset = origin - center
    scale = np.linalg.norm(offset, axis=1) + radius
    hit = t < MISS
    assert (t[~hit] == np.float32(MISS)).all()
    assert (t[hit] > 0).all()
    # Each hit lies on the sphere, and is the first one but for rays that graze it.
    surface = np.linalg.norm(offset + t[:, None] * direction, axis=1)
    assert (np.abs(surface - radius)[hit] <= 5e-7 * scale[hit]).all()
    sizes = (np.maximum(0, radius + e * scale) for e in (-1e-6, 1e-6))
    smaller, larger = (shape_oracle.sphere(center, r, origin, direction) for r in sizes)
    agreed = np.isfinite(smaller) & np.isfinite(larger)
    assert hit[agreed].all()
    assert not hit[~np.isfinite(smaller) & ~np.isfinite(larger)].any()
    exact = shape_oracle.sphere(center, radius, origin, direction)
    known_to = np.abs(larger[agreed] - smaller[agreed]) + 5e-7 * scale[agreed]
    assert (np.abs(t - exact)[agreed] <= known_to).all()
    assert agreed.mean() > 0.2 or name == "very far"
    # The front is met from outside.
    outside = np.linalg.norm(offset, axis=1) - radius
    known = hit & (np.abs(outside) > 1e-6 * scale)
    np.testing.assert_array_equal(is_front[known], outside[known] > 0)


def test_globe(ctx: moderngl.Context) -> None:
    """What passes near the origin is known to a millionth of the distance from there, however large it is."""
    rng = np.random.default_rng(3)
    radius = 10 ** rng.uniform(3, 12, COUNT)
    normal = random_directions(rng, COUNT).astype(np.float64)
    normal[::97] = (0, 1, 0)
    nearest = rng.uniform(-10, 10, (COUNT, 1)) * normal
    center = nearest - radius[:, None] * normal
    origin = nearest + 10 ** rng.uniform(-3, 3, (COUNT, 1)) * random_directions(rng, COUNT)
    direction = random_directions(rng, COUNT).astype(np.float64)
    along = unit(direction - (direction * normal).sum(1, keepdims=True) * normal)
    direction[::3] = unit(along + 10 ** rng.uniform(-6, -2, (COUNT, 1)) * normal)[::3]
    origin[::97] = nearest[::97] - rng.uniform(1, 10, (len(normal[::97]), 1)) * normal[::97]  # level, from below
    direction[::97] = (1, 0, 0)
    origin, direction = rounded(origin, direction)

    def height(points: Floats) -> Floats:
        beside = points - nearest
        return (normal * beside).sum(1) + np.square(beside).sum(1) / (2 * radius)

    inputs = {"center": center, "r": radius, "curvature": 1 / radius, "nearest": nearest, "o": origin, "d": direction}
    body = """
        Sphere globe = Sphere(center, 0u, r, 0u, 0u, curvature, nearest);
        bool front; t = sphere_intersect_globe(globe, o, d, front); is_front = float(front);"""
    result = probe(ctx, SHAPES, body, inputs, {"t": 1, "is_front": 1})
    t, is_front = result["t"].astype(np.float64), result["is_front"] > 0
    hit, start = t < MISS, height(origin)
    met = origin + np.where(hit, t, 0)[:, None] * direction
    error = 1e-6 * (np.linalg.norm(met, axis=1) + np.linalg.norm(origin, axis=1))
    assert (t[hit] > 0).all()
    assert (np.abs(height(met)) <= error)[hit].all()
    known = np.abs(start) > error
    np.testing.assert_array_equal(is_front[known], start[known] > 0)
    # From below all rays leave it; from above those that turn down far enough meet it, before they leave it again.
    slope = (direction * (normal + (origin - nearest) / radius[:, None])).sum(1)
    assert hit[known & (start < 0)].all()
    squared = np.square(slope) - 2 * start / radius
    doubt = 1e-6 * np.abs(slope) + 2 * error / radius
    meets = (slope < 0) & (squared > 0)
    sure = known & (start > 0) & (np.abs(squared) > doubt) & (np.abs(slope) > 1e-6)
    np.testing.assert_array_equal(hit[sure], meets[sure])
    first = hit & sure
    assert (t <= -slope * radius * (1 + 1e-5))[first].all()
    assert sure.mean() > 0.4


def test_plane(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(2)
    normal = random_directions(rng, COUNT)
    point = 10 ** rng.uniform(-3, 4, (COUNT, 1)) * random_directions(rng, COUNT)
    origin = 10 ** rng.uniform(-3, 4, (COUNT, 1)) * random_directions(rng, COUNT)
    direction = random_directions(rng, COUNT).astype(np.float64)
    # A third runs nearly along the plane.
    along = unit(direction - (direction * normal).sum(1, keepdims=True) * normal)
    direction[::3] = unit(along + 10 ** rng.uniform(-6, -2, (COUNT, 1)) * normal)[::3]
    offset = (normal.astype(np.float64) * point).sum(1)
    normal, offset, origin, direction = rounded(normal, offset, origin, direction)
    inputs = {"normal": normal, "offset": offset, "o": origin, "d": direction}
    body = "t = plane_intersect(normal, offset, Ray(o, d));"
    t = probe(ctx, SHAPES, body, inputs, {"t": 1})["t"].astype(np.float64)
    height, slope = offset - (normal * origin).sum(1), (normal * direction).sum(1)
    # Both are sums of three products, known to 2e-7 of the largest.
    height_error = 2e-7 * (np.abs(offset) + np.linalg.norm(origin, axis=1))
    sure = (np.abs(height) > height_error) & (np.abs(slope) > 2e-7)
    np.testing.assert_array_equal(t[sure] < MISS, (height / slope)[sure] > 0)
    hit = sure & (t < MISS)
    error = (height_error + 2e-7 * t) / np.abs(slope) + 2e-7 * t
    assert (np.abs(t - height / slope)[hit] <= error[hit]).all()
    assert hit.mean() > 0.3


KINDS = {"rectangle": "KIND_RECTANGLE", "disk": "KIND_DISK", "triangle": "KIND_SINGLE_TRIANGLE"}
# Distance to a flat shape: by its formula, as in the short list, and as under the BVH.
WAYS = {
    "listed": """
        vec3 normal = normalize(cross(b - a, c - a));
        t = flat_intersect(Flat(a, {0} << 24u | flags, b, 0u, c, 0u, normal), Ray(o, d));
        """,
    "bvh": """
        bool inside;
        vec4 found = triangle_intersect(a, b, c, bvh_ray(o, d), inside);
        if (flat_contains({0} << 24u, found.yz) && (flags == 0u || found.w > 0.0)) t = found.x;""",
}


def flat_distance(
    ctx: moderngl.Context,
    kind: str,
    way: str,
    a: Floats,
    b: Floats,
    c: Floats,
    o: Floats,
    d: Floats,
    culled: bool = False,
) -> Floats:
    body = f"uint flags = {int(culled)}u; t = INFINITE_DISTANCE; {WAYS[way].format(KINDS[kind])}"
    t: Floats = probe(ctx, SHAPES, body, {"a": a, "b": b, "c": c, "o": o, "d": d}, {"t": 1})["t"]
    return t.astype(np.float64)


@pytest.mark.parametrize("way", WAYS)
def test_ray_in_a_plane_never_hits(ctx: moderngl.Context, way: str) -> None:
    """Parallel above, below and within, where the distance is infinite or not a number."""
    origin = np.array([(0, 1, 0), (0, -1, 0), (0, 0, 0), (5, 0, 5), (0, -0.0, 0)], np.float32)
    direction = np.array([(1, 0, 0), (0.6, 0, 0.8), (1, 0, 0), (0, 0, -1), (0, -0.0, 1)], np.float32)
    body = "plane = plane_intersect(vec3(0.0, 1.0, 0.0), 0.0, Ray(o, d));"
    t = probe(ctx, SHAPES, body, {"o": origin, "d": direction}, {"plane": 1})["plane"]
    assert (t >= np.float32(MISS)).all()
    corners = (np.broadcast_to(p, (5, 3)) for p in ((-5, 0, -5), (-5, 0, 5), (5, 0, -5)))
    a, b, c = corners
    for kind in KINDS:
        assert (flat_distance(ctx, kind, way, a, b, c, origin, direction) >= np.float32(MISS)).all(), kind


def flat_shapes(rng: np.random.Generator, right: bool) -> tuple[Floats, Floats, Floats]:
    """Corners and two edges each, at right angles or not, of sizes 1e-2 to 1e2."""
    u, v = (10 ** rng.uniform(-1, 1, (COUNT, 1)) * random_directions(rng, COUNT) for _ in range(2))
    if right:
        v = np.linalg.norm(v, axis=1, keepdims=True) * unit(np.cross(u, v))
    return rng.normal(size=(COUNT, 3)), u, v


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", KINDS)
def test_flat_shape(ctx: moderngl.Context, kind: str, way: str) -> None:
    """Rays at known coordinates: well inside and outside, and within 1e-4 of edges and vertices; and where the shape is
    culled, from its front alone."""
    rng = np.random.default_rng(3)
    corner, u, v = flat_shapes(rng, kind != "triangle")
    if kind == "disk":
        v *= np.linalg.norm(u, axis=1, keepdims=True) / np.linalg.norm(v, axis=1, keepdims=True)
    corner, far_u, far_v = rounded(corner, corner + u, corner + v)
    u, v = far_u - corner, far_v - corner
    normal = unit(np.cross(u, v))
    rows = np.linalg.inv(np.stack([u, v, normal], -1))[:, :2]
    coordinates = rng.uniform(-0.5, 1.5, (COUNT, 2))
    near = np.arange(COUNT) % 3 == 0
    vertices = rng.integers(0, 2, (COUNT, 2)).astype(np.float64)
    along = np.where((np.arange(COUNT) % 2)[:, None] == 0, vertices, np.stack([vertices[:, 0], rng.random(COUNT)], -1))
    if kind == "disk":
        coordinates = rng.uniform(-1.3, 1.3, (COUNT, 2))
        turns = 2 * np.pi * rng.random(COUNT)
        along = np.stack([np.cos(turns), np.sin(turns)], -1)
    coordinates[near] = (along + rng.uniform(-1e-4, 1e-4, (COUNT, 2)))[near]
    target = corner + coordinates[:, :1] * u + coordinates[:, 1:] * v
    distance = 10 ** rng.uniform(-1, 1, COUNT)
    slant = unit(normal * rng.choice([-1, 1], (COUNT, 1)) + rng.normal(size=(COUNT, 3)))
    origin = target + distance[:, None] * slant
    direction = -slant * np.where(rng.random(COUNT) < 0.9, 1, -1)[:, None]
    t = flat_distance(ctx, kind, way, corner, far_u, far_v, origin, direction)

    scale = np.linalg.norm(corner, axis=1) + np.linalg.norm(origin, axis=1) + distance
    slope = np.abs((normal * slant).sum(1))
    error = 1e-6 * scale / slope
    # The same error across the shape, in its coordinates, decides who may be taken for inside.
    doubt = error * np.linalg.norm(rows, axis=2).max(1)
    s, r = coordinates.T
    depth = {
        "rectangle": np.min([s, r, 1 - s, 1 - r], axis=0),
        "triangle": np.min([s, r, 1 - s - r], axis=0),
        "disk": 1 - np.hypot(s, r),
    }[kind]
    ahead = (direction * slant).sum(1) < 0
    hit = t < MISS
    assert not hit[~ahead].any()
    assert hit[ahead & (depth > doubt)].all()
    assert not hit[depth < -doubt].any()
    assert (np.abs(t - distance)[hit] <= error[hit]).all()
    decided = np.abs(depth) > doubt
    assert decided.mean() > 0.7
    assert decided[near].mean() > 0.2

    from_front = (direction * normal).sum(1) < 0
    seen = flat_distance(ctx, kind, way, corner, far_u, far_v, origin, direction, culled=True)
    np.testing.assert_array_equal(seen, np.where(from_front, t, MISS).astype(np.float32))


@pytest.mark.parametrize("way", WAYS)
def test_flat_shape_far_from_the_origin(ctx: moderngl.Context, way: str) -> None:
    """The distance is as exact as near the origin of the coordinates: float32 rounds ray and shape alone."""
    rng = np.random.default_rng(5)
    corner, u, v = flat_shapes(rng, right=True)
    corner, far_u, far_v = rounded(corner + 1e3, corner + 1e3 + u, corner + 1e3 + v)
    u, v = far_u - corner, far_v - corner
    normal = unit(np.cross(u, v))
    slant = unit(normal + rng.normal(size=(COUNT, 3)))
    target = corner + rng.uniform(0.1, 0.9, (COUNT, 1)) * u + rng.uniform(0.1, 0.9, (COUNT, 1)) * v
    origin, direction = rounded(target + rng.uniform(0.1, 2, (COUNT, 1)) * slant, -slant)
    t = flat_distance(ctx, "rectangle", way, corner, far_u, far_v, origin, direction)
    slope = -(normal * direction).sum(1)
    expected = (normal * (origin - corner)).sum(1) / slope
    reach = np.linalg.norm(origin - corner, axis=1) + np.linalg.norm(u, axis=1) + np.linalg.norm(v, axis=1)
    steep = (slope > 0.1) & (expected > 0.01)
    assert steep.mean() > 0.5
    assert (np.abs(t - expected) <= 1e-6 * reach / slope)[steep].all()
