# SPDX-License-Identifier: MIT
"""bsdf/: what bsdf_sample draws, against bsdf_pdf and the integrals of the formulas."""

import re
from collections.abc import Sequence
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scipy import stats

from fragtracer.resources import folder

from . import Floats
from .bsdf_models import CASES, DEGREES, MODELS, TERMS
from .bsdf_models.model import ALPHAS, Delta, Model, Parameters
from .bsdf_oracle import Direction, Material
from .bsdf_probe import run
from .chi_square import assert_fits, assert_likely, fit, nodes
from .directions import direction
from .domains import Cone

DRAW = """
    BsdfSample s = bsdf_sample(b, wo, u);
    drawn = vec4(s.wi, s.pdf); weight = s.weight; what = vec2(float(s.event), s.eta);"""
DRAW_ALONE = "BsdfSample s = bsdf_sample(b, wo, u); drawn = vec4(s.wi, s.pdf); event = float(s.event);"
DRAWN = {"drawn": 4, "weight": 3, "what": 2}
_MODEL = (folder("shaders") / "bsdf/model.glsl").read_text()
REFLECTION, TRANSMISSION, DELTA, NULL = (
    int(re.findall(rf"const int EVENT_{name} = (\d+);", _MODEL)[0])
    for name in ("REFLECTION", "TRANSMISSION", "DELTA", "NULL")
)
SMITH = MODELS["cook-torrance SMITH"]
DRAWN_AS_SMITHS = ("cook-torrance SCHLICK_BECKMANN", "cook-torrance KARIS")


def uniform_numbers(count: int = 1 << 18) -> Floats:
    return np.random.default_rng(1).random((count, 2), np.float32)


def seen(name: str, material: str) -> list[tuple[Parameters, float]]:
    """Parameters and angles: all combinations, but for materials that have the lobes of others in other colours or with
    another factor. Of these each set of parameters is seen from one angle, which is another one in the next material:
    these combinations decide over nothing but the chance and the weight of a lobe, of which
    test_weight_is_value_over_density has all."""
    model = MODELS[name]
    every, place = model.materials[material], list(model.materials).index(material)
    if model.name == "COOK_TORRANCE":
        recoloured = material not in ("plastic", "gold") or "SMITH" not in name.split()
    else:
        before = [forms(some) for some in list(model.materials.values())[:place]]
        recoloured = any(forms(every) <= those for those in before)
    if not recoloured:
        return [(parameters, degrees) for parameters in every for degrees in DEGREES]
    return [(parameters, DEGREES[(place + i) % len(DEGREES)]) for i, parameters in enumerate(every)]


def forms(every: Sequence[Parameters]) -> set[tuple[float, ...]]:
    """Parameters without their colours."""
    return {tuple(value for value in vars(parameters).values() if np.ndim(value) == 0) for parameters in every}


def albedo(model: Model, parameters: Parameters, wo: Direction) -> tuple[Floats, Floats]:
    """Scattered share of radiance from every side, and that of power, in float64, (3,) each."""
    wi, weights = nodes(model.domain(parameters, wo), (8, 8), (8, 12))
    value = weights[:, None] * model.value(parameters, np.broadcast_to(wo, wi.shape), wi)
    deltas = model.deltas(parameters, np.array([wo]))
    radiance = value.sum(0) + sum(delta.value[0] for delta in deltas)
    power = (model.power(parameters, wi)[:, None] * value).sum(0) + sum(d.value[0] * d.eta**2 for d in deltas)
    return radiance, power


def kind(delta: Delta) -> int:
    """The event of a delta lobe."""
    side = TRANSMISSION if delta.wi[0, 2] < 0 else REFLECTION
    return side + DELTA + (NULL if delta.null else 0)


@pytest.mark.parametrize(("name", "material"), [case for case in CASES if case[0] not in DRAWN_AS_SMITHS])
def test_samples_have_their_density(ctx: moderngl.Context, name: str, material: str) -> None:
    """Where it integrates to less than 1, the rest is samples below the surface, which are none, and a delta lobe,
    chosen as often as its pdf says."""
    model, u, fits = MODELS[name], uniform_numbers(1 << 17), {}
    for parameters, degrees in seen(name, material):
        wo = direction(degrees)
        share = model.delta_chance(parameters, wo)

        def pdf(wi: Floats, parameters: Parameters = parameters, wo: Direction = wo) -> Floats:
            return run(ctx, model, parameters, "pdf = bsdf_pdf(b, wo, wi);", {"wi": wi}, {"pdf": 1}, wo)["pdf"]

        result = run(ctx, model, parameters, DRAW_ALONE, {"u": u}, {"drawn": 4, "event": 1}, wo)
        event = result["event"].astype(int)
        delta = (event & DELTA) != 0
        assert delta.any() == (share > 0)
        for lobe in model.deltas(parameters, np.array([wo])):
            same, chance = event == kind(lobe), lobe.chance[0]
            np.testing.assert_allclose(result["drawn"][same, 3], chance, rtol=1e-5)
            assert abs(same.mean() - chance) <= 5 * np.sqrt(chance * (1 - chance) / len(u)), parameters
        found = (result["drawn"][:, 3] > 0) & ~delta
        if share > 1 - 1e-12:
            assert delta.all()
            continue
        domain, missing = model.domain(parameters, wo), len(u) - np.count_nonzero(found)
        case = f"{parameters} at {degrees}°"
        fits[case] = fit(domain, result["drawn"][found, :3], pdf, missing)
        assert fits[case].mass < 1 - share + 2e-5
    if fits:
        assert_fits(fits)


@pytest.mark.parametrize("degrees", [0, 45, 80])
def test_samples_of_a_coat_over_a_bent_base_have_their_density(ctx: moderngl.Context, degrees: float) -> None:
    """Where the horizon of the base is above that of the coat, and the other way round; seen from 80° the base has its
    back to the viewer."""
    model, wo, u = MODELS["coated"], direction(degrees), uniform_numbers(1 << 17)
    bent = {"base_normal": (-0.1854, -0.5706, 0.8), "base_tangent": (0.9742, 0.0, 0.2258)}
    parameters = replace(model.materials["lacquer"][0], coat_alpha=0.3, **bent)

    def pdf(wi: Floats) -> Floats:
        return run(ctx, model, parameters, "pdf = bsdf_pdf(b, wo, wi);", {"wi": wi}, {"pdf": 1}, wo)["pdf"]

    drawn = run(ctx, model, parameters, DRAW_ALONE, {"u": u}, {"drawn": 4, "event": 1}, wo)["drawn"]
    found = drawn[:, 3] > 0
    fits = {"bent": fit(Cone(), drawn[found, :3], pdf, len(u) - np.count_nonzero(found))}
    assert fits["bent"].mass < 1 + 2e-5
    assert_fits(fits)


@pytest.mark.parametrize(("name", "material"), CASES)
def test_grazing_viewers_have_samples(ctx: moderngl.Context, name: str, material: str) -> None:
    """At a fifth of a degree above the surface."""
    model, u = MODELS[name], uniform_numbers(1 << 8)
    parameters = model.materials[material][0]
    drawn = run(ctx, model, parameters, DRAW_ALONE, {"u": u}, {"drawn": 4, "event": 1}, direction(89.8))["drawn"]
    assert (drawn[:, 3] > 0).any()


@pytest.mark.parametrize("name", DRAWN_AS_SMITHS)
def test_terms_share_samples_and_densities(ctx: moderngl.Context, name: str) -> None:
    """To the bit, so that what test_samples_have_their_density says of Smith's holds for these."""
    u = uniform_numbers(1 << 14)
    for material, every in MODELS[name].materials.items():
        for parameters in every:
            assert parameters in SMITH.materials[material]
            for degrees in DEGREES:
                one, other = (
                    run(ctx, model, parameters, DRAW, {"u": u}, DRAWN, direction(degrees))["drawn"]
                    for model in (SMITH, MODELS[name])
                )
                np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("name", "material"), CASES)
def test_weight_is_value_over_density(ctx: moderngl.Context, name: str, material: str) -> None:
    """Of the formulas, at the direction drawn; the distribution cancels, so this holds for narrow lobes too. And of
    each delta lobe, one direction, of its value over the chance to choose it. Events say on which side it is, and eta
    is that of the model where it is beyond the surface."""
    model, u = MODELS[name], uniform_numbers(1 << 12)
    for parameters in model.materials[material]:
        for degrees in DEGREES:
            wo = direction(degrees)
            result = run(ctx, model, parameters, DRAW, {"u": u}, DRAWN, wo)
            drawn, weight, event, eta = result["drawn"], result["weight"], result["what"][:, 0], result["what"][:, 1]
            found = drawn[:, 3] > 0
            assert not weight[~found].any()
            delta = (event.astype(int) & DELTA) != 0
            lobes = model.deltas(parameters, np.array([wo]))
            assert set(event[delta]) <= {kind(lobe) for lobe in lobes}
            for lobe in lobes:
                same, share = event == kind(lobe), lobe.chance[0]
                np.testing.assert_allclose(
                    drawn[same, :3], np.broadcast_to(lobe.wi, drawn[same, :3].shape), atol=2e-7 * model.transmits
                )
                if same.any():
                    np.testing.assert_allclose(drawn[same, 3], share, rtol=1e-5)
                    expected = np.broadcast_to(lobe.value / share, weight[same].shape)
                    np.testing.assert_allclose(weight[same], expected, rtol=2e-6 if share == 1 else 1e-5)
                np.testing.assert_allclose(eta[same], lobe.eta, rtol=1e-6)

            below = drawn[:, 2] < 0
            assert model.transmits or not below[found].any()
            np.testing.assert_array_equal(
                event[found & ~delta], np.where(below, TRANSMISSION, REFLECTION)[found & ~delta]
            )
            np.testing.assert_allclose(
                eta[found & ~delta & below], parameters.eta if model.refracts else 1.0, rtol=1e-6
            )
            assert (eta[~below] == 1).all()

            plain = found & ~delta
            wi, pdf = drawn[plain, :3], drawn[plain, 3]
            assert np.abs(np.linalg.norm(drawn[found, :3], axis=1) - 1).max(initial=0) < 1e-6
            viewer = np.broadcast_to(wo, wi.shape)
            value, density = model.value(parameters, viewer, wi), model.pdf(parameters, viewer, wi)
            tolerance = 9e-4 + model.tolerance(parameters, viewer, wi)
            assert (np.abs(pdf - density) <= tolerance * density).all(), (parameters, degrees)
            error = np.abs(weight[plain] - value / density[:, None])
            assert (error <= tolerance[:, None] * weight[plain]).all(), (parameters, degrees)


@pytest.mark.parametrize(("name", "material"), CASES)
def test_mean_weight_is_the_albedo(ctx: moderngl.Context, name: str, material: str) -> None:
    """By quadrature in float64, for glossy lobes and for a mirror, alone or over a base."""
    model, u, p_values = MODELS[name], uniform_numbers(1 << 16), {}
    for parameters, degrees in seen(name, material):
        wo = direction(degrees)
        weight = run(ctx, model, parameters, DRAW, {"u": u}, DRAWN, wo)["weight"]
        expected, power = albedo(model, parameters, wo)
        assert (power <= 1 + 1e-6).all() or model.makes_energy
        p_values[f"{parameters} at {degrees}°"] = mean_p_value(weight, expected)
    assert_likely(p_values)


def mean_p_value(samples: Floats, expected: Floats) -> float:
    """Of the mean of all channels together, with 1e-5 for float32."""
    deviation = samples.sum(1).std() / np.sqrt(len(samples)) + 1e-5 * expected.sum()
    return float(2 * stats.norm.sf(abs(samples.sum(1).mean() - expected.sum()) / max(deviation, 1e-30)))


@pytest.mark.parametrize("name", MODELS)
def test_white_furnace(ctx: moderngl.Context, name: str) -> None:
    """What is white and loses nothing weighs 1 in the mean."""
    u = uniform_numbers(1 << 16)
    for parameters in MODELS[name].lossless:
        for degrees in (0, 45, 80):
            result = run(ctx, MODELS[name], parameters, DRAW, {"u": u}, DRAWN, direction(degrees))
            power = result["weight"] * result["what"][:, 1:] ** 2
            assert power.mean() == pytest.approx(1, abs=1e-3)


def test_a_rough_metal_loses_what_its_facets_scatter_again() -> None:
    white = SMITH.materials["white metal"][0]
    losses = [1 - albedo(SMITH, replace(white, alpha=alpha), direction(45))[1].mean() for alpha in ALPHAS]
    assert losses == sorted(losses)
    assert losses[-1] > 0.1


@pytest.mark.parametrize("material", MODELS["diffuse"].materials)
def test_lambert_returns_its_albedo(ctx: moderngl.Context, material: str) -> None:
    """Exactly; and all but that where it is the base of a surface that has no specular lobe."""
    (parameters,), u = MODELS["diffuse"].materials[material], uniform_numbers(1 << 14)
    base = Material(diffuse=parameters.diffuse)
    expected = np.broadcast_to(np.float32(parameters.diffuse), (len(u), 3))
    for degrees in DEGREES:
        result = run(ctx, SMITH, base, DRAW, {"u": u}, DRAWN, direction(degrees))
        np.testing.assert_allclose(result["weight"], expected, rtol=1e-6)
        pure = run(ctx, MODELS["diffuse"], parameters, DRAW, {"u": u}, DRAWN, direction(degrees))
        np.testing.assert_array_equal(pure["weight"], expected)
        np.testing.assert_allclose(pure["drawn"], result["drawn"], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("term", TERMS)
def test_mirror_is_one_direction_alone(ctx: moderngl.Context, term: str) -> None:
    model, u = MODELS[f"cook-torrance {term}"], uniform_numbers(1 << 10)
    gold = replace(model.materials["gold"][0], alpha=0.0)
    for degrees in DEGREES:
        wo = direction(degrees)
        result = run(ctx, model, gold, DRAW, {"u": u}, DRAWN, wo)
        assert (result["what"] == (REFLECTION + DELTA, 1)).all()
        np.testing.assert_array_equal(result["drawn"], np.broadcast_to((-wo[0], -wo[1], wo[2], 1.0), (len(u), 4)))


@pytest.mark.parametrize(("name", "material"), [*CASES, *((f"cook-torrance {term}", "black") for term in TERMS)])
def test_samples_of_extreme_arguments(ctx: moderngl.Context, name: str, material: str) -> None:
    """Finite, not negative, and at most the largest weight that a lobe can have there, for every u and angle."""
    model = MODELS[name]
    ends = np.float32([0, 2**-24, 0.04, 0.25, 0.5, 0.75, 1 - 2**-24])
    cosines = np.float32([0, 1e-30, 1e-6, 1e-3, 0.5, 1 - 2**-24, 1])
    cosine, x, y = np.stack(np.meshgrid(cosines, ends, ends), -1).reshape(-1, 3).T
    view = np.column_stack([np.sqrt(1 - cosine.astype(np.float64) ** 2), np.zeros(len(cosine)), cosine])
    inputs = {"view": view, "u": np.column_stack([x, y])}
    some = model.materials.get(material, [Material()])
    if model.name == "COOK_TORRANCE":  # on both sides of the width below which it is a mirror
        some = [replace(some[0], alpha=alpha) for alpha in (0, 0.99e-4, 1e-4, 1e-3, 0.1, 1)]
    for parameters in some:
        result = run(ctx, model, parameters, f"wo = view; {DRAW}", inputs, DRAWN)
        assert np.isfinite(result["drawn"]).all(), parameters
        assert np.isfinite(result["weight"]).all(), parameters
        assert (result["drawn"][:, 3] >= 0).all(), parameters
        assert (result["weight"] >= 0).all(), parameters
        limit = model.largest_weight(parameters, cosine.astype(np.float64))
        assert (result["weight"] <= (1 + 1e-4) * limit + 1e-30).all(), parameters
        assert not result["weight"][cosine == 0].any(), parameters
        assert model.transmits or (result["what"][:, 1] == 1).all(), parameters
