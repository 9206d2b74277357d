# SPDX-License-Identifier: MIT
"""The shader's models, value by value, against Mitsuba's own plugins, on both sides of a surface."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from shaders.bsdf_models import MODELS
from shaders.bsdf_models.brushed import Brushed
from shaders.bsdf_models.coated import Coated
from shaders.bsdf_models.conductor import Conductor
from shaders.bsdf_models.dielectric import Dielectric
from shaders.bsdf_models.plastic import plastic_of
from shaders.bsdf_models.rough_plastic import rough_plastic_chance, rough_plastic_interface, rough_plastic_of
from shaders.bsdf_models.sheen import Sheened
from shaders.bsdf_models.translucent import Translucent
from shaders.bsdf_probe import run
from shaders.directions import direction

from fragtracer.probe import probe
from fragtracer.reference.dielectrics import conductor_bsdf, dielectric_bsdf, medium_tree, plastic_bsdf
from fragtracer.reference.materials import exact_bsdf, surface
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.plugins import register
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import Material, Medium
from fragtracer.scene.reflectance import METAL_INDEX

from .test_bsdf import follow_the_density

DEGREES = [3, 40, 65, 85]
EVAL = "vec4 both = bsdf_eval_pdf(b, wo, wi); value = both.rgb; pdf = both.a;"
DRAW = "BsdfSample s = bsdf_sample(b, wo, u); drawn = vec4(s.wi, s.pdf); weight = vec4(s.weight, s.eta);"


def seen_from(mi: Any, viewer: Any) -> Any:
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(*map(float, viewer))
    dr.make_opaque(si.wi)  # Mitsuba would compile a kernel for each literal
    return si


def over_the_sphere(count: int) -> Any:
    z, turns = np.random.default_rng(5).random((2, count)) * ((2,), (1,)) - ((1,), (0,))
    radius, angle = np.sqrt(1 - z**2), 2 * np.pi * turns
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], 1).astype(np.float32)


@pytest.mark.parametrize("g", [-0.7, 0.0, 0.4, 0.9])
def test_phase_function(ctx: moderngl.Context, mi: Any, g: float) -> None:
    """Values and densities; in Mitsuba wi is against the ray that arrives, and the context none of ours."""
    import drjit as dr

    wi = over_the_sphere(4096)
    body = f"p = phase_eval({g}, vec3(0.0, 0.0, 1.0), wi);"
    ours = probe(ctx, ["medium/phase.glsl"], body, {"wi": wi}, {"p": 1})["p"]
    theirs = mi.load_dict(medium_tree(Medium(g=g), Path())["phase"])
    place = dr.zeros(mi.MediumInteraction3f)
    place.wi = mi.Vector3f(0.0, 0.0, 1.0)
    place.sh_frame = mi.Frame3f(mi.Vector3f(0.0, 0.0, 1.0))
    value, pdf = theirs.eval_pdf(mi.PhaseFunctionContext(None), place, mi.Vector3f(wi.T))
    np.testing.assert_allclose(value.numpy().T, np.stack([ours] * 3, 1), rtol=1e-4)
    np.testing.assert_allclose(np.ravel(pdf), ours, rtol=1e-4)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("roughness", [0.2, 0.6, 1.0])
@pytest.mark.parametrize("model", ["dielectric", "rough-thin-dielectric"])
def test_rough_lobes(ctx: moderngl.Context, mi: Any, model: Any, roughness: float, side: int) -> None:
    """Values, densities, and weights of our samples; on the back, up is down in our frame, and the index inverted, but
    that of a pane."""
    material = Material(model=model, roughness=roughness, ior=1.6, transmittance=(0.9, 0.6, 0.3))
    material = replace(material, anisotropy=0.5) if material.is_pane else material
    register()
    theirs = mi.load_dict(dielectric_bsdf(material, None))
    name = "dielectric" if material.is_solid else "thin-dielectric"
    parameters = Dielectric(1.6 ** (side if material.is_solid else 1), material.alpha, material.transmittance)
    parameters = replace(parameters, anisotropy=material.anisotropy)
    flip = np.float32((1, 1, side))
    for degrees in DEGREES:
        wo = direction(degrees)
        drawn = run(ctx, MODELS[name], parameters, DRAW, {"u": u(4096)}, {"drawn": 4, "weight": 4}, wo)
        found = drawn["drawn"][:, 3] > 0
        wi = np.concatenate([over_the_sphere(4096), drawn["drawn"][found, :3]]).astype(np.float32)
        ours = run(ctx, MODELS[name], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        si, light = seen_from(mi, wo * flip), mi.Vector3f((wi * flip).T)
        value, pdf = theirs.eval_pdf(mi.BSDFContext(), si, light)
        slack = MODELS[name].tolerance(parameters, np.broadcast_to(wo, wi.shape), wi.astype(np.float64))
        slack = 2 * np.minimum(slack, 1)
        assert (np.abs(ours["pdf"] - pdf.numpy()) <= slack * ours["pdf"] + 1e-7).all(), degrees
        assert (np.abs(ours["value"] - value.numpy().T) <= slack[:, None] * ours["value"] + 1e-7).all(), degrees
        weight = (value / pdf).numpy().T[-np.count_nonzero(found) :]
        error = np.abs(drawn["weight"][found, :3] - weight)
        assert (error <= (1e-3 + slack[-len(weight) :, None]) * weight).all(), degrees


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("model", ["dielectric", "thin-dielectric"])
def test_smooth_lobes(ctx: moderngl.Context, mi: Any, model: str, side: int) -> None:
    """Direction, probability, weight and index of what is reflected and of what is transmitted."""
    material = Material(model=model, ior=1.5, transmittance=(0.9, 0.6, 0.3))
    if model == "dielectric":
        material = Material(model=model, roughness=0.0, ior=1.5, transmittance=(0.9, 0.6, 0.3))
    theirs = mi.load_dict(dielectric_bsdf(material, None))
    parameters = Dielectric(1.5 ** (side if model == "dielectric" else 1), 0.0, material.transmittance)
    for degrees in DEGREES:
        wo = direction(degrees)
        for choice in (0.0, 0.999):
            inputs = {"u": np.float32([(choice, 0.5)])}
            ours = run(ctx, MODELS[model], parameters, DRAW, inputs, {"drawn": 4, "weight": 4}, wo)
            viewer = np.asarray(wo) * (1, 1, side)
            bs, weight = theirs.sample(mi.BSDFContext(), seen_from(mi, viewer), choice, mi.Point2f(0.5, 0.5))
            np.testing.assert_allclose(ours["drawn"][0, :3] * (1, 1, side), bs.wo.numpy()[:, 0], atol=2e-6)
            np.testing.assert_allclose(ours["drawn"][0, 3], bs.pdf.numpy()[0], rtol=2e-5)
            np.testing.assert_allclose(ours["weight"][0, :3], weight.numpy()[:, 0], rtol=2e-5)
            np.testing.assert_allclose(ours["weight"][0, 3], bs.eta.numpy()[0], rtol=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_conductor(ctx: moderngl.Context, mi: Any, roughness: float) -> None:
    material = Material(model="conductor", metal="gold", roughness=roughness)
    theirs = mi.load_dict(conductor_bsdf(material))
    parameters = Conductor(*material.complex_index, material.alpha)
    for degrees in DEGREES:
        wo = direction(degrees)
        drawn = run(ctx, MODELS["conductor"], parameters, DRAW, {"u": u(1024)}, {"drawn": 4, "weight": 4}, wo)
        found = drawn["drawn"][:, 3] > 0
        if roughness == 0:
            bs, weight = theirs.sample(mi.BSDFContext(), seen_from(mi, wo), 0.5, mi.Point2f(0.5, 0.5))
            np.testing.assert_allclose(drawn["drawn"][0], [*bs.wo.numpy()[:, 0], bs.pdf.numpy()[0]], atol=1e-6)
            np.testing.assert_allclose(drawn["weight"][0, :3], weight.numpy()[:, 0], rtol=2e-5)
            continue
        wi = np.concatenate([over_the_sphere(4096), drawn["drawn"][found, :3]]).astype(np.float32)
        ours = run(ctx, MODELS["conductor"], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        value, pdf = theirs.eval_pdf(mi.BSDFContext(), seen_from(mi, wo), mi.Vector3f(wi.T))
        np.testing.assert_allclose(ours["value"], value.numpy().T, rtol=1e-3, atol=1e-6)
        np.testing.assert_allclose(ours["pdf"], pdf.numpy(), rtol=1e-3, atol=1e-6)
        weight = (value / pdf).numpy().T[-np.count_nonzero(found) :]
        np.testing.assert_allclose(drawn["weight"][found, :3], weight, rtol=2e-3)


@pytest.mark.parametrize("model", ["conductor", "dielectric", "back of dielectric"])
@pytest.mark.parametrize(("roughness", "anisotropy"), [(0.3, 0.4), (0.6, 0.8)])
def test_anisotropic(ctx: moderngl.Context, mi: Any, model: str, roughness: float, anisotropy: float) -> None:
    """Values, densities, and weights of samples; of the plugin of the default model the values, too."""
    side = -1 if model.startswith("back") else 1
    name = model.split()[-1]
    facets = {"roughness": roughness, "anisotropy": anisotropy}
    parameters: Conductor | Dielectric
    if name == "conductor":
        material = Material(model=name, metal="gold", **facets)
        theirs = mi.load_dict(conductor_bsdf(material))
        parameters = Conductor(*material.complex_index, material.alpha, anisotropy)
    else:
        material = Material(model=name, ior=1.6, **facets)
        theirs = mi.load_dict(dielectric_bsdf(material, None))
        parameters = Dielectric(1.6**side, material.alpha, anisotropy=anisotropy)
    flip = np.float32((1, 1, side))
    for degrees in DEGREES:
        wo = direction(degrees)
        drawn = run(ctx, MODELS[name], parameters, DRAW, {"u": u(2048)}, {"drawn": 4, "weight": 4}, wo)
        found = drawn["drawn"][:, 3] > 0
        wi = np.concatenate([over_the_sphere(4096), drawn["drawn"][found, :3]]).astype(np.float32)
        ours = run(ctx, MODELS[name], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        value, pdf = theirs.eval_pdf(mi.BSDFContext(), seen_from(mi, wo * flip), mi.Vector3f((wi * flip).T))
        slack = MODELS[name].tolerance(parameters, np.broadcast_to(wo, wi.shape), wi.astype(np.float64))
        slack = 2 * np.minimum(slack, 1) + 1e-4
        assert (np.abs(ours["pdf"] - pdf.numpy()) <= slack * ours["pdf"] + 1e-6).all(), degrees
        assert (np.abs(ours["value"] - value.numpy().T) <= slack[:, None] * ours["value"] + 1e-6).all(), degrees
        weight = (value / pdf).numpy().T[-np.count_nonzero(found) :]
        error = np.abs(drawn["weight"][found, :3] - weight)
        assert (error <= (1e-3 + slack[-len(weight) :, None]) * weight).all(), degrees


def test_anisotropic_plugin_of_the_default_model(ctx: moderngl.Context, mi: Any) -> None:
    material = Material(albedo=(0.8, 0.5, 0.2), roughness=0.5, anisotropy=0.7)
    for geometry, model in (("smith", "brushed SMITH"), ("smith-height-correlated", "brushed SMITH_HEIGHT_CORRELATED")):
        register()
        tree = exact_bsdf(material, geometry, MeshAttributes(), TextureFolder(Path()))
        theirs = mi.load_dict(tree)
        parameters = Brushed(material.albedo, material.alpha, material.specular_f0, material.specular_f90, 0.7)
        for degrees in DEGREES:
            wo, wi = direction(degrees), over_the_sphere(4096)
            ours = run(ctx, MODELS[model], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
            value = theirs.eval(mi.BSDFContext(), seen_from(mi, wo), mi.Vector3f(wi.T))
            np.testing.assert_allclose(ours["value"], value.numpy().T, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("material", MODELS["sheen"].scene_materials, ids=["bare", "coated"])
@pytest.mark.parametrize("mirror", [False, True])
def test_sheen(ctx: moderngl.Context, mi: Any, material: Material, mirror: bool) -> None:
    """Bare and under a coat, over a rough base and a mirror: values, and densities of what is drawn."""
    register()
    material = replace(material, roughness=0.0) if mirror else material
    theirs = mi.load_dict(exact_bsdf(material, "smith", MeshAttributes(), TextureFolder(Path())))
    parameters = {
        **{name: getattr(material, name) for name in ("alpha", "sheen_color", "sheen_roughness")},
        "diffuse": material.diffuse_albedo,
        "f0": material.specular_f0,
        "f90": material.specular_f90,
    }
    coat = {"coat_weight": material.coat, "coat_alpha": material.coat_alpha, "coat_f0": material.coat_f0}
    model, values = ("coated", Coated(**parameters, **coat)) if material.is_coated else ("sheen", Sheened(**parameters))
    for degrees in DEGREES:
        wo, wi = direction(degrees), over_the_sphere(4096)
        ours = run(ctx, MODELS[model], values, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        value = theirs.eval(mi.BSDFContext(), seen_from(mi, wo), mi.Vector3f(wi.T))
        np.testing.assert_allclose(ours["value"], value.numpy().T, rtol=1e-3, atol=1e-6)
    seen = seen_from(mi, direction(65))
    follow_the_density(mi, theirs, seen, 4)
    bs, weight = theirs.sample(mi.BSDFContext(), seen, mi.Float(np.linspace(0, 0.999, 999)), mi.Point2f(0.4, 0.6))
    found = (weight * bs.pdf).numpy()[:, bs.sampled_type.numpy() == int(mi.BSDFFlags.DeltaReflection)]
    for lobe in MODELS[model].deltas(values, np.array([direction(65)])):
        np.testing.assert_allclose(found, np.broadcast_to(lobe.value.T, found.shape), rtol=1e-4)
    assert (found.shape[1] > 0) == mirror


FILMS = {
    "oil": Material(albedo=0.1, roughness=0.3, iridescence=1.0, iridescence_thickness=500.0),
    "oxide on a mirror": Material(
        metal="gold", roughness=0.0, iridescence=0.8, iridescence_ior=2.0, iridescence_thickness=150.0
    ),
    "below sheen and coat": Material(
        albedo=0.3, metallic=0.5, sheen_color=0.4, sheen_roughness=0.6, coat=0.5, coat_roughness=0.4, iridescence=1.0
    ),
}


@pytest.mark.parametrize("name", FILMS)
def test_thin_film(ctx: moderngl.Context, mi: Any, name: str) -> None:
    """By the sum over wavelengths, whose curves our fit follows, to 0.0003 of what white facets would reflect."""
    register()
    material = FILMS[name]
    theirs = mi.load_dict(exact_bsdf(material, "smith", MeshAttributes(), TextureFolder(Path())))
    names = ("alpha", "sheen_color", "iridescence", "iridescence_ior", "iridescence_thickness")
    parameters = {
        **{name: getattr(material, name) for name in names},
        "sheen_roughness": max(material.sheen_roughness, 0.1),
        "diffuse": material.diffuse_albedo,
        "f0": material.specular_f0,
        "f90": material.specular_f90,
    }
    coat = {"coat_weight": material.coat, "coat_alpha": material.coat_alpha, "coat_f0": material.coat_f0}
    model, values = ("coated", Coated(**parameters, **coat)) if material.is_coated else ("sheen", Sheened(**parameters))
    white = replace(values, iridescence=0.0, f0=(1.0, 1.0, 1.0), f90=(1.0, 1.0, 1.0))
    for degrees in DEGREES:
        wo, wi = direction(degrees), over_the_sphere(4096)
        ours, most = (
            run(ctx, MODELS[model], each, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo) for each in (values, white)
        )
        value = theirs.eval(mi.BSDFContext(), seen_from(mi, wo), mi.Vector3f(wi.T)).numpy().T
        error = np.abs(ours["value"] - value) / np.maximum(most["value"] + np.maximum(wi[:, 2:], 0) / np.pi, 1e-6)
        assert error.max() < 0.0003
    seen = seen_from(mi, direction(65))
    if name == "oil":
        follow_the_density(mi, theirs, seen, 1)
    bs, weight = theirs.sample(mi.BSDFContext(), seen, mi.Float(np.linspace(0, 0.999, 999)), mi.Point2f(0.4, 0.6))
    found = (weight * bs.pdf).numpy()[:, bs.sampled_type.numpy() == int(mi.BSDFFlags.DeltaReflection)]
    for lobe in MODELS[model].deltas(values, np.array([direction(65)])):
        np.testing.assert_allclose(found, np.broadcast_to(lobe.value.T, found.shape), atol=0.001)
    assert (found.shape[1] > 0) == (material.roughness == 0)


@pytest.mark.parametrize("material", MODELS["translucent"].scene_materials, ids=["rough", "mirror"])
@pytest.mark.parametrize("is_uniform", [True, False])
def test_translucent(ctx: moderngl.Context, mi: Any, material: Material, is_uniform: bool) -> None:
    """By the plugin of uniform materials and by that of the others: values on both sides, and densities of what is
    drawn."""
    register()
    build, nothing = exact_bsdf if is_uniform else surface, (MeshAttributes(), TextureFolder(Path()))
    theirs = mi.load_dict(build(material, "smith", *nothing))
    factor = material.diffuse_transmission
    values = Translucent(
        tuple((1 - factor) * np.array(material.diffuse_albedo)),
        material.alpha,
        material.specular_f0,
        material.specular_f90,
        tuple(factor * (1 - material.metallic) * np.array(material.diffuse_transmission_color)),
    )
    for degrees in DEGREES:
        wo, wi = direction(degrees), over_the_sphere(4096)
        ours = run(ctx, MODELS["translucent"], values, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        seen = seen_from(mi, wo)
        if not is_uniform:
            seen.n, seen.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f(mi.Vector3f(0, 0, 1))
        value = theirs.eval(mi.BSDFContext(), seen, mi.Vector3f(wi.T))
        assert (ours["value"][wi[:, 2] < 0] > 0).all()
        np.testing.assert_allclose(ours["value"], value.numpy().T, rtol=1e-3, atol=1e-6)
    follow_the_density(mi, theirs, seen, 4)
    bs, weight = theirs.sample(mi.BSDFContext(), seen, mi.Float(np.linspace(0, 0.999, 999)), mi.Point2f(0.4, 0.6))
    kinds, below = bs.sampled_type.numpy(), bs.wo.z.numpy() < 0
    np.testing.assert_array_equal(kinds == int(mi.BSDFFlags.DiffuseTransmission), below)
    mirrored = (weight * bs.pdf).numpy()[:, kinds == int(mi.BSDFFlags.DeltaReflection)]
    for lobe in MODELS["translucent"].deltas(values, np.array([direction(DEGREES[-1])])):
        np.testing.assert_allclose(mirrored, np.broadcast_to(lobe.value.T, mirrored.shape), rtol=1e-4)
    assert (mirrored.shape[1] > 0) == (material.alpha == 0)


@pytest.mark.parametrize("values", [{"anisotropy": 0.7}, {"model": "conductor", "metal": "gold"}])
def test_one_sided(mi: Any, values: dict[str, Any]) -> None:
    """As the material of two sides from the front; what comes from behind passes."""
    register()
    material, context, sample = Material(roughness=0.5, **values), mi.BSDFContext(), (0.4, mi.Point2f(0.3, 0.6))
    one, two = (
        mi.load_dict(exact_bsdf(replace(material, double_sided=both), "smith", MeshAttributes(), TextureFolder(Path())))
        for both in (False, True)
    )
    wi, front, behind = mi.Vector3f(over_the_sphere(64).T), seen_from(mi, (0.6, 0, 0.8)), seen_from(mi, (0.6, 0, -0.8))
    for found, expected in zip(one.eval_pdf(context, front, wi), two.eval_pdf(context, front, wi), strict=True):
        assert np.array_equal(found, expected)
    assert not any(np.ravel(found).any() for found in one.eval_pdf(context, behind, wi))
    assert np.array_equal(one.sample(context, front, *sample)[0].wo, two.sample(context, front, *sample)[0].wo)
    passed, weight = one.sample(context, behind, *sample)
    np.testing.assert_allclose(np.ravel(passed.wo), (-0.6, 0, 0.8), rtol=1e-6)
    assert mi.has_flag(one.flags(), mi.BSDFFlags.Null)
    assert (np.ravel(weight) == np.ravel(one.eval_null_transmission(behind))).all()
    assert not np.ravel(one.eval_null_transmission(front)).any()


@pytest.mark.parametrize(
    "values", [{}, {"anisotropy": 0.7}, {"model": "plastic"}, {"alpha_mode": "blend", "opacity": 0.4}]
)
def test_black_back(mi: Any, values: dict[str, Any]) -> None:
    """As the material of two sides from the front; from behind nothing is scattered, and rays pass holes alone."""
    register()
    material, context = Material(roughness=0.5, **values), mi.BSDFContext()
    one, two = (
        mi.load_dict(exact_bsdf(replace(material, black_back=black), "smith", MeshAttributes(), TextureFolder(Path())))
        for black in (True, False)
    )
    wi, front, behind = mi.Vector3f(over_the_sphere(64).T), seen_from(mi, (0.6, 0, 0.8)), seen_from(mi, (0.6, 0, -0.8))
    for found, expected in zip(one.eval_pdf(context, front, wi), two.eval_pdf(context, front, wi), strict=True):
        assert np.array_equal(found, expected)
    assert not np.ravel(one.eval(context, behind, wi)).any()
    if material.alpha_mode == "opaque":  # the plugin with holes asks where the surface is
        assert np.ravel(two.eval(context, behind, wi)).any()
    for seen in (front, behind):
        for choice in (0.1, 0.5, 0.9):
            (a, weight), (b, expected) = (
                bsdf.sample(context, seen, choice, mi.Point2f(0.3, 0.6)) for bsdf in (one, two)
            )
            is_null = bool(np.ravel(a.sampled_type)[0] & int(mi.BSDFFlags.Null))
            kept = seen is front or is_null
            np.testing.assert_allclose(np.ravel(weight), kept * np.ravel(expected))
            assert not np.ravel(weight).any() or np.array_equal(a.wo, b.wo)
        assert np.array_equal(one.eval_null_transmission(seen), two.eval_null_transmission(seen))


@pytest.mark.parametrize("ior", [1.3, 1.5, 2.5])
@pytest.mark.parametrize("nonlinear", [False, True])
def test_plastic(ctx: moderngl.Context, mi: Any, nonlinear: bool, ior: float) -> None:
    """Mitsuba's fit of what the coat reflects back, which errs, is made up for by the albedo."""
    material = Material(model="plastic", albedo=(0.8, 0.4, 0.1), ior=ior, nonlinear=nonlinear)
    theirs, parameters = mi.load_dict(plastic_bsdf(material)), plastic_of(material.albedo, ior, nonlinear)
    for degrees in DEGREES:
        wo, wi = direction(degrees), over_the_sphere(4096)
        ours = run(ctx, MODELS["plastic"], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        value = theirs.eval(mi.BSDFContext(), seen_from(mi, wo), mi.Vector3f(wi.T))
        np.testing.assert_allclose(ours["value"], value.numpy().T, rtol=2e-4, atol=1e-6)
        bs, weight = theirs.sample(mi.BSDFContext(), seen_from(mi, wo), 0.0, mi.Point2f(0.5, 0.5))
        drawn = run(ctx, MODELS["plastic"], parameters, DRAW, {"u": np.zeros((1, 2))}, {"drawn": 4, "weight": 4}, wo)
        np.testing.assert_allclose(drawn["drawn"][0, :3], bs.wo.numpy()[:, 0], atol=1e-6)
        mirrored = drawn["weight"][0, :3] * drawn["drawn"][0, 3]
        np.testing.assert_allclose(mirrored, (weight * bs.pdf).numpy()[:, 0], rtol=2e-5)


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("roughness", [0.2, 0.55, 1.0])
def test_rough_plastic(ctx: moderngl.Context, mi: Any, roughness: float, nonlinear: bool) -> None:
    """Values, but for the error of the fit to what the coat passes on the way in and out, 0.08 % of all light; and the
    densities of the two lobes, which Mitsuba chooses more often or less."""
    material = Material(model="rough-plastic", albedo=(0.8, 0.4, 0.1), roughness=roughness, nonlinear=nonlinear)
    theirs = mi.load_dict(plastic_bsdf(material))
    parameters = rough_plastic_of(material.albedo, material.alpha, 1.5, nonlinear)
    black = mi.load_dict(plastic_bsdf(Material(model="rough-plastic", albedo=0.0, roughness=roughness)))
    for degrees in DEGREES:
        wo = direction(degrees)
        drawn = run(ctx, MODELS["rough-plastic"], parameters, DRAW, {"u": u(2048)}, {"drawn": 4, "weight": 4}, wo)
        found = drawn["drawn"][:, 3] > 0
        wi = np.concatenate([over_the_sphere(4096), drawn["drawn"][found, :3]]).astype(np.float32)
        ours = run(ctx, MODELS["rough-plastic"], parameters, EVAL, {"wi": wi}, {"value": 3, "pdf": 1}, wo)
        si, light = seen_from(mi, wo), mi.Vector3f(wi.T)
        value = theirs.eval(mi.BSDFContext(), si, light).numpy().T
        up = np.maximum(wi[:, 2:], 1e-6).astype(np.float64)
        passed = [rough_plastic_interface(parameters, c)[1] for c in (np.cos(np.radians(degrees)), up)]
        slack = MODELS["rough-plastic"].tolerance(parameters, np.array(wo), wi.astype(np.float64))
        base = np.multiply(parameters.diffuse, up / np.pi)
        slack = (5e-4 + 2 * slack[:, None]) * value + 8e-4 * (passed[0] + passed[1]) * base
        steep = wi[:, 2] > 0.1  # Mitsuba interpolates what passes between 64 cosines, too few for grazing angles
        assert (np.abs(ours["value"] - value) <= slack + 1e-6)[steep].all(), degrees
        # A black base is never sampled, so that this is the density of the facets.
        chance = float(rough_plastic_chance(parameters, np.array(wo)))
        facets = black.pdf(mi.BSDFContext(), si, light).numpy()
        pdf = np.where(wi[:, 2] > 0, chance * facets + (1 - chance) * np.maximum(wi[:, 2], 0) / np.pi, 0)
        np.testing.assert_allclose(ours["pdf"], pdf, rtol=1e-3, atol=1e-6)
        some = steep & (np.arange(len(wi)) >= len(wi) - np.count_nonzero(found))
        weight = drawn["weight"][found, :3][some[-np.count_nonzero(found) :]]
        np.testing.assert_allclose(weight, value[some] / pdf[some, None], rtol=4e-3)


def test_named_metals_have_the_indices_of_mitsubas_spectra(mi: Any) -> None:
    symbols = {"aluminium": "Al", "chromium": "Cr", "copper": "Cu", "gold": "Au", "iridium": "Ir", "mercury": "Hg"}
    symbols |= {"molybdenum": "Mo", "nickel": "Ni_palik", "silver": "Ag", "tungsten": "W"}
    assert symbols.keys() == METAL_INDEX.keys()
    for name, symbol in symbols.items():
        found = mi.traverse(mi.load_dict({"type": "conductor", "material": symbol}))
        for key, ours in zip(("eta.value", "k.value"), METAL_INDEX[name], strict=True):
            np.testing.assert_allclose(np.ravel(found[key]), ours, rtol=1e-5)


def u(count: int) -> Any:
    return np.random.default_rng(1).random((count, 2), np.float32)
