# SPDX-License-Identifier: MIT
"""The shapes in which light that is traced from the lights is seen, for shaders/integrator/mirrored.glsl."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.materials import ALPHA_DELTA
from fragtracer.packing.shapes import Shape
from fragtracer.scene import Material, Plane, Scene, Sphere

MOST_MIRRORS = 4  # the components of an ivec4
NARROW_WIDEST = 0.3  # of integrator/vertex.glsl


def mirror_uniforms(
    planes: Sequence[Plane],
    shapes: Sequence[Shape],
    materials: Mapping[str, Material],
    primitives: NDArray[np.int64],
) -> dict[str, Any]:
    """The records of the largest mirrors; planes have the records from 0 on, ``shapes`` the records ``primitives``, or
    -1 where they are none."""
    records = [*enumerate(planes), *zip(primitives.tolist(), shapes, strict=True)]
    found = [
        (_area(shape), record, shape)
        for record, shape in records
        if record >= 0 and _is_mirror(materials[shape.material])
    ]
    largest = sorted(found, key=lambda mirror: -mirror[0])[:MOST_MIRRORS]
    none = MOST_MIRRORS - len(largest)
    widths = [materials[shape.material].alpha for _, _, shape in largest]
    return {
        "u_mirror_count": len(largest),
        "u_mirrors": (*(record for _, record, _ in largest), *[-1] * none),
        "u_mirror_widths": (*(0.0 if width < ALPHA_DELTA else width for width in widths), *[0.0] * none),
    }


def camera_is_in_mirror(scene: Scene) -> bool:
    """Whether the lens of the camera, or a part of it, is inside of a sphere that is a mirror."""
    camera = scene.camera
    return any(
        math.dist(sphere.center, camera.position) < sphere.radius + camera.aperture_radius for sphere in _spheres(scene)
    )


def _spheres(scene: Scene) -> Iterator[Sphere]:
    return (sphere for sphere in scene.spheres if _is_mirror(scene.materials[sphere.material]))


def _is_mirror(material: Material) -> bool:
    """Whether all of a surface reflects narrowly and alike, besides what else it does, and lets nothing pass."""
    is_smooth = material.alpha <= NARROW_WIDEST and material.roughness_texture is None and material.anisotropy == 0
    is_alike = material.blend is None and material.normal_texture is None and material.alpha_mode == "opaque"
    layers = material.is_coated or material.has_sheen or material.has_iridescence
    is_bare = not (material.unlit or material.is_dielectric or layers)
    reflects = is_bare and not material.is_translucent and max(material.specular_f0) > 0
    return is_smooth and is_alike and reflects


def _area(shape: Shape | Plane) -> float:
    if isinstance(shape, Plane):
        return math.inf
    return 4 * math.pi * shape.radius**2 if isinstance(shape, Sphere) else shape.area
