# SPDX-License-Identifier: MIT
"""What a rough coat passes and reflects, against the integrals of its facets' BSDF, and what they leave of a base."""

import moderngl
import numpy as np
import pytest

from fragtracer.packing.coats import LEAST_ALPHA, ROUGHNESSES, coat
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.microfacets import internal_reflectance, rough_interface

from .bsdf_models import MODELS
from .bsdf_models.dielectric import Dielectric, dielectric_lobes
from .bsdf_models.plastic import plastic_of
from .bsdf_models.rough_plastic import rough_plastic_interface, rough_plastic_of
from .bsdf_oracle import Direction
from .chi_square import nodes
from .directions import direction
from .domains import Sides
from .test_bsdf_values import albedos
from .texture_probe import material_probe, packed_materials

INDICES = (1.1, 1.33, 1.5, 2.4, 4.0)
ALPHAS = (1e-3, 0.01, 0.05, 0.2, 0.5, 1.0)
DEGREES = (0, 40, 65, 80, 87, 89.7)
FIT = 1e-3  # the error of a fit, as a share of all light


def scattered(alpha: float, eta: float, degrees: float) -> tuple[float, float]:
    """What the facets reflect and pass of light from an angle, by quadrature of Walter's formulas."""
    wo: Direction = direction(degrees)
    wi, weights = nodes(Sides(alpha, eta, wo), (16, 8), (8, 12))
    value, _ = dielectric_lobes(Dielectric(eta, alpha), np.broadcast_to(wo, wi.shape), wi)
    power = weights * value[:, 0] * np.where(wi[:, 2] < 0, eta**2, 1)
    return float(power[wi[:, 2] > 0].sum()), float(power[wi[:, 2] < 0].sum())


@pytest.mark.parametrize("eta", [1.1, 1.5, 2.4])
def test_shares_are_the_integrals_of_the_facets(eta: float) -> None:
    for alpha in (0.02, 0.3, 1.0):
        for degrees in (0, 40, 70, 85):
            found = rough_interface(alpha, eta, [np.cos(np.radians(degrees))])
            np.testing.assert_allclose(np.ravel(found), scattered(alpha, eta, degrees), atol=3e-4)


def test_shares_of_light_from_within() -> None:
    """But at the critical angle, 42°, which no quadrature finds."""
    for alpha in (0.02, 0.3, 1.0):
        for degrees in (0, 20, 60, 80):
            found, _ = rough_interface(alpha, 1 / 1.5, [np.cos(np.radians(degrees))])
            np.testing.assert_allclose(found[0], scattered(alpha, 1 / 1.5, degrees)[0], atol=3e-3)


def test_the_fit_errs_by_less_than_it_says() -> None:
    worst = 0.0
    for eta in INDICES:
        for alpha in ALPHAS:
            cosine = np.cos(np.radians(DEGREES))
            _, fit = rough_plastic_interface(rough_plastic_of((0.5, 0.5, 0.5), alpha, eta), cosine)
            worst = max(worst, np.abs(fit - rough_interface(alpha, eta, cosine)[1]).max())
    print(f"error of the fit: {100 * worst:.3f} %")
    assert worst < FIT


@pytest.mark.parametrize("eta", [1.1, 1.5, 2.4])
def test_what_the_coat_reflects_within(eta: float) -> None:
    """By 500 angles; and of a coat that is all but smooth what passes and what does not add up to 1 on both sides."""
    cosine = (np.arange(500) + 0.5) / 500
    for alpha in (0.05, 0.5):
        reflected, _ = rough_interface(alpha, 1 / eta, cosine)
        assert internal_reflectance(alpha, eta) == pytest.approx(2 * np.mean(cosine * reflected), abs=2e-4)
    _, passed = rough_interface(LEAST_ALPHA, eta, cosine)
    assert coat(0.0, eta)["leaving"] == pytest.approx(2 * np.mean(cosine * passed) / eta**2, abs=1e-3)


@pytest.mark.parametrize("nonlinear", [True, False])
def test_a_base_under_a_coat(ctx: moderngl.Context, nonlinear: bool) -> None:
    """Reflected share of light from everywhere: of the facets R, and of the base of albedo ρ what passes, T, times the
    mean T / n² of what leaves, over 1 - ρ R within."""
    rho, eta = 0.7, 1.5
    x, weights = np.polynomial.legendre.leggauss(32)
    for alpha in (0.05, 0.3, 1.0):
        cosine = (x + 1) / 2
        mean = float(weights @ (cosine * rough_interface(alpha, eta, cosine)[1]))
        within = float(weights @ (cosine * rough_interface(alpha, 1 / eta, cosine)[0]))
        parameters = rough_plastic_of((rho, rho, rho), alpha, eta, nonlinear)
        albedo = albedos(ctx, MODELS["rough-plastic"], [parameters], DEGREES[:4], (8, 8))
        reflected, passed = rough_interface(alpha, eta, np.cos(np.radians(DEGREES[:4])))
        base = rho * passed * mean / eta**2 / (1 - within * (rho if nonlinear else 1))
        np.testing.assert_allclose(albedo[0, :, 0], reflected + base, atol=2 * FIT)


def test_a_base_under_a_smooth_coat_of_any_index(ctx: moderngl.Context) -> None:
    """What it reflects back is all but 1 where the index is large."""
    bases = [(albedo, eta) for albedo in (0.5, 1.0) for eta in (1.0, 1.5, 30.0, 300.0, 3000.0, 1e38)]
    materials = [Material(model="plastic", albedo=albedo, ior=eta) for albedo, eta in bases]
    body = "value = material_bsdf(material_at(surface), true).diffuse.r;"
    inputs = {"index": np.arange(len(bases)), "uv": np.zeros((len(bases), 4))}
    found = material_probe(ctx, packed_materials(materials), body, inputs, {"value": 1})["value"]
    assert np.isfinite(found).all()
    for value, (albedo, eta) in zip(found, bases, strict=True):
        if eta < 1e38:
            assert value == pytest.approx(plastic_of((albedo,) * 3, eta).diffuse[0], rel=1e-3)


def test_a_texture_varies_the_coat(ctx: moderngl.Context) -> None:
    """Between the roughnesses that are stored, too, with the error of two fits, at grazing angles below the first of
    them of four; and a base of that colour is as bright."""
    roughnesses = [0.0, 0.03, 0.1, 0.22, 0.47, 0.72, 0.99, 1.0]
    white = Texture(Image(np.ones((1, 1, 1), np.float32), "linear"))
    materials = [
        Material(model="rough-plastic", albedo=0.8, roughness=r, roughness_texture=white, ior=1.6) for r in roughnesses
    ]
    cosine = np.cos(np.radians(DEGREES))
    inputs = {
        "index": np.repeat(np.arange(len(materials)), len(cosine)),
        "uv": np.zeros((len(materials) * len(cosine), 4)),
        "cosine": np.tile(cosine, len(materials)),
    }
    body = """Bsdf b = material_bsdf(material_at(surface), true);
        passed = rough_plastic_interface(b, cosine).y; diffuse = b.diffuse.r;"""
    found = material_probe(ctx, packed_materials(materials), body, inputs, {"passed": 1, "diffuse": 1})
    for i, roughness in enumerate(roughnesses):
        alpha, mine = max(roughness**2, LEAST_ALPHA), inputs["index"] == i
        error = 4 * FIT if roughness < 1 / (ROUGHNESSES - 1) else 2 * FIT
        np.testing.assert_allclose(found["passed"][mine], rough_interface(alpha, 1.6, cosine)[1], atol=error)
        base = 0.8 / (1 - 0.8 * internal_reflectance(alpha, 1.6)) / 1.6**2
        np.testing.assert_allclose(found["diffuse"][mine], base, rtol=1e-3)
