# SPDX-License-Identifier: MIT
"""Errors in shapes, and in the records of the scene."""

from mutations.checks import FURNACE_WITHOUT_NOISE, MIRROR, choice, points_on_area
from mutations.mutation import Check, Mutation
from shaders import test_intersect, test_mesh, test_mesh_light, test_shapes, test_texture


def closest_hit(storage: str, culled: bool = False) -> Check:
    return Check(test_intersect.test_closest_hit, storage=storage, scale=1.0, culled=culled)


MESH_SURFACE = Check(test_mesh.test_surface, most_repeated=10**6)
TRAVERSAL = Check(test_intersect.test_traversal_finds_what_trying_every_shape_finds, scale=1.0, count=30, culled=False)

MUTATIONS = [
    Mutation(
        "one triangle in ten thousand missed",
        "shape/bvh.glsl",
        "if (distance < hit.distance && record != ignored",
        "if (distance < hit.distance && record % 10007 != 5003 && record != ignored",
        Check(test_mesh.test_no_triangle_is_missed, part=test_mesh.KNOT, placements=test_mesh.CROWD[:1]),
    ),
    Mutation(
        "interpolated normal not made unit",
        "shape/surface.glsl",
        "return size > 1e-6 ? v / size :",
        "return size > 1e-6 ? v :",
        MESH_SURFACE,
    ),
    Mutation(
        "rays leave from the wrong side",
        "shape/ray.glsl",
        "return position + normal",
        "return position - normal",
        FURNACE_WITHOUT_NOISE,
    ),
    Mutation(
        "direction of a ray through a small instance taken for its opposite",
        "shape/bvh.glsl",
        "lessThan(ray.inverse, vec3(0.0))",
        "lessThan(ray.inverse, vec3(0.01))",
        Check(test_mesh.test_no_triangle_is_missed, part=test_mesh.BALL, placements=test_mesh.CROWD),
    ),
    Mutation(
        "disk sampled as the square around it",
        "shape/flat.glsl",
        "kind == KIND_DISK ? square_to_disk(u)",
        "kind == KIND_DISK ? 2.0 * u - 1.0",
        points_on_area("disk"),
    ),
    Mutation(
        "disk met as a square",
        "shape/flat.glsl",
        "dot(uv, uv) - 1.0",
        "max(abs(uv.x), abs(uv.y)) - 1.0",
        Check(test_shapes.test_flat_shape, kind="disk", way="bvh"),
    ),
    Mutation(
        "front of a sphere inverted",
        "shape/sphere.glsl",
        "is_front = near > 0.0",
        "is_front = near <= 0.0",
        Check(test_shapes.test_sphere, name="outside"),
    ),
    Mutation(
        "culling of listed spheres inverted",
        "shape/shape.glsl",
        "if (is_front || (sphere.kind & SHAPE_CULLED)",
        "if (!is_front || (sphere.kind & SHAPE_CULLED)",
        closest_hit("listed", culled=True),
    ),
    Mutation(
        "culling in the BVH inverted",
        "shape/bvh.glsl",
        "(is_front || (flags & SHAPE_CULLED) == 0u)",
        "(!is_front || (flags & SHAPE_CULLED) == 0u)",
        closest_hit("bvh", culled=True),
    ),
    Mutation(
        "inside of a sphere not met",
        "shape/sphere.glsl",
        "is_front ? near : far",
        "near",
        Check(test_shapes.test_sphere, name="inside"),
    ),
    Mutation(
        "BVH ignores rectangles",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind > KIND_RECTANGLE",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores disks",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || kind == KIND_RECTANGLE || kind > KIND_DISK",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores triangles of no mesh",
        "shape/shape.glsl",
        "kind == KIND_TRIANGLE || kind >= KIND_RECTANGLE",
        "kind == KIND_TRIANGLE || (kind >= KIND_RECTANGLE && kind != KIND_SINGLE_TRIANGLE)",
        closest_hit("bvh"),
    ),
    Mutation(
        "BVH ignores spheres",
        "shape/shape.glsl",
        "BVH_SPHERES) != 0 && kind == KIND_SPHERE",
        "BVH_SPHERES) != 0 && kind == KIND_PLANE",
        closest_hit("bvh"),
    ),
    Mutation(
        "fourth child ignored",
        "shape/bvh.glsl",
        "near.w <= far.w && node.count > 3u",
        "false",
        closest_hit("bvh, many"),
    ),
    Mutation(
        "shadow rays stop at the short list",
        "shape/bvh.glsl",
        "(any && hit.primitive != NO_PRIMITIVE)) return;",
        "any) return;",
        TRAVERSAL,
    ),
    Mutation(
        "flat shape in the BVH taken for a triangle",
        "shape/shape.glsl",
        "if ((u_bvh_shapes & BVH_FLATS) != 0 && kind != KIND_TRIANGLE) inside",
        "if ((u_bvh_shapes & BVH_FLATS) == 0 && kind != KIND_TRIANGLE) inside",
        closest_hit("bvh"),
    ),
    Mutation("light does not ignore itself", "shape/bvh.glsl", " && record != ignored", "", closest_hit("bvh")),
    Mutation(
        "rows of the guide table swapped",
        "scene/light.glsl",
        "int(t1.x), int(t1.y)",
        "int(t1.y), int(t1.x)",
        choice(1000),
    ),
    Mutation(
        "reflectance at grazing incidence read from its neighbour",
        "scene/material.glsl",
        "uintBitsToFloat(t2.xyz), int(t2.w), uintBitsToFloat(t3.xyz), int(t3.w));",
        "uintBitsToFloat(t1.xyz), int(t2.w), uintBitsToFloat(t3.xyz), int(t3.w));",
        MIRROR,
    ),
    Mutation(
        "sides of boxes swapped",
        "scene/shape.glsl",
        "t1.xy, t1.zw, t2.xy",
        "t1.zw, t1.xy, t2.xy",
        closest_hit("bvh, many"),
    ),
    Mutation(
        "second row of the records not found",
        "scene/storage.glsl",
        "(record & 1023) << 2 | texel, record >> 10",
        "(record & 1023) << 2 | texel, record >> 11",
        Check(test_mesh_light.test_triangles_are_drawn_by_density, count=5000, probability=1.0),
    ),
    Mutation(
        "place in the atlas turned about",
        "scene/texture.glsl",
        "int(t1.w), int(t2.x), int(t2.y)",
        "int(t1.w), int(t2.y), int(t2.x)",
        Check(test_texture.test_lookup, kind="srgb", filtering="nearest"),
    ),
    Mutation(
        "attributes of two vertices swapped",
        "scene/vertex.glsl",
        "b.x * vertex_texel(index.x) + b.y * vertex_texel(index.y)",
        "b.y * vertex_texel(index.x) + b.x * vertex_texel(index.y)",
        MESH_SURFACE,
    ),
    Mutation(
        "normal of a copy taken along as a point",
        "shape/instance.glsl",
        "return mat3(instance.row_x, instance.row_y, instance.row_z);",
        "return instance_matrix(instance);",
        Check(test_mesh.test_surface, most_repeated=0),
    ),
    Mutation(
        "the primitive that a ray leaves not ignored",
        "shape/intersect.glsl",
        "shape_list_intersect(hit, ray, ignored)",
        "shape_list_intersect(hit, ray, NO_PRIMITIVE)",
        closest_hit("listed"),
    ),
    Mutation(
        "plane on the other side of the origin",
        "shape/plane.glsl",
        "offset - dot(normal, ray.origin)",
        "offset + dot(normal, ray.origin)",
        Check(test_shapes.test_plane),
    ),
    Mutation(
        "triangles behind the ray met",
        "shape/triangle.glsl",
        "has_area && distance > 0.0",
        "has_area",
        closest_hit("bvh"),
    ),
]
