// SPDX-License-Identifier: MIT
// The one traversal, for closest hits and for occlusion. Primitives are numbered spheres first, then
// planes, rectangles and triangles.

struct Hit { float distance; int primitive; };

const int FIRST_SPHERE = 0;
const int FIRST_PLANE = FIRST_SPHERE + SPHERE_COUNT;
const int FIRST_RECTANGLE = FIRST_PLANE + PLANE_COUNT;
const int FIRST_TRIANGLE = FIRST_RECTANGLE + RECTANGLE_COUNT;
const int NO_PRIMITIVE = -1;

void hit_update(inout Hit hit, float distance, int primitive, int skipped) {
    if (distance < hit.distance && primitive != skipped) hit = Hit(distance, primitive);
}

#define INTERSECT_SPHERE(i) { Sphere s = sphere_load(i); hit_update(hit, sphere_intersect(s.center, s.radius, ray), FIRST_SPHERE + i, skipped); }
#define INTERSECT_PLANE(i) { Plane p = plane_load(i); hit_update(hit, plane_intersect(p.normal, p.offset, ray), FIRST_PLANE + i, skipped); }
#define INTERSECT_RECTANGLE(i) { Rectangle r = rectangle_load(i); hit_update(hit, rectangle_intersect(r.plane, r.u_row, r.v_row, ray), FIRST_RECTANGLE + i, skipped); }
#define INTERSECT_TRIANGLE(i) { Triangle t = triangle_load(i); hit_update(hit, triangle_intersect(t.plane, t.u_row, t.v_row, ray), FIRST_TRIANGLE + i, skipped); }

// The closest hit nearer than max_distance, its primitive NO_PRIMITIVE where there is none. The
// primitive `skipped` is passed over: a light does not occlude itself.
Hit scene_intersect(Ray ray, float max_distance, int skipped) {
    Hit hit = Hit(max_distance, NO_PRIMITIVE);
    FOR_EACH_SPHERE(INTERSECT_SPHERE)
    FOR_EACH_PLANE(INTERSECT_PLANE)
    FOR_EACH_RECTANGLE(INTERSECT_RECTANGLE)
    FOR_EACH_TRIANGLE(INTERSECT_TRIANGLE)
    return hit;
}
