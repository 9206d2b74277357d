# SPDX-License-Identifier: MIT
"""Scenes for the tests of the viewer."""

import numpy as np

from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Placement,
    Scene,
    Sphere,
    SpotLight,
    Texture,
)
from fragtracer.scene import Part as MeshPart


def tetrahedra() -> Scene:
    """Two instances of a tetrahedron, one turned and stretched, behind a small sphere."""
    corners = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)])
    geometry = Geometry(corners, [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    instances = (Placement((-3.0, 0.0, 0.0)), Placement((3.0, 0.5, -1.0), (10.0, 40.0, 70.0), (0.5, 1.5, 1.0)))
    mesh = Mesh((MeshPart(geometry, "a"),), instances, name="two of them")
    texture = Texture(Image(np.zeros((2, 3, 3), np.uint8), file="wood.png"))
    materials = {"a": Material(albedo_texture=texture), "b": Material()}
    camera = Camera((0.0, 0.5, 9.0), (0.0, 0.0, 0.0))
    return Scene(camera, materials, spheres=(Sphere((3.0, 0.5, 3.0), 0.01, "b"),), meshes=(mesh,))


def stage() -> Scene:
    """A disk that faces the camera, under a point light, a spot light and a directional light."""
    return Scene(
        Camera((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), fov_degrees=40.0),
        {"a": Material()},
        disks=(Disk((1.0, 0.0, 0.0), (1.0, 0.0, 2.0), 1.0, "a"),),
        lights=(Light((-2.0, 1.0, 0.0), power=10.0),),
        spot_lights=(SpotLight((2.0, 2.0, 1.0), (-1.0, -2.0, -1.0), (3.0, 2.0, 1.0), 10.0, 30.0),),
        directional_lights=(DirectionalLight((0.0, -2.0, 0.0), (1.0, 2.0, 4.0)),),
    )
