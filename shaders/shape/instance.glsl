// SPDX-License-Identifier: MIT
// A mesh that is there more than once: between its space and the scene's.
#include "scene/shape.glsl"

#ifndef HAS_INSTANCES
#define HAS_INSTANCES 0
#endif

#if HAS_INSTANCES
// A direction, or a point relative to the instance's translation, in the space of its mesh.
vec3 instance_to_local(Instance instance, vec3 v) {
    return vec3(dot(instance.row_x, v), dot(instance.row_y, v), dot(instance.row_z, v));
}

// From the space of the mesh to the scene, but for the translation.
mat3 instance_matrix(Instance instance) {
    return inverse(transpose(mat3(instance.row_x, instance.row_y, instance.row_z)));
}

// Of normals, whose lengths it changes; their front stays the front even through a mirror.
mat3 instance_normal_matrix(Instance instance) { return mat3(instance.row_x, instance.row_y, instance.row_z); }
#endif
