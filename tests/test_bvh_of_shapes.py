# SPDX-License-Identifier: MIT
"""Shapes of every kind in the BVH, and spheres in a grid: many of them, of any size, anywhere, and single-sided."""

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray
from rendering import list_at_most, rendered
from scene_builders import lambert
from shaders.scene_probe import scene_probe

from fragtracer.packing import PackedScene, pack
from fragtracer.renderer import Renderer
from fragtracer.scene import Ambient, Camera, Disk, Material, Rectangle, Scene, Sphere, Triangle

Floats = NDArray[np.float64]
KINDS = ("spheres", "rectangles", "disks", "triangles")


def many(
    kind: str, count: int, scale: float = 1.0, shift: float = 0.0, seed: int = 1
) -> tuple[Scene, dict[str, Floats]]:
    """``count`` shapes of a kind within a ball of about ``scale`` metres, ``shift`` metres off the origin in x, and
    their places: a, and for flat ones the edges u and v."""
    rng = np.random.default_rng(seed)
    size = 1.5 * scale * count ** (-1 / 3) * rng.uniform(0.2, 1.0, (count, 1))
    a = scale * rng.uniform(-1, 1, (count, 3)) + (shift, 0.0, 0.0)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3))).Q
    u, v = axes[:, 0] * size, axes[:, 1] * size * rng.uniform(0.3, 1.0, (count, 1))
    if kind == "disks":
        v = np.cross(axes[:, 2], u)
    material = "matte"

    def rows(*columns: Floats) -> Any:
        """Whole tuples of floats: pydantic reads them several times as fast as arrays."""
        return zip(*(map(tuple, column.tolist()) for column in columns), strict=True)

    shapes: dict[str, Any] = {
        "spheres": lambda: [Sphere(c, r, material) for c, (r,) in rows(a, size)],
        "rectangles": lambda: [Rectangle(p, s, t, material) for p, s, t in rows(a, u, v)],
        "disks": lambda: [Disk(c, n, r, material) for c, n, (r,) in rows(a, axes[:, 2], size)],
        "triangles": lambda: [Triangle(t, material) for t in rows(a, a + u, a + v)],
    }
    camera = Camera((shift, 0.0, 1.5 * scale), (shift, 0.0, 0.0), fov_degrees=50.0)
    scene = Scene(camera, {material: lambert(0.5)}, ambient=Ambient(1.0), **{kind: shapes[kind]()})
    return scene, {"a": a, "u": u, "v": v, "radius": size}


def dots(x: Floats, y: Floats) -> Floats:
    """The products of vectors (n, 3)."""
    return np.asarray(np.einsum("ij,ij->i", x, y))


def nearest(
    kind: str, places: dict[str, Floats], origin: Floats, direction: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """The closest distance of each ray in float64, infinite for a miss, by testing every shape that it passes near
    enough; and whether a shape before it, or it, is met so near its rim that float32 may well say something else."""
    u, v, radius = places["u"], places["v"], places["radius"][:, 0]
    middle = places["a"].mean(0)
    a, origin = places["a"] - middle, origin - middle
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    u2, v2 = dots(u, u), dots(v, v)
    reach = 1.01 * (radius if kind == "spheres" else np.sqrt(u2) + np.sqrt(v2))  # from a, its rim included
    distances, unclear = np.full(len(origin), np.inf), np.zeros(len(origin), bool)
    for rays in np.array_split(np.arange(len(origin)), -(-len(a) * len(origin) // 2**17)):
        o, d = origin[rays], direction[rays]
        along = d @ a.T - dots(o, d)[:, None]
        ray, shape = np.nonzero(dots(o, o)[:, None] - 2 * (o @ a.T) + dots(a, a) - along**2 <= reach**2)
        c, d, r, along = a[shape] - o[ray], d[ray], radius[shape], along[ray, shape]
        ray = rays[ray]
        if kind == "spheres":
            beside = c - along[:, None] * d
            off = np.sqrt(dots(beside, beside))
            half = np.sqrt(np.maximum(0, r**2 - off**2))
            t = np.where(along - half > 0, along - half, along + half)
            beyond = off / r - 1
        else:
            t = dots(c, normal[shape]) / dots(d, normal[shape])
            p = t[:, None] * d - c
            x, y = dots(p, u[shape]) / u2[shape], dots(p, v[shape]) / v2[shape]
            if kind == "triangles":  # whose sides are not perpendicular in general: these are, by their making
                beyond = -np.minimum(np.minimum(x, y), 1 - x - y)
            elif kind == "disks":
                beyond = np.hypot(x, y) - 1
            else:
                beyond = np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) - 0.5
        met = (beyond < 0) & (t > 0)
        np.minimum.at(distances, ray[met], t[met])
        unclear[ray[(np.abs(beyond) < 1e-3) & (t > 0) & (t <= distances[ray] * (1 + 1e-6))]] = True
    return distances, unclear


def rays(scene: Scene, scale: float, shift: float, count: int) -> tuple[Floats, Floats]:
    """From around the scene and from within it, towards some point of it."""
    rng = np.random.default_rng(3)
    start = scale * rng.normal(size=(count, 3)) * np.where(np.arange(count) % 2, 0.3, 1.5)[:, None]
    direction = scale * rng.uniform(-1, 1, (count, 3)) - start
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return start + np.array((shift, 0.0, 0.0)), direction


def assert_none_is_missed(ctx: moderngl.Context, kind: str, packed: PackedScene, places: dict[str, Floats]) -> None:
    """A short ray to every shape from just outside of it meets the shape, or something before it."""
    height = 0.05 * places["radius"]
    if kind == "spheres":
        normal = np.random.default_rng(4).normal(size=places["a"].shape)
        target = places["a"]
    else:
        normal = np.cross(places["u"], places["v"])
        target = places["a"] + 0.3 * (places["u"] + places["v"])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    start = target + (height + (places["radius"] if kind == "spheres" else 0.0)) * normal - packed.origin
    body = "t = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false).distance;"
    inputs = {"o": start.astype(np.float32), "d": -normal.astype(np.float32)}
    found = scene_probe(ctx, packed, ["shape/intersect.glsl"], body, inputs, {"t": 1})["t"]
    excess = found / height[:, 0] - 1
    assert excess.max() < 0.05, np.flatnonzero(excess >= 0.05)
    assert (excess > -0.05).mean() > 0.5  # most are met themselves


def assert_closest_hits(
    ctx: moderngl.Context, kind: str, count: int, scale: float = 1.0, shift: float = 0.0, ray_count: int = 400
) -> Scene:
    """Of rays through :func:`many` shapes, which are returned."""
    scene, places = many(kind, count, scale, shift)
    packed = pack(scene, scene.render, 8, 8)
    assert (packed.uniforms["u_bvh_root"] >= 0) != (packed.flags["u_has_sphere_grid"] == 1)
    origin, direction = rays(scene, scale, shift, ray_count)
    local = (origin - packed.origin).astype(np.float32)
    direction = direction.astype(np.float32).astype(np.float64)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    body = "t = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false).distance;"
    inputs = {"o": local, "d": direction.astype(np.float32)}
    found = scene_probe(ctx, packed, ["shape/intersect.glsl"], body, inputs, {"t": 1})["t"]
    expected, unclear = nearest(kind, places, local.astype(np.float64) + packed.origin, direction)
    assert unclear.mean() < 0.1
    assert np.isfinite(expected).mean() > 0.2
    found = np.where(found > 1e29, np.inf, found)
    # Edges grow by a millionth of the scene; a slanted shape is met so much the nearer.
    np.testing.assert_allclose(found[~unclear], expected[~unclear], rtol=2e-4, atol=2e-5 * scale)
    if count >= 20_000:
        assert_none_is_missed(ctx, kind, packed, places)
    return scene


@pytest.mark.parametrize("kind", KINDS)
def test_a_hundred_thousand_shapes(ctx: moderngl.Context, kind: str) -> None:
    """They render, rays meet what float64 says that they meet first of all, and not one of them is missed: spheres,
    which have a grid, and fewer of other kinds, which have a BVH. A fifth of them of yet others."""
    count = 100_000 if kind == "spheres" else 20_000
    scene = assert_closest_hits(ctx, kind, count, ray_count=100)
    with Renderer(scene, (8, 8), context=ctx, bounces=1) as renderer:
        renderer.sample(2)
        image = renderer.image()
        assert renderer.non_finite_samples() == 0
    assert 0.0 < image[2:6, 2:6].mean() < 0.6  # half of what comes, less what others hide


@pytest.mark.parametrize(("scale", "shift"), [(1e-3, 0.0), (1.0, 1e4), (1e3, 0.0), (1e3, -1e7), (1e6, 0.0)])
@pytest.mark.parametrize(("kind", "in_grid"), [("spheres", True), *((kind, False) for kind in KINDS)])
def test_any_size_and_place(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kind: str, in_grid: bool, scale: float, shift: float
) -> None:
    """Far from the origin as well, since a scene is packed about its own middle."""
    if not in_grid:
        monkeypatch.setattr("fragtracer.packing.pack_sphere_grid", lambda *_: None)
    scene = assert_closest_hits(ctx, kind, 500, scale, shift, 2000)
    assert pack(scene, scene.render, 8, 8).flags["u_has_sphere_grid"] == in_grid


SINGLE = Material(unlit=True, albedo=1.0, double_sided=False)
ONE_OF = {
    "spheres": Sphere((0.0, 0.0, 0.0), 1.0, "m"),
    "rectangles": Rectangle((-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "m"),
    "disks": Disk((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, "m"),
    "triangles": Triangle(((-2.0, -2.0, 0.0), (2.0, -2.0, 0.0), (0.0, 2.0, 0.0)), "m"),
}


def check_culling(ctx: moderngl.Context, kind: str, specialised: bool = True) -> None:
    """A single-sided shape is seen from its front alone, a double-sided one from both."""
    front = Camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), fov_degrees=5.0)
    behind = replace(front, position=(0.0, 0.0, 0.3) if kind == "spheres" else (0.0, 0.0, -3.0))
    for material in (SINGLE, replace(SINGLE, double_sided=True)):
        for camera in (front, behind):
            scene = Scene(camera, {"m": material}, **{kind: [ONE_OF[kind]]})
            image = rendered(ctx, scene, 1, (4, 4), specialised=specialised)
            np.testing.assert_array_equal(image, float(camera is front or material.double_sided))


@pytest.mark.parametrize(
    ("kind", "most_listed", "specialised"),
    [(kind, most, (i + (most == 0)) % 2 == 0) for i, kind in enumerate(KINDS) for most in (0, 64)],
)
def test_single_sided_shapes(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, kind: str, most_listed: int, specialised: bool
) -> None:
    list_at_most(monkeypatch, most_listed)
    check_culling(ctx, kind, specialised)
