# SPDX-License-Identifier: MIT
"""The split-sum integrator: closed forms, and each of its steps against the path tracer and against its neighbours."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
import split_sum_oracle as oracle
from rendering import Planter, rendered
from scene_builders import lambert, stare

from fragtracer.gpu.cube_maps import MapSizes
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.scene import Ambient, Camera, Geometry, Light, Material, Mesh, Part, Rectangle, Scene, Sphere
from fragtracer.scene.environment import Environment, Panorama, lookup

WHITE = Environment(radiance=(1.0, 1.0, 1.0))
PICTURE = Environment(image=Panorama(oracle.picture(128)), rotation_degrees=70.0, strength=0.5, tint=(1.0, 0.8, 1.5))
LOOKED_UP = ("LOOKUPS", "OCCLUSION_MAP")
STEPS = re.findall(r"#define SPLIT_SUM_(\w+) \d", (folder("shaders") / "integrator/split_sum.glsl").read_text("utf-8"))


def at(step: str) -> dict[str, Any]:
    """The settings of a step."""
    masking = "GEOMETRY_SMITH" if step in ("OCCLUDED", "UNOCCLUDED") else "GEOMETRY_KARIS_ENVIRONMENT"
    defines = {"SPLIT_SUM_STEP": f"SPLIT_SUM_{step}", "GEOMETRY_TERM": masking}
    return {"integrator": "split-sum", "defines": defines}


def at_angle(cosine: float, material: Material, environment: Environment | None, **more: Any) -> Scene:
    """A point of the plane y = 0, seen under an angle from the +x side."""
    sine = np.sqrt(1 - cosine**2)
    floor = Rectangle((-5.0, 0.0, 5.0), (10.0, 0.0, 0.0), (0.0, 0.0, -10.0), "floor")
    camera = stare((0.0, 0.0, 0.0), (4 * sine, 4 * cosine, 0.0))
    return Scene(camera=camera, materials={"floor": material}, rectangles=(floor,), environment=environment, **more)


def value(ctx: moderngl.Context, scene: Scene, spp: int = 1, **settings: Any) -> np.ndarray:
    defines = settings.pop("defines", None)
    with Renderer(scene, (8, 8), context=ctx, defines=defines, rays=min(spp, 256), **settings) as renderer:
        image = renderer.render(spp)
        assert renderer.non_finite_samples() == 0
    return image.mean(axis=(0, 1), dtype=np.float64)


@pytest.mark.parametrize("roughness", [0.0, 0.15, 0.5, 0.77, 1.0])
@pytest.mark.parametrize("cosine", [0.1, 0.5, 0.97])
def test_white_metal_under_white_light_is_scale_plus_bias(
    ctx: moderngl.Context, cosine: float, roughness: float
) -> None:
    metal = Material(albedo=1.0, metallic=1.0, roughness=roughness)
    settings = {"integrator": "split-sum", "specialised": False}  # one program for all angles
    found = value(ctx, at_angle(cosine, metal, WHITE), **settings)
    outer = 0.5 / MapSizes().brdf  # beyond the middle of its outer texels the map is constant
    closed = sum(oracle.brdf(cosine, min(max(roughness, outer), 1 - outer), oracle.g1_environment))
    np.testing.assert_allclose(found, closed, rtol=4e-3)
    ambient = value(ctx, at_angle(cosine, metal, None, ambient=Ambient(1.0)), **settings)
    np.testing.assert_allclose(ambient, found, rtol=1e-6)


@pytest.mark.parametrize("metallic", [0.0, 0.4])
def test_dielectric_under_white_light_is_the_formula(ctx: moderngl.Context, metallic: float) -> None:
    cosine, roughness = 0.4, 0.6
    material = Material(albedo=(0.8, 0.4, 0.1), metallic=metallic, roughness=roughness, f0=0.04)
    found = value(ctx, at_angle(cosine, material, WHITE), integrator="split-sum")
    albedo = np.array((0.8, 0.4, 0.1))
    f0 = 0.04 * (1 - metallic) + albedo * metallic
    f = f0 + (np.maximum(1 - roughness, f0) - f0) * (1 - cosine) ** 5
    scale, bias = oracle.brdf(cosine, roughness, oracle.g1_environment)
    np.testing.assert_allclose(found, (1 - f) * (1 - metallic) * albedo + f * scale + bias, rtol=6e-3)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.6, 0.64, 0.48), (-0.36, -0.48, 0.8)])
def test_diffuse_sphere_is_the_integral(ctx: moderngl.Context, normal: tuple[float, float, float]) -> None:
    n = np.array(normal)
    spheres = (Sphere((0.0, 0.0, 0.0), 1.0, "grey"),)
    scene = Scene(camera=stare(normal, tuple(3 * n)), materials={"grey": lambert(0.5)}, spheres=spheres)
    found = value(ctx, replace(scene, environment=PICTURE), integrator="split-sum")
    integrals = oracle.Integrals(PICTURE.pixels)
    wanted = 0.5 * integrals.irradiance(n @ PICTURE.rotation) * PICTURE.scale
    np.testing.assert_allclose(found, wanted, rtol=2e-3)


def test_mirror_is_the_path_traced_one(ctx: moderngl.Context) -> None:
    mirror = {"mirror": Material(albedo=(1.0, 0.8, 0.5), metallic=1.0, roughness=0.0)}
    camera = Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), fov_degrees=40.0)
    scene = Scene(camera, mirror, spheres=(Sphere((0.0, 0.0, 0.0), 1.0, "mirror"),), environment=PICTURE)
    ours = rendered(ctx, scene, 32, (48, 48), integrator="split-sum")
    truth = rendered(ctx, scene, 32, (48, 48))
    error = np.abs(ours / truth - 1)
    # Towards the rim, at 17 pixels, the approximation puts F in the place of F0.
    inside = np.hypot(*np.mgrid[-23.5:24, -23.5:24]) < 9
    assert error[inside].max() < 0.02
    np.testing.assert_allclose(ours[:4], truth[:4], rtol=1e-5)  # the background is that of the path tracer


MATERIALS = {
    "smooth": Material(albedo=(0.9, 0.7, 0.3), metallic=1.0, roughness=0.1),
    "rough": Material(albedo=(0.7, 0.9, 0.8), metallic=1.0, roughness=0.8),
    "plastic": Material(albedo=(0.8, 0.3, 0.2), roughness=0.4),
    "mirror": Material(albedo=0.9, metallic=1.0, roughness=0.0),
    "chalk": lambert(0.7),
}
BALLS = Scene(
    camera=Camera((0.0, 2.0, 7.0), (0.0, 0.0, 0.0), fov_degrees=40.0),
    materials=MATERIALS,
    spheres=tuple(Sphere((1.05 * i - 2.1, 0.0, 0.0), 0.5, name) for i, name in enumerate(MATERIALS)),
    rectangles=(Rectangle((-4.0, -0.5, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -8.0), "chalk"),),
    environment=PICTURE,
)


def image(ctx: moderngl.Context, scene: Scene, seed: int, spp: int = 512, **settings: Any) -> np.ndarray:
    """Means of 6 x 6 pixels."""
    defines = settings.pop("defines", None)
    with Renderer(scene, (72, 48), context=ctx, defines=defines, seed=seed, rays=64, **settings) as renderer:
        found = renderer.render(spp)
        assert renderer.non_finite_samples() == 0
    return found.reshape(8, 6, 12, 6, 3).mean(axis=(1, 3), dtype=np.float64)


def test_first_step_is_direct_light(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Integrated with occlusion, the light of the environment, here with a sun, is what the path tracer finds with one
    bounce. No map is looked up, so that black ones do."""
    black = {name: np.zeros((1, 1, 3), np.float32) for name in ("irradiance", "prefiltered")}
    monkeypatch.setattr("fragtracer.gpu.tracer.environment_maps", lambda *_: black)
    scene = replace(BALLS, environment=replace(PICTURE, image=Panorama(oracle.picture(128, 300.0))))
    ours = image(ctx, scene, 1, **at("OCCLUDED"))
    truth = image(ctx, scene, 2, bounces=1)
    assert ours.mean() == pytest.approx(truth.mean(), rel=2e-3)
    assert np.abs(ours / truth - 1).max() < 0.03


def test_last_step_is_what_the_maps_say(ctx: moderngl.Context) -> None:
    """Lookups add no error of their own where the environment is smooth: all others have been made by then."""
    integrated = image(ctx, BALLS, 1, 2048, **at("FRESNEL"))
    looked_up = image(ctx, BALLS, 2, 64, **at("LOOKUPS"))
    assert looked_up.mean() == pytest.approx(integrated.mean(), rel=2e-3)
    assert np.abs(looked_up / integrated - 1).max() < 0.02


@pytest.mark.parametrize(
    ("cosine", "step"), [*((0.3, step) for step in STEPS), *((0.9, step) for step in ("OCCLUDED", "NORMAL_VIEW"))]
)
def test_steps_under_white_light(ctx: moderngl.Context, cosine: float, step: str) -> None:
    """Each is a closed form there: the specular factors come one after the other."""
    roughness, f0 = 0.5, 0.3
    metal = Material(albedo=f0, metallic=1.0, roughness=roughness)
    found = value(ctx, at_angle(cosine, metal, WHITE), 8192, **at(step))
    g1 = oracle.g1_smith if step in ("OCCLUDED", "UNOCCLUDED") else oracle.g1_environment
    scale, bias = oracle.brdf(cosine, roughness, g1)
    f = f0 + (max(1 - roughness, f0) - f0) * (1 - cosine) ** 5 if step in ("FRESNEL", *LOOKED_UP) else f0
    np.testing.assert_allclose(found, f * scale + bias, rtol=6e-3)


@pytest.mark.parametrize("step", ["DIFFUSE", "FACTORS", "NORMAL_VIEW", "FRESNEL", "LOOKUPS"])
def test_diffuse_steps_under_white_light(ctx: moderngl.Context, step: str) -> None:
    cosine, roughness = 0.5, 0.7
    plastic = Material(albedo=0.8, roughness=roughness, f0=0.04)
    found = value(ctx, at_angle(cosine, plastic, WHITE), 8192, **at(step))
    scale, bias = oracle.brdf(cosine, roughness, oracle.g1_environment)
    f = 0.04 + (1 - roughness - 0.04) * (1 - cosine) ** 5
    wanted = (1 - f) * 0.8 + (f if step in ("FRESNEL", *LOOKED_UP) else 0.04) * scale + bias
    np.testing.assert_allclose(found, wanted, rtol=3e-3)


def test_point_light_is_the_formula(ctx: moderngl.Context) -> None:
    """Two metres above a surface that nothing else lights, with something in between that casts no shadow."""
    material = Material(albedo=0.8, roughness=0.6, f0=0.04)
    light = Light((1.0, 2.0, 0.0), power=(100.0, 100.0, 100.0))
    cosine = 0.8
    scene = at_angle(cosine, material, None, lights=(light,))
    scene = replace(scene, spheres=(Sphere((0.5, 1.0, 0.0), 0.1, "floor"),))
    found = value(ctx, scene, integrator="split-sum")
    wo, wi = np.array([0.6, 0.8]), np.array([1.0, 2.0]) / np.sqrt(5)
    h = (wo + wi) / np.linalg.norm(wo + wi)
    alpha, k = 0.36, 1.6**2 / 8
    f = 0.04 + 0.96 * (1 - h @ wo) ** 5
    g = np.prod([c / (c * (1 - k) + k) for c in (wo[1], wi[1])])
    specular = oracle.d_ggx(alpha, h[1] ** 2) * f * g / (4 * wo[1] * wi[1])
    wanted = ((1 - f) * 0.8 / np.pi + specular) * 100 / (4 * np.pi) / 5 * wi[1]
    np.testing.assert_allclose(found, wanted, rtol=1e-4)


def test_small_lights_are_points(ctx: moderngl.Context) -> None:
    """A sphere, a rectangle and a point of the same intensity light a surface alike."""
    floor = lambert(0.5)
    power = 40.0
    point = Light((0.0, 2.0, 0.0), power=(power,) * 3)
    sphere = replace(point, radius=0.01)
    side = 0.02
    lamp = lambert(0.0, emission=power / (4 * np.pi) / side**2)
    rectangle = Rectangle((-side / 2, 2.0, -side / 2), (side, 0.0, 0.0), (0.0, 0.0, side), "lamp")
    base = at_angle(0.7, floor, None)
    scenes = [replace(base, lights=(point,)), replace(base, lights=(sphere,))]
    both = {"floor": floor, "lamp": lamp}
    scenes.append(replace(base, materials=both, rectangles=(*base.rectangles, rectangle)))
    found = [value(ctx, scene, integrator="split-sum") for scene in scenes]
    np.testing.assert_allclose(found, 0.5 / np.pi * power / (4 * np.pi) / 4, rtol=1e-3)


def test_meshes_that_emit_are_seen_and_give_no_light(ctx: moderngl.Context) -> None:
    """The surface under one, which is at the middle of the scene, is black."""
    lamp = Geometry([(-1, 1, -1), (1, 1, -1), (0, 1, 1)], [(0, 1, 2)])
    above = Mesh((Part(lamp, "lamp"),))
    both = {"floor": lambert(0.5), "lamp": lambert(0.0, emission=5.0)}
    scene = replace(at_angle(0.7, lambert(0.5), None), materials=both, meshes=(above,))
    assert value(ctx, scene, 64, bounces=1).min() > 0.1
    assert value(ctx, scene, integrator="split-sum").max() == 0
    seen = replace(scene, camera=stare((0.0, 1.0, 0.0), (0.0, 0.2, 0.5)))
    np.testing.assert_allclose(value(ctx, seen, integrator="split-sum"), 5.0, rtol=1e-6)


@pytest.mark.parametrize("integrator", ["path", "split-sum"])
def test_backgrounds(ctx: moderngl.Context, integrator: str) -> None:
    scene = Scene(camera=stare((0.0, 0.3, 1.0), (0.0, 0.0, 0.0)), environment=PICTURE)
    direction = np.array([0.0, 0.3, 1.0]) / np.hypot(0.3, 1.0) @ PICTURE.rotation
    integrals = oracle.Integrals(PICTURE.pixels)
    wanted = {
        "environment": lookup(PICTURE.pixels, direction),
        "irradiance": integrals.irradiance(direction),
        "black": np.zeros(3),
    }
    for background, radiance in wanted.items():
        found = value(ctx, scene, integrator=integrator, background=background)
        np.testing.assert_allclose(found, radiance * PICTURE.scale, rtol=2e-3)
    for roughness in (0.0, 0.25, 1.0):
        found = value(ctx, scene, integrator=integrator, background="prefiltered", background_roughness=roughness)
        mean = integrals.lobe_mean(direction, roughness**2) if roughness else wanted["environment"]
        np.testing.assert_allclose(found, mean * PICTURE.scale, rtol=4e-3)


def test_renderer_moves_between_integrators_and_environments(ctx: moderngl.Context) -> None:
    scene = at_angle(0.6, lambert(0.5), WHITE)
    with Renderer(scene, (4, 4), context=ctx) as renderer:
        assert renderer.render(256).mean() == pytest.approx(0.5, rel=1e-3)
        renderer.reset(integrator="split-sum")
        assert renderer.render(4).mean() == pytest.approx(0.5, rel=1e-4)
        renderer.reset(replace(scene, environment=replace(WHITE, radiance=(0.5, 0.5, 0.5))))
        assert renderer.render(4).mean() == pytest.approx(0.25, rel=1e-4)
        renderer.reset(replace(scene, environment=None))
        assert renderer.render(4).mean() == 0
        renderer.reset(integrator="path")
        assert renderer.render(4).mean() == 0


MUTATIONS = [
    ("diffuse without what is reflected", "(1.0 - fresnel) * b.diffuse * irradiance", "b.diffuse * irradiance"),
    ("bias forgotten", "+ b.f90 * map.y) * prefiltered", ") * prefiltered"),
    ("scale and bias swapped", "maps_brdf(vertex.wo.z, sqrt(b.alpha));", "maps_brdf(vertex.wo.z, sqrt(b.alpha)).yxz;"),
    ("alpha for roughness", "maps_brdf(vertex.wo.z, sqrt(b.alpha));", "maps_brdf(vertex.wo.z, b.alpha);"),
]


@pytest.mark.parametrize(("name", "text", "replacement"), MUTATIONS)
def test_planted_errors_are_found(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, text: str, replacement: str
) -> None:
    Planter(monkeypatch, tmp_path)("integrator/split_sum.glsl", text, replacement)
    with pytest.raises(AssertionError):
        test_dielectric_under_white_light_is_the_formula(ctx, 0.4)


def test_mirrored_lookups_are_found(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    Planter(monkeypatch, tmp_path)("integrator/split_sum.glsl", "vec3(-vertex.wo.xy, vertex.wo.z)", "vertex.wo")
    with pytest.raises(AssertionError):
        test_mirror_is_the_path_traced_one(ctx)
