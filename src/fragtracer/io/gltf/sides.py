# SPDX-License-Identifier: MIT
"""Double-sided emissive surfaces: in glTF 2.0 (section 3.9.6) both sides emit, in the scene model the front alone."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fragtracer.scene import Geometry, Material, Part
from fragtracer.scene.tangents import with_tangents


def split_double_sided_emitters(
    parts: Sequence[Part], materials: Mapping[str, Material]
) -> tuple[list[Part], dict[str, Material]]:
    """Replace each double-sided emissive part by two single-sided ones, which back-face culling keeps apart."""
    split = {name for name, m in materials.items() if m.is_emissive and m.double_sided and not _lets_pass(m, materials)}
    backs: dict[tuple[Geometry, int | None], Geometry] = {}
    found = []
    for part in parts:
        found.append(part)
        if part.material in split:
            key = part.geometry, materials[part.material].tangent_coordinates
            if key not in backs:
                backs[key] = _flipped(*key)
            found.append(Part(backs[key], part.material, part.matrix))
    return found, {name: replace(m, double_sided=False) if name in split else m for name, m in materials.items()}


def _lets_pass(material: Material, materials: Mapping[str, Material]) -> bool:
    """Whether light passes the surface, whose back is its other side."""
    parts = (material,) if material.blend is None else (material, materials[material.blend])
    return any(part.is_dielectric or part.is_translucent for part in parts)


def _flipped(geometry: Geometry, coordinates: int | None) -> Geometry:
    """The same surface with the orientation, the normals and the tangents reversed, which those computed later from the
    set ``coordinates`` of texture coordinates would not be."""
    if coordinates is not None:
        geometry = with_tangents(geometry, coordinates)
    return Geometry(
        geometry.positions,
        geometry.triangles[:, ::-1],
        None if geometry.normals is None else -geometry.normals,
        geometry.uvs,
        geometry.uvs_1,
        None if geometry.tangents is None else -geometry.tangents,  # reverses normal maps too
        geometry.colors,
    )
