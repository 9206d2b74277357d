# SPDX-License-Identifier: MIT
"""light/sphere.glsl: the cone under which a sphere is seen, from close by and from far away."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from . import shape_oracle
from .chi_square import assert_fits, fit
from .directions import direction
from .domains import Cone
from .kept import kept_probe

INCLUDES = ["light/sphere.glsl"]
UNIFORMS = {"probe/sphere.glsl": "uniform vec3 u_center;\nuniform vec3 u_origin;\n"}
RADIUS = 0.3
DISTANCES = [1.0001, 1.5, 10.0, 1e4]  # in radii
WAYS = {"up": (0.0, 0.0, 1.0), "down": (0.0, 0.0, -1.0), "aslant": direction(60), "below": direction(170)}

BODY = """
    SphereLight light = SphereLight(center, radius, vec3(1.0, 2.0, 3.0), 17);
    LightSample s = sphere_light_sample(light, o, u);
    point = vec4(s.wi, s.distance); pdf = sphere_light_pdf(light, o); said = s.pdf;
    radiance = s.radiance; what = vec2(float(s.primitive), float(s.delta));"""
OUTPUTS = {"point": 4, "pdf": 1, "said": 1, "radiance": 3, "what": 2}


def one_minus_cos(distance: float) -> float:
    """Of the half angle of a sphere of radius 1, in float64."""
    sin2 = 1 / distance**2
    return sin2 / (1 + np.sqrt(1 - sin2))


# Half of all combinations: the frame of a cone is one of its axis alone, whatever the distance.
@pytest.mark.parametrize(
    ("way", "distance"), [(w, d) for i, w in enumerate(WAYS) for j, d in enumerate(DISTANCES) if (i + j) % 2]
)
def test_directions_fill_the_cone(ctx: moderngl.Context, distance: float, way: str) -> None:
    u = np.random.default_rng(1).random((1 << 18, 2), np.float32)
    origin = np.float32([0.5, -0.25, 2.0])
    center = (origin + RADIUS * distance * np.array(WAYS[way])).astype(np.float32)
    if distance > 1e3:  # the origin's own digits would be lost beside the distance
        origin = np.float32([0, 0, 0])
        center = (RADIUS * distance * np.array(WAYS[way])).astype(np.float32)
    axis = center.astype(np.float64) - origin
    exact = np.linalg.norm(axis) / np.float64(np.float32(RADIUS))
    body = f"vec3 center = u_center; vec3 o = u_origin; const float radius = {RADIUS};" + BODY
    uniforms = {"u_center": center, "u_origin": origin}
    result = kept_probe(ctx, [*INCLUDES, *UNIFORMS], body, {"u": u}, OUTPUTS, generated=UNIFORMS, uniforms=uniforms)
    wi, reach, pdf = result["point"][:, :3].astype(np.float64), result["point"][:, 3], result["pdf"]
    assert np.abs(np.linalg.norm(wi, axis=1) - 1).max() < 5e-7

    np.testing.assert_array_equal(result["said"], pdf)
    assert (result["radiance"] == (1, 2, 3)).all()
    assert (result["what"] == (17, 0)).all()

    # Close by, sqrt(1 - sin²) has the error of the square root of its own.
    expected = 1 / (2 * np.pi * one_minus_cos(exact))
    np.testing.assert_allclose(pdf, expected, rtol=1e-5 if distance < 1.01 else 1e-6)

    # A narrow cone is a few thousand float32 steps wide, and its axis known to one of them.
    domain = Cone(tuple(axis.tolist()), one_minus_cos(exact), slack=5e-7 * distance)
    assert_fits({way: fit(domain, wi, lambda points: np.full(len(points), pdf[0]))})

    # Each reaches the near side of the sphere, those at the rim but for rounding.
    radius = np.float64(np.float32(RADIUS)) * (1 + 1e-6 * distance)
    met = shape_oracle.sphere(center, radius, np.broadcast_to(origin, wi.shape), wi)
    assert np.isfinite(met).all()
    surface = np.linalg.norm(origin + reach[:, None] * wi - center, axis=1)
    assert np.abs(surface - RADIUS).max() < 1e-6 * RADIUS * distance
    tangent = RADIUS * np.sqrt(max(0.0, exact**2 - 1))
    assert reach.max() <= tangent * (1 + 1e-6) + 2e-3 * RADIUS


def test_from_inside_there_is_no_sample(ctx: moderngl.Context) -> None:
    """A sphere emits outwards, so within there is nothing to find."""
    origin = [(0, 0, 0), (0.1, 0, 0), (0, -0.9999, 0), (0, 0, 1)]
    inputs = {"o": origin, "u": np.full((4, 2), 0.5)}
    result = probe(ctx, INCLUDES, "vec3 center = vec3(0.0); float radius = 1.0;" + BODY, inputs, OUTPUTS)
    assert result["pdf"][:3].tolist() == [0, 0, 0]
    assert result["said"][:3].tolist() == [0, 0, 0]
    assert not result["radiance"][:3].any()
    assert not result["point"][:3, 3].any()
    assert np.isfinite(result["pdf"]).all()
    assert np.isfinite(result["point"]).all()
