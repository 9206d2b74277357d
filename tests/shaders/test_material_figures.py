# SPDX-License-Identifier: MIT
"""The figures of docs/material.md, read there and computed in float64 by quadrature."""

import re

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.resources import folder
from fragtracer.scene.microfacets import internal_reflectance, rough_interface

from . import bsdf_oracle
from .bsdf_models import MODELS
from .bsdf_models.half_vector import HalfVector
from .bsdf_models.sheen import Sheened
from .bsdf_oracle import Material, interface_reflectance
from .chi_square import nodes
from .directions import direction
from .domains import Cone, Reflections
from .test_bsdf_values import albedos

PAGE = (folder("shaders").parent / "docs/material.md").read_text("utf-8").replace("\n", " ")
WHITE = (1.0, 1.0, 1.0)
CORRELATED = "SMITH_HEIGHT_CORRELATED"


def figures(pattern: str) -> list[float]:
    """The numbers, each a # in ``pattern``, of the one place where that stands on the page."""
    (found,) = re.findall(pattern.replace("#", r"(\d+(?:\.\d+)?)"), PAGE)
    return [float(x) for x in ([found] if isinstance(found, str) else found)]


def row(label: str) -> list[float]:
    """The numbers of the one row of a table that begins so."""
    (found,) = re.findall(re.escape(f"| {label} |") + r"((?: [\d.]+ \|)+)", PAGE)
    return [float(x) for x in found.split("|")[:-1]]


def dielectric(f0: float, alpha: float = 0.0) -> Material:
    return Material(WHITE, alpha, (f0,) * 3, (1.0,) * 3)


def lobe(m: Material, degrees: float, term: str = "SMITH") -> float:
    """What the specular lobe reflects towards an angle, of light from everywhere."""
    wo = direction(degrees)
    wi, weights = nodes(Reflections(m.alpha, wo), (8, 8), (8, 12))
    viewer = np.broadcast_to(wo, wi.shape)
    value = bsdf_oracle.bsdf_eval(m, term, viewer, wi) - bsdf_oracle.bsdf_eval_diffuse(m, viewer, wi, term)
    return float(weights @ value[:, 0])


def base(m: Material, degrees: float, term: str = "SMITH") -> float:
    wo, (wi, weights) = direction(degrees), nodes(Cone(), (8, 1), (12, 2))
    return float(weights @ bsdf_oracle.bsdf_eval_diffuse(m, np.broadcast_to(wo, wi.shape), wi, term)[:, 0])


@pytest.mark.parametrize("alpha", [0, 0.1, 0.25, 1])
def test_the_factor_of_the_half_vector(ctx: moderngl.Context, alpha: float) -> None:
    """Over a white base, 1 - F(wo . wh) times cos / pi, and the lobe; and a material that has the factor does that."""
    wi, weights = nodes(Cone(), (32, 8), (8, 12))
    found = []
    for cosine in figures(r"\| factor \| α \| # \| # \| # \| # \| # \|"):
        wo, m = np.array([np.sqrt(1 - cosine**2), 0, cosine]), dielectric(0.04, alpha)
        wh = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
        passed = weights @ ((1 - bsdf_oracle.fresnel(m.f0, m.f90, wh @ wo)[:, 0]) * wi[:, 2] / np.pi)
        mirrored = lobe(m, np.degrees(np.arccos(cosine))) if alpha else bsdf_oracle.fresnel(m.f0, m.f90, cosine)[0]
        found.append(passed + mirrored)
    np.testing.assert_allclose(row("1 − F(wo·h) | 0" if alpha == 0 else f"| {alpha}"), found, atol=0.005)
    degrees = np.degrees(np.arccos(figures(r"\| factor \| α \| # \| # \| # \| # \| # \|")))
    material = HalfVector(WHITE, alpha, (0.04,) * 3, WHITE)
    shaded = albedos(ctx, MODELS["half-vector"], [material], degrees, (16, 8))[0, :, 0]
    np.testing.assert_allclose(shaded, found, rtol=2e-3)


def test_what_a_white_base_loses() -> None:
    """Under a smooth interface: of all light from above, by the mean of what the interface reflects."""
    share, most, worst = figures("that is # %; .* up to # % at F0 = #")

    def lost(f0: float, degrees: float = 0) -> float:
        m = dielectric(f0)
        return 1 - interface_reflectance(m, np.cos(np.radians(degrees)))[0] - base(m, degrees)

    assert 100 * lost(0.04) == pytest.approx(share, abs=0.05)
    assert lost(0.04) > max(lost(0.04, degrees) for degrees in (20, 60, 80))
    f0 = np.arange(0.025, 1, 0.05)
    found = [lost(x) for x in f0]
    assert 100 * max(found) == pytest.approx(most, abs=0.5)
    assert f0[np.argmax(found)] == pytest.approx(worst)


def unpolarized(cosine: NDArray[np.float64], eta: float) -> NDArray[np.float64]:
    """Fresnel's reflectance; ``eta`` is the index beyond the surface over that before it."""
    inside = np.sqrt(np.maximum(0, 1 - (1 - cosine**2) / eta**2))
    s, p = (cosine - eta * inside) / (cosine + eta * inside), (eta * cosine - inside) / (eta * cosine + inside)
    return np.where((1 - cosine**2) > eta**2, 1, (s**2 + p**2) / 2)


def test_the_base_of_a_real_coat() -> None:
    """With all orders of reflection between coat and base, for the Fresnel equations."""
    (percent,) = figures("of n = 1.5, # % of what")
    cosine = (np.arange(200_000) + 0.5) / 200_000
    back = np.mean(2 * cosine * unpolarized(cosine, 1 / 1.5))
    assert 100 * back == pytest.approx(percent, abs=0.05)
    albedo = np.array(row("albedo"))
    assert unpolarized(np.array(1.0), 1.5) == pytest.approx(0.04)
    coat = 0.96 * albedo * (1 - back) / (1 - back * albedo)
    ours = albedo * base(dielectric(0.04), 0)
    np.testing.assert_allclose(row("base of fragtracer over base of a coat, n = 1.5"), ours / coat, atol=0.005)


def test_why_the_height_correlated_term_has_a_lesser_rise() -> None:
    """With all of alpha, a white base under a rough interface reflects more than it receives."""
    (percent,) = figures("s = 1 would exceed it by # %")
    m = dielectric(0.02, 1.0)
    total = lobe(m, 89.95, CORRELATED) + base(m, 89.95, "SMITH")
    assert 100 * (total - 1) == pytest.approx(percent, abs=0.05)
    assert lobe(m, 89.95, CORRELATED) + base(m, 89.95, CORRELATED) <= 1


def test_what_a_white_metal_reflects() -> None:
    metal = Material(alpha=1.0, f0=WHITE, f90=WHITE)
    (percent,) = figures("reflects # % of the light that it is seen by from above")
    assert 100 * lobe(metal, 0) == pytest.approx(percent, abs=0.5)
    for term in ("SMITH", CORRELATED):
        found = [lobe(metal, degrees, term) for degrees in row("degrees from the normal")]
        np.testing.assert_allclose(row(f"`{term.lower().replace('_', '-')}`"), found, atol=0.005)


def test_the_fit_of_what_a_white_metal_reflects() -> None:
    """Of the matrix on the page, before which there is that of sheen; and what it makes of a dielectric's lobe, most
    where E is least."""
    rows = re.findall(r"\| +((?:[−\d.]+ +){4})\|", PAGE)
    numbers = np.array([[float(x.replace("−", "-")) for x in found.split()] for found in rows])
    sheen, matrix = np.split(numbers, [len(bsdf_oracle.SHEEN_FIT)])
    np.testing.assert_array_equal(sheen, bsdf_oracle.SHEEN_FIT)
    assert matrix.shape == (4, 4)
    (largest,) = figures("largest relative error in E is # %")
    errors, least = [], 1.0
    for alpha in (1e-4, 0.01, 0.1, 0.3, 0.6, 1.0):
        for degrees in (0, 40, 65, 78, 85, 88, 89.4, 89.97):
            single = lobe(Material(alpha=alpha, f0=WHITE, f90=WHITE), degrees)
            c = np.cos(np.radians(degrees))
            t = c / np.sqrt(c**2 + 9 * alpha**2)
            fit = 1 - (1 - t**2) * (alpha ** np.arange(4) @ matrix @ t ** np.arange(4))
            errors.append(abs(fit / single - 1))
            least = min(least, single)
    assert 100 * max(errors) <= largest + 0.005
    (percent,) = figures("F0 = 0.04 grows by at most # %")
    assert 100 * 0.04 * (1 - least) / least == pytest.approx(percent, abs=0.5)


@pytest.mark.parametrize("degrees", [0, 60, 80])
def test_what_white_sheen_reflects(ctx: moderngl.Context, degrees: int) -> None:
    """Alone, and over a white base."""
    for label, diffuse in (("white sheen", (0.0, 0.0, 0.0)), ("over white", WHITE)):
        cloth = [Sheened(diffuse, sheen_color=WHITE, sheen_roughness=r) for r in row("roughness of the sheen")]
        found = albedos(ctx, MODELS["sheen"], cloth, [degrees], (8, 8))[:, 0, 0]
        np.testing.assert_allclose(row(f"{label}, from {degrees}°"), found, atol=0.0051)


def test_what_white_under_a_rough_coat_reflects() -> None:
    """Of diffuse light: at the facets, and by the base; in, out and within by single scattering."""
    x, weights = np.polynomial.legendre.leggauss(48)
    cosine, found = (x + 1) / 2, []
    for roughness in row("roughness"):
        alpha = max(roughness**2, 1e-3)
        reflected, passed = (float(weights @ (cosine * y)) for y in rough_interface(alpha, 1.5, cosine))
        found.append(reflected + passed**2 / 1.5**2 / (1 - internal_reflectance(alpha, 1.5)))
    np.testing.assert_allclose(row("white, under a coat of n = 1.5"), found, atol=0.005)
