# SPDX-License-Identifier: MIT
"""What planted errors must not pass: a furnace of a mesh, interpolated normals, how emitting triangles are drawn."""

import moderngl
import numpy as np
from mesh_shapes import ball, geometry, mesh_scene, smooth, soup
from rendering import rendered
from shaders.directions import random_directions
from shaders.scene_probe import scene_probe

from fragtracer.packing import pack
from fragtracer.scene import Camera, Material


def furnace_rejects(ctx: moderngl.Context) -> bool:
    """Whether a ball that shines inwards is not as bright as it must be."""
    points, triangles = ball(16, 8)
    scene = mesh_scene(
        geometry((points, triangles[:, ::-1])),
        material=Material(albedo=0.5, specular=0.0, emission=1.0),
        camera=Camera((0.0, 0.0, 0.4), (0.0, 0.0, 0.0), fov_degrees=90.0),
    )
    image = rendered(ctx, scene, 512, bounces=4, russian_roulette=False)
    return bool(abs(image.mean() / (2 * (1 - 0.5**5)) - 1) > 0.005)


def normals_reject(ctx: moderngl.Context) -> bool:
    """Whether interpolated normals are not those of the sphere that they are taken from, of unit length."""
    scene = mesh_scene(smooth(ball(8, 4)))
    packed = pack(scene, scene.render, 8, 8)
    body = """
        Ray ray = Ray(2.0 * d - middle, -d);
        Surface s = surface_at(ray, scene_intersect(ray, INFINITE_DISTANCE, NO_PRIMITIVE, false));
        normal = s.shading_normal;"""
    direction = random_directions(np.random.default_rng(1), 1000)
    middle = np.broadcast_to(packed.origin, direction.shape)
    normal = scene_probe(
        ctx,
        packed,
        ["shape/intersect.glsl"],
        body,
        {"d": direction, "middle": middle},
        {"normal": 3},
    )["normal"]
    near = (normal * direction).sum(axis=1) > 0.9
    return bool(np.abs(np.linalg.norm(normal, axis=1) - 1).max() > 1e-5 or not near.all())


def choice_rejects(ctx: moderngl.Context) -> bool:
    """Whether triangles that shine are not drawn as their densities say: the mean of 1 / density is the area."""
    scene = mesh_scene(geometry(soup(200, size=1.0)), material=Material(emission=1.0))
    packed = pack(scene, scene.render, 8, 8)
    u = np.random.default_rng(1).random((1 << 16, 2))
    body = "inverse = 1.0 / triangle_load(mesh_light_sample(vec3(9.0), u).primitive).density;"
    inverse = scene_probe(ctx, packed, ["light/mesh.glsl"], body, {"u": u}, {"inverse": 1})["inverse"]
    points, triangles = soup(200, size=1.0)
    a, b, c = points[triangles].swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return bool(abs(inverse.mean() - area) > 5 * inverse.std() / np.sqrt(len(inverse)))
