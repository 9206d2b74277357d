# SPDX-License-Identifier: MIT
"""Errors in BSDFs."""

from collections.abc import Callable

import test_aov
import test_translucent

from mutations.checks import BUMPS, MIRROR, values
from mutations.mutation import Check, Mutation
from shaders import test_bsdf_sample, test_bsdf_values, test_fresnel, test_ggx


def weights(material: str) -> Check:
    test = test_bsdf_sample.test_weight_is_value_over_density
    return Check(test, name="cook-torrance SMITH", material=material)


def glass(test: Callable[..., None]) -> Check:
    return Check(test, name="dielectric", material="glass")


CLAY = values("eon", "clay")
BENT_BASE = Check(test_bsdf_sample.test_samples_of_a_coat_over_a_bent_base_have_their_density, degrees=45)
OIL = values("iridescent", "oil")
PLASTIC, GOLD = (values("cook-torrance SMITH", material) for material in ("plastic", "gold"))

MUTATIONS = [
    Mutation(
        "cosine forgotten",
        "bsdf/cook_torrance.glsl",
        "b.diffuse * (wi.z * INVERSE_PI)",
        "b.diffuse * INVERSE_PI",
        PLASTIC,
    ),
    Mutation(
        "Fresnel of the wrong cosine",
        "bsdf/cook_torrance.glsl",
        "iridescence_fresnel(b, dot(wo, wh))",
        "iridescence_fresnel(b, wi.z)",
        GOLD,
    ),
    Mutation(
        "light scattered between facets lost",
        "bsdf/cook_torrance.glsl",
        "        if (u_multiple_scattering != 0) fresnel *= "
        "ggx_compensation(iridescence_f0(b), facets_mean_width(b), wo.z);\n",
        "",
        Check(test_bsdf_values.test_white_metal_with_multiple_scattering_reflects_everything),
    ),
    Mutation(
        "samples below the horizon of the base kept",
        "bsdf/coated.glsl",
        "        if (s.pdf <= 0.0) return s;\n",
        "",
        BENT_BASE,
    ),
    Mutation(
        "light passes the coat but once",
        "bsdf/coated.glsl",
        "return coated_transmittance(b, wo) * coated_transmittance(b, wi);",
        "return coated_transmittance(b, wo);",
        values("coated", "lacquer"),
    ),
    Mutation(
        "film taken for as thick as it looks",
        "bsdf/iridescence.glsl",
        "float path = 0.002 * b.iridescence_thickness * film;",
        "float path = 0.002 * b.iridescence_thickness * film2;",
        OIL,
    ),
    Mutation(
        "one polarisation for both",
        "bsdf/iridescence.glsl",
        "iridescence_polarised_change(air, film / film2, base_p, path);",
        "iridescence_polarised_change(air, film, base, path);",
        OIL,
    ),
    Mutation(
        "what the film reflects not lost to the base",
        "bsdf/cook_torrance.glsl",
        "    return clamp(passed - iridescence_rough_change(b, cos_theta), 0.0, 1.0);",
        "    return passed;",
        Check(test_bsdf_values.test_no_material_reflects_more_than_it_receives, name="iridescent"),
    ),
    Mutation(
        "sheen lost to the base on one way alone",
        "bsdf/sheen.glsl",
        "    float most = max(albedo.x, albedo.y);\n",
        "    float most = albedo.x;\n",
        values("sheen", "cloth"),
    ),
    Mutation(
        "sheen sampled by the cosine",
        "bsdf/sheen.glsl",
        "s.wi = square_to_uniform_cone(u, 1.0);",
        "s.wi = square_to_cosine_hemisphere(u);",
        Check(test_bsdf_sample.test_samples_have_their_density, name="sheen", material="velvet"),
    ),
    Mutation(
        "what sheen reflects a hundredth less",
        "bsdf/sheen.glsl",
        "return exp(x) / (4.0 * cosines * (1.0 + lambda));",
        "return 0.99 * exp(x) / (4.0 * cosines * (1.0 + lambda));",
        Check(test_bsdf_values.test_the_albedo_of_sheen_is_that_of_its_lobe),
    ),
    Mutation(
        "what is transmitted passes the interface but once",
        "bsdf/translucent.glsl",
        "cook_torrance_transmittance(b, wo.z) * cook_torrance_transmittance(b, -wi.z);",
        "cook_torrance_transmittance(b, wo.z);",
        values("translucent", "leaf"),
    ),
    Mutation(
        "reflection of a translucent surface as likely as of an opaque one",
        "bsdf/translucent.glsl",
        "return vec4(reflected.rgb, (1.0 - probability) * reflected.a);",
        "return reflected;",
        Check(test_bsdf_sample.test_samples_have_their_density, name="translucent", material="paper"),
    ),
    Mutation(
        "a translucent base that reflects all the same",
        "material/material.glsl",
        "    b.diffuse *= 1.0 - factor;\n",
        "",
        Check(test_translucent.test_a_furnace_of_white_paper),
    ),
    Mutation(
        "ambient light of one side alone",
        "bsdf/bsdf.glsl",
        "(refracts || bsdf_is(b, BSDF_TRANSLUCENT));",
        "refracts;",
        Check(test_translucent.test_a_sheet_in_ambient_light_by_light_samples),
    ),
    Mutation(
        "alpha for alpha squared in D",
        "bsdf/ggx.glsl",
        "return a2 * INVERSE_PI / (t * t);",
        "return alpha * INVERSE_PI / (t * t);",
        Check(test_ggx.test_distribution_integrates_to_one, alpha=0.5),
    ),
    Mutation(
        "G without the side of the light",
        "bsdf/ggx.glsl",
        "return ggx_g1(alpha.x, wo.z) * ggx_g1(alpha.y, wi.z);",
        "return ggx_g1(alpha.x, wo.z);",
        Check(test_ggx.test_geometry_term, term="SMITH"),
    ),
    Mutation(
        "mirror without Fresnel",
        "bsdf/cook_torrance.glsl",
        "vec3 reflectance = iridescence_fresnel(b, wo.z) * ggx_g",
        "vec3 reflectance = b.f0 * ggx_g",
        MIRROR,
    ),
    Mutation(
        "mirror not divided by its probability",
        "bsdf/cook_torrance.glsl",
        "reflectance / specular_probability, specular_probability",
        "reflectance, specular_probability",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="cook-torrance SMITH", material="faint plastic"),
    ),
    Mutation(
        "visible normals sampled without the stretch",
        "bsdf/ggx.glsl",
        "normalize(vec3(wo.xy * alpha, wo.z))",
        "normalize(vec3(wo.xy, wo.z))",
        Check(test_bsdf_sample.test_mean_weight_is_the_albedo, name="cook-torrance SMITH", material="gold"),
    ),
    Mutation(
        "interface passed once, not twice",
        "bsdf/cook_torrance.glsl",
        "return cook_torrance_transmittance(b, wo.z) * cook_torrance_transmittance(b, wi.z);",
        "return cook_torrance_transmittance(b, wi.z);",
        PLASTIC,
    ),
    Mutation(
        "cosine of the diffuse model forgotten",
        "bsdf/diffuse.glsl",
        "b.diffuse * (wi.z * INVERSE_PI)",
        "b.diffuse * INVERSE_PI",
        values("diffuse", "grey"),
    ),
    Mutation(
        "one model taken for another",
        "bsdf/bsdf.glsl",
        "result = eon_eval_pdf(b, wo, wi)",
        "result = diffuse_eval_pdf(b, wo, wi)",
        CLAY,
    ),
    Mutation("light that returns not widened", "bsdf/eon.glsl", "s > 0.0 ? s / max(wo.z, wi.z) : s", "s", CLAY),
    Mutation(
        "Schlick to the fourth power",
        "bsdf/fresnel.glsl",
        "(m2 * m2 * m)",
        "(m2 * m2)",
        Check(test_fresnel.test_schlick),
    ),
    Mutation(
        "no sample taken for one",
        "bsdf/model.glsl",
        "vec3(0.0), 0.0, 1.0, EVENT_REFLECTION",
        "vec3(0.0), 1.0, 1.0, EVENT_REFLECTION",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="conductor", material="measured gold"),
    ),
    Mutation(
        "a direction without density taken for a sample",
        "bsdf/model.glsl",
        "is_drawn ? eval_pdf.a : 0.0",
        "is_drawn ? eval_pdf.a : 1.0",
        weights("gold"),
    ),
    Mutation("no shadow at the terminator", "bsdf/shading_normal.glsl", "g + square(g) * (1.0 - g)", "1.0", BUMPS),
    Mutation(
        "eta squared forgotten",
        "bsdf/dielectric.glsl",
        "b.transmittance / square(b.eta), 1.0 - fresnel",
        "b.transmittance, 1.0 - fresnel",
        glass(test_bsdf_sample.test_weight_is_value_over_density),
    ),
    Mutation(
        "Fresnel of the other side",
        "bsdf/dielectric.glsl",
        "float fresnel = fresnel_dielectric(cos_o, b.eta);",
        "float fresnel = fresnel_dielectric(cos_o, 1.0 / b.eta);",
        values("dielectric", "glass"),
    ),
    Mutation(
        "lobe of a facet chosen by the mean normal",
        "bsdf/dielectric.glsl",
        "fresnel_dielectric(dot(wo, wh), b.eta)",
        "fresnel_dielectric(wo.z, b.eta)",
        glass(test_bsdf_sample.test_mean_weight_is_the_albedo),
    ),
    Mutation(
        "density without the Jacobian of refraction",
        "bsdf/dielectric.glsl",
        " * square(b.eta / (cos_o + b.eta * cos_i))",
        "",
        values("dielectric", "glass"),
    ),
    Mutation(
        "reflections within a pane left out",
        "bsdf/thin_dielectric.glsl",
        "2.0 * fresnel / (1.0 + fresnel)",
        "fresnel",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="thin-dielectric", material="window"),
    ),
    Mutation(
        "the colour of a frosted pane on what it reflects",
        "bsdf/thin_dielectric.glsl",
        "(wi.z > 0.0 ? vec3(1.0) : b.transmittance)",
        "b.transmittance",
        values("thin-dielectric", "green frosted pane"),
    ),
    Mutation(
        "the chance of a frosted pane to reflect taken for that to transmit",
        "bsdf/thin_dielectric.glsl",
        "bool reflects = dielectric_choice(u) <",
        "bool reflects = dielectric_choice(u) >",
        Check(test_bsdf_sample.test_samples_have_their_density, name="thin-dielectric", material="frosted pane"),
    ),
    Mutation(
        "Fresnel term of a conductor without its extinction",
        "bsdf/conductor.glsl",
        "vec3 mirrored = fresnel_conductor(wo.z, b.index, b.extinction);",
        "vec3 mirrored = fresnel_conductor(wo.z, b.index, vec3(0.0));",
        Check(test_bsdf_sample.test_weight_is_value_over_density, name="conductor", material="measured gold"),
    ),
    Mutation(
        "the factor of the half vector at the mean normal",
        "bsdf/cook_torrance.glsl",
        "return 1.0 - iridescence_fresnel(b, dot(wo, normalize(wo + wi)));",
        "return 1.0 - iridescence_fresnel(b, wo.z);",
        values("half-vector", "plastic"),
    ),
    Mutation(
        "widths along the tangent and across it exchanged",
        "bsdf/facets.glsl",
        "widths.yx / widths",
        "widths / widths.yx",
        values("conductor", "brushed gold"),
    ),
    Mutation(
        "facets masked by the width across the tangent",
        "bsdf/facets.glsl",
        "return ggx_g1_smith(facets_width(b, w), abs(w.z));",
        "return ggx_g1_smith(b.alpha, abs(w.z));",
        values("conductor", "brushed gold"),
    ),
    Mutation(
        "what a rough coat passes taken once for both ways",
        "bsdf/rough_plastic.glsl",
        "interface_o.y * rough_plastic_interface(b, wi.z).y * wi.z",
        "interface_o.y * wi.z",
        values("rough-plastic", "satin"),
    ),
    Mutation(
        "a coat that is diffuse by a tenth",
        "bsdf/bsdf.glsl",
        "diffuse = cook_torrance_diffuse(b, wo, wi);",
        "diffuse = 1.1 * cook_torrance_diffuse(b, wo, wi);",
        Check(test_aov.test_what_is_diffuse_of_a_coated_base, model="default"),
    ),
]
