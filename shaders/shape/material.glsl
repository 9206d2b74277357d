// SPDX-License-Identifier: MIT
// What a surface is made of at one point: the material's constant values, times its textures and the
// colours of the vertices (the metallic-roughness material of glTF 2.0, section 3.9).

#if HAS_MAPS
// The material where its values vary. `uv` holds both sets of coordinates; scene/material.py says the same.
Material material_with_maps(Material material, Maps maps, vec4 uv, vec3 color) {
    vec3 albedo = maps.albedo * color;
    float metallic = maps.metallic;
#if HAS_ALBEDO_TEXTURE
    if (maps.albedo_texture >= 0) albedo *= texture_value(texture_select(maps.albedo_texture), uv).rgb;
#endif
#if HAS_METALLIC_TEXTURE && !HAS_METALLIC_ROUGHNESS
    if (maps.metallic_texture >= 0) metallic *= texture_channel(texture_select(maps.metallic_texture), uv);
#endif
#if HAS_ROUGHNESS_TEXTURE
    if (maps.roughness_texture >= 0) {
        Texture t = texture_select(maps.roughness_texture);
        vec4 value = texture_value(t, uv);
        material.alpha = square(clamp(maps.roughness * texture_pick(t, value), 0.0, 1.0));
#if HAS_METALLIC_ROUGHNESS
        metallic *= texture_pick(texture_select(maps.metallic_texture), value);
#endif
    }
#endif
    albedo = clamp(albedo, 0.0, 1.0);
    metallic = clamp(metallic, 0.0, 1.0);
    if (material.unlit == 0) {
        material.diffuse = (1.0 - metallic) * albedo;
        material.f0 = (1.0 - metallic) * maps.dielectric_f0 + metallic * albedo;
        // A metal reflects white at grazing angles, unless it is all but black (materials.py).
        float grazing = min(1.0, 50.0 * max_component(albedo));
        material.f90 = (1.0 - metallic) * maps.dielectric_f90 + metallic * grazing;
#if HAS_EMISSION_TEXTURE
        if (maps.emission_texture >= 0) material.emission *= texture_value(texture_select(maps.emission_texture), uv).rgb;
#endif
    } else {
        material.emission = albedo;
    }
    return material;
}
#endif

#if HAS_NORMAL_TEXTURE
// The shading normal that the map makes of `normal`. The tangent is made perpendicular to it; the bitangent is
// cross(normal, tangent) times the sign in w (glTF 2.0, sections 3.7.2.1 and 3.9.3). Without a tangent nothing changes.
vec3 material_mapped_normal(Maps maps, vec4 uv, vec3 normal, vec4 tangent) {
    vec3 along = tangent.xyz - normal * dot(normal, tangent.xyz);
    float size = length(along);
    if (maps.normal_texture < 0 || size <= 0.0) return normal;
    along /= size;
    vec3 local = 2.0 * texture_value(texture_select(maps.normal_texture), uv).xyz - 1.0;
    local.xy *= maps.normal_scale;
    vec3 mapped = local.x * along + local.y * tangent.w * cross(normal, along) + local.z * normal;
    float mapped_size = length(mapped);
    return mapped_size > 0.0 ? mapped / mapped_size : normal;
}
#endif

#if HAS_ALPHA
// How much of a surface is there: the chance that a ray meets it.
float material_opacity(int index, vec4 uv, float vertex_alpha) {
    Opacity o = opacity_select(index);
    if (o.mode == ALPHA_OPAQUE) return 1.0;
    float alpha = o.opacity * vertex_alpha;
#if HAS_ALBEDO_TEXTURE
    if (o.texture_index >= 0) alpha *= texture_value(texture_select(o.texture_index), uv).a;
#endif
    return o.mode == ALPHA_MASK ? float(alpha >= o.cutoff) : clamp(alpha, 0.0, 1.0);
}
#endif

// Both sets of texture coordinates.
vec4 material_coordinates(Surface surface) {
    vec4 uv = vec4(0.0);
#if HAS_UV
    uv.xy = surface.uv;
#endif
#if HAS_UV_1
    uv.zw = surface.uv_1;
#endif
    return uv;
}

Material material_at(Surface surface) {
    Material material = material_select(surface.material);
#if HAS_MAPS
    vec3 color = vec3(1.0);
#if HAS_COLORS
    color = surface.color.rgb;
#endif
    material = material_with_maps(material, maps_select(surface.material), material_coordinates(surface), color);
#endif
    return material;
}

#if HAS_OCCLUSION_TEXTURE
// What is left of light from all around, for shading that traces no rays to find out.
float material_occlusion(Surface surface) {
    Maps maps = maps_select(surface.material);
    if (maps.occlusion_texture < 0) return 1.0;
    float open = texture_channel(texture_select(maps.occlusion_texture), material_coordinates(surface));
    return 1.0 + maps.occlusion_strength * (open - 1.0);
}
#endif

#if HAS_ALPHA
// As a ray of this direction meets it.
float material_opacity_at(Surface surface, vec3 direction) {
    if (opacity_select(surface.material).one_sided != 0 && dot(surface.normal, direction) > 0.0) return 0.0;
    float vertex_alpha = 1.0;
#if HAS_COLORS
    vertex_alpha = surface.color.a;
#endif
    return material_opacity(surface.material, material_coordinates(surface), vertex_alpha);
}
#endif

#if HAS_SHADING_NORMALS
// The interpolated normal, with what a normal map makes of it; on the side of the surface's front.
vec3 material_shading_normal(Surface surface) {
#if HAS_NORMAL_TEXTURE
    Maps maps = maps_select(surface.material);
    return material_mapped_normal(maps, material_coordinates(surface), surface.shading_normal, surface.tangent);
#else
    return surface.shading_normal;
#endif
}
#endif
