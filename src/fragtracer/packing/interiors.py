# SPDX-License-Identifier: MIT
"""What a path is inside of, as shaders/integrator/interior.glsl counts it."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from fragtracer.scene import Geometry, Material, Scene
from fragtracer.scene.content import kept_by_digest
from fragtracer.scene.interiors import fillings, has_interiors, has_media, solids

_KIND_OF = {"dielectric": "dielectric", "null": "boundary"}
MOST_INTERIORS = 4  # of a path at once: the components of an ivec4


def dielectrics(materials: Mapping[str, Material]) -> dict[str, int]:
    """The records of dielectrics by the name of the material, in the order of their priorities; of two with the same,
    that which is written later has the higher number."""
    names = [name for name, material in materials.items() if material.is_dielectric]
    return {name: i for i, name in enumerate(sorted(names, key=lambda name: materials[name].priority))}


def interior_flags(scene: Scene) -> dict[str, int]:
    """The uniforms that say whether paths have to know what they are in, and of what colour. Warns of meshes that are
    not closed."""
    inside = fillings(scene)
    for mesh in scene.meshes:
        for part in mesh.parts:
            name = inside.get(mesh.material_of(part))
            if name is not None and not is_closed(part.geometry):
                warnings.warn(
                    f"mesh {mesh.name!r} of the {_KIND_OF[scene.materials[name].model]} {name!r} is not closed: where "
                    "a ray gets in by a gap, it is taken to be outside",
                    stacklevel=2,
                )
    found = list(solids(scene))
    disperses = any(scene.materials[solid.material].dispersion > 0 for solid in found)
    return {
        "u_has_interiors": int(disperses or has_interiors(dict(scene.materials), found) or has_media(scene)),
        "u_has_null": int(any(scene.materials[solid.material].model == "null" for solid in found)),
        "u_has_dispersion": int(disperses),
    }


def camera_interiors(scene: Scene) -> dict[str, Any]:
    """The uniform with the dielectrics that the camera is in, each by the number of its record and 1."""
    number = dielectrics(scene.materials)
    inside = [number[solid.material] + 1 for solid in solids(scene) if solid.contains(scene.camera.position)]
    inside = sorted(inside, reverse=True)[:MOST_INTERIORS]
    return {"u_camera_interiors": (*inside, *[0] * (MOST_INTERIORS - len(inside)))}


@kept_by_digest(64)
def is_closed(geometry: Geometry) -> bool:
    """Whether each edge of a triangle is one of another too, the other way round; vertices of one place are one."""
    rows = (geometry.positions + 0.0).view(np.dtype((np.void, 3 * geometry.positions.itemsize)))  # -0 is 0
    _, place = np.unique(rows, return_inverse=True)
    corners = place.reshape(-1)[geometry.triangles]
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    is_edge = starts != ends
    there, back = (np.sort((a * len(rows) + b)[is_edge]) for a, b in ((starts, ends), (ends, starts)))
    return np.array_equal(there, back)
