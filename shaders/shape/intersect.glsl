// SPDX-License-Identifier: MIT
// The one traversal, for closest hits and for occlusion. Primitives are numbered spheres first, then
// planes, rectangles, triangles and the records of meshes.

struct Hit {
    float distance;
    int primitive;
#if HAS_MESHES
    vec2 weights;  // of the second and third vertex
#endif
#if HAS_INSTANCES
    int instance;  // the record of the one that a mesh was met in, or -1
#endif
};

const int FIRST_SPHERE = 0;
const int FIRST_PLANE = FIRST_SPHERE + SPHERE_COUNT;
const int FIRST_RECTANGLE = FIRST_PLANE + PLANE_COUNT;
const int FIRST_TRIANGLE = FIRST_RECTANGLE + RECTANGLE_COUNT;
const int FIRST_MESH = FIRST_TRIANGLE + TRIANGLE_COUNT;
const int NO_PRIMITIVE = -1;

void hit_update(inout Hit hit, float distance, int primitive, int skipped) {
    if (distance < hit.distance && primitive != skipped) {
        hit.distance = distance;
        hit.primitive = primitive;
    }
}

#define INTERSECT_SPHERE(i) { Sphere s = sphere_load(i); hit_update(hit, sphere_intersect(s.center, s.radius, ray), FIRST_SPHERE + i, skipped); }
#define INTERSECT_PLANE(i) { Plane p = plane_load(i); hit_update(hit, plane_intersect(p.normal, p.offset, ray), FIRST_PLANE + i, skipped); }
#define INTERSECT_RECTANGLE(i) { Rectangle r = rectangle_load(i); hit_update(hit, rectangle_intersect(r.plane, r.u_row, r.v_row, ray), FIRST_RECTANGLE + i, skipped); }
#define INTERSECT_TRIANGLE(i) { Triangle t = triangle_load(i); hit_update(hit, triangle_intersect(t.plane, t.u_row, t.v_row, ray), FIRST_TRIANGLE + i, skipped); }

#if HAS_MESHES || HAS_ALPHA
// A driver may end a loop before its time (llvmpipe does after 65,535 rounds of all loops in a draw).
bool scene_is_cut_short = false;
#endif

#if HAS_MESHES
void hit_meshes(inout Hit hit, Ray ray, int skipped, bool any) {
    if (any && hit.primitive != NO_PRIMITIVE) return;
    MeshRay local = mesh_ray(ray.origin, ray.direction);
    // What is left to do: records, and the distances at which the ray enters them, as bits, which are in the same order.
    ivec2 stack[MESH_STACK];
    stack[0] = ivec2(-1);
    int top = 1;
    int record = 0;
#if HAS_INSTANCES
    int instance = -1;
    int instance_top = 0;   // entries of the stack that do not belong to the instance
    uint instance_kind = 0u;
#endif
    do {
        uvec4 t0 = mesh_texel(3 * record);
        uvec4 t1 = mesh_texel(3 * record + 1);
        uvec4 t2 = mesh_texel(3 * record + 2);
        uint kind = t0.w >> 24u;
        int next = -1;
        if (kind == uint(MESH_NODE)) {
            MeshNode node = mesh_node_of(t0, t1, t2);
            ivec4 keys = mesh_node_intersect(node, local, hit.distance);
            if (keys.w != MESH_NO_CHILD) stack[top++] = ivec2(mesh_child(node, keys.w), keys.w);
            if (keys.z != MESH_NO_CHILD) stack[top++] = ivec2(mesh_child(node, keys.z), keys.z);
            if (keys.y != MESH_NO_CHILD) stack[top++] = ivec2(mesh_child(node, keys.y), keys.y);
            if (keys.x != MESH_NO_CHILD) next = mesh_child(node, keys.x);
#if HAS_INSTANCES
        } else if (kind == uint(MESH_INSTANCE)) {
            MeshInstance space = mesh_instance_of(t0, t1, t2);
            vec3 translation = mesh_instance_detail_of(mesh_detail_texel(space.detail)).translation;
            instance = record;
            instance_top = top;
            instance_kind = space.kind;
            local = mesh_ray(mesh_to_instance(space, ray.origin - translation), mesh_to_instance(space, ray.direction));
            next = int(space.root);
#endif
        } else {
            MeshTriangle triangle = mesh_triangle_of(t0, t1, t2);
            vec4 found = mesh_triangle_intersect(triangle.a, triangle.b, triangle.c, local);
            bool is_met = found.x < hit.distance && FIRST_MESH + record != skipped;
#if HAS_CULLING
#if HAS_INSTANCES
            if (instance >= 0) triangle.kind = instance_kind;
#endif
            is_met = is_met && ((triangle.kind & 255u) == 0u || found.w > 0.0);
#endif
            if (is_met) {
                hit.distance = found.x;
                hit.primitive = FIRST_MESH + record;
                hit.weights = found.yz;
#if HAS_INSTANCES
                hit.instance = instance;
#endif
            }
            if (is_met && any) top = 1;
            else if (kind == uint(MESH_TRIANGLE)) next = record + 1;
        }
        if (next < 0) {
            ivec2 entry;
            do {
                top--;
                entry = stack[top];
            } while (entry.y >= floatBitsToInt(hit.distance));
            next = entry.x;
#if HAS_INSTANCES
            if (instance >= 0 && top < instance_top) {
                instance = -1;
                local = mesh_ray(ray.origin, ray.direction);
            }
#endif
        }
        record = next;
    } while (record >= 0);
    if (record >= 0) scene_is_cut_short = true;
}
#endif

// The closest hit nearer than max_distance, its primitive NO_PRIMITIVE where there is none; if `any` will do, some hit.
// The primitive `skipped` is passed over: a light does not occlude itself.
Hit scene_intersect(Ray ray, float max_distance, int skipped, bool any) {
    Hit hit;
    hit.distance = max_distance;
    hit.primitive = NO_PRIMITIVE;
    FOR_EACH_SPHERE(INTERSECT_SPHERE)
    FOR_EACH_PLANE(INTERSECT_PLANE)
    FOR_EACH_RECTANGLE(INTERSECT_RECTANGLE)
    FOR_EACH_TRIANGLE(INTERSECT_TRIANGLE)
#if HAS_MESHES
    hit_meshes(hit, ray, skipped, any);
#endif
    return hit;
}
