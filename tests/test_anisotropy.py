# SPDX-License-Identifier: MIT
"""Along which direction facets are wider: on flat shapes, spheres and meshes, by light from one direction."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rendering import rendered
from scene_builders import stare
from shaders.bsdf_models.conductor import Conductor, conductor_eval

from fragtracer.scene import (
    DirectionalLight,
    Geometry,
    Image,
    Material,
    Mesh,
    Part,
    Placement,
    Rectangle,
    Scene,
    Sphere,
    Texture,
)

GOLD = Material(model="conductor", metal="gold", roughness=0.5, anisotropy=0.7, anisotropy_rotation_degrees=25.0)
LIGHT, EYE = np.array((0.2, 0.9, 0.3)), np.array((0.6, 0.4, 1.5))  # from the origin
QUAD = np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)])
UVS = np.array(
    [(0.0, 0.0), (1.0, 0.5), (0.5, 1.5), (-0.5, 1.0)]
)  # u grows along (2, -1, 0) / √5 and v upwards: mirrored


def unit(v: Any) -> Any:
    return np.asarray(v) / np.linalg.norm(v)


def expected(normal: Any, tangent: Any, turned: float, strength: float = GOLD.anisotropy) -> Any:
    """Radiance towards the eye, of facets wider along `tangent` turned by an angle about `normal`."""
    n, t = unit(normal), unit(np.asarray(tangent) - np.dot(tangent, unit(normal)) * unit(normal))
    along = np.cos(turned) * t + np.sin(turned) * np.cross(n, t)
    frame = np.stack([along, np.cross(n, along), n])
    parameters = Conductor(*GOLD.complex_index, GOLD.alpha, strength)
    return conductor_eval(parameters, frame @ unit(EYE), frame @ unit(LIGHT))


TURN = np.radians(25.0)
BRUSHED = np.array([[[0.5 + 0.4 * np.cos(0.9), 0.5 + 0.4 * np.sin(0.9), 0.75]]], np.float32)  # turned by 0.9 rad
SHAPES: dict[str, tuple[dict[str, Any], Any]] = {
    "wall": (
        {"rectangles": [Rectangle((-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "gold")]},
        expected((0, 0, 1), (1, 0, 0), TURN),
    ),
    "floor": (
        {"rectangles": [Rectangle((-1.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, -2.0), "gold")]},
        expected((0, 1, 0), (1, 0, 0), TURN),
    ),
    "sphere": (
        {"spheres": [Sphere(tuple(-1e3 * unit((0.6, 0.3, 1.0))), 1e3, "gold")]},
        expected((0.6, 0.3, 1.0), (1.0, 0.0, -0.6), TURN),
    ),
    "mesh": (
        {"meshes": [Mesh((Part(Geometry(QUAD, [(0, 1, 2), (0, 2, 3)], uvs=UVS), "gold"),))]},
        expected((0, 0, 1), (2, -1, 0), -TURN),
    ),
    "turned mesh": (
        {
            "meshes": [
                Mesh(
                    (Part(Geometry(QUAD, [(0, 1, 2), (0, 2, 3)], uvs=UVS), "gold"),),
                    (Placement(rotation_degrees=(0.0, 0.0, 40.0)),),
                )
            ]
        },
        expected(
            (0, 0, 1),
            (
                2 * np.cos(np.radians(40)) + np.sin(np.radians(40)),
                2 * np.sin(np.radians(40)) - np.cos(np.radians(40)),
                0,
            ),
            -TURN,
        ),
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_facets_are_wider_along_the_tangent(ctx, name):
    shapes, radiance = SHAPES[name]
    scene = Scene(
        stare((0.0, 0.0, 0.0), tuple(EYE)),
        {"gold": GOLD},
        directional_lights=[DirectionalLight(tuple(-LIGHT), (1.0, 1.0, 1.0))],
        **shapes,
    )
    image = rendered(ctx, scene, 1, bounces=1, shared=True)
    np.testing.assert_allclose(image, np.broadcast_to(radiance, image.shape), rtol=2e-3)
    plain = replace(GOLD, anisotropy_rotation_degrees=115.0)
    other = rendered(ctx, replace(scene, materials={"gold": plain}), 1, bounces=1, shared=True)
    assert abs(other.mean() / image.mean() - 1) > 0.02


def test_a_texture_turns_facets_and_makes_them_less_wide(ctx):
    """From the tangent of its coordinates, before the angle of the material does."""
    shapes, _ = SHAPES["mesh"]
    texture = Texture(Image(BRUSHED, "linear"))
    image = rendered(
        ctx,
        Scene(
            stare((0.0, 0.0, 0.0), tuple(EYE)),
            {"gold": replace(GOLD, anisotropy_texture=texture)},
            directional_lights=[DirectionalLight(tuple(-LIGHT), (1.0, 1.0, 1.0))],
            **shapes,
        ),
        1,
        bounces=1,
    )
    radiance = expected((0, 0, 1), (2, -1, 0), -TURN - 0.9, 0.75 * GOLD.anisotropy)
    np.testing.assert_allclose(image, np.broadcast_to(radiance, image.shape), rtol=2e-3)
    for other in (expected((0, 0, 1), (2, -1, 0), -TURN - 0.9), expected((0, 0, 1), (2, -1, 0), -TURN + 0.9, 0.525)):
        assert np.abs(other / radiance - 1).max() > 0.02
