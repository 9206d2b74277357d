# SPDX-License-Identifier: MIT
"""bsdf/cook_torrance.glsl: what bsdf_sample draws, against bsdf_pdf and the integrals of the formulas."""

from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy import stats

from . import Floats, bsdf_oracle
from .bsdf_oracle import Direction, Material
from .bsdf_probe import ALPHAS, DEGREES, MATERIALS, TERMS, run
from .chi_square import assert_fits, assert_likely, fit, nodes
from .directions import direction
from .domains import Reflections

DRAW = "BsdfSample s = bsdf_sample(b, wo, u); drawn = vec4(s.wi, s.pdf); weight = vec4(s.weight, float(s.delta));"
DRAWN = {"drawn": 4, "weight": 4}


def uniform_numbers(count: int = 1 << 18) -> Floats:
    return np.random.default_rng(1).random((count, 2), np.float32)


def albedo(material: Material, term: str, wo: Direction) -> Floats:
    """Reflected share of light from every side, in float64, (3,)."""
    wi, weights = nodes(Reflections(material.alpha or 1.0, wo), (8, 8), (8, 12))
    viewer = np.broadcast_to(wo, wi.shape)
    if material.alpha > 0:
        return weights @ bsdf_oracle.bsdf_eval(material, term, viewer, wi)
    mirrored = bsdf_oracle.fresnel(material.f0, material.f90, wo[2]) * bsdf_oracle.g1(term, 0.0, wo[2]) ** 2
    return weights @ bsdf_oracle.bsdf_eval_diffuse(material, viewer, wi) + mirrored


@pytest.mark.parametrize("name", MATERIALS)
def test_samples_have_their_density(ctx: moderngl.Context, name: str) -> None:
    """Where it integrates to less than 1, the rest is samples below the surface, which are none."""
    u, fits = uniform_numbers(), {}
    for alpha in ALPHAS if name != "lambert" else [1.0]:
        material = replace(MATERIALS[name], alpha=alpha)
        for degrees in DEGREES:
            wo = direction(degrees)

            def pdf(wi: Floats, material: Material = material, wo: Direction = wo) -> Floats:
                return run(ctx, "pdf = bsdf_pdf(b, wo, wi);", {"wi": wi}, {"pdf": 1}, material, wo)["pdf"]

            drawn = run(ctx, DRAW, {"u": u}, DRAWN, material, wo)["drawn"]
            found = drawn[:, 3] > 0
            missing = len(u) - np.count_nonzero(found)
            fits[f"alpha {alpha} at {degrees}°"] = fit(Reflections(alpha, wo), drawn[found, :3], pdf, missing)
            assert fits[f"alpha {alpha} at {degrees}°"].mass < 1 + 2e-5
    assert_fits(fits)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("name", MATERIALS)
def test_weight_is_value_over_density(ctx: moderngl.Context, name: str, term: str) -> None:
    """Of the formulas, at the direction drawn; the distribution cancels, so this holds for narrow lobes too."""
    u = uniform_numbers(1 << 12)
    for alpha in ALPHAS:
        material = replace(MATERIALS[name], alpha=alpha)
        for degrees in DEGREES:
            wo = direction(degrees)
            result = run(ctx, DRAW, {"u": u}, DRAWN, material, wo, term)
            found = result["drawn"][:, 3] > 0
            wi, pdf, weight = result["drawn"][found, :3], result["drawn"][found, 3], result["weight"][found, :3]
            assert np.abs(np.linalg.norm(wi, axis=1) - 1).max() < 1e-6
            assert (wi[:, 2] > 0).all()
            assert not result["weight"][~found].any()
            assert not result["weight"][:, 3].any()  # no delta lobe
            viewer = np.broadcast_to(wo, wi.shape)
            value, density = (
                bsdf_oracle.bsdf_eval(material, term, viewer, wi),
                bsdf_oracle.bsdf_pdf(material, viewer, wi),
            )
            tolerance = 1e-3 + 4e-7 / (alpha * np.linalg.norm(wi + wo, axis=1))
            assert (np.abs(pdf - density) <= tolerance * density).all(), (alpha, degrees)
            assert (np.abs(weight - value / density[:, None]) <= tolerance[:, None] * weight).all(), (alpha, degrees)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("name", MATERIALS)
def test_mean_weight_is_the_albedo(ctx: moderngl.Context, name: str, term: str) -> None:
    """By quadrature in float64, for glossy lobes and for a mirror, alone or over a base."""
    u, p_values = uniform_numbers(1 << 16), {}
    for alpha in [0.0, *ALPHAS]:
        material = replace(MATERIALS[name], alpha=alpha)
        for degrees in DEGREES:
            wo = direction(degrees)
            weight = run(ctx, DRAW, {"u": u}, DRAWN, material, wo, term)["weight"][:, :3]
            expected = albedo(material, term, wo)
            assert (expected <= 1 + 1e-6).all()
            p_values[f"alpha {alpha} at {degrees}°"] = mean_p_value(weight, expected)
    assert_likely(p_values)


def mean_p_value(samples: Floats, expected: Floats) -> float:
    """Of the mean of all channels together, with 1e-5 for float32."""
    deviation = samples.sum(1).std() / np.sqrt(len(samples)) + 1e-5 * expected.sum()
    return float(2 * stats.norm.sf(abs(samples.sum(1).mean() - expected.sum()) / max(deviation, 1e-30)))


def test_white_furnace(ctx: moderngl.Context) -> None:
    """A smooth white metal loses nothing; what a rough one loses is light scattered again by its facets."""
    u = uniform_numbers(1 << 16)
    for degrees in (0, 45, 80):
        metal = replace(MATERIALS["white metal"], alpha=1e-3)
        weight = run(ctx, DRAW, {"u": u}, DRAWN, metal, direction(degrees))["weight"][:, :3]
        assert weight.mean() == pytest.approx(1, abs=1e-3)
    losses = [
        1 - albedo(replace(MATERIALS["white metal"], alpha=alpha), "SMITH", direction(45)).mean() for alpha in ALPHAS
    ]
    assert losses == sorted(losses)
    assert losses[-1] > 0.1


def test_lambert_returns_its_albedo(ctx: moderngl.Context) -> None:
    material, u = MATERIALS["lambert"], uniform_numbers(1 << 14)
    for degrees in DEGREES:
        result = run(ctx, DRAW, {"u": u}, DRAWN, material, direction(degrees))
        np.testing.assert_allclose(result["weight"][:, :3], np.broadcast_to(material.diffuse, (len(u), 3)), rtol=1e-6)
        pure = run(ctx, DRAW, {"u": u}, DRAWN, material, direction(degrees), HAS_SPECULAR=0, HAS_GLOSSY=0, HAS_DELTA=0)
        np.testing.assert_array_equal(pure["weight"][:, :3], np.broadcast_to(np.float32(material.diffuse), (len(u), 3)))


@pytest.mark.parametrize("term", TERMS)
def test_mirror(ctx: moderngl.Context, term: str) -> None:
    """One direction, flagged as delta, of weight F G."""
    material, u = replace(MATERIALS["gold"], alpha=0.0), uniform_numbers(1 << 10)
    for degrees in DEGREES:
        wo = direction(degrees)
        result = run(ctx, DRAW, {"u": u}, DRAWN, material, wo, term)
        expected = bsdf_oracle.fresnel(material.f0, material.f90, wo[2]) * bsdf_oracle.g1(term, 0.0, wo[2]) ** 2
        np.testing.assert_allclose(result["weight"][:, :3], np.broadcast_to(expected, (len(u), 3)), rtol=2e-6)
        assert (result["weight"][:, 3] == 1).all()
        np.testing.assert_array_equal(result["drawn"], np.broadcast_to((-wo[0], -wo[1], wo[2], 1.0), (len(u), 4)))


def test_smooth_plastic_is_a_mirror_over_a_base(ctx: moderngl.Context) -> None:
    """The delta lobe is chosen as often as its pdf says; the other samples have the density of the base."""
    material, u = replace(MATERIALS["plastic"], alpha=0.0), uniform_numbers()
    fits = {}
    for degrees in DEGREES:
        wo = direction(degrees)
        result = run(ctx, DRAW, {"u": u}, DRAWN, material, wo)
        delta = result["weight"][:, 3] > 0
        share = bsdf_oracle.specular_probability(material, np.array(wo))
        np.testing.assert_allclose(result["drawn"][delta, 3], share, rtol=1e-5)

        def pdf(wi: Floats, wo: Direction = wo) -> Floats:
            return run(ctx, "pdf = bsdf_pdf(b, wo, wi);", {"wi": wi}, {"pdf": 1}, material, wo)["pdf"]

        domain = Reflections(1.0, wo)
        fits[f"{degrees}°"] = fit(domain, result["drawn"][~delta, :3], pdf, np.count_nonzero(delta))
    assert_fits(fits)


def test_samples_of_extreme_arguments(ctx: moderngl.Context) -> None:
    """Finite, not negative, and at most the largest weight that a lobe can have there, for every u and angle."""
    ends = np.float32([0, 2**-24, 0.04, 0.25, 0.5, 0.75, 1 - 2**-24])
    cosines = np.float32([0, 1e-30, 1e-6, 1e-3, 0.5, 1 - 2**-24, 1])
    widths = np.float32([0, 0.99e-4, 1e-4, 1e-3, 0.1, 1])
    width, cosine, x, y = np.stack(np.meshgrid(widths, cosines, ends, ends), -1).reshape(-1, 4).T
    view = np.column_stack([np.sqrt(1 - cosine.astype(np.float64) ** 2), np.zeros(len(cosine)), cosine])
    inputs = {"width": width, "view": view, "u": np.column_stack([x, y])}
    for name, material in (MATERIALS | {"black": Material(), "black mirror": Material(alpha=0.0)}).items():
        for term in TERMS:
            body = "b.alpha = width; wo = view;" + DRAW
            result = run(ctx, body, inputs, DRAWN, material, term=term)
            assert np.isfinite(result["drawn"]).all(), name
            assert np.isfinite(result["weight"]).all(), name
            assert (result["drawn"][:, 3] >= 0).all(), name
            assert (result["weight"] >= 0).all(), name
            limit = largest_weight(material, term, width.astype(np.float64), cosine.astype(np.float64))
            assert (result["weight"][:, :3] <= (1 + 1e-4) * limit + 1e-30).all(), (name, term)
            assert not result["weight"][cosine == 0].any(), name


def largest_weight(material: Material, term: str, alpha: Floats, cosine: Floats) -> Floats:
    """What value over density cannot exceed at these widths and angles, (n, 3): the larger one of the two lobes alone,
    each divided by its chance, with the most that Fresnel and masking leave."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    weights = np.zeros((len(alpha), 3))
    for width in np.unique(alpha):
        here, glossy = alpha == width, replace(material, alpha=float(width))
        c = wo[here, 2]
        chance = bsdf_oracle.specular_probability(glossy, wo[here])[:, None]
        masking = bsdf_oracle.g1(term, width, c) / bsdf_oracle.g1_smith(width, c)
        specular = np.maximum(material.f0, material.f90) * masking[:, None]
        base = np.multiply(material.diffuse, 1 - bsdf_oracle.interface_reflectance(glossy, c))
        with np.errstate(divide="ignore", invalid="ignore"):
            weights[here] = np.fmax(
                np.where(chance > 0, specular / chance, 0), np.where(chance < 1, base / (1 - chance), 0)
            )
    return weights
