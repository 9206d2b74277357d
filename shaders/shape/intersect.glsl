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
    // What is left to do: records that lie side by side, from `first` on, in the order of their slots in `rest`.
    uint first = 0u, rest = 4u;
    uint last = 1u;          // the group to go on with after this one, 1 if there is none
    uint stack[MESH_STACK];  // those below it
    int top = 0;
#if HAS_INSTANCES
    int instance = -1;
    int instance_top = 0;   // entries of the stack that do not belong to the instance
    uint instance_kind = 0u;
#endif
    do {
        int record = int(first + (rest & 3u));
        rest >>= 2u;
        uvec4 t0 = mesh_texel(record, 0);
        uvec4 t1 = mesh_texel(record, 1);
        uvec4 t2 = mesh_texel(record, 2);
        uint kind = t0.w >> 24u;
        uint below = 1u;
        uint below_first = 0u;
        if (kind == uint(MESH_NODE)) {
            MeshNode node = mesh_node_of(t0, t1, t2);
            below = mesh_node_intersect(node, local, hit.distance);
            below_first = node.first;
        }
#if HAS_INSTANCES
        if (kind == uint(MESH_INSTANCE)) {
            MeshInstance space = mesh_instance_of(t0, t1, t2, mesh_texel(record, 3));
            instance = record;
            instance_top = top + int(rest > 1u);
            instance_kind = space.kind;
            local = mesh_ray(mesh_to_instance(space, ray.origin - space.translation), mesh_to_instance(space, ray.direction));
            below = 4u;
            below_first = space.root;
        }
#endif
        if (kind == uint(MESH_TRIANGLE)) {
            MeshTriangle triangle = mesh_triangle_of(t0, t1, t2, uvec4(0u));
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
                if (any) {
                    last = 1u;
                    rest = 1u;
                }
            }
        }
        stack[top] = last;
        if (below > 1u) {
            if (rest > 1u) {
                last = first << 7u | rest;
                top++;
            }
            first = below_first;
            rest = below;
        }
        if (rest == 1u) {
            first = last >> 7u;
            rest = last & 127u;
            top = max(top - 1, 0);
            last = stack[top];
#if HAS_INSTANCES
            if (instance >= 0 && top < instance_top) {
                instance = -1;
                local = mesh_ray(ray.origin, ray.direction);
            }
#endif
        }
    } while (rest > 1u);
    if (rest > 1u) scene_is_cut_short = true;
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
