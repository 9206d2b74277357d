# SPDX-License-Identifier: MIT
"""Errors in light tracing and guiding."""

import test_guiding as test_guided_pictures
import test_light_tracing

from mutations.checks import traced
from mutations.mutation import Check, Mutation
from shaders import test_guiding

GUIDED = Check(test_guiding.test_directions_have_the_density_of_the_mixture, name="three-spheres")
# With fewer samples than the suite takes where that many find the error.
TRACED = traced(test_light_tracing.spheres, 512, 0.15)
MIRRORED = traced(test_light_tracing.mirrors, 256, 0.2)

MUTATIONS = [
    Mutation(
        "light that photons bring found by paths too",
        "integrator/light_traced.glsl",
        "return 1.0 - traced.earlier * traced.narrow;",
        "return vec3(1.0);",
        TRACED,
    ),
    Mutation(
        "light that photons bring to mirrors found by paths too",
        "integrator/light_traced.glsl",
        "traced.received += traced.mirrored * (1.0 - narrow)",
        "traced.received += vec3(0.0)",
        MIRRORED,
    ),
    Mutation(
        "mirror spheres that spread light as flat mirrors do",
        "integrator/mirrored.glsl",
        "2.0 * before * after * curvature",
        "0.0",
        MIRRORED,
    ),
    Mutation(
        "rough mirrors that are seen at a slant as if from above",
        "integrator/mirrored.glsl",
        "vertex.wo.z / (square(after) * density)",
        "1.0 / (square(after) * density)",
        traced(test_light_tracing.spheres, 1536, 0.05),
    ),
    Mutation(
        "places on rough spheres as dense as on their tangent planes",
        "integrator/mirrored.glsl",
        "density *= stretch * square(stretch)",
        "density *= 1.0",
        traced(test_light_tracing.rough_mirror, 512, 0.3),
    ),
    Mutation(
        "photons seen in mirrors that reflect all light",
        "integrator/mirrored.glsl",
        "(s.event & EVENT_REFLECTION) != 0 ? s.weight :",
        "(s.event & EVENT_REFLECTION) != 0 ? vec3(1.0) :",
        MIRRORED,
    ),
    Mutation(
        "photons that arrive at a slant are as strong",
        "light_tracing.frag",
        "(opacity * wanted * abs(cosine) /",
        "(opacity * wanted /",
        TRACED,
    ),
    Mutation(
        "photons scattered diffusely at first",
        "light_tracing.frag",
        "        if (photon.events == 0 && !bsdf_is_null(s)) factor *= narrow;\n",
        "",
        TRACED,
    ),
    Mutation(
        "photons that coloured water does not absorb",
        "light_tracing.frag",
        "        photon.flux *= interior_transmittance(beyond, photon.hit.distance);\n",
        "",
        traced(test_light_tracing.glass, 512, 0.4),
    ),
    Mutation(
        "photons of the sun for those of the sky",
        "light_tracing.frag",
        "(opacity * wanted * abs(cosine) /",
        "(opacity * abs(cosine) /",
        traced(test_light_tracing.sunlit, 1280, 0.1),
    ),
    Mutation(
        "probability of the lobes not divided out",
        "guiding/guide.glsl",
        "eval_pdf.rgb / max(mixture, 1e-30)",
        "eval_pdf.rgb / max(eval_pdf.a, 1e-30)",
        GUIDED,
    ),
    Mutation(
        "probability of the BSDF forgotten after a delta",
        "guiding/guide.glsl",
        "s.weight / (1.0 - guide.sum)",
        "s.weight",
        Check(test_guided_pictures.test_coats_and_lamps),
    ),
    Mutation(
        "density of another lobe",
        "guiding/guide.glsl",
        "lobe_pdf(guide.lobes[i], wi)",
        "lobe_pdf(guide.lobes[0], wi)",
        GUIDED,
    ),
    Mutation(
        "density of another cell",
        "guiding/guide.glsl",
        "guide_pdf(guide, frame_to_world(frame, s.wi))",
        "guide_pdf(guide_at(frame.normal, frame, bsdf, true), frame_to_world(frame, s.wi))",
        GUIDED,
    ),
    Mutation(
        "cells counted in another order",
        "guiding/lobes.glsl",
        "(fine.z * edge + fine.y) * edge + fine.x",
        "(fine.x * edge + fine.y) * edge + fine.z",
        GUIDED,
    ),
    Mutation(
        "photons that count alike wherever they are aimed",
        "photons.frag",
        "float flux = 1.0 / target.density;",
        "float flux = 1.0;",
        Check(test_guided_pictures.test_photons_bring_what_mirrors_reflect),
        kept=True,
    ),
    Mutation(
        "photons that a sieve stops all",
        "photons.frag",
        "        if (is_first) flux *= material_opacity(surface);\n",
        "",
        Check(test_guided_pictures.test_photons_bring_what_mirrors_reflect),
        kept=True,
    ),
    Mutation(
        "guided paths measured as if they were not",
        "guiding/measure.glsl",
        "    moments.odds *= odds;\n",
        "",
        Check(test_guided_pictures.test_guiding_pays_for_caustics),
    ),
    Mutation(
        "guided paths taken to be no longer than others",
        "guiding/measure.glsl",
        "    moments.rays += 1.0;\n",
        "",
        Check(test_guided_pictures.test_guided_paths_are_longer),
    ),
]
