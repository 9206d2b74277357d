# SPDX-License-Identifier: MIT
"""Our material in Mitsuba: its density, its value, its energy, and Mitsuba's own materials beside it."""

import numpy as np
import pytest

from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene.reflectance import grazing_reflectance

GEOMETRIES = ("smith", "smith-height-correlated", "schlick-beckmann", "karis")
MULTIPLE = "smith-multiple-scattering"


GREY = (1.0, 1.0, 1.0)


def load(mi, albedo=0.0, f0=1.0, alpha=0.3, geometry="smith", f90=1.0, tint=(1.0, 0.5, 0.25), **more):
    return mi.load_dict(
        {
            "type": "fragtracer_cooktorrance",
            "diffuse_albedo": [albedo * t for t in tint],
            "specular_f0": [f0 * t for t in tint],
            "specular_f90": [f90 * 1.0] * 3,
            "alpha": alpha,
            "geometry": geometry,
            **more,
        }
    )


def direction(mi, degrees, azimuth=0.0):
    import drjit as dr

    theta, phi = np.radians(degrees), np.radians(azimuth)
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    found = mi.Vector3f(float(x), float(y), float(z))
    dr.make_opaque(found)  # Mitsuba would compile a kernel for each literal
    return found


def seen_from(mi, viewer):
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = viewer
    return si


def random_directions(mi, count, seed):
    """Uniform on the whole sphere."""
    return mi.warp.square_to_uniform_sphere(mi.Point2f(np.random.default_rng(seed).random((2, count), dtype="f4")))


def sample(mi, bsdf, viewer, count=200_000, seed=1):
    u = np.random.default_rng(seed).random((3, count), dtype="f4")
    return bsdf.sample(mi.BSDFContext(), seen_from(mi, viewer), mi.Float(u[0]), mi.Point2f(u[1:]))


def evaluate(mi, bsdf, viewer, light):
    return bsdf.eval(mi.BSDFContext(), seen_from(mi, viewer), light).numpy()


CHI2_CASES = [
    # albedo, F0, alpha, geometry, viewer's angle
    (0.0, 1.0, 0.1, "smith", 40),
    (0.0, 0.9, 0.3, "karis", 80),
    (0.0, 0.9, 1.0, "schlick-beckmann", 60),
    (0.5, 0.04, 0.25, "smith", 0),
    (0.5, 0.04, 0.5, "karis", 75),
    (0.5, 0.04, 0.5, "smith-height-correlated", 120),
    (0.8, 0.04, 1e-5, "smith", 50),
]


@pytest.mark.parametrize(("albedo", "f0", "alpha", "geometry", "angle"), CHI2_CASES)
def test_samples_follow_the_density(mi, albedo, f0, alpha, geometry, angle):
    bsdf, viewer = load(mi, albedo, f0, alpha, geometry), direction(mi, angle, 30)
    follow_the_density(mi, bsdf, seen_from(mi, viewer), len(CHI2_CASES))


def follow_the_density(mi, bsdf, si, test_count):
    """Of so many tests one: smooth lobes are sampled with their density."""
    import drjit as dr
    from mitsuba.chi2 import ChiSquareTest, SphericalDomain

    def draw(u):
        bs, _ = bsdf.sample(mi.BSDFContext(), si, u[0], mi.Point2f(u[1], u[2]))
        delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.DeltaReflection)
        return bs.wo, dr.select((bs.pdf > 0) & ~delta, mi.Float(1), 0)

    chi2 = ChiSquareTest(
        domain=SphericalDomain(),
        sample_func=draw,
        pdf_func=lambda wi: bsdf.pdf(mi.BSDFContext(), si, wi),
        sample_dim=3,
        sample_count=500_000,
        res=51,
        ires=16,
    )
    assert chi2.run(significance_level=0.01, test_count=test_count, quiet=True), chi2.messages
    assert chi2.pdf_sum[0] == pytest.approx(chi2.histogram_sum[0], abs=0.004)


def weighed_by_density(mi, bsdf, viewer):
    """Samples, and which of them are any; their weights are values over densities."""
    bs, weight = sample(mi, bsdf, viewer, count=10_000)
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), seen_from(mi, viewer), bs.wo)
    used = bs.pdf.numpy() > 0
    assert used.mean() > 0.5
    np.testing.assert_allclose(bs.pdf.numpy()[used], pdf.numpy()[used], rtol=2e-3)
    np.testing.assert_allclose((weight * pdf).numpy()[:, used], value.numpy()[:, used], rtol=1e-5)
    return bs, used


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("alpha", [1e-4, 0.3, 1.0])
@pytest.mark.parametrize(("albedo", "angle"), [(0.0, 70), (0.6, 10), (0.6, 150)])
def test_weight_is_value_over_density(mi, alpha, geometry, albedo, angle):
    bsdf, viewer = load(mi, albedo, 0.5, alpha, geometry), direction(mi, angle, 200)
    bs, used = weighed_by_density(mi, bsdf, viewer)
    assert np.array_equal(np.sign(bs.wo.z.numpy()[used]), np.full(used.sum(), np.sign(viewer.z.numpy()[0])))


def g(co, ci, alpha, geometry):
    """Each geometry term in float64."""
    if geometry.startswith("smith"):
        lambdas = [(np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) - 1) / 2 for c in (co, ci)]
        return 1 / (1 + sum(lambdas) + (geometry == "smith") * np.prod(lambdas, axis=0))
    k = alpha * np.sqrt(2 / np.pi) if geometry == "schlick-beckmann" else (np.sqrt(alpha) + 1) ** 2 / 8
    return co / (co * (1 - k) + k) * ci / (ci * (1 - k) + k)


def reflected_share(f0, alpha, geometry, angle, cells=600):
    """Directional albedo of the specular lobe alone, by the midpoint rule over microfacet slopes in float64.

    In slopes s = tan(theta) / alpha, D cos(theta) dω = s ds dphi / (pi (1 + s²)²); v = s² / (1 + s²)
    makes that dv dphi / (2 pi). Of wi it is 4 (wo·h) dω_h that makes dω_i.
    """
    v, phi = np.meshgrid((np.arange(cells) + 0.5) / cells, (np.arange(cells) + 0.5) / cells * 2 * np.pi)
    tangent = alpha * np.sqrt(v / (1 - v))
    h = np.stack([tangent * np.cos(phi), tangent * np.sin(phi), np.ones_like(phi)]) / np.sqrt(1 + tangent**2)
    wo = np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))])
    wo_h = np.tensordot(wo, h, 1)
    wi_z = 2 * wo_h * h[2] - wo[2]

    seen = (wo_h > 0) & (wi_z > 0)
    fresnel = f0 + (1 - f0) * (1 - wo_h) ** 5
    light = fresnel * g(np.full_like(wi_z, wo[2]), np.abs(wi_z), alpha, geometry) * wo_h / (wo[2] * h[2])
    return np.mean(np.where(seen, light, 0))


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("alpha", [1e-4, 0.2, 1.0])
@pytest.mark.parametrize("angle", [5, 65, 85])
def test_mean_weight_is_the_integral(mi, alpha, geometry, angle):
    _, weight = sample(mi, load(mi, 0.0, 0.6, alpha, geometry), direction(mi, angle, 70))
    red = weight.numpy()[0]
    error = 4 * red.std() / np.sqrt(red.size) + 5e-4
    assert red.mean() == pytest.approx(reflected_share(0.6, alpha, geometry, angle), abs=error)


@pytest.mark.parametrize(
    ("alpha", "geometry"),
    [(1e-5, "smith"), (1e-5, "smith-height-correlated"), (0.0, "karis"), (1e-5, "schlick-beckmann")],
)
def test_mirror(mi, alpha, geometry):
    bs, weight = sample(mi, load(mi, 0.0, 0.6, alpha, geometry), direction(mi, 60, 30), count=4)
    np.testing.assert_allclose(bs.wo.numpy()[:, 0], direction(mi, 60, 210).numpy()[:, 0], atol=1e-6)
    np.testing.assert_allclose(weight.numpy()[0], (0.6 + 0.4 * 0.5**5) * g(0.5, 0.5, alpha, geometry), rtol=1e-5)
    assert (bs.sampled_type.numpy() == int(mi.BSDFFlags.DeltaReflection)).all()
    assert (bs.pdf.numpy() == 1).all()


def test_mirror_over_a_base_splits_the_probability(mi):
    bsdf, viewer = load(mi, 0.8, 0.04, 0.0), direction(mi, 60)
    bs, weight = sample(mi, bsdf, viewer)
    delta = bs.sampled_type.numpy() == int(mi.BSDFFlags.DeltaReflection)
    share = bs.pdf.numpy()[delta][0]
    assert delta.mean() == pytest.approx(share, abs=0.01)
    mirrored = 0.04 + 0.96 * 0.5**5
    np.testing.assert_allclose(weight.numpy()[0][delta], mirrored / share, rtol=1e-5)
    base = 0.8 * (1 - mirrored) * (1 - (0.04 + 0.96 / 21))  # Schlick's term has the mean F0 + (1 - F0) / 21
    assert weight.numpy()[0].mean() == pytest.approx(mirrored + base, rel=0.005)
    assert [mi.has_flag(bsdf.flags(i), mi.BSDFFlags.DeltaReflection) for i in range(2)] == [False, True]


@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("alpha", [0.01, 0.4])
def test_reciprocity(mi, alpha, geometry):
    bsdf = load(mi, 0.6, 0.1, alpha, geometry)
    a, b = random_directions(mi, 5000, 1), random_directions(mi, 5000, 2)
    b.z = abs(b.z) * mi.Float(np.sign(a.z.numpy()))
    forth = evaluate(mi, bsdf, a, b) / np.abs(b.z.numpy())
    back = evaluate(mi, bsdf, b, a) / np.abs(a.z.numpy())
    assert forth.max() > 0
    np.testing.assert_allclose(forth, back, rtol=1e-4, atol=1e-7)


def test_nothing_passes_through(mi):
    light = random_directions(mi, 1000, 3)
    light.z = -abs(light.z)
    assert not evaluate(mi, load(mi, 0.5, 0.5), direction(mi, 30), light).any()


@pytest.mark.parametrize("angle", [30, 75, 120, 165])
def test_a_blend_scatters_what_its_parts_scatter(mi, angle):
    """In the mean of its samples, by Mitsuba's own rough glass and a black surface, from without and from within."""
    glass = {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.25}
    black = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.0}}
    blend = mi.load_dict({"type": "fragtracer_blend", "bsdf_0": black, "bsdf_1": glass, "weight": 0.4})
    count = 4_000_000
    found, expected = (
        sample(mi, bsdf, direction(mi, angle), count, seed)[1].numpy()[0].astype(np.float64)
        for seed, bsdf in enumerate((blend, mi.load_dict(glass)))
    )
    error = np.hypot(found.std(), 0.4 * expected.std()) / np.sqrt(count)
    assert error < 0.001 * expected.mean()
    assert found.mean() == pytest.approx(0.4 * expected.mean(), abs=4 * error)


@pytest.mark.parametrize(("albedo", "f0"), [(0.0, 1.0), (1.0, 0.04), (1.0, 0.5), (1.0, 0.005), (1.0, 0.0)])
@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("alpha", [1e-5, 1e-4, 0.05, 0.3, 1.0])
def test_no_energy_is_made(mi, albedo, f0, alpha, geometry):
    bsdf = load(mi, albedo, f0, alpha, geometry, f90=grazing_reflectance(f0))
    for angle in (1, 45, 80, 89.5):
        _, weight = sample(mi, bsdf, direction(mi, angle), count=50_000)
        red = weight.numpy()[0]
        assert red.mean() < 1 + 4 * red.std() / np.sqrt(red.size) + 1e-6


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.3, 0.6, 1.0])
def test_multiple_scattering_fills_the_white_furnace(mi, alpha):
    """The weight of the metal's samples is G1(wi) / E, whose mean is 1, but for the 0.35 % of the fit of E."""
    bsdf = load(mi, alpha=alpha, geometry=MULTIPLE, tint=GREY)
    for angle in (0, 40, 70, 85, 89):
        _, weight = sample(mi, bsdf, direction(mi, angle), count=400_000)
        red = weight.numpy()[0]
        assert abs(red.mean() - 1) < 0.0035 + 4 * red.std() / np.sqrt(red.size)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0])
def test_smith_term_is_that_of_roughconductor(mi, alpha):
    other = mi.load_dict({"type": "roughconductor", "distribution": "ggx", "material": "none", "alpha": alpha})
    ours = load(mi, alpha=alpha, tint=GREY)
    for angle in (3, 50, 87):
        viewer = direction(mi, angle, 20)
        bs, _ = sample(mi, other, viewer, count=5000)
        expected = evaluate(mi, other, viewer, bs.wo)
        np.testing.assert_allclose(evaluate(mi, ours, viewer, bs.wo), expected, rtol=1e-4, atol=1e-7)
        assert expected.max() > 0


def test_without_specular_it_is_mitsubas_diffuse(mi):
    ours = load(mi, 0.8, 0.0, 0.3, f90=0.0)
    other = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.8, 0.4, 0.2]}})
    viewer, light = direction(mi, 40), random_directions(mi, 1000, 4)
    np.testing.assert_allclose(evaluate(mi, ours, viewer, light), evaluate(mi, other, viewer, light), rtol=1e-5)


def test_a_perfect_mirror_is_mitsubas_conductor(mi):
    ours = load(mi, alpha=0.0, tint=GREY)
    viewer = direction(mi, 50, 10)
    (bs, weight), (other_bs, other_weight) = (
        sample(mi, bsdf, viewer, count=10) for bsdf in (ours, mi.load_dict({"type": "conductor", "material": "none"}))
    )
    np.testing.assert_allclose(bs.wo.numpy()[:, :1], other_bs.wo.numpy(), atol=1e-6)
    np.testing.assert_allclose(weight.numpy()[:, :1], other_weight.numpy()[:, :1], rtol=1e-6)


def test_scalar_variant_gives_the_same_numbers(mi):
    expected = evaluate(mi, load(mi, 0.5, 0.2), direction(mi, 40), direction(mi, 20, 100)).ravel()
    with mitsuba_variant("scalar_rgb"):
        bsdf = load(mi, 0.5, 0.2)
        si = seen_from(mi, direction(mi, 40))
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, direction(mi, 20, 100))
        bs, weight = bsdf.sample(mi.BSDFContext(), si, 0.3, mi.Point2f(0.4, 0.6))
        again = bsdf.eval(mi.BSDFContext(), si, bs.wo)
    np.testing.assert_allclose(np.array(value), expected, rtol=1e-5)
    np.testing.assert_allclose(np.array(weight) * bs.pdf, np.array(again), rtol=1e-5)
    assert pdf > 0


def test_an_unknown_geometry_term_is_refused(mi):
    with pytest.raises(RuntimeError, match="geometry must be smith"):
        load(mi, geometry="walter")
