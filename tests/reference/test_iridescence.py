# SPDX-License-Identifier: MIT
"""Iridescence by a thin film, against the sum over wavelengths in float64, every nanometre."""

from typing import Any

import moderngl
import numpy as np
import pytest
from shaders.bsdf_models import MODELS
from shaders.bsdf_oracle import Filmed
from shaders.bsdf_probe import run

from fragtracer.reference.plugins.thin_film import sensitivities
from shaders import bsdf_oracle

COSINES = np.cos(np.radians([0, 20, 40, 55, 65, 75, 82, 88]))
REFLECTANCES = [(0.0, 0.001, 0.02), (0.04, 0.1, 0.17), (0.3, 0.5, 0.7), (0.9, 0.95, 1.0)]
SET = "b.f0 = f0; b.f90 = min(50.0 * f0, vec3(1.0)); b.iridescence_thickness = thickness;"


def filmed(f0: tuple[float, float, float], ior: float = 1.3, thickness: float = 400.0) -> Filmed:
    f90 = min(1, 50 * f0[0]), min(1, 50 * f0[1]), min(1, 50 * f0[2])
    return Filmed(f0=f0, f90=f90, iridescence=1.0, iridescence_ior=ior, iridescence_thickness=thickness)


def reflected(ctx: moderngl.Context, m: Filmed, thickness: Any, f0: Any, cosine: Any) -> Any:
    body = f"{SET} value = iridescence_fresnel(b, cosine);"
    inputs = {"thickness": thickness, "f0": f0, "cosine": cosine}
    return run(ctx, MODELS["iridescent"], m, body, inputs, {"value": 3})["value"]


def summed(m: Filmed, sensitivity: tuple[Any, Any]) -> Any:
    """The squares of what interferes, of each wavelength and polarisation."""
    path, interfaces = bsdf_oracle.film_interfaces(m, COSINES)
    phase = np.exp(2e3j * np.pi * path[..., None] / sensitivity[0][:, None])
    r, s = (np.array([pair[i] + 0 * path for pair in interfaces])[:, :, None, :] for i in (0, 1))
    squares = np.abs((r + s * phase) / (1 + r * s * phase)) ** 2
    return np.einsum("pcwk,wk->ck", squares, sensitivity[1]) / 2


@pytest.mark.parametrize(("ior", "most"), [(1.2, 0.0004), (1.33, 0.001), (1.8, 0.0011), (2.5, 0.0018)])
def test_colors_are_those_of_the_spectrum(ctx: moderngl.Context, mi: Any, ior: float, most: float) -> None:
    """Over thicknesses up to 1200 nm and all angles, in the root mean square to 0.00025."""
    sensitivity = sensitivities(step=1)
    cases = [filmed(f0, ior, thickness) for f0 in REFLECTANCES for thickness in range(0, 1201, 60)]
    count = len(COSINES)
    exact = np.concatenate([bsdf_oracle.film_fresnel(m, COSINES, summed(m, sensitivity)) for m in cases])
    thickness = np.repeat([m.iridescence_thickness for m in cases], count)
    found = reflected(
        ctx, cases[0], thickness, np.repeat([m.f0 for m in cases], count, 0), np.tile(COSINES, len(cases))
    )
    assert exact.std() > 0.2
    error = np.abs(found - exact)
    assert error.max() < most, cases[int(error.max(1).argmax()) // count]
    assert np.sqrt((error**2).mean()) < 0.00025


def test_a_film_of_no_thickness_is_none(ctx: moderngl.Context) -> None:
    """To rounding; and reflectances stay between 0 and 1, of films thicker than any."""
    f0 = np.concatenate([REFLECTANCES, [(0.0, 0.0, 1.0)]])
    each = [np.repeat(f0, len(COSINES), 0), np.tile(COSINES, len(f0))]
    for ior in (1.0, 1.3, 3.0):
        found = reflected(ctx, filmed(REFLECTANCES[0], ior), np.zeros(len(each[1])), *each)
        schlick = bsdf_oracle.fresnel(each[0], np.minimum(50 * each[0], 1), each[1])
        np.testing.assert_allclose(found, schlick, atol=1e-6)
        for thickness in (1.0, 90.0, 600.0, 5e3, 1e6):
            found = reflected(ctx, filmed(REFLECTANCES[0], ior), np.full(len(each[1]), thickness), *each)
            assert 0 <= found.min() <= found.max() <= 1
