# SPDX-License-Identifier: MIT
"""light/mesh.glsl and its table: triangles drawn as often as their density says, and points evenly on them."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from mesh_shapes import ball, field, geometry, mesh_scene, soup
from scipy import stats

from fragtracer.packing import PackedScene, pack
from fragtracer.packing.alias import alias_table
from fragtracer.packing.lights import LightKind
from fragtracer.scene import Light, Material, Mesh, Part, Placement, Rectangle, Scene, Sphere

from .chi_square import assert_likely, chi_square
from .directions import random_directions
from .scene_probe import camera_on, scene_probe, shape_records, triangles_of

LIGHT = ["light/light.glsl"]
SAMPLE = """
    LightSample s = light_sample(o, u);
    wi = vec4(s.wi, s.distance);
    radiance = vec4(s.radiance, s.pdf);
    Hit hit = scene_intersect(Ray(o, s.wi), INFINITE_DISTANCE, NO_PRIMITIVE, false);
    Surface surface = surface_at(Ray(o, s.wi), hit);
    float cosine = -dot(surface.normal, s.wi);
    met = vec4(float(s.primitive), float(hit.primitive), hit.distance, 0.0);
    if (surface.light >= 0) met.w = light_pdf(surface.light, o, hit.distance, cosine, surface.light_density);
"""
OUTPUTS = {"wi": 4, "radiance": 4, "met": 4}
POINT = """
    LightSample s = mesh_light_sample(o, u, probability);
    point = vec4(s.wi * s.distance, float(s.primitive)); pdf = s.pdf; wi = s.wi;"""


def glowing(arrays: tuple[np.ndarray, np.ndarray]) -> Scene:
    """All of it emits, front and inside a ball alike, next to something that does not."""
    dark = Mesh((Part(geometry(ball(6, 3)), "dark"),), (Placement((9.0, 0.0, 0.0)),))
    glow = mesh_scene(geometry(arrays), material=Material(emission=(1.0, 2.0, 3.0)))
    return replace(glow, materials=glow.materials | {"dark": Material()}, meshes=(dark, *glow.meshes))


def packed_of(scene: Scene) -> PackedScene:
    return pack(replace(scene, camera=camera_on(1.0, 0.0)), scene.render, 64, 64)


def inside_out(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    points, triangles = ball(columns, rows)
    return points, triangles[:, ::-1]


@pytest.mark.parametrize(("count", "probability"), [(1, 1.0), (3, 1.0), (200, 1.0), (5000, 1.0), (5000, 2.0**-12)])
def test_triangles_are_drawn_by_density(ctx: moderngl.Context, count: int, probability: float) -> None:
    """Also where the light is chosen so rarely that what is left of u has fewer values than there are triangles."""
    packed = packed_of(glowing(soup(count, size=1.0)))
    assert packed.uniforms["u_mesh_light_count"] == count
    record, vertices = triangles_of(packed)
    numbers, words = shape_records(packed)
    density = words[np.searchsorted(numbers, record)].view(np.float32)[:, 2, 3].astype(np.float64)
    emitting, vertices, density = record[density > 0], vertices[density > 0], density[density > 0]
    assert len(emitting) == count
    a, b, c = vertices.swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    share = density * area
    np.testing.assert_allclose(share.sum(), 1, rtol=1e-6)
    np.testing.assert_allclose(share, 0.9 * area / area.sum() + 0.1 / count, rtol=1e-5)

    samples = 1 << 18
    u = np.random.default_rng(1).random((samples, 2)).astype(np.float32)
    u = np.minimum(u, np.float32(1 - 2**-23))
    u[:, 0] = np.floor(u[:, 0] * 2**23 * probability) / (2**23 * probability)
    inputs = {"u": u, "o": np.zeros((samples, 3)), "probability": np.full(samples, probability)}
    found = scene_probe(ctx, packed, LIGHT, POINT, inputs, {"point": 4, "pdf": 1, "wi": 3})
    order = np.argsort(emitting)
    row = order[np.searchsorted(emitting, found["point"][:, 3], sorter=order)]
    np.testing.assert_array_equal(emitting[row], found["point"][:, 3])

    # The density over solid angle is that over the area of the chosen triangle, from its front.
    normal = np.cross(b - a, c - a)[row]
    cosine = -(found["wi"] * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    distance = np.linalg.norm(found["point"][:, :3], axis=1)
    sure = np.abs(cosine) > 1e-2
    expected = np.where(cosine > 0, density[row] * distance**2 / cosine, 0)
    np.testing.assert_allclose(found["pdf"][sure], expected[sure], rtol=1e-3)
    p_values = {"choice": chi_square(np.bincount(row, minlength=count), samples * share)} if count > 1 else {}

    # The weights of all three vertices, each with the density 2 (1 - w) over an even triangle.
    place = found["point"][:, :3] - a[row]
    edges = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=-1)[row]
    weights = np.linalg.solve(edges, place[..., None])[..., 0]
    assert np.abs(weights[:, 2]).max() < 1e-2 / area.min() ** 0.5
    for name, weight in zip("abc", (1 - weights[:, 0] - weights[:, 1], *weights[:, :2].T), strict=True):
        p_values[name] = stats.kstest((1 - np.clip(weight, 0, 1)) ** 2, "uniform").pvalue
    assert_likely(p_values)


@pytest.mark.parametrize("others", [False, True])
def test_the_density_of_a_sample_is_that_of_its_hit(ctx: moderngl.Context, others: bool) -> None:
    scene = glowing(inside_out(16, 8))
    if others:
        shapes = {"spheres": (Sphere((0.0, 0.0, 4.0), 0.5, "mesh"),), "lights": (Light((0.0, 3.0, 0.0), power=1.0),)}
        panel = Rectangle((3.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), "mesh")
        scene = replace(scene, rectangles=(panel,), **shapes)
    packed = packed_of(scene)
    assert packed.uniforms["u_light_count"] == (4 if others else 1)
    rng = np.random.default_rng(1)
    count = 1 << 14
    origin = 0.5 * random_directions(rng, count) - packed.origin
    u = np.minimum(rng.random((count, 2)).astype(np.float32), np.float32(1 - 2**-23))
    found = scene_probe(ctx, packed, LIGHT, SAMPLE, {"o": origin, "u": u}, OUTPUTS)
    of_mesh = np.isin(found["met"][:, 0], triangles_of(packed)[0])
    assert of_mesh.mean() > 0.2
    same = of_mesh & (found["met"][:, 0] == found["met"][:, 1])
    assert same.sum() > 0.98 * of_mesh.sum()  # the rest are on edges, and the neighbour is met
    np.testing.assert_allclose(found["met"][same, 3], found["radiance"][same, 3], rtol=2e-4)
    np.testing.assert_allclose(found["met"][same, 2], found["wi"][same, 3], rtol=1e-4)
    assert (found["radiance"][of_mesh, :3] == [1, 2, 3]).all()


def test_the_density_integrates_to_one(ctx: moderngl.Context) -> None:
    """Over all directions from within a closed mesh that shines inwards; and it is 0 from outside."""
    packed = packed_of(glowing(inside_out(32, 16)))
    body = """
        Hit hit = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false);
        Surface s = surface_at(Ray(o, d), hit);
        pdf = s.light < 0 ? 0.0 : light_pdf(s.light, o, hit.distance, -dot(s.normal, d), s.light_density);
    """
    rng = np.random.default_rng(1)
    count = 1 << 17
    direction = random_directions(rng, count)
    origin = np.array([0.3, -0.4, 0.2]) - packed.origin
    inputs = {"o": np.broadcast_to(origin, (count, 3)), "d": direction}
    pdf = 4 * np.pi * scene_probe(ctx, packed, LIGHT, body, inputs, {"pdf": 1})["pdf"]
    assert abs(pdf.mean() - 1) < 4 * pdf.std() / np.sqrt(count)
    assert pdf.std() < 1.5  # so that the test can see a few thousandths
    outside = {"o": 3.0 * direction - packed.origin, "d": -direction}
    assert not scene_probe(ctx, packed, LIGHT, body, outside, {"pdf": 1})["pdf"].any()


@pytest.mark.parametrize("count", [1, 2, 7, 1000, 100_000])
def test_alias_table(count: int) -> None:
    rng = np.random.default_rng(count)
    for power in (0, 1, 8):
        probability = rng.random(count) ** power
        probability /= probability.sum()
        threshold, other = alias_table(probability)
        assert (threshold >= 0).all()
        assert (threshold <= 1).all()
        drawn = (threshold + np.bincount(other, 1 - threshold, count)) / count
        np.testing.assert_allclose(drawn, probability, atol=1e-9 / count)


def test_a_height_field_has_its_area() -> None:
    """The power of all triangles is what decides how often meshes are drawn among other lights."""
    points, triangles = field(8)
    scene = glowing((points * [1, 0, 1], triangles))
    assert power_of_meshes(scene) == pytest.approx(np.pi * 4 * 6)


def power_of_meshes(scene: Scene) -> float:
    """Beside a point light of as much power as they have in all, meshes are chosen as often."""
    share = []
    for watts in (50.0, 100.0):
        packed = packed_of(replace(scene, lights=(Light((0.0, 3.0, 0.0), power=watts),)))
        choices = packed.scene_records["LightChoice"]
        mesh = choices[:, 0, 2] == LightKind.MESH
        share.append((float(choices.view(np.float32)[mesh, 0, 1][0]) - 0.1 / 2) / 0.9)
    powers = [3 * watts * p / (1 - p) for watts, p in zip((50.0, 100.0), share, strict=True)]
    assert powers[0] == pytest.approx(powers[1], rel=1e-6)
    return powers[0]
