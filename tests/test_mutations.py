# SPDX-License-Identifier: MIT
"""The checks reject every error of tests/mutations.py, planted one at a time in the shader."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import test_bvh_of_shapes as shapes
import test_direct_light as direct_light
import test_same_picture as same_picture
from mesh_checks import choice_rejects, furnace_rejects, normals_reject
from mutations import MUTATIONS
from rendering import Planter, list_at_most, rendered
from scipy import stats
from textured_scenes import facing, mesh, quad, texture, under_sheets

from fragtracer.apps.compare.rendering import Rendering, render_ours, render_reference
from fragtracer.apps.compare.verdict import judge
from fragtracer.errors import DeviceError
from fragtracer.gpu.probe import probe
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Ambient,
    Camera,
    Light,
    Material,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    Triangle,
)

pytest.importorskip("mitsuba", reason="Mitsuba is not installed: nothing to hold the mutations against")

SIZE = (48, 36)
BATCHES = 16
SPP = 256 * BATCHES


def studio() -> Scene:
    """Every feature whose breaking must show, in one small picture."""
    materials = {
        "floor": Material(albedo=(0.7, 0.65, 0.6), specular=0.0),
        "plastic": Material(albedo=(0.7, 0.1, 0.1), roughness=0.4),
        "gold": Material(metal="gold", roughness=0.5),
        "mirror": Material(albedo=(0.5, 0.5, 0.6), roughness=0.0, f0=0.3),
        "blue": Material(albedo=(0.2, 0.3, 0.8), roughness=1.0, metallic=0.5),
        "panel": Material(albedo=0.2, specular=0.0, emission=(3.0, 3.0, 2.0)),
        "sail": Material(albedo=0.3, specular=0.0, emission=(0.5, 1.0, 1.5)),
    }
    spheres = ("plastic", "gold", "mirror", "blue")
    return Scene(
        camera=Camera(position=(0.0, 1.6, 4.0), target=(0.0, 0.6, 0.0), fov_degrees=45.0),
        materials=materials,
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor"),),
        spheres=tuple(Sphere((1.1 * i - 1.65, 0.5, -0.2 * i), 0.5, name) for i, name in enumerate(spheres)),
        rectangles=(Rectangle((-1.0, 2.0, -1.5), (2.0, 0.0, 0.0), (0.0, 0.5, 0.5), "panel"),),
        triangles=(Triangle(((-2.5, 0.0, 0.5), (-1.5, 0.0, -1.5), (-2.2, 1.5, -0.5)), "sail"),),
        lights=(Light((1.5, 2.5, 1.5), 0.5, power=60.0), Light((-1.0, 1.5, 2.0), 0.0, power=20.0)),
        ambient=Ambient(0.1),
        render=RenderSettings(bounces=4, light_samples=2, russian_roulette_depth=1, multiple_scattering=True),
        name="studio",
    )


@pytest.fixture(scope="module")
def reference() -> Rendering:
    return render_reference(studio(), SIZE, SPP, BATCHES)


@pytest.fixture
def plant(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Planter:
    return Planter(monkeypatch, tmp_path)


def reference_rejects(ctx, reference) -> bool:
    """Whether the comparison with Mitsuba finds a difference."""
    ours = render_ours(studio(), SIZE, SPP, BATCHES, context=ctx)
    return judge(ours.pictures, reference.pictures, non_finite=ours.non_finite).outcome == "disagreement"


def count_rejects(ctx, plant) -> bool:
    """Whether samples made NaN on purpose go uncounted."""
    plant(
        "integrator/path.glsl",
        "path.radiance += path.throughput * direct_light(",
        "path.radiance += vec3(0.0) / 0.0 * direct_light(",
    )
    with Renderer(studio(), (8, 8), context=ctx) as renderer:
        renderer.sample(4)
        try:
            assert np.isfinite(renderer.image()).all()
        except DeviceError:  # the renderer itself misses samples that are neither in the mean nor counted
            return True
        return renderer.non_finite_samples() == 0


def samplers_reject(ctx) -> bool:
    """Whether points on lights are not spread as their densities say (Kolmogorov and Smirnov, Šidák over 3)."""
    includes = ["core/warp.glsl", "light/sphere.glsl"]
    body = """
        SphereLight light = SphereLight(vec3(0.0, 3.0, 0.0), 1.0, vec3(1.0), 0);
        float y = sphere_light_sample(light, vec3(0.0), u).wi.y;
        height = (1.0 - y) / sphere_light_one_minus_cos(vec3(0.0, 3.0, 0.0), 1.0, vec3(0.0));
        weights = square_to_triangle(u);"""
    u = np.random.default_rng(1).random((100_000, 2))
    found = probe(ctx, includes, body, {"u": u}, {"height": 1, "weights": 2})
    # Uniform in the cone: 1 - cos is uniform. Uniform in the triangle: each weight has the density 2 (1 - w).
    p = [stats.kstest(found["height"], "uniform").pvalue]
    p += [stats.kstest(1 - (1 - weight) ** 2, "uniform").pvalue for weight in found["weights"].T]
    return min(p) < 1 - (1 - 1e-4) ** (1 / 3)


def textures_reject(ctx) -> bool:
    """Whether the light on an image with a normal map of one value, or below two sheets, is not what it should be."""
    pixels = np.array([[[200, 30, 90], [60, 250, 10]], [[120, 120, 0], [20, 60, 180]]], np.uint8)
    lean = np.array([0.3, 0.0, 1.0]) / np.sqrt(1.09)
    material = Material(
        albedo=1.0,
        specular=0.0,
        albedo_texture=texture(pixels, "srgb"),
        normal_texture=texture(((1 + lean) / 2).astype(np.float32).reshape(1, 1, 3)),
        normal_scale=0.5,
    )
    light = Light((0.0, 0.0, 50.0), power=1e5)
    picture = rendered(ctx, facing({"m": material}, mesh(quad(), "m"), ambient=0.0, lights=(light,)), 16, (2, 2))
    albedo = np.where(pixels <= 10, pixels / 255 / 12.92, ((pixels / 255 + 0.055) / 1.055) ** 2.4)
    irradiance = 1e5 / (4 * np.pi) / 50**2 / np.hypot(1, 0.15)
    if not np.allclose(picture, albedo * irradiance / np.pi, rtol=0.01):
        return True
    light = Light((5.0, 0.0, 5.0), power=100.0)
    clear, dimmed = (rendered(ctx, under_sheets(sheets, light), 64, (16, 16), bounces=1) for sheets in (0, 2))
    if not clear.min() > 0:
        return True
    met = round(float((dimmed / clear)[..., 0].sum()) * 64)
    return bool(stats.binomtest(met, 64 * 256, 0.49).pvalue < 1e-4)


def fails(check, *arguments) -> bool:
    """Whether a test does."""
    try:
        check(*arguments)
    except AssertionError:
        return True
    return False


def lights_reject(ctx) -> bool:
    """Whether the light of a disk, of spots, of a direction or of very many or a few lights is not what it must be."""
    return (
        fails(direct_light.test_floor_under_a_spot_light, ctx, "between the cones", "nee")
        or fails(direct_light.test_lights_that_no_ray_meets_cast_shadows, ctx, "nee")
        or any(fails(direct_light.test_floor_under_a_disk, ctx, e, "aside") for e in ("nee", "bsdf", "mis"))
        or fails(direct_light.test_floor_under_many_lights, ctx, 1, "mis")
        or fails(direct_light.test_floor_under_eighty_lights, ctx, 1, "nee")
    )


def storage_rejects(ctx, monkeypatch) -> bool:
    """Whether shapes look otherwise one by one than in a BVH, or single-sided ones are seen from behind."""
    for most_listed in (0, 64):
        with monkeypatch.context() as patch:
            list_at_most(patch, most_listed)
            if any(fails(shapes.check_culling, ctx, kind) for kind in shapes.KINDS):
                return True
    return any(
        fails(same_picture.test_one_by_one_or_by_a_bvh, ctx, monkeypatch, name, False)
        for name in ("everything", "cornell-box")
    )


def rejecting(ctx, reference, plant, monkeypatch) -> Iterator[str]:
    """The names of the checks that find something, the quickest first."""
    checks = {
        "spread of light samples": lambda: samplers_reject(ctx),
        "lights of known strength": lambda: lights_reject(ctx),
        "list and BVH": lambda: storage_rejects(ctx, monkeypatch),
        "textures": lambda: textures_reject(ctx),
        "furnace of a mesh": lambda: furnace_rejects(ctx),
        "interpolated normals": lambda: normals_reject(ctx),
        "choice of triangles": lambda: choice_rejects(ctx),
        "comparison with Mitsuba": lambda: reference_rejects(ctx, reference),
        "count of samples that are not finite": lambda: count_rejects(ctx, plant),
    }
    yield from (name for name, rejects in checks.items() if rejects())


def test_the_checks_pass_without_a_mutation(ctx, reference, plant, monkeypatch):
    assert not list(rejecting(ctx, reference, plant, monkeypatch))


@pytest.mark.parametrize("mutation", MUTATIONS, ids=[mutation.name for mutation in MUTATIONS])
def test_a_mutation_is_of_the_shaders_as_they_are(plant, mutation):
    """Its text is there, once."""
    plant(mutation.file, mutation.text, mutation.replacement)


@pytest.mark.slow
@pytest.mark.parametrize("mutation", MUTATIONS, ids=[mutation.name for mutation in MUTATIONS])
def test_a_mutation_is_rejected(ctx, reference, plant, monkeypatch, mutation):
    plant(mutation.file, mutation.text, mutation.replacement)
    assert next(rejecting(ctx, reference, plant, monkeypatch), None)
