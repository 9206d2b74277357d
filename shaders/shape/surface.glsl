// SPDX-License-Identifier: MIT
// What a hit says about the surface: computed once, after the traversal.

struct Surface {
    vec3 position;  // put back onto the surface, free of the error of the distance
    vec3 normal;    // unit, geometric: out of a sphere, up from a plane, by the right hand for the others
    float extent;   // the largest coordinate behind `position`, for ray_offset_origin
    int material;
    int light;      // index of the light that this primitive is, or -1
#if HAS_MESH_LIGHT
    float light_density;  // of a light of meshes: per area, of a sample of it
#endif
#if HAS_SHADING_NORMALS
    vec3 shading_normal;  // unit, on the side of `normal`
#endif
    // Of meshes alone; elsewhere coordinates and tangent are 0, the colour 1.
#if HAS_UV
    vec2 uv;
#endif
#if HAS_UV_1
    vec2 uv_1;
#endif
#if HAS_TANGENTS
    vec4 tangent;  // unit, not perpendicular to the normal; w is the sign of the bitangent; 0: none is given
#endif
#if HAS_COLORS
    vec4 color;
#endif
};

void surface_set_flat(inout Surface surface, vec4 plane, int material, int light) {
    surface.normal = plane.xyz;
    surface.position -= plane.xyz * (dot(plane.xyz, surface.position) - plane.w);
    surface.extent = max_component(abs(surface.position));
    surface.material = material;
    surface.light = light;
}

#if HAS_MESHES
void surface_set_mesh(inout Surface surface, Hit hit) {
    int record = hit.primitive - FIRST_MESH;
    MeshTriangle t = mesh_triangle_load(record);
    vec3 weights = vec3(1.0 - hit.weights.x - hit.weights.y, hit.weights);
    surface.position = weights.x * t.a + weights.y * t.b + weights.z * t.c;
    surface.normal = mesh_triangle_normal(t.a, t.b, t.c);
    vec3 reach = max(abs(t.a), max(abs(t.b), abs(t.c)));
    surface.material = int(t.material);
#if HAS_MESH_LIGHT
    surface.light = t.density > 0.0 ? 0 : -1;
    surface.light_density = t.density;
#endif
#if MESH_VERTEX_TEXELS
    MeshVertex a = mesh_vertex_load(t.vertices.x);
    MeshVertex b = mesh_vertex_load(t.vertices.y);
    MeshVertex c = mesh_vertex_load(t.vertices.z);
#endif
#if HAS_SHADING_NORMALS
    vec3 shading_normal = weights.x * a.normal + weights.y * b.normal + weights.z * c.normal;
#endif
#if HAS_UV
    surface.uv = weights.x * a.uv + weights.y * b.uv + weights.z * c.uv;
#endif
#if HAS_UV_1
    surface.uv_1 = weights.x * a.uv_1 + weights.y * b.uv_1 + weights.z * c.uv_1;
#endif
#if HAS_TANGENTS
    vec4 tangent = weights.x * a.tangent + weights.y * b.tangent + weights.z * c.tangent;
#endif
#if HAS_COLORS
    surface.color = weights.x * a.color + weights.y * b.color + weights.z * c.color;
#endif
#if HAS_INSTANCES
    if (hit.instance >= 0) {
        MeshInstance space = mesh_instance_load(hit.instance);
        mat3 to_world = mesh_instance_matrix(space);
        surface.position = to_world * surface.position + space.translation;
        surface.normal = normalize(mesh_normal_to_world(space, surface.normal));
        reach = abs(space.translation) + abs(to_world[0]) * reach.x + abs(to_world[1]) * reach.y + abs(to_world[2]) * reach.z;
        surface.material = int(space.material);
#if HAS_SHADING_NORMALS
        shading_normal = mesh_normal_to_world(space, shading_normal);
#endif
#if HAS_TANGENTS
        tangent = vec4(to_world * tangent.xyz, determinant(to_world) < 0.0 ? -tangent.w : tangent.w);
#endif
    }
#endif
#if HAS_SHADING_NORMALS
    float size = length(shading_normal);
    surface.shading_normal = size > 1e-6 ? shading_normal / size : surface.normal;
#endif
#if HAS_TANGENTS
    float reach_of_tangent = length(tangent.xyz);
    surface.tangent = reach_of_tangent > 1e-6 ? vec4(tangent.xyz / reach_of_tangent, tangent.w < 0.0 ? -1.0 : 1.0) : vec4(0.0);
#endif
    surface.extent = max_component(max(reach, abs(surface.position)));
}
#endif

Surface surface_at(Ray ray, Hit hit) {
    Surface surface;
    surface.position = ray.origin + hit.distance * ray.direction;
    surface.normal = vec3(0.0);
    surface.extent = 0.0;
    surface.material = 0;
    surface.light = -1;
#if HAS_MESH_LIGHT
    surface.light_density = 0.0;
#endif
#if HAS_SHADING_NORMALS
    surface.shading_normal = vec3(0.0);
#endif
#if HAS_UV
    surface.uv = vec2(0.0);
#endif
#if HAS_UV_1
    surface.uv_1 = vec2(0.0);
#endif
#if HAS_TANGENTS
    surface.tangent = vec4(0.0);
#endif
#if HAS_COLORS
    surface.color = vec4(1.0);
#endif
#if SPHERE_COUNT
    if (hit.primitive < FIRST_PLANE) {
        Sphere s = sphere_select(hit.primitive - FIRST_SPHERE);
        surface.normal = normalize(surface.position - s.center);
        surface.position = s.center + s.radius * surface.normal;
        surface.extent = max_component(abs(s.center)) + s.radius;
        surface.material = s.material;
        surface.light = s.light;
    }
#endif
#if PLANE_COUNT
    if (hit.primitive >= FIRST_PLANE && hit.primitive < FIRST_RECTANGLE) {
        Plane p = plane_select(hit.primitive - FIRST_PLANE);
        surface_set_flat(surface, vec4(p.normal, p.offset), p.material, -1);
    }
#endif
#if RECTANGLE_COUNT
    if (hit.primitive >= FIRST_RECTANGLE && hit.primitive < FIRST_TRIANGLE) {
        Rectangle r = rectangle_select(hit.primitive - FIRST_RECTANGLE);
        surface_set_flat(surface, r.plane, r.material, r.light);
    }
#endif
#if TRIANGLE_COUNT
    if (hit.primitive >= FIRST_TRIANGLE && hit.primitive < FIRST_MESH) {
        Triangle t = triangle_select(hit.primitive - FIRST_TRIANGLE);
        surface_set_flat(surface, t.plane, t.material, t.light);
    }
#endif
#if HAS_MESHES
    if (hit.primitive >= FIRST_MESH) surface_set_mesh(surface, hit);
#endif
#if HAS_SHADING_NORMALS
    // A flat triangle has none, and one that is at odds with the triangle is of no use.
    float side = dot(surface.shading_normal, surface.normal);
    surface.shading_normal = side > 0.0 ? surface.shading_normal : (side < 0.0 ? -surface.shading_normal : surface.normal);
#endif
    return surface;
}

float surface_light_density(Surface surface) {
#if HAS_MESH_LIGHT
    return surface.light_density;
#else
    return 0.0;
#endif
}
