# SPDX-License-Identifier: MIT
"""bsdf/fresnel.glsl."""

import moderngl
import numpy as np

from fragtracer.probe import probe

from . import bsdf_oracle

FRESNEL = ["bsdf/fresnel.glsl"]


def test_schlick(ctx: moderngl.Context) -> None:
    rng = np.random.default_rng(1)
    f0, f90, cosine = rng.random((1 << 14, 3)), rng.random((1 << 14, 3)), rng.random(1 << 14)
    cosine[:2] = 0, 1  # f90 and f0
    inputs = {"f0": f0, "f90": f90, "cosine": cosine}
    result = probe(ctx, FRESNEL, "f = fresnel_schlick(f0, f90, cosine);", inputs, {"f": 3})["f"]
    np.testing.assert_allclose(result, bsdf_oracle.fresnel(f0, f90, cosine), rtol=3e-6, atol=3e-7)


def test_cosine_beyond_its_range_is_clamped(ctx: moderngl.Context) -> None:
    """Rounding makes cosines a little above 1 and below 0."""
    inputs = {"cosine": [1.0000002, -1e-7, -1.0]}
    result = probe(ctx, FRESNEL, "f = fresnel_schlick(vec3(0.04), vec3(1.0), cosine);", inputs, {"f": 3})["f"][:, 0]
    np.testing.assert_array_equal(result, np.array([0.04, 1, 1], np.float32))


SURFACES = [
    ((0.04, 0.04, 0.04), (1.0, 1.0, 1.0), 0.3),
    ((0.9, 0.5, 0.1), (0.8, 0.8, 0.5), 0.7),
    ((0.02, 0.02, 0.0), (0.5, 0.5, 0.0), 0.0),
]


def test_rough_interface(ctx: moderngl.Context) -> None:
    """Towards grazing angles a rough surface reflects less, but never less than at normal incidence."""
    rng = np.random.default_rng(2)
    cosine = rng.random(1 << 12)
    for f0, f90, alpha in SURFACES:
        body = f"r = fresnel_schlick_rough(vec3{f0}, vec3{f90}, {alpha}, cosine);"
        result = probe(ctx, FRESNEL, body, {"cosine": cosine}, {"r": 3})["r"]
        material = bsdf_oracle.Material(alpha=alpha, f0=f0, f90=f90)
        np.testing.assert_allclose(result, bsdf_oracle.interface_reflectance(material, cosine), rtol=3e-6)
        assert (result >= np.float32(f0)).all()


def test_conductors_of_any_index(ctx: moderngl.Context) -> None:
    """Up to the largest float32, as perfect mirrors are written; above 1e9 it is no matter how large."""
    rng = np.random.default_rng(3)
    eta, k = 10 ** rng.uniform(-2, 38, (2, 1 << 12, 3))
    cosine = np.append(rng.random((1 << 12) - 2), [1.0, 1e-3])
    inputs = {"cosine": cosine, "eta": eta, "k": k}
    result = probe(ctx, FRESNEL, "f = fresnel_conductor(cosine, eta, k);", inputs, {"f": 3})["f"]
    error = np.abs(result - bsdf_oracle.fresnel_conductor(cosine, eta, k))
    assert (error <= 1e-6 + 4e-9 / cosine[:, None]).all()
