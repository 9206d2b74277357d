# SPDX-License-Identifier: MIT
"""bsdf/ggx.glsl: the distribution, its geometry terms, and the sampling of its visible normals."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from . import bsdf_oracle
from .bsdf_models import TERMS
from .bsdf_models.model import ALPHAS
from .chi_square import assert_fits, fit, nodes
from .directions import direction
from .domains import VisibleNormals
from .kept import kept_probe

GGX = ["bsdf/ggx.glsl"]
UNIFORMS = {"probe/seen.glsl": "uniform float u_alpha;\nuniform vec3 u_wo;\n"}
SEEN = [*GGX, *UNIFORMS]
DEGREES = [0, 45, 80, 89, 89.9]
# Whole cells, each with an exact rule: the error of an integral is far below that of float32.
CELLS, ORDER = (16, 16), (8, 12)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_distribution_integrates_to_one(ctx: moderngl.Context, alpha: float) -> None:
    """Over projected solid angle: the facets cover the surface."""
    wh, weights = nodes(VisibleNormals(alpha, (0.0, 0.0, 1.0)), CELLS, ORDER)
    d = probe(ctx, GGX, f"d = ggx_d({alpha}, wh);", {"wh": wh}, {"d": 1})["d"].astype(np.float64)
    assert (d * wh[:, 2]) @ weights == pytest.approx(1, abs=2e-5)
    np.testing.assert_allclose(d, bsdf_oracle.ggx_d(alpha, wh), rtol=2e-5)


def test_distribution_is_zero_below(ctx: moderngl.Context) -> None:
    wh = [(0, 0, -1), (1, 0, 0), (0.6, 0, -0.8)]
    d = probe(ctx, GGX, "d = ggx_d(0.3, wh);", {"wh": wh}, {"d": 1})["d"]
    assert d.tolist() == [0, 0, 0]


@pytest.mark.parametrize("term", TERMS)
def test_geometry_term(ctx: moderngl.Context, term: str) -> None:
    rng = np.random.default_rng(1)
    alpha = np.repeat([1e-4, *ALPHAS], 1 << 10)
    cosine = np.concatenate([rng.random(len(alpha) // 2), 10 ** rng.uniform(-6, 0, len(alpha) // 2)])
    cosine[:2] = 1, 1e-7
    alpha, cosine = (np.tile(alpha, 1).astype(np.float32), rng.permutation(cosine).astype(np.float32))
    zeros = np.zeros((len(alpha), 2))
    inputs = {"alpha": alpha, "wo": np.column_stack([zeros, cosine]), "wi": np.column_stack([zeros, cosine[::-1]])}
    body = "g1 = ggx_g1(alpha, wo.z); smith = ggx_g1_smith(alpha, wo.z); g = ggx_g(alpha, wo, wi);"
    defines = {"GEOMETRY_TERM": f"GEOMETRY_{term}"}
    result = probe(ctx, GGX, body, inputs, {"g1": 1, "smith": 1, "g": 1}, defines)
    expected = bsdf_oracle.g1(term, alpha, cosine)
    np.testing.assert_allclose(result["g1"], expected, rtol=2e-6)
    np.testing.assert_allclose(result["smith"], bsdf_oracle.g1_smith(alpha, cosine), rtol=2e-6)
    np.testing.assert_allclose(result["g"], bsdf_oracle.g(term, alpha, cosine, cosine[::-1]), rtol=4e-6)
    assert (result["g1"] <= 1 + 1e-6).all()


def test_no_geometry_term_masks_less_than_smith() -> None:
    """Of all terms that correlated by height is the largest, and leaves at most G1 of the viewer: since visible normals
    are sampled with that, weights G / G1 and so the albedo stay below 1."""
    grid = np.meshgrid(np.linspace(0, 1, 41), np.linspace(1e-3, 1, 80), np.linspace(1e-3, 1, 80))
    g = {term: bsdf_oracle.g(term, *grid) for term in TERMS}
    for term in ("SCHLICK_BECKMANN", "KARIS", "SMITH_HEIGHT_CORRELATED"):
        larger = g["SMITH"] if term != "SMITH_HEIGHT_CORRELATED" else bsdf_oracle.g1_smith(*grid[:2])
        assert (g[term] <= larger * (1 + 1e-12)).all(), term
    assert (g["SMITH"] <= g["SMITH_HEIGHT_CORRELATED"] * (1 + 1e-12)).all()


def _pdf(ctx: moderngl.Context, alpha: float, wo: tuple[float, float, float], wh: np.ndarray) -> np.ndarray:
    uniforms = {"u_alpha": alpha, "u_wo": wo}
    body = "pdf = ggx_sample_vndf_pdf(u_alpha, u_wo, wh);"
    return kept_probe(ctx, SEEN, body, {"wh": wh}, {"pdf": 1}, generated=UNIFORMS, uniforms=uniforms)["pdf"]


@pytest.mark.parametrize("alpha", ALPHAS)
def test_visible_normals_have_their_density(ctx: moderngl.Context, alpha: float) -> None:
    u = np.random.default_rng(2).random((1 << 19, 2), np.float32)
    fits = {}
    for degrees in DEGREES:
        wo = direction(degrees)
        uniforms = {"u_alpha": alpha, "u_wo": wo}
        body = "wh = ggx_sample_vndf(u_alpha, u_wo, u);"
        wh = kept_probe(ctx, SEEN, body, {"u": u}, {"wh": 3}, generated=UNIFORMS, uniforms=uniforms)["wh"]
        fits[f"{degrees}°"] = fit(VisibleNormals(alpha, wo), wh, lambda wh, wo=wo: _pdf(ctx, alpha, wo, wh))
    assert_fits(fits)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_density_of_visible_normals(ctx: moderngl.Context, alpha: float) -> None:
    """It integrates to 1, and is the one of its formula."""
    for degrees in DEGREES:
        wo = direction(degrees)
        wh, weights = nodes(VisibleNormals(alpha, wo), CELLS, ORDER)
        pdf = _pdf(ctx, alpha, wo, wh).astype(np.float64)
        assert pdf @ weights == pytest.approx(1, abs=2e-5), degrees
        expected = bsdf_oracle.visible_normal_pdf(alpha, np.array(wo), wh)
        # Rounding wh to float32 moves wo . wh, which the smallest densities feel.
        np.testing.assert_allclose(pdf, expected, rtol=2e-5, atol=1e-6 * expected.max(), err_msg=f"{degrees}°")


def test_visible_normals_of_extreme_arguments(ctx: moderngl.Context) -> None:
    """Unit vectors above the surface that face the viewer, for every u and angle."""
    ends = np.float32([0, 2**-24, 0.25, 0.5, 0.75, 1 - 2**-24])
    cosines = np.float32([1e-6, 1e-3, 0.5, 1 - 2**-24, 1])
    alpha, cosine, x, y = np.stack(np.meshgrid(np.float32([1e-4, *ALPHAS]), cosines, ends, ends), -1).reshape(-1, 4).T
    wo = np.column_stack([np.sqrt(1 - cosine.astype(np.float64) ** 2), np.zeros(len(cosine)), cosine])
    inputs = {"alpha": alpha, "wo": wo, "u": np.column_stack([x, y])}
    wh = probe(ctx, GGX, "wh = ggx_sample_vndf(alpha, wo, u);", inputs, {"wh": 3})["wh"].astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(wh, axis=1), 1, atol=3e-7)
    assert (wh[:, 2] >= 0).all()
    # Only the very last u.y may miss by rounding; its reflection is below the surface, and no sample.
    assert ((wh * wo).sum(1)[y < ends[-1]] >= -1e-6).all()
