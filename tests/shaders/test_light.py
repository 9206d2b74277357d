# SPDX-License-Identifier: MIT
"""light/: samples of all lights together, and of each kind for itself."""

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.gpu.specialise import Level
from fragtracer.packing.lights import LightKind
from fragtracer.packing.shapes import Kind
from fragtracer.probe import probe
from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Light,
    Material,
    Rectangle,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)
from fragtracer.scene.light import NARROWEST_SPOT

from . import Floats, domains
from .chi_square import assert_fits, fit
from .directions import direction, random_directions
from .light_oracle import LIGHTS, khronos_falloff, sphere_irradiance
from .scene_oracle import bounds, corners_of, shapes_of
from .scene_probe import light_numbers, random_scene, scene_probe, shape_records
from .test_light_choice import LIGHT, packed_lights

FLATS = ["rectangle", "disk", "triangle"]

SAMPLE = (
    "LightSample s = light_sample(o, u); wi = vec4(s.wi, s.distance); pdf = vec3(s.pdf, float(s.delta), s.primitive);"
)
SAMPLED = {"wi": 4, "pdf": 3}


@pytest.mark.parametrize("most_listed", [0, 10**6], ids=["bvh", "listed"])
@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
def test_density_of_a_sample_is_that_of_its_hit(ctx: moderngl.Context, most_listed: int, level: Level) -> None:
    """What light_sample says of a direction is what a path that meets the light there asks of light_pdf;
    and the light is at the distance it says."""
    scene = random_scene(5)
    packed = packed_lights(scene, most_listed)
    rng = np.random.default_rng(1)
    count = 1 << 16
    origin = rng.normal(size=(count, 3)).astype(np.float32)
    body = f"""{SAMPLE}
        for (int i = 0; i < u_light_count; i++) {{
            LightChoice c = light_choice_load(i);
            int primitive = -2;
            vec3 normal = vec3(0.0);
            if (c.kind == LIGHT_SPHERE) primitive = sphere_light_load(c.record).primitive;
            if (c.kind == LIGHT_AREA) {{
                primitive = area_light_load(c.record).primitive;
                normal = area_light_load(c.record).normal;
            }}
            float alone = c.probability;
            if (i < u_light_tree_count) alone = light_tree_probability(o, c.cumulative, c.probability);
            vec3 place = vec3(1e9);
            if (c.kind == LIGHT_POINT) place = point_light_load(c.record).position;
            if (c.kind == LIGHT_SPOT) place = spot_light_load(c.record).position;
            bool is_there = distance(o + s.wi * s.distance, place) < 1e-5;
            if (s.delta && (c.kind == LIGHT_DIRECTIONAL ? s.distance > 1e6 : is_there)) met = alone;
            if (primitive == s.primitive && !s.delta) {{
                cosine = -dot(s.wi, normal);
                met = light_pdf(i, o, s.distance, cosine, 0.0);
                number = float(i);
            }}
        }}"""
    inputs = {"o": origin, "u": rng.random((count, 2), np.float32)}
    outputs = SAMPLED | {"met": 1, "cosine": 1, "number": 1}
    result = scene_probe(ctx, packed, LIGHT, body, inputs, outputs, level)
    pdf, delta, primitive = result["pdf"].T
    assert (pdf >= 0).all()
    assert ((primitive == -1) == (delta == 1))[pdf > 0].all()
    assert not delta[pdf == 0].any()  # within a sphere, where there is no sample, or behind an area
    np.testing.assert_allclose(result["met"], pdf, rtol=1e-5)

    found = pdf > 0
    wi, distance = result["wi"][:, :3], result["wi"][:, 3]
    assert np.abs(np.linalg.norm(wi[found], axis=1) - 1).max() < 1e-6
    shines = [
        s for s in shapes_of(scene) if s.material not in scene.materials or scene.materials[s.material].is_emissive
    ]
    kinds = [LightKind.SPHERE if isinstance(shape, Sphere) else LightKind.AREA for shape in shines]
    number_of = light_numbers(packed)
    numbers = [number_of[kind, kinds[:k].count(kind)] for k, kind in enumerate(kinds)]
    for i, shape in zip(numbers, shines, strict=True):
        mine = found & (delta == 0) & (result["number"] == i)
        assert len(np.unique(primitive[mine])) == 1
        low, high = bounds(shape, origin[mine] + packed.origin, wi[mine], 1e-5)
        assert ((distance[mine] >= low - 1e-5) & (distance[mine] <= high + 1e-5)).all(), shape
        if not isinstance(shape, Sphere):
            assert (result["cosine"][mine] > 0).all()
            behind = (delta == 0) & (result["number"] == i) & (result["cosine"] <= 0)
            assert not pdf[behind].any()  # behind it is dark
    assert len(np.unique(result["number"][found & (delta == 0)])) == len(shines)


CEILING = Rectangle((-0.5, 2.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), "dim")  # its front looks down
HATCH = Disk((0.3, 1.8, 0.6), (0.2, -1.0, -0.3), 0.5, "dim")
GABLE = Triangle(((1.0, 0.5, 0.0), (1.5, 2.0, 1.0), (1.2, 1.5, -1.0)), "bright")
BALL = Sphere((-1.0, 1.5, 0.5), 0.4, "dim")


def lit_by(**contents: Any) -> Scene:
    materials = {"dim": Material(emission=(1.0, 0.5, 0.2)), "bright": Material(emission=(7.0, 8.0, 9.0))}
    return Scene(camera=Camera((0.0, 1.0, 3.0)), materials=materials, **contents)


EMISSIVE = {
    "rectangle": {"rectangles": (CEILING,)},
    "disk": {"disks": (HATCH,)},
    "triangle": {"triangles": (GABLE,)},
    "sphere": {"spheres": (BALL,)},
}
OWN = {name: {kind: (light,)} for kind, model in LIGHTS.items() for name, light in model.examples.items()}
# Two of each kind, so that the records of a kind follow each other.
SECOND = {
    "lights": (
        Light((-0.8, 1.2, 0.4), power=(5.0, 15.0, 25.0)),
        Light((1.5, 1.5, -0.5), radius=0.3, radiance=(3.0, 2.0, 1.0)),
    ),
    "spot_lights": (SpotLight((-0.5, 1.5, 0.6), (0.3, -1.0, -0.4), (2.0, 3.0, 6.0), 20.0, 50.0),),
    "directional_lights": (DirectionalLight((-0.5, -1.0, 0.2), (0.2, 0.5, 0.9)),),
}
EVERYTHING = {kind: (*model.examples.values(), *SECOND[kind]) for kind, model in LIGHTS.items()}
EVERYTHING |= {kind: shapes for contents in EMISSIVE.values() for kind, shapes in contents.items()}
ROOMS = {name: lit_by(**contents) for name, contents in (EMISSIVE | OWN | {"all": EVERYTHING}).items()}


def polygon_irradiance(corners: Floats, normal: Floats) -> float:
    """Of radiance 1 from the front of a polygon wholly above the horizon (Lambert's formula)."""
    v = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    after = np.roll(v, -1, axis=0)
    cross = np.cross(v, after)
    angle = np.arctan2(np.linalg.norm(cross, axis=1), (v * after).sum(1))
    across = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    return max(0.0, float(-(angle[:, None] * across).sum(0) @ normal / 2))


def irradiance(scene: Scene, normal: Floats) -> Floats:
    """At the origin, of everything that emits, as if nothing stood in its way."""
    total = np.zeros(3)
    for r in scene.rectangles:
        c, u, v = (np.array(x) for x in (r.corner, r.edge_u, r.edge_v))
        corners = np.array([c, c + u, c + u + v, c + v])
        total += polygon_irradiance(corners, normal) * np.array(scene.materials[r.material].emission)
    for d in scene.disks:  # as a polygon of 4096 sides and the same area
        turns = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
        center, u, v = corners_of(d)
        swell = np.sqrt(np.pi / (4096 * np.sin(2 * np.pi / 4096) / 2))
        corners = center + swell * (np.cos(turns)[:, None] * (u - center) + np.sin(turns)[:, None] * (v - center))
        total += polygon_irradiance(corners, normal) * np.array(scene.materials[d.material].emission)
    for t in scene.triangles:
        total += polygon_irradiance(np.array(t.vertices), normal) * np.array(scene.materials[t.material].emission)
    for s in scene.spheres:
        emission = np.array(scene.materials[s.material].emission)
        total += sphere_irradiance(np.array(s.center), s.radius, normal) * emission
    for kind, model in LIGHTS.items():
        for light in getattr(scene, kind):
            total += model.irradiance(light, normal)
    return total


(SPOT,) = LIGHTS["spot_lights"].examples.values()
(SUN,) = LIGHTS["directional_lights"].examples.values()
SPOTS = [
    SPOT,
    SpotLight((1.0, 2.0, 3.0), (0.0, 0.0, -1.0), (1.0, 2.0, 3.0), 0.0, 90.0),
    SpotLight((-1.0, 0.0, 0.0), (3.0, 1.0, -2.0), (5.0, 0.0, 1.0), 30.0, 33.0),
    SpotLight((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 89.0, 90.0),
    SpotLight((0.0, 0.0, 0.0), (1.0, 2.0, -2.0), (1.0, 1.0, 1.0), 0.0, 0.1),
    SpotLight((0.0, 0.0, 0.0), (2.0, 1.0, 3.0), (1.0, 1.0, 1.0), NARROWEST_SPOT / 2, NARROWEST_SPOT),
]


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
@pytest.mark.parametrize("spot", SPOTS)
def test_spot(ctx: moderngl.Context, spot: SpotLight, level: Level) -> None:
    """Its falloff in every direction, at every distance; it is a delta light that nothing meets."""
    packed = packed_lights(Scene(spot_lights=(spot,), camera=Camera((0.0, 1.0, 3.0)), materials={"m": Material()}))
    rng = np.random.default_rng(5)
    axis = np.array(spot.direction) / np.linalg.norm(spot.direction)
    direction = np.concatenate(
        [random_directions(rng, 4000), around(axis, spot.inner_degrees, spot.outer_degrees, rng)]
    )
    distance = 10 ** rng.uniform(-1, 2, len(direction))
    origin = np.array(spot.position) + distance[:, None] * direction - packed.origin
    body = f"{SAMPLE} radiance = s.radiance;"
    inputs = {"o": origin, "u": rng.random((len(direction), 2))}
    found = scene_probe(ctx, packed, LIGHT, body, inputs, SAMPLED | {"radiance": 3}, level)
    assert (found["pdf"] == (1, 1, -1)).all()
    np.testing.assert_allclose(found["wi"][:, :3], -direction, atol=3e-6 * (1 + 4 / distance[:, None]).max())
    np.testing.assert_allclose(found["wi"][:, 3], distance, rtol=1e-5)
    # float32 knows directions to a few 1e-7, and to the rounding of the places.
    inner, outer = np.radians([spot.inner_degrees, spot.outer_degrees])
    edge = np.sin(outer) / (2 * np.sin((outer + inner) / 2) * np.sin((outer - inner) / 2))
    doubt = 2 * edge * (5e-7 + 1e-6 * 4 / distance)
    falloff = khronos_falloff(spot, direction)
    exact = np.array(spot.intensity) / (distance**2)[:, None]
    error = np.abs(found["radiance"] - falloff[:, None] * exact)
    assert (error <= exact * (doubt + 2e-5 * falloff)[:, None]).all()
    assert (falloff == 1).any() or spot.inner_degrees == 0
    assert ((falloff > 0) & (falloff < 1)).mean() > 0.02


def around(axis: Floats, inner: float, outer: float, rng: np.random.Generator) -> Floats:
    """Directions from within the inner to beyond the outer angle."""
    across = np.cross(axis, random_directions(rng, 2000))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    margin = min(3.0, outer)
    angle = np.radians(rng.uniform(max(0.0, inner - margin), outer + margin, (2000, 1)))
    result: Floats = np.cos(angle) * axis + np.sin(angle) * across
    return result


@pytest.mark.parametrize("level", [Level.NOTHING, Level.SCENE], ids=["texture", "compiled in"])
def test_directional(ctx: moderngl.Context, level: Level) -> None:
    """The same from everywhere, against the way that it travels."""
    packed = packed_lights(lit_by(directional_lights=(SUN,)))
    rng = np.random.default_rng(6)
    inputs = {"o": 100 * rng.normal(size=(1000, 3)), "u": rng.random((1000, 2))}
    found = scene_probe(
        ctx, packed, LIGHT, f"{SAMPLE} radiance = s.radiance;", inputs, SAMPLED | {"radiance": 3}, level
    )
    expected = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    np.testing.assert_allclose(found["wi"][:, :3], np.broadcast_to(expected, (1000, 3)), rtol=2e-7)
    assert (found["wi"][:, 3] == np.float32(1e30)).all()
    assert (found["pdf"] == (1, 1, -1)).all()
    np.testing.assert_allclose(found["radiance"], np.broadcast_to(SUN.irradiance, (1000, 3)), rtol=2e-7)


@pytest.mark.parametrize("name", ROOMS)
def test_irradiance(ctx: moderngl.Context, name: str) -> None:
    """The mean of radiance times cosine over the density is the closed form: it needs the density, the
    distance and the choice of the light to be right together."""
    scene = ROOMS[name]
    packed = packed_lights(scene)
    u = np.random.default_rng(2).random((1 << 20, 2), np.float32)
    x, z, y = direction(15)
    for normal in (np.array([0.0, 1.0, 0.0]), np.array([x, y, z])):
        place = np.broadcast_to((-packed.origin).astype(np.float32), (len(u), 3))
        facing = np.broadcast_to(normal, (len(u), 3))
        body = """
            LightSample s = light_sample(o, u);
            if (s.pdf > 0.0) e = s.radiance * max(0.0, dot(s.wi, n)) / s.pdf;"""
        e = scene_probe(ctx, packed, LIGHT, body, {"o": place, "n": facing, "u": u}, {"e": 3})["e"]
        error = e.std(axis=0) / np.sqrt(len(e))
        expected = irradiance(scene, normal)
        assert (np.abs(e.mean(axis=0) - expected) <= 4.5 * error + 1e-5 * expected).all()
        assert (error < 0.005 * expected).all()


RECTANGLE, DISK, TRIANGLE = Kind.RECTANGLE, Kind.DISK, Kind.SINGLE_TRIANGLE


def test_flat_lights_are_dark_from_behind(ctx: moderngl.Context) -> None:
    """Above the ceiling and the disk, and below the triangle whose front is above."""
    turned = replace(GABLE, vertices=GABLE.vertices[::-1])
    for most_listed in (0, 10**6):
        packed = packed_lights(lit_by(rectangles=(CEILING,), disks=(HATCH,), triangles=(turned,)), most_listed)
        numbers, words = shape_records(packed)
        kind = dict(zip(numbers.tolist(), (words[:, 0, 3] >> 24).tolist(), strict=True))
        u = np.random.default_rng(3).random((1 << 12, 2), np.float32)
        for place, lit in (((0.0, 3.0, 0.0), {TRIANGLE}), ((0.0, 0.0, 0.0), {RECTANGLE, DISK})):
            origin = np.broadcast_to(np.array(place) - packed.origin, (len(u), 3))
            result = scene_probe(ctx, packed, LIGHT, SAMPLE, {"o": origin, "u": u}, SAMPLED)
            of = np.array([kind[int(p)] for p in result["pdf"][:, 2]])
            assert set(of.tolist()) == {RECTANGLE, DISK, TRIANGLE}
            for one in {RECTANGLE, DISK, TRIANGLE} - lit:
                assert not result["pdf"][of == one, 0].any()
            if lit == {RECTANGLE, DISK}:
                assert (result["pdf"][np.isin(of, (RECTANGLE, DISK)), 0] > 0).all()


KINDS = {"rectangle": "KIND_RECTANGLE", "disk": "KIND_DISK", "triangle": "KIND_SINGLE_TRIANGLE"}


@pytest.mark.parametrize("kind", FLATS)
def test_points_are_uniform_over_the_area(ctx: moderngl.Context, kind: str) -> None:
    """Whatever the place they are seen from; the density over solid angle is that over the area, turned."""
    corner, u_edge, v_edge, origin = (np.float32(v) for v in ((1, 2, 3), (2, 0, 0.5), (0, 3, 0), (0.5, 1, -2)))
    if kind == "disk":
        v_edge = v_edge / 3 * np.linalg.norm(u_edge)
    normal = np.cross(v_edge, u_edge).astype(np.float32)  # on the side of the origin
    normal /= np.linalg.norm(normal)
    place = np.random.default_rng(4).random((1 << 18, 2), np.float32)
    a, u, v, n, o = (f"vec3{tuple(x.tolist())}" for x in (corner, u_edge, v_edge, normal, origin))
    body = f"""
        AreaLight light = AreaLight({a}, 2.5, {u}, {KINDS[kind]}, {v}, 17, {n}, vec3(1.0, 2.0, 3.0));
        LightSample s = area_light_sample(light, {o}, place);
        point = vec4(s.wi, s.distance); said = s.pdf; radiance = s.radiance;
        what = vec2(float(s.primitive), float(s.delta));
        pdf = area_light_pdf(2.5, s.distance, 0.4);"""
    outputs = {"point": 4, "said": 1, "radiance": 3, "what": 2, "pdf": 1}
    result = probe(ctx, ["light/area.glsl"], body, {"place": place}, outputs)
    wi, distance = result["point"][:, :3].astype(np.float64), result["point"][:, 3].astype(np.float64)
    found = origin + distance[:, None] * wi - corner
    inside = found @ np.linalg.pinv(np.stack([u_edge, v_edge]).astype(np.float64))
    if kind == "disk":
        assert np.linalg.norm(inside, axis=1).max() < 1 + 2e-6
        points = inside / np.maximum(1, np.linalg.norm(inside, axis=1) + 1e-9)[:, None]
    else:
        assert np.abs(inside - np.clip(inside, 0, 1)).max() < 2e-6
        points = np.clip(inside, 0, 1 - 1e-9)
    if kind == "triangle":
        assert points.sum(1).max() < 1 + 2e-6
        points /= np.maximum(1, points.sum(1) + 1e-9)[:, None]
    domain, density = {
        "rectangle": (domains.Box(), 1.0),
        "disk": (domains.Disk(), 1 / np.pi),
        "triangle": (domains.Triangle(), 2.0),
    }[kind]
    assert_fits({kind: fit(domain, points, lambda points: np.full(len(points), density))})
    np.testing.assert_allclose(result["pdf"], distance**2 / (0.4 * 2.5), rtol=1e-6)
    cosine = -wi @ normal.astype(np.float64)
    assert (cosine > 0).all()
    np.testing.assert_allclose(result["said"], distance**2 / (cosine * 2.5), rtol=1e-5)
    assert (result["radiance"] == (1, 2, 3)).all()
    assert (result["what"] == (17, 0)).all()


@pytest.mark.parametrize("kind", FLATS)
def test_density_of_an_area_integrates_to_one(ctx: moderngl.Context, kind: str) -> None:
    """Over the directions in which the shader's own intersection meets it; and it is 0 from behind."""
    shapes = {"rectangle": {"rectangles": (CEILING,)}, "disk": {"disks": (HATCH,)}, "triangle": {"triangles": (GABLE,)}}
    scene = lit_by(**shapes[kind])
    packed = packed_lights(scene)
    (shape,) = shapes_of(scene)
    a, b, c = corners_of(shape)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    for side in (1, -1):
        origin = a + (b - a) * 0.3 + (c - a) * 0.3 + side * 0.6 * normal
        axis = tuple((-side * normal).tolist())
        rng = np.random.default_rng(7)
        count = 1 << 18
        s, t = rng.random((2, count))
        wi, _ = domains.Cone(axis).place(s, t)  # uniform over the hemisphere that looks at it
        body = """
            Hit hit = scene_intersect(Ray(o, d), INFINITE_DISTANCE, NO_PRIMITIVE, false);
            if (hit.primitive != NO_PRIMITIVE) {
                Surface s = surface_at(Ray(o, d), hit);
                pdf = light_pdf(s.light, o, hit.distance, -dot(s.normal, d), 0.0);
            }"""
        inputs = {"o": np.broadcast_to(origin - packed.origin, (count, 3)), "d": wi}
        pdf = 2 * np.pi * scene_probe(ctx, packed, LIGHT, body, inputs, {"pdf": 1})["pdf"]
        if side == 1:
            assert abs(pdf.mean() - 1) < 4 * pdf.std() / np.sqrt(count)
            assert pdf.std() / np.sqrt(count) < 0.01
        else:
            assert not pdf.any()
