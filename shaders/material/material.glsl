// SPDX-License-Identifier: MIT
// What a surface is made of at one point: the material's constant values, times its textures and the
// colours of the vertices (the metallic-roughness material of glTF 2.0, section 3.9).
#include "bsdf/bsdf.glsl"
#include "core/frame.glsl"
#include "core/hash.glsl"
#include "core/math.glsl"
#include "scene/material.glsl"
#include "shape/surface.glsl"
#include "texture/texture.glsl"

// The coat of a rough plastic, between the two of the nearest roughnesses.
Coat material_coat(Plastic plastic, float alpha) {
    Coat coat = coat_load(plastic.coat);
    if (plastic.coats > 1) {
        float place = sqrt(alpha) * float(plastic.coats - 1);
        int below = min(int(place), plastic.coats - 2);
        float t = place - float(below);
        coat = coat_load(plastic.coat + below);
        Coat above = coat_load(plastic.coat + below + 1);
        coat.facets = mix(coat.facets, above.facets, t);
        coat.angles = mix(coat.angles, above.angles, t);
        coat.leaving = mix(coat.leaving, above.leaving, t);
    }
    return coat;
}

// The BSDF of a surface of this material, met from its front or from behind. There is nothing before the front of a
// dielectric.
Bsdf material_bsdf(Material material, bool is_front) {
    Bsdf b = bsdf_of(material.bsdf, material.diffuse, material.alpha, material.f0, material.f90);
#if HAS_COOK_TORRANCE
    if (u_without_half_vector == 0 && bsdf_is(b, BSDF_COOK_TORRANCE)) b.half_vector = material.record;
#endif
#if HAS_EXACT_FRESNEL
    if (u_without_half_vector == 0 && bsdf_is(b, BSDF_SHEEN)) b.half_vector = material.record;
    if (bsdf_is_present(BSDF_DIELECTRIC) || bsdf_is_present(BSDF_THIN_DIELECTRIC)) {
        Dielectric dielectric = dielectric_load(material.record);
        b.eta = is_front || bsdf_is(b, BSDF_THIN_DIELECTRIC) ? dielectric.eta : 1.0 / dielectric.eta;
        b.transmittance = dielectric.transmittance;
        if (material_is_mapped(material) && (bsdf_is(b, BSDF_DIELECTRIC) || bsdf_is(b, BSDF_THIN_DIELECTRIC))) {
            b.transmittance = b.diffuse;  // with its texture, in the place of an albedo
            b.diffuse = vec3(0.0);
        }
    }
    if (bsdf_is(b, BSDF_CONDUCTOR)) {
        Conductor conductor = conductor_load(material.record);
        b.index = conductor.index;
        b.extinction = conductor.extinction;
    }
    if (bsdf_is(b, BSDF_PLASTIC) || bsdf_is(b, BSDF_ROUGH_PLASTIC)) {
        Plastic plastic = plastic_load(material.record);
        b.eta = plastic.eta;
        if (bsdf_is(b, BSDF_ROUGH_PLASTIC)) {
            b.alpha = max(b.alpha, ALPHA_DELTA);
            Coat coat = material_coat(plastic, b.alpha);
            b.coat_facets = coat.facets;
            b.coat_angles = coat.angles;
            plastic.leaving = coat.leaving;
        }
        // A geometric series of what goes to and fro, and the radiance of the coat spread by refraction to that outside.
        vec3 again = plastic.nonlinear != 0 ? b.diffuse : vec3(1.0);
        b.diffuse /= (1.0 - again + again * plastic.leaving) * square(plastic.eta);
    }
#endif
    if (material_is_black(material, is_front)) b.model = BSDF_NONE;
    return b;
}

#if HAS_TEXTURES
// What the textures of a material are, those of occlusion, anisotropy, coats, sheen, films, translucency and blends apart.
int material_uses(Maps maps) {
    int uses = 0;
    if (textures_change(TEXTURE_ALBEDO) && maps.albedo_texture >= 0) uses |= TEXTURE_ALBEDO;
    if (textures_change(TEXTURE_ROUGHNESS) && maps.roughness_texture >= 0) uses |= TEXTURE_ROUGHNESS;
    if (textures_change(TEXTURE_METALLIC) && maps.metallic_texture >= 0) uses |= TEXTURE_METALLIC;
    if (textures_change(TEXTURE_NORMAL) && maps.normal_texture >= 0) uses |= TEXTURE_NORMAL;
    if (textures_change(TEXTURE_EMISSION) && maps.emission_texture >= 0) uses |= TEXTURE_EMISSION;
    return uses;
}

int material_texture(Maps maps, int use) {
    if (use == TEXTURE_ALBEDO) return maps.albedo_texture;
    if (use == TEXTURE_ROUGHNESS) return maps.roughness_texture;
    if (use == TEXTURE_METALLIC) return maps.metallic_texture;
    return use == TEXTURE_NORMAL ? maps.normal_texture : maps.emission_texture;
}
#endif

// The interpolated normal of a surface with what a normal map of the value `rgb` makes of it; on the side of the surface's
// front. The tangent is made perpendicular to the normal; the bitangent is cross(normal, tangent) times the sign
// in w (glTF 2.0, sections 3.7.2.1 and 3.9.3). Without a tangent nothing changes.
vec3 material_mapped_normal(Surface surface, vec3 rgb, float scale) {
    vec3 local = (2.0 * rgb - 1.0) * vec3(scale, scale, 1.0);
    vec3 normal = surface.shading_normal;
    vec3 along = surface.tangent.xyz - normal * dot(normal, surface.tangent.xyz);
    float size = length(along);
    if (size <= 0.0) return normal;
    along /= size;
    vec3 mapped = local.x * along + local.y * surface.tangent.w * cross(normal, along) + local.z * normal;
    return length(mapped) > 0.0 ? normalize(mapped) : normal;
}

// The material where its values vary, and the normal of the surface; scene/material.py says the same.
Material material_with_maps(Material material, inout Surface surface) {
    Maps maps = maps_load(surface.material);
    vec3 albedo = maps.albedo * surface.color.rgb;
    float metallic = maps.metallic;
#if HAS_TEXTURES
    // One texture a turn: drivers compile the reading of it once, and those that execute every branch read one where no
    // lane has any.
    int uses = material_uses(maps);
    do {
        int use = uses & -uses;
        uses -= use;
        Texture t = texture_load(max(0, material_texture(maps, use)));
        vec4 value = texture_value(t, surface.uv);
        if (use == TEXTURE_ALBEDO) albedo *= value.rgb;
        if (use == TEXTURE_METALLIC) metallic *= texture_pick(t.channel, value);
        if (use == TEXTURE_ROUGHNESS) {
            material.alpha = square(clamp(maps.roughness * texture_pick(t.channel, value), 0.0, 1.0));
            if (maps.metallic_channel >= 0) metallic *= texture_pick(maps.metallic_channel, value);
        }
        if (use == TEXTURE_EMISSION && !material_is_unlit(material)) material.emission *= value.rgb;
        if (use == TEXTURE_NORMAL) surface.mapped_normal = material_mapped_normal(surface, value.rgb, maps.normal_scale);
    } while (uses != 0);
#endif
    albedo = clamp(albedo, 0.0, 1.0);
    metallic = clamp(metallic, 0.0, 1.0);
    if (!material_is_unlit(material)) {
        material.diffuse = (1.0 - metallic) * albedo;
        material.f0 = (1.0 - metallic) * maps.dielectric_f0 + metallic * albedo;
        // A metal reflects white at grazing angles, unless it is all but black (scene/reflectance.py).
        float grazing = min(1.0, 50.0 * max_component(albedo));
        material.f90 = (1.0 - metallic) * maps.dielectric_f90 + metallic * grazing;
    } else {
        material.emission = albedo;
    }
    return material;
}

// Of two materials that are blended a ray meets one: the other one with the probability of its weight, by a hash of the
// ray's own `seed`. The mean is that of the blended BSDFs, whatever technique chose the direction, so that no weight between
// techniques needs to know of it (compare material/visibility.glsl).
void material_choose(inout Surface surface, uint seed) {
    if (u_has_blends == 0) return;
    Blend blend = blend_load(surface.material);
    float weight = blend.weight;
#if HAS_TEXTURES
    if (textures_change(TEXTURE_BLEND_WEIGHT) && blend.texture_index >= 0) {
        weight *= texture_channel(texture_load(blend.texture_index), surface.uv);
    }
#endif
    if (hash_to_unit(hash_uint(seed ^ 0xb5297a4du)) < weight) surface.material = blend.other;
}

// Of a surface, whose mapped normal it sets.
Material material_at(inout Surface surface) {
    Material material = material_load(surface.material);
    if (material_is_mapped(material)) material = material_with_maps(material, surface);
    return material;
}

// What is left of light from all around, for shading that traces no rays to find out.
float material_occlusion(Surface surface) {
#if HAS_TEXTURES
    if (textures_change(TEXTURE_OCCLUSION)) {
        Maps maps = maps_load(surface.material);
        if (maps.occlusion_texture >= 0) {
            float open = texture_channel(texture_load(maps.occlusion_texture), surface.uv);
            return 1.0 + maps.occlusion_strength * (open - 1.0);
        }
    }
#endif
    return 1.0;
}

// The sheen over the base, black where it has none.
void material_set_sheen(inout Bsdf b, Surface surface) {
    Sheen sheen = sheen_load(surface.material);
    b.sheen_color = sheen.color;
    b.sheen_roughness = sheen.roughness;
#if HAS_TEXTURES
    if (textures_change(TEXTURE_SHEEN_COLOR) && sheen.color_texture >= 0) {
        b.sheen_color *= texture_value(texture_load(sheen.color_texture), surface.uv).rgb;
    }
    if (textures_change(TEXTURE_SHEEN_ROUGHNESS) && sheen.roughness_texture >= 0) {
        b.sheen_roughness *= texture_channel(texture_load(sheen.roughness_texture), surface.uv);
    }
#endif
    b.sheen_color = clamp(b.sheen_color, 0.0, 1.0);
    b.sheen_roughness = clamp(b.sheen_roughness, SHEEN_LEAST_ROUGHNESS, 1.0);
}

// The thin film on the facets, of the weight 0 where there is none.
void material_set_iridescence(inout Bsdf b, Surface surface) {
    Iridescence film = iridescence_load(surface.material);
    float weight = film.weight, thickness = film.thickness;
#if HAS_TEXTURES
    if (textures_change(TEXTURE_IRIDESCENCE) && film.weight_texture >= 0) {
        weight *= texture_channel(texture_load(film.weight_texture), surface.uv);
    }
    if (textures_change(TEXTURE_IRIDESCENCE_THICKNESS) && film.thickness_texture >= 0) {
        float share = texture_channel(texture_load(film.thickness_texture), surface.uv);
        thickness = mix(film.thickness_minimum, film.thickness, clamp(share, 0.0, 1.0));
    }
#endif
    b.iridescence = clamp(weight, 0.0, 1.0);
    b.iridescence_ior = film.ior;
    b.iridescence_thickness = thickness;
}

// What a translucent base transmits and what it reflects. A metal has no base.
void material_set_translucency(inout Bsdf b, Surface surface, Translucency translucency) {
    vec3 color = translucency.color;
    float factor = translucency.factor, metallic = translucency.metallic;
#if HAS_TEXTURES
    if (textures_change(TEXTURE_DIFFUSE_TRANSMISSION_COLOR) && translucency.color_texture >= 0) {
        color *= texture_value(texture_load(translucency.color_texture), surface.uv).rgb;
    }
    if (textures_change(TEXTURE_DIFFUSE_TRANSMISSION) && translucency.factor_texture >= 0) {
        factor *= texture_channel(texture_load(translucency.factor_texture), surface.uv);
    }
    if (translucency.metallic_texture >= 0) {
        metallic *= texture_channel(texture_load(translucency.metallic_texture), surface.uv);
    }
#endif
    factor = clamp(factor, 0.0, 1.0);
    b.transmitted = (1.0 - clamp(metallic, 0.0, 1.0)) * factor * clamp(color, 0.0, 1.0);
    b.diffuse *= 1.0 - factor;
}

// The coat of a coated material, and what it says of the base.
void material_set_coat(inout Bsdf b, Surface surface, ClearCoat coat) {
    float weight = coat.weight, roughness = coat.roughness;
#if HAS_TEXTURES
    if (textures_change(TEXTURE_COAT) && coat.weight_texture >= 0) {
        weight *= texture_channel(texture_load(coat.weight_texture), surface.uv);
    }
    if (textures_change(TEXTURE_COAT_ROUGHNESS) && coat.roughness_texture >= 0) {
        roughness *= texture_channel(texture_load(coat.roughness_texture), surface.uv);
    }
#endif
    b.half_vector = coat.half_vector;
    b.coat_weight = clamp(weight, 0.0, 1.0);
    b.coat_alpha = max(square(clamp(roughness, 0.0, 1.0)), ALPHA_DELTA);
    b.coat_f0 = coat.f0;
}

// The normal of a coat, on the side of the surface's front.
vec3 material_coat_normal(Surface surface, ClearCoat coat) {
#if HAS_TEXTURES
    if (textures_change(TEXTURE_COAT_NORMAL) && coat.normal_texture >= 0) {
        vec3 rgb = texture_value(texture_load(coat.normal_texture), surface.uv).rgb;
        return material_mapped_normal(surface, rgb, coat.normal_scale);
    }
#endif
    return surface.shading_normal;
}

// How facets are wider: of a texture, red and green are the direction in the plane of the tangent, which is turned by the
// angle of the material, and blue is a factor of the strength (Khronos Group 2023, KHR_materials_anisotropy).
Anisotropy material_anisotropy(Surface surface) {
    Anisotropy anisotropy = anisotropy_load(surface.material);
#if HAS_TEXTURES
    if (textures_change(TEXTURE_ANISOTROPY) && anisotropy.texture_index >= 0) {
        vec3 value = texture_value(texture_load(anisotropy.texture_index), surface.uv).rgb;
        vec2 along = unit_or(vec3(2.0 * value.xy - 1.0, 0.0), vec3(1.0, 0.0, 0.0)).xy;
        vec2 turned = vec2(anisotropy.cosine, anisotropy.sine);
        anisotropy.cosine = turned.x * along.x - turned.y * along.y;
        anisotropy.sine = turned.y * along.x + turned.x * along.y;
        anisotropy.strength *= clamp(value.z, 0.0, 1.0);
    }
#endif
    return anisotropy;
}

// The direction along which facets are wider: the tangent of a mesh, or, where there is none, the horizontal one to the
// right as seen from outside, x where the surface is horizontal; turned by the angle of the material.
vec3 material_tangent(Surface surface, Anisotropy anisotropy) {
    vec3 normal = surface.shading_normal;
    vec3 level = unit_or(vec3(normal.z, 0.0, -normal.x), vec3(1.0, 0.0, 0.0));
    bool has_tangent = dot(surface.tangent.xyz, surface.tangent.xyz) > 0.0;
    Frame frame = frame_from_tangent(normal, has_tangent ? surface.tangent.xyz : level);
    float handed = has_tangent ? surface.tangent.w : 1.0;
    return anisotropy.cosine * frame.tangent + anisotropy.sine * handed * frame.bitangent;
}
