# SPDX-License-Identifier: MIT
"""bsdf/cook_torrance.glsl: its values, against the formulas in float64, and what physics asks of them."""

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer import scene

from . import Floats, bsdf_oracle
from .bsdf_oracle import Material
from .bsdf_probe import ALPHAS, DEGREES, MATERIALS, TERMS, WHITE, run
from .chi_square import nodes
from .directions import direction, upper_directions
from .domains import Reflections

VALUES = {"value": 3, "pdf": 1}


def float32_tolerance(alpha: Floats | float, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what the distribution makes of rounding the half vector: its slope is at most 2 / alpha."""
    return 1e-4 + 4e-7 / (alpha * np.linalg.norm(wo + wi, axis=-1))


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("name", MATERIALS)
def test_values_are_those_of_the_formulas(ctx: moderngl.Context, name: str, term: str) -> None:
    for alpha in ALPHAS:
        material = replace(MATERIALS[name], alpha=alpha)
        for degrees in DEGREES:
            wo = direction(degrees)
            wi = nodes(Reflections(alpha, wo), (8, 8), (3, 3))[0].astype(np.float32)
            body = "value = bsdf_eval(b, wo, wi); pdf = bsdf_pdf(b, wo, wi);"
            result = run(ctx, body, {"wi": wi}, VALUES, material, wo, term)
            tolerance = float32_tolerance(alpha, np.array(wo), wi)
            viewer = np.broadcast_to(wo, wi.shape)
            value = bsdf_oracle.bsdf_eval(material, term, viewer, wi.astype(np.float64))
            assert (np.abs(result["value"] - value) <= tolerance[:, None] * value).all(), (alpha, degrees)
            pdf = bsdf_oracle.bsdf_pdf(material, viewer, wi.astype(np.float64))
            assert (np.abs(result["pdf"] - pdf) <= tolerance * pdf).all(), (alpha, degrees)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("name", MATERIALS)
def test_values_are_reciprocal(ctx: moderngl.Context, name: str, term: str) -> None:
    """f itself, without the cosine, is the same with light and viewer exchanged."""
    rng = np.random.default_rng(1)
    wo, wi = upper_directions(rng, 1 << 12), upper_directions(rng, 1 << 12)
    body = "there = bsdf_eval(b, view, wi) / wi.z; back = bsdf_eval(b, wi, view) / view.z;"
    for alpha in ALPHAS:
        material = replace(MATERIALS[name], alpha=alpha)
        result = run(ctx, body, {"view": wo, "wi": wi}, {"there": 3, "back": 3}, material, term=term)
        np.testing.assert_allclose(result["there"], result["back"], rtol=1e-4)
        assert (result["there"] >= 0).all()


def test_nothing_passes_the_surface(ctx: moderngl.Context) -> None:
    """With the viewer or the light at or below the horizon there is neither value nor density."""
    up, level, down = (0.6, 0.0, 0.8), (1.0, 0.0, 0.0), (0.0, 0.6, -0.8)
    pairs = [(up, level), (level, up), (up, down), (down, up), (down, down), (level, level)]
    inputs = {"view": np.array([a for a, _ in pairs]), "wi": np.array([b for _, b in pairs])}
    body = "value = bsdf_eval(b, view, wi); pdf = bsdf_pdf(b, view, wi);"
    for material in MATERIALS.values():
        result = run(ctx, body, inputs, VALUES, replace(material, alpha=0.3))
        assert not result["value"].any()
        assert not result["pdf"].any()


def test_delta_lobe_has_no_values(ctx: moderngl.Context) -> None:
    """Only the base is left of smooth plastic, even in the direction of the mirror image."""
    wo = direction(45)
    wi = np.concatenate([[(-wo[0], -wo[1], wo[2])], upper_directions(np.random.default_rng(2), 1000)])
    material = replace(MATERIALS["plastic"], alpha=0.0)
    body = "value = bsdf_eval(b, wo, wi); pdf = bsdf_pdf(b, wo, wi);"
    result = run(ctx, body, {"wi": wi}, VALUES, material, wo)
    viewer = np.broadcast_to(wo, wi.shape)
    np.testing.assert_allclose(result["value"], bsdf_oracle.bsdf_eval_diffuse(material, viewer, wi), rtol=1e-4)
    diffuse_share = 1 - bsdf_oracle.specular_probability(material, np.array(wo))
    np.testing.assert_allclose(result["pdf"], diffuse_share * wi[:, 2] / np.pi, rtol=1e-5)
    result = run(ctx, body, {"wi": wi}, VALUES, replace(MATERIALS["gold"], alpha=0.0), wo)
    assert not result["value"].any()
    assert not result["pdf"].any()


# A program made for a scene leaves out what its materials do not need.
SPECIALISED = [
    ("lambert", 1.0, {"HAS_SPECULAR": 0, "HAS_GLOSSY": 0, "HAS_DELTA": 0}),
    ("gold", 0.2, {"HAS_DIFFUSE": 0, "HAS_DELTA": 0}),
    ("gold", 0.0, {"HAS_DIFFUSE": 0, "HAS_GLOSSY": 0}),
    ("plastic", 0.2, {"HAS_DELTA": 0}),
    ("plastic", 0.0, {"HAS_GLOSSY": 0}),
]


@pytest.mark.parametrize(("name", "alpha", "features"), SPECIALISED)
def test_specialised_programs_agree(ctx: moderngl.Context, name: str, alpha: float, features: dict[str, int]) -> None:
    rng = np.random.default_rng(3)
    wi, u, material = upper_directions(rng, 1 << 12), rng.random((1 << 12, 2), np.float32), MATERIALS[name]
    body = """
        BsdfSample s = bsdf_sample(b, wo, u);
        value = vec4(bsdf_eval(b, wo, wi), bsdf_pdf(b, wo, wi));
        drawn = vec4(s.wi, s.pdf); weight = vec4(s.weight, float(s.delta));"""
    inputs, outputs = {"wi": wi, "u": u}, {"value": 4, "drawn": 4, "weight": 4}
    general, special = (
        run(ctx, body, inputs, outputs, replace(material, alpha=alpha), direction(60), **some)
        for some in ({}, features)
    )
    for output in outputs:
        np.testing.assert_allclose(special[output], general[output], rtol=1e-5, atol=1e-7, err_msg=output)


def white_materials() -> list[Material]:
    """What reflects the most: white bases under all interfaces that a scene can ask for, and metals."""
    reflectances = (0.0, 0.001, 0.01, 0.02, 0.04, 0.17, 0.5, 1.0)
    chosen = [scene.Material(albedo=WHITE, f0=f0, specular=s) for f0 in reflectances for s in (1.0, 0.3)]
    odd = ((0.04, 0.0, 0.0), (0.0, 1.0, 0.02), (0.2, 0.01, 0.001))
    chosen += [scene.Material(albedo=WHITE, f0=f0, metallic=metallic) for f0 in odd for metallic in (0.0, 0.5)]
    chosen += [scene.Material(albedo=(1.0, 0.5, 0.0), metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    chosen += [scene.Material(albedo=WHITE, metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    return [Material(m.diffuse_albedo, 1.0, m.specular_f0, m.specular_f90) for m in chosen]


EVAL = "b.alpha = width; value = bsdf_eval(b, view, wi);"


def quadrature(places: Any, pieces: tuple[int, int]) -> tuple[dict[str, Floats], Floats]:
    """What :data:`EVAL` reads, to reflect light from every side at ``places`` (alpha, wo), and weights (places, n)."""
    grids = [nodes(Reflections(alpha, wo), pieces, (12, 10)) for alpha, wo in places]
    count = len(grids[0][1])
    inputs = {
        "wi": np.concatenate([wi for wi, _ in grids]),
        "view": np.repeat([wo for _, wo in places], count, axis=0),
        "width": np.repeat([alpha for alpha, _ in places], count),
    }
    return inputs, np.stack([w for _, w in grids])


@pytest.mark.parametrize("term", TERMS)
def test_no_material_reflects_more_than_it_receives(ctx: moderngl.Context, term: str) -> None:
    """Reflected share of light from every side, by quadrature, over fine steps of angle and roughness."""
    angles = [0, 20, 40, 55, 65, 72, 77, 81, 84, 86.5, 88, 89, 89.6, 89.95]
    alphas = [1e-3, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]
    places = [(alpha, direction(degrees)) for alpha in alphas for degrees in angles]
    inputs, weights = quadrature(places, (4, 8))
    for material in white_materials():
        value = run(ctx, EVAL, inputs, {"value": 3}, material, term=term)["value"]
        albedo = np.einsum("pn,pnc->pc", weights, value.reshape(*weights.shape, 3))
        worst = places[albedo.max(1).argmax()]
        assert albedo.max() <= 1 + 1e-4, f"{albedo.max():.5f} at alpha, wo = {worst}, {material}"


# The fit of what single scattering reflects, in its own terms and in those of the light that the lobe reflects.
FIT = 0.0035
WIDE = [1e-3, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0]
VIEWERS = [0, 30, 50, 65, 75, 82, 86, 88, 89, 89.7, 89.99]


def test_multiple_scattering_scales_the_specular_lobe(ctx: moderngl.Context) -> None:
    """By 1 + F0 (1 - E) / E, with E by quadrature, and leaves the base and the density alone."""
    white = Material(f0=WHITE, f90=WHITE)
    body = "value = bsdf_eval(b, wo, wi); pdf = bsdf_pdf(b, wo, wi);"
    for alpha in ALPHAS:
        for degrees in DEGREES:
            wo = direction(degrees)
            wi, weights = nodes(Reflections(alpha, wo), (8, 8), (8, 12))
            viewer = np.broadcast_to(wo, wi.shape)
            single = weights @ bsdf_oracle.bsdf_eval(replace(white, alpha=alpha), "SMITH", viewer, wi)[:, 0]
            rounded = wi.astype(np.float32)
            tolerance = FIT + float32_tolerance(alpha, np.array(wo), rounded)
            for name in ("plastic", "half metallic", "gold", "white metal"):
                material = replace(MATERIALS[name], alpha=alpha)
                result = run(ctx, body, {"wi": rounded}, VALUES, material, wo, MULTIPLE_SCATTERING=1)
                value = bsdf_oracle.bsdf_eval_compensated(material, viewer, rounded.astype(np.float64), single)
                assert (np.abs(result["value"] - value) <= tolerance[:, None] * value).all(), (name, alpha, degrees)
                pdf = bsdf_oracle.bsdf_pdf(material, viewer, rounded.astype(np.float64))
                assert (np.abs(result["pdf"] - pdf) <= tolerance * pdf).all(), (name, alpha, degrees)


def albedos(ctx: moderngl.Context, material: Material) -> Floats:
    """What is reflected with multiple scattering, of light from every side, (alphas, viewers, 3)."""
    places = [(alpha, direction(degrees)) for alpha in WIDE for degrees in VIEWERS]
    inputs, weights = quadrature(places, (8, 8))
    value = run(ctx, EVAL, inputs, {"value": 3}, material, MULTIPLE_SCATTERING=1)["value"]
    albedo = np.einsum("pn,pnc->pc", weights, value.reshape(*weights.shape, 3))
    return albedo.reshape(len(WIDE), len(VIEWERS), 3)


def test_white_metal_with_multiple_scattering_reflects_everything(ctx: moderngl.Context) -> None:
    assert np.abs(albedos(ctx, MATERIALS["white metal"]) - 1).max() < FIT


def test_multiple_scattering_makes_no_energy(ctx: moderngl.Context) -> None:
    """Over white bases too, but for what the fit errs."""
    for material in white_materials():
        assert albedos(ctx, material).max() <= 1 + FIT, material


def test_smooth_material_reflects_at_most_everything(ctx: moderngl.Context) -> None:
    """With a delta lobe: Fresnel reflectance and the base together."""
    for material in white_materials():
        for degrees in (0, 30, 60, 75, 85, 89, 89.9):
            wo = direction(degrees)
            wi, weights = nodes(Reflections(1.0, wo), (16, 16), (6, 8))
            smooth = replace(material, alpha=0.0)
            base = run(ctx, "value = bsdf_eval(b, wo, wi);", {"wi": wi}, {"value": 3}, smooth, wo)["value"]
            mirrored = bsdf_oracle.fresnel(material.f0, material.f90, wo[2])
            assert (weights @ base + mirrored).max() <= 1 + 1e-4, (material, degrees)
