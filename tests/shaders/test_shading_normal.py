# SPDX-License-Identifier: MIT
"""bsdf/shading_normal.glsl: the bending of shading normals, and the factor at the shadow terminator."""

import moderngl
import numpy as np

from fragtracer.probe import probe

from . import Floats
from .directions import random_directions, upper_directions

SHADING_NORMAL = ["bsdf/shading_normal.glsl"]
COUNT = 1 << 14


def dot(a: Floats, b: Floats) -> Floats:
    return (a.astype(np.float64) * b).sum(-1)


def bent(ctx: moderngl.Context, normal: Floats, geometric: Floats, wo: Floats) -> Floats:
    inputs = {"normal": normal, "geometric": geometric, "wo": wo}
    body = """
    float bend = shading_normal_bend(normal, geometric, wo);
    bent = bend > 0.0 ? normalize(normal + bend * wo) : normal;
    """
    return probe(ctx, SHADING_NORMAL, body, inputs, {"bent": 3})["bent"]


def test_shading_normal_bends_to_the_viewer(ctx: moderngl.Context) -> None:
    """Where it faces away, in its plane with wo, to a cosine of 0.01 / sqrt(1 + 1e-4 - cos²); elsewhere it stays."""
    rng = np.random.default_rng(1)
    normal, wo = random_directions(rng, COUNT), random_directions(rng, COUNT)
    wo[: COUNT // 2] -= normal[: COUNT // 2] * (dot(normal, wo) + rng.uniform(-0.03, 0.05, COUNT))[: COUNT // 2, None]
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    normal[0], wo[0] = (0, 0, 1), (0, 0, -1)
    found, cosine = bent(ctx, normal, wo, wo), dot(normal, wo)
    faces = cosine >= 0.01 + 1e-6
    np.testing.assert_array_equal(found[faces], normal[faces])
    assert faces.mean() > 0.2
    away = cosine < 0.01 - 1e-6
    across = normal - cosine[:, None] * wo
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    new = 0.01 / np.sqrt(1 + 1e-4 - cosine**2)
    expected = new[:, None] * wo + np.sqrt(np.maximum(0, 1 - new**2))[:, None] * across
    clear = away & (cosine > -0.99)  # opposite the viewer any rounding turns it far
    np.testing.assert_allclose(found[clear], expected[clear], atol=2e-5)
    assert (dot(found, wo)[away] >= 0.0099).all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(found[0], (0, 0, -1), atol=1e-6)


def test_a_surface_that_is_seen_at_a_grazing_angle_is_enough(ctx: moderngl.Context) -> None:
    """A flat one stays as it is, and another normal is bent to the cosine of the surface."""
    rng = np.random.default_rng(3)
    geometric, across = upper_directions(rng, COUNT), random_directions(rng, COUNT)
    across -= dot(geometric, across)[:, None] * geometric
    cosine = rng.uniform(0, 0.01, COUNT)
    across *= np.sqrt((1 - cosine**2) / np.square(across).sum(axis=1))[:, None]
    wo = (cosine[:, None] * geometric + across).astype(np.float32)
    inputs = {"normal": geometric, "geometric": geometric, "wo": wo}
    bend = probe(ctx, SHADING_NORMAL, "bend = shading_normal_bend(normal, geometric, wo);", inputs, {"bend": 1})["bend"]
    assert not bend.any()
    away = ((geometric - 0.1 * wo) / np.sqrt(1.01 - 0.2 * cosine)[:, None]).astype(np.float32)
    least = dot(geometric, wo)
    expected = least / np.sqrt(1 - dot(away, wo) ** 2 + least**2)
    np.testing.assert_allclose(dot(bent(ctx, away, geometric, wo), wo), expected, atol=1e-6)


def terminator(ctx: moderngl.Context, geometric: Floats, wi: Floats) -> Floats:
    inputs = {"geometric": geometric, "wi": wi}
    body = "factor = shadow_terminator(geometric, wi);"
    return probe(ctx, SHADING_NORMAL, body, inputs, {"factor": 1})["factor"].astype(np.float64)


def test_shadow_terminator(ctx: moderngl.Context) -> None:
    """-G³ + G² + G of G = cos(geometric, wi) / (cos(shading, wi) cos(shading, geometric)), at most 1, of which a flat
    surface has 1 and the geometric horizon 0; nothing is reflected beyond the horizon of either normal."""
    rng = np.random.default_rng(2)
    geometric, wi = upper_directions(rng, COUNT), random_directions(rng, COUNT)
    factor, cosine = terminator(ctx, geometric, wi), dot(geometric, wi)
    up = wi[:, 2] > 0
    g = np.clip(cosine[up] / (wi[up, 2].astype(np.float64) * geometric[up, 2]), 0, 1)
    np.testing.assert_allclose(factor[up], g + g**2 - g**3, rtol=2e-5, atol=1e-6)
    assert not factor[up & (cosine <= 0)].any()
    assert 0.1 < (factor[up] == 1).mean() < 0.9
    # What is transmitted by both normals is whole, what by one of them nothing.
    np.testing.assert_array_equal(factor[~up], cosine[~up] < 0)
    flat = terminator(ctx, np.tile([0.0, 0.0, 1.0], (COUNT, 1)), wi)
    np.testing.assert_allclose(flat, 1, atol=1e-6)


def test_shadow_terminator_has_no_edge(ctx: moderngl.Context) -> None:
    """Towards the horizon of a geometric normal 40° aslant, it falls from 1 without a bend where it begins to fall, and
    reaches 0 without a step."""
    angle = np.radians(np.linspace(-49, 49.999, COUNT))  # from the geometric normal at 40° to its horizon at -50°
    wi = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)
    slope = np.radians(40)
    geometric = np.tile([np.sin(slope), 0, np.cos(slope)], (COUNT, 1))
    factor = terminator(ctx, geometric, wi)
    assert factor[0] < 0.05
    assert factor[-1] == 1
    steps = np.diff(factor)
    assert (steps >= -1e-6).all()
    assert steps.max() < 10 / COUNT
    begins = np.argmax(factor == 1)
    assert np.abs(steps[begins - 100 : begins]).max() < 0.1 * steps.max()
