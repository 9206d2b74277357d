# SPDX-License-Identifier: MIT
"""Double-sided surfaces that shine (glTF 2.0, section 3.9.6): they do so to both sides, our emission from the front."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fragtracer.scene import Geometry, Material, Part


def shining_from_both(
    parts: Sequence[Part], materials: Mapping[str, Material]
) -> tuple[list[Part], dict[str, Material]]:
    """``parts`` and ``materials``, with a part for either side of what is double-sided and shines.

    Neither is there for rays from behind, so that the two do not hide each other.
    """
    both = {name for name, material in materials.items() if material.is_emissive and material.double_sided}
    backs: dict[Geometry, Geometry] = {}
    found = []
    for part in parts:
        found.append(part)
        if part.material in both:
            if part.geometry not in backs:
                backs[part.geometry] = _turned(part.geometry)
            found.append(Part(backs[part.geometry], part.material, part.matrix))
    return found, {name: replace(m, double_sided=False) if name in both else m for name, m in materials.items()}


def _turned(geometry: Geometry) -> Geometry:
    """The same surface with its front behind, and the normals of the back: those of the front, reversed."""
    return Geometry(
        geometry.positions,
        geometry.triangles[:, ::-1],
        None if geometry.normals is None else -geometry.normals,
        geometry.uvs,
        geometry.uvs_1,
        None if geometry.tangents is None else -geometry.tangents,  # so that those of a normal map are reversed too
        geometry.colors,
    )
