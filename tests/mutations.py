# SPDX-License-Identifier: MIT
"""Errors for the shaders, each a slip that someone has made: what it is, where, and the text it replaces.

Every one changes what the picture converges to, or hides that something went wrong.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    name: str
    file: str
    text: str
    replacement: str


MUTATIONS = [
    Mutation(
        "cosine forgotten", "bsdf/cook_torrance.glsl", "b.diffuse * (wi.z * INVERSE_PI)", "b.diffuse * INVERSE_PI"
    ),
    Mutation("cosine pdf 2 % too large", "core/warp.glsl", "max(0.0, v.z) * INVERSE_PI", "max(0.0, v.z) * 0.32468"),
    Mutation(
        "light counted twice",
        "integrator/path.glsl",
        "path.unweighted ? 1.0 : power_heuristic(",
        "1.0 + 0.0 * power_heuristic(",
    ),
    Mutation(
        "MIS weight squared",
        "core/math.glsl",
        "return 1.0 / (1.0 + ratio * ratio);",
        "return 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));",
    ),
    Mutation(
        "probability of the light's choice left out", "emitter/light.glsl", "    s.pdf *= light.probability;\n", ""
    ),
    Mutation(
        "Fresnel of the wrong cosine",
        "bsdf/cook_torrance.glsl",
        "fresnel_schlick(b.f0, b.f90, dot(wo, wh))",
        "fresnel_schlick(b.f0, b.f90, wi.z)",
    ),
    Mutation(
        "light scattered between facets lost",
        "bsdf/cook_torrance.glsl",
        "        fresnel *= ggx_compensation(b.f0, b.alpha, wo.z);\n",
        "",
    ),
    Mutation(
        "alpha for alpha squared in D",
        "bsdf/ggx.glsl",
        "float a2 = alpha * alpha;\n    float t",
        "float a2 = alpha;\n    float t",
    ),
    Mutation(
        "G without the side of the light",
        "bsdf/ggx.glsl",
        "return ggx_g1(alpha, wo.z) * ggx_g1(alpha, wi.z);",
        "return ggx_g1(alpha, wo.z);",
    ),
    Mutation("Russian roulette without its division", "integrator/path.glsl", "    path.throughput /= survival;\n", ""),
    Mutation(
        "throughput multiplied by the radiance",
        "integrator/path.glsl",
        "path.radiance += path.throughput * direct;",
        "path.radiance += path.throughput * direct;\n    path.throughput *= direct;",
    ),
    Mutation(
        "light radius 1 % too large",
        "emitter/sphere_light.glsl",
        "float sin2 = radius * radius / dot(to_center, to_center);",
        "float sin2 = 1.0201 * radius * radius / dot(to_center, to_center);",
    ),
    Mutation(
        "whole light sphere sampled without its measure",
        "emitter/sphere_light.glsl",
        "    float center_distance = length(to_center);\n",
        "    vec3 point = to_center + radius * square_to_uniform_sphere(u);\n"
        "    if (radius > 0.0) return vec4(normalize(point), length(point));\n"
        "    float center_distance = length(to_center);\n",
    ),
    Mutation(
        "last bounce dropped",
        "integrator/path.glsl",
        "path.vertex >= u_bounces) return",
        "path.vertex >= u_bounces - 1) return",
    ),
    Mutation("NaN swallowed", "film/film.glsl", "        film.non_finite += 1.0;\n", ""),
    Mutation("no jitter in the pixel", "film/pixel_filter.glsl", "return u - 0.5;", "return vec2(0.0);"),
    Mutation(
        "emission from the back", "integrator/path.glsl", "surface.light >= 0 && cos_theta > 0.0", "surface.light >= 0"
    ),
    Mutation(
        "shadow ray too short",
        "integrator/path.glsl",
        "scene_intersect(ray, distance, light",
        "scene_intersect(ray, 0.5 * distance, light",
    ),
    Mutation(
        "mirror without Fresnel",
        "bsdf/cook_torrance.glsl",
        "vec3 reflectance = fresnel_schlick(b.f0, b.f90, wo.z) * ggx_g",
        "vec3 reflectance = b.f0 * ggx_g",
    ),
    Mutation(
        "mirror not divided by its probability",
        "bsdf/cook_torrance.glsl",
        "reflectance / specular_probability, specular_probability",
        "reflectance, specular_probability",
    ),
    Mutation("all vertices share their random numbers", "sampler/sampler.glsl", "return 1 + vertex; ", "return 1; "),
    Mutation(
        "number not stretched after its first use",
        "core/math.glsl",
        "    u = first ? u / probability : (u - probability) / (1.0 - probability);\n",
        "",
    ),
    Mutation(
        "light samples summed, not averaged", "integrator/path.glsl", "    direct /= float(u_light_samples);\n", ""
    ),
    Mutation(
        "visible normals sampled without the stretch",
        "bsdf/ggx.glsl",
        "normalize(vec3(wo.xy * alpha, wo.z))",
        "normalize(vec3(wo.xy, wo.z))",
    ),
    Mutation("inverse square forgotten", "emitter/light.glsl", "        s.radiance /= square(s.distance);\n", ""),
    Mutation(
        "emitting triangle without its cosine",
        "emitter/mesh_light.glsl",
        "density * square(distance) / cos_theta : 0.0",
        "density * square(distance) : 0.0",
    ),
    Mutation(
        "second triangle of a place never drawn",
        "emitter/mesh_light.glsl",
        "< entry.threshold ? entry.record : entry.other",
        "< 2.0 ? entry.record : entry.other",
    ),
    Mutation(
        "interpolated normal not made unit",
        "shape/surface.glsl",
        "size > 1e-6 ? shading_normal / size :",
        "size > 1e-6 ? shading_normal :",
    ),
    Mutation("area light without its cosine", "emitter/area_light.glsl", "(cos_theta * area)", "area"),
    Mutation(
        "triangle sampled with a folded corner",
        "core/warp.glsl",
        "vec2(0.5 * u.x, u.y - 0.5 * u.x)",
        "vec2(0.5 * u.x, u.y * u.y)",
    ),
    Mutation(
        "interface passed once, not twice",
        "bsdf/cook_torrance.glsl",
        "diffuse *= bsdf_transmittance(b, wo.z) *",
        "diffuse *=",
    ),
    Mutation(
        "rays leave from the wrong side", "shape/ray.glsl", "return position + normal", "return position - normal"
    ),
    Mutation(
        "sRGB taken for linear",
        "texture/texture.glsl",
        "    if ((t.flags & TEXTURE_SRGB) != 0) value.rgb = texture_decode_srgb(value.rgb);\n",
        "",
    ),
    Mutation(
        "image upside down",
        "texture/texture.glsl",
        "texture_wrap(uv.y, t.wrap_v)",
        "texture_wrap(1.0 - uv.y, t.wrap_v)",
    ),
    Mutation("scale of a normal map ignored", "shape/material.glsl", "    local.xy *= maps.normal_scale;\n", ""),
    Mutation(
        "shadow of what is there in part as of what is there",
        "integrator/path.glsl",
        "alpha_intersect(ray, distance, light_primitive, seed).primitive",
        "scene_intersect(ray, distance, light_primitive, true).primitive",
    ),
    Mutation(
        "one decision for all sheets", "shape/alpha.glsl", "            seed = hash_uint(seed + 0x9e3779b9u);\n", ""
    ),
]
