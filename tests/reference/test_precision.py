# SPDX-License-Identifier: MIT
"""The errors of Mitsuba's single precision against float64, for which compare/verdict.py has REFERENCE_ALLOWANCE."""

import numpy as np

from fragtracer.apps.compare.verdict import REFERENCE_ALLOWANCE
from fragtracer.io.toml import load
from fragtracer.reference.translate import to_mitsuba
from fragtracer.scene import Light, Scene

COUNT = 2**20


def floor_points(mi, points):
    """Points of a horizontal surface, as Mitsuba's integrators have them."""
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p, si.n, si.t = mi.Point3f(points.T.astype(np.float32)), mi.Normal3f(0, 1, 0), mi.Float(1)
    si.sh_frame = mi.Frame3f(si.n)
    return si


def irradiance_error(mi, distance):
    """Relative, below the lamp of red-bounce at a distance in metres, where it is π L (r / d)²."""
    radius = load("red-bounce").lights[0].radius
    world = mi.load_dict(to_mitsuba(Scene(lights=[Light((0.0, float(distance), 0.0), radius, radiance=1.0)])))
    si = floor_points(mi, np.zeros((COUNT, 3)))
    u = np.random.default_rng(1).random((2, COUNT), dtype="f4")
    sample, weight = world.sample_emitter_direction(si, mi.Point2f(u), False)
    return (weight.x * sample.d.y).numpy().mean(dtype=float) / (np.pi * (radius / distance) ** 2) - 1


def test_the_cone_of_a_far_light_is_rounded(mi):
    """Mitsuba's 1 - cos of the cone has few digits left where the lamp is small and far, and all where it is near."""
    assert abs(irradiance_error(mi, 3)) < REFERENCE_ALLOWANCE
    assert max(abs(irradiance_error(mi, distance)) for distance in range(300, 400, 20)) > 0.2


def lit(points, center, radius, light):
    """Whether nothing of a sphere is between points and the light, in float64."""
    ahead = light - points
    distance = np.linalg.norm(ahead, axis=1, keepdims=True)
    along = np.clip(((center - points) * ahead / distance).sum(axis=1, keepdims=True), 0, distance)
    return np.linalg.norm(points + along * ahead / distance - center, axis=1) > radius


def test_shadow_rays_start_above_the_surface(mi):
    """By 1500 half units in the last place of a coordinate that is one metre larger than the largest: in
    light-size-0 a few tenths of a millimetre, by which the edge of a shadow moves. Of the square metre
    around a shadow a ten-thousandth is lit otherwise so; but for that, Mitsuba and float64 agree."""
    scene = load("light-size-0")
    sphere, light = scene.spheres[0], np.array(scene.lights[0].position)
    toward = np.subtract(sphere.center, light)
    middle = light + toward * (light[1] / -toward[1])
    points = middle + np.random.default_rng(2).uniform(-0.5, 0.5, (COUNT, 3)) * (1, 0, 1)
    points = points.astype(np.float32).astype(float)

    world = mi.load_dict(to_mitsuba(Scene(spheres=[sphere], materials=scene.materials)))
    ray = floor_points(mi, points).spawn_ray_to(mi.Point3f(light.astype(np.float32).tolist()))
    found = ~world.ray_test(ray).numpy()
    lift = ray.o.y.numpy()
    np.testing.assert_allclose(lift, 1500 * 2.0**-24 * (1 + np.abs(points).max(axis=1)), rtol=1e-5)
    assert 1e-4 < lift.mean() < 5e-4

    exact = lit(points, sphere.center, sphere.radius, light)
    lifted = lit(points + np.outer(lift, (0, 1, 0)), sphere.center, sphere.radius, light)
    assert 0.25 * REFERENCE_ALLOWANCE < (found != exact).mean() < REFERENCE_ALLOWANCE
    assert (found != lifted).sum() < (found != exact).sum() / 20
