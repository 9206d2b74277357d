// SPDX-License-Identifier: MIT
// All triangles of meshes that emit, as one light: one of them drawn in constant time from an alias table (Walker
// 1977, An Efficient Method for Generating Discrete Random Variables with General Distributions), then a point on it.
#if HAS_MESH_LIGHT

struct MeshLightSample {
    int record;     // of the triangle
    int material;
    vec3 position;
    vec3 normal;    // unit, on its front
    float density;  // per area
};

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
    return MeshLightSample(record, t.material, position, mesh_triangle_normal(t.a, t.b, t.c), t.density);
}

// Density over solid angle at `distance` under the angle `cos_theta` to the normal, where it is `density` over area;
// 0 from behind.
float mesh_light_pdf(float density, float distance, float cos_theta) {
    return cos_theta > 0.0 ? density * square(distance) / cos_theta : 0.0;
}

#endif
