# SPDX-License-Identifier: MIT
"""Probes over a packed scene, and a scene with everything in it."""

from collections.abc import Mapping

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from fragtracer.gpu.meshes import mesh_textures
from fragtracer.gpu.probe import probe
from fragtracer.gpu.tables import folded_texture
from fragtracer.packing import PackedScene
from fragtracer.scene import Camera, Light, Material, Plane, Rectangle, Scene, Sphere, Triangle
from fragtracer.shader_composer import CONSTANTS

from . import Floats


def scene_probe(
    ctx: moderngl.Context,
    packed: PackedScene,
    includes: list[str],
    body: str,
    inputs: Mapping[str, ArrayLike],
    outputs: Mapping[str, int],
) -> dict[str, Floats]:
    """A probe with ``packed`` at hand, from a uniform block or a texture as it wants; results in float64."""
    resource: moderngl.Buffer | moderngl.Texture
    resources: dict[str, moderngl.Buffer | moderngl.Texture]
    if packed.defines["SCENE_IN_UNIFORMS"]:
        name, resource = "SceneBlock", ctx.buffer(packed.texels.tobytes())
    else:
        name, resource = "u_scene", folded_texture(ctx, packed.texels)
    resources = {name: resource}
    if packed.environment is not None:
        resources["u_environment"] = folded_texture(ctx, packed.environment.texels)
        resources["u_environment_tree"] = folded_texture(ctx, packed.environment.tree)
    if packed.meshes is not None:
        resources |= mesh_textures(ctx, packed.meshes)
    uniforms = {key: value for key, value in packed.uniforms.items() if key.startswith("u_environment")}
    generated = {"generated/scene_layout.glsl": packed.layout}
    try:
        result = probe(ctx, includes, body, inputs, outputs, packed.defines, generated, uniforms, resources)
    finally:
        for used in resources.values():
            used.release()
    return {key: values.astype(np.float64) for key, values in result.items()}


def triangles_of(packed: PackedScene) -> tuple[Floats, Floats]:
    """The records that are triangles, and their vertices (n, 3, 3)."""
    assert packed.meshes
    tree = packed.meshes.tree
    place = np.flatnonzero(tree[:, 0, 3] >> 24 == CONSTANTS["MESH_TRIANGLE"])
    return place, tree.view(np.float32)[place, :3, :3].astype(np.float64)


def camera_on(scale: float, shift: float) -> Camera:
    """One that does not make the scene larger, as it would if it stayed at its default place."""
    return Camera((shift, shift, shift + 2 * scale), (shift, shift, shift))


def random_scene(seed: int = 1, triangles: int = 12, scale: float = 1.0, shift: float = 0.0) -> Scene:
    """Shapes and lights of all kinds, crossing each other, in a ball of about ``scale`` metres that lies
    ``shift`` metres off the origin."""
    rng = np.random.default_rng(seed)

    def points(count: int) -> Floats:
        return scale * rng.normal(size=(count, 3)) + shift

    names = [f"material {i}" for i in range(10)]
    materials = {
        name: Material(
            albedo=tuple(rng.random(3).tolist()),
            roughness=float(rng.random()),
            metallic=float(rng.integers(0, 2)),
            emission=tuple(rng.random(3).tolist()) if i >= 7 else 0.0,
        )
        for i, name in enumerate(names)
    }

    def rectangle() -> Rectangle:
        u, v, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0] * scale * rng.uniform(0.3, 2, (3, 1))
        return Rectangle(points(1)[0], u, v, str(rng.choice(names)))

    return Scene(
        camera=camera_on(scale, shift),
        materials=materials,
        spheres=tuple(Sphere(p, float(scale * rng.uniform(0.1, 0.7)), str(rng.choice(names))) for p in points(5)),
        planes=tuple(Plane(p, n, str(rng.choice(names[:7]))) for p, n in zip(3 * points(2), points(2), strict=True)),
        rectangles=tuple(rectangle() for _ in range(5)),
        triangles=tuple(Triangle(tuple(points(3)), str(rng.choice(names))) for _ in range(triangles)),
        lights=(
            Light(points(1)[0], radius=0.2 * scale, power=(3.0, 2.0, 1.0)),
            Light(points(1)[0], power=(1.0, 2.0, 3.0)),
            Light(points(1)[0], radius=0.05 * scale, radiance=(5.0, 5.0, 5.0)),
        ),
    )
