// SPDX-License-Identifier: MIT
// All triangles of meshes that emit, as one light: one of them drawn in constant time from an alias table (Walker
// 1977, An Efficient Method for Generating Discrete Random Variables with General Distributions), then a point on it.
#if HAS_MESH_LIGHT

struct MeshLightSample {
    int record;     // of the triangle
    vec3 radiance;
    vec3 position;
    vec3 normal;    // unit, on its front
    float density;  // per area
};

// Radiance at a point of the triangle `record`, as far as it is there; the density knows only the mean of a texture.
vec3 mesh_light_radiance(int record, int material, vec2 weights) {
#if HAS_EMISSION_TEXTURE || HAS_ALPHA
    Hit hit;
    hit.primitive = FIRST_MESH + record;
    hit.weights = weights;
#if HAS_INSTANCES
    hit.instance = -1;  // what emits is no instance
#endif
    Surface surface;
    surface_set_mesh(surface, hit);
#if HAS_ALPHA
    return material_opacity_at(surface, -surface.normal) * material_at(surface).emission;
#else
    return material_at(surface).emission;
#endif
#else
    return material_select(material).emission;
#endif
}

// u.x has 23 bits or so. They choose the place in the table, and what is left goes to the point on the triangle; so
// that many triangles do not use up all of them, bits of a hash come after them.
MeshLightSample mesh_light_sample(vec2 u) {
    uint bits = hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y)));
    float place = u.x * float(MESH_LIGHT_COUNT);
    int index = min(int(place), MESH_LIGHT_COUNT - 1);
    vec4 texel = texelFetch(u_mesh_lights, ivec2(index & 4095, index >> 12), 0);
    MeshLight entry = mesh_light_of(texel);
    int record = hash_to_unit(bits) < entry.threshold ? entry.record : entry.other;
    u.x = fract(place - float(index) + hash_to_unit(hash_uint(bits)) * (1.1920929e-7 * float(MESH_LIGHT_COUNT)));

    MeshTriangle t = mesh_triangle_load(record);
    vec2 weights = square_to_triangle(u);
    vec3 position = (1.0 - weights.x - weights.y) * t.a + weights.x * t.b + weights.y * t.c;
    vec3 normal = mesh_triangle_normal(t.a, t.b, t.c);
    return MeshLightSample(record, mesh_light_radiance(record, int(t.material), weights), position, normal, t.density);
}

// Density over solid angle at `distance` under the angle `cos_theta` to the normal, where it is `density` over area;
// 0 from behind.
float mesh_light_pdf(float density, float distance, float cos_theta) {
    return cos_theta > 0.0 ? density * square(distance) / cos_theta : 0.0;
}

#endif
