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
        "integrator/direct.glsl",
        "return certain ? 1.0 : power_heuristic(",
        "return 1.0 + 0.0 * power_heuristic(",
    ),
    Mutation(
        "MIS weight squared",
        "core/math.glsl",
        "return 1.0 / (1.0 + ratio * ratio);",
        "return 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));",
    ),
    Mutation(
        "probability of the light's choice left out", "light/light.glsl", "    s.pdf *= choice.probability;\n", ""
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
        "path.radiance += path.throughput * direct_light(vertex, path.depth, pixel, index, u.zw);",
        "path.radiance += path.throughput * direct_light(vertex, path.depth, pixel, index, u.zw);\n"
        "            path.throughput *= direct_light(vertex, path.depth, pixel, index, u.zw);",
    ),
    Mutation(
        "light radius 1 % too large",
        "light/sphere.glsl",
        "float sin2 = radius * radius / dot(to_center, to_center);",
        "float sin2 = 1.0201 * radius * radius / dot(to_center, to_center);",
    ),
    Mutation(
        "whole light sphere sampled without its measure",
        "light/sphere.glsl",
        "    float center_distance = length(to_center);\n",
        "    vec3 point = to_center + light.radius * square_to_uniform_sphere(u);\n"
        "    float density = square_to_uniform_cone_pdf(one_minus_cos_max);\n"
        "    if (light.radius > 0.0) return LightSample(\n"
        "        normalize(point), length(point), light.radiance, density, false, light.primitive);\n"
        "    float center_distance = length(to_center);\n",
    ),
    Mutation(
        "last bounce dropped",
        "integrator/path.glsl",
        "path.depth < u_bounces && path.rr_sample",
        "path.depth < u_bounces - 1 && path.rr_sample",
    ),
    Mutation("NaN swallowed", "film/film.glsl", "        film.non_finite += 1.0;\n", ""),
    Mutation("no jitter in the pixel", "film/pixel_filter.glsl", "return u - 0.5;", "return vec2(0.0);"),
    Mutation(
        "emission from the back", "integrator/path.glsl", "surface.light >= 0 && cos_theta > 0.0", "surface.light >= 0"
    ),
    Mutation(
        "shadow ray too short",
        "material/visibility.glsl",
        "scene_intersect(ray, distance, ignored, true)",
        "scene_intersect(ray, 0.5 * distance, ignored, true)",
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
        "light samples summed, not averaged",
        "integrator/direct.glsl",
        "        direct /= float(u_light_samples);\n",
        "",
    ),
    Mutation(
        "visible normals sampled without the stretch",
        "bsdf/ggx.glsl",
        "normalize(vec3(wo.xy * alpha, wo.z))",
        "normalize(vec3(wo.xy, wo.z))",
    ),
    Mutation("inverse square forgotten", "light/point.glsl", "light.intensity / square(distance)", "light.intensity"),
    Mutation(
        "emitting triangle without its cosine",
        "light/mesh.glsl",
        "density * square(distance) / cos_theta : 0.0",
        "density * square(distance) : 0.0",
    ),
    Mutation(
        "second triangle of a place never drawn",
        "light/mesh.glsl",
        "< entry.threshold ? entry.record : entry.other",
        "< 2.0 ? entry.record : entry.other",
    ),
    Mutation(
        "interpolated normal not made unit",
        "shape/surface.glsl",
        "return size > 1e-6 ? v / size :",
        "return size > 1e-6 ? v :",
    ),
    Mutation("area light without its cosine", "light/area.glsl", "(cos_theta * area)", "area"),
    Mutation(
        "triangle sampled with a folded corner",
        "core/warp.glsl",
        "vec2(0.5 * u.x, u.y - 0.5 * u.x)",
        "vec2(0.5 * u.x, u.y * u.y)",
    ),
    Mutation(
        "interface passed once, not twice",
        "bsdf/cook_torrance.glsl",
        "diffuse *= cook_torrance_transmittance(b, wo.z) *",
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
    Mutation("scale of a normal map ignored", "material/material.glsl", "    local.xy *= maps.normal_scale;\n", ""),
    Mutation(
        "shadow of what is there in part as of what is there",
        "material/visibility.glsl",
        "alpha_intersect(ray, distance, ignored, seed).primitive",
        "scene_intersect(ray, distance, ignored, true).primitive",
    ),
    Mutation(
        "one decision for all sheets",
        "material/visibility.glsl",
        "            seed = hash_uint(seed + 0x9e3779b9u);\n",
        "",
    ),
    Mutation(
        "cosine of the diffuse model forgotten",
        "bsdf/diffuse.glsl",
        "b.diffuse * (wi.z * INVERSE_PI)",
        "b.diffuse * INVERSE_PI",
    ),
    Mutation(
        "probability of the light's choice left out where it is met",
        "light/light.glsl",
        "return pdf * choice.probability;",
        "return pdf;",
    ),
    Mutation(
        "guide table off by one",
        "light/light.glsl",
        "min(int(u * float(u_light_count)), u_light_count - 1)",
        "min(int(u * float(u_light_count)) + 1, u_light_count - 1)",
    ),
    Mutation("bisection stops too soon", "light/light.glsl", "while (number < last) {", "while (number + 1 < last) {"),
    Mutation(
        "few lights looked through but for the last",
        "light/light.glsl",
        "for (int i = 1; i < u_light_count; i++)",
        "for (int i = 1; i < u_light_count - 1; i++)",
    ),
    Mutation(
        "number not stretched over the light's part",
        "light/light.glsl",
        "u = clamp((u - choice.cumulative) / choice.probability, 0.0, ONE_MINUS_EPSILON);",
        "",
    ),
    Mutation("falloff of a spot not squared", "light/spot.glsl", "return square(clamp(", "return (clamp("),
    Mutation(
        "spot shines backwards", "light/spot.glsl", "spot_light_falloff(light, -wi)", "spot_light_falloff(light, wi)"
    ),
    Mutation("spot without its inverse square", "light/spot.glsl", "intensity / square(distance)", "intensity"),
    Mutation("directional light at a distance", "light/directional.glsl", "INFINITE_DISTANCE", "1.0"),
    Mutation(
        "disk sampled as the square around it",
        "shape/flat.glsl",
        "kind == KIND_DISK ? square_to_disk(u)",
        "kind == KIND_DISK ? 2.0 * u - 1.0",
    ),
    Mutation(
        "disk sampled with the area of that square",
        "light/area.glsl",
        "area_light_pdf(light.area, distance, -dot",
        "area_light_pdf(light.kind == KIND_DISK ? light.area * 4.0 / PI : light.area, distance, -dot",
    ),
    Mutation("disk met as a square", "shape/flat.glsl", "dot(uv, uv) - 1.0", "max(abs(uv.x), abs(uv.y)) - 1.0"),
    Mutation("front of a sphere inverted", "shape/sphere.glsl", "is_front = near > 0.0", "is_front = near <= 0.0"),
    Mutation(
        "culling of listed spheres inverted",
        "shape/shape.glsl",
        "if (is_front || (sphere.kind & SHAPE_CULLED)",
        "if (!is_front || (sphere.kind & SHAPE_CULLED)",
    ),
    Mutation(
        "culling in the BVH inverted",
        "shape/bvh.glsl",
        "(is_front || (flags & SHAPE_CULLED) == 0u)",
        "(!is_front || (flags & SHAPE_CULLED) == 0u)",
    ),
    Mutation("inside of a sphere not met", "shape/sphere.glsl", "is_front ? near : far", "near"),
    Mutation(
        "BVH ignores rectangles",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind > KIND_RECTANGLE",
    ),
    Mutation(
        "BVH ignores disks",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind == KIND_RECTANGLE || kind > KIND_DISK",
    ),
    Mutation(
        "BVH ignores triangles of no mesh",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || (kind >= KIND_RECTANGLE && kind != KIND_SINGLE_TRIANGLE)",
    ),
    Mutation("BVH ignores spheres", "shape/shape.glsl", "&& kind == KIND_SPHERE", "&& kind == KIND_PLANE"),
    Mutation("fourth child ignored", "shape/bvh.glsl", "near.w <= far.w && node.count > 3u", "false"),
    Mutation(
        "shadow rays stop at the short list",
        "shape/bvh.glsl",
        "(any && hit.primitive != NO_PRIMITIVE)) return;",
        "any) return;",
    ),
    Mutation(
        "flat shape in the BVH taken for a triangle",
        "shape/shape.glsl",
        "if ((u_bvh_shapes & BVH_FLATS) != 0 && kind != KIND_TRIANGLE) inside",
        "if ((u_bvh_shapes & BVH_FLATS) == 0 && kind != KIND_TRIANGLE) inside",
    ),
    Mutation("light does not ignore itself", "shape/bvh.glsl", " && record != ignored", ""),
]
