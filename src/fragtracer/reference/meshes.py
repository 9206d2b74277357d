# SPDX-License-Identifier: MIT
"""Writes meshes in world space as PLY files, one for each part of each instance; Mitsuba's instancing is not used.

Positions are float32, about the origin of the world. The triangles of a mirrored instance are
wound the other way, so that their fronts stay outside.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.reference.shapes import Columns, Tree, write_ply
from fragtracer.reference.textures import opacity_at
from fragtracer.scene import Geometry, Material
from fragtracer.scene.tangents import with_tangents

_FORWARD = 1e-5  # of the largest coordinate
VERTEX_COLORS = ("vertex_color", "vertex_blended")  # what Mitsuba's own materials look up: of a material, of its blend


@dataclass(frozen=True)
class MeshAttributes:
    """The vertex attributes that a material and its blend read; which set of texture coordinates is Mitsuba's ``uv``:
    that of its emission, which Mitsuba's own emitter looks up; and whether its textures are left out, since the shape
    has no texture coordinates."""

    shading: bool = False
    tangent: bool = False
    color: bool = False
    alpha: bool = False
    uv: int = 0
    bare: bool = False

    @classmethod
    def of(cls, geometry: Geometry, blended: Sequence[Material]) -> "MeshAttributes":
        """Those of ``geometry`` that the first of ``blended`` reads, and that which it is blended with."""
        material = blended[0]
        alpha = geometry.colors is not None and geometry.colors.shape[1] == 4 and material.alpha_mode != "opaque"
        texture = material.emission_texture or material.albedo_texture if material.is_emissive else None
        return cls(
            geometry.normals is not None,
            any(part.normal_maps for part in blended) and geometry.tangents is not None,
            geometry.colors is not None,
            alpha,
            texture.coordinates if texture else 0,
        )

    @property
    def key(self) -> str:
        """A name for them, empty where there are none."""
        letters = "".join(n[0] for n in ("shading", "tangent", "color", "alpha", "bare") if getattr(self, n))
        return letters + ("1" if self.uv else "")

    def set_of(self, coordinates: int) -> str:
        """The mesh attribute that holds one of the two sets of texture coordinates."""
        return "uv" if coordinates == self.uv else "vertex_other"


def with_needed_tangents(geometry: Geometry, blended: Sequence[Material]) -> Geometry:
    """The geometry with the tangents that normal maps need, those of the first of ``blended``."""
    maps = [texture for part in blended for texture in part.normal_maps]
    return with_tangents(geometry, maps[0].coordinates) if maps else geometry


def with_needed_coordinates(geometry: Geometry, blended: Sequence[Material]) -> Geometry:
    """The geometry with texture coordinates of 0, as ours has them, where textures look for some and there are none:
    Mitsuba would take the barycentric ones."""
    needed = {texture.coordinates for material in blended for texture in material.textures.values()}
    sets = [geometry.uvs, geometry.uvs_1]
    if all(sets[i] is not None for i in needed):
        return geometry
    none = np.zeros((len(geometry.positions), 2))
    uvs, uvs_1 = (none if i in needed and values is None else values for i, values in enumerate(sets))
    attributes = (geometry.normals, uvs, uvs_1, geometry.tangents, geometry.colors)
    return Geometry(geometry.positions, geometry.triangles, *attributes)


def world_mesh(
    path: Path,
    geometry: Geometry,
    matrix: NDArray[np.float64],
    attributes: MeshAttributes,
    factors: Sequence[Material] = (),
    forward: bool = False,
) -> Tree:
    """The triangles of ``geometry``, transformed by ``matrix`` (4, 4) to world space, as a PLY file and its shape.

    Parameters
    ----------
    factors
        The material and its blend, if they are Mitsuba's own: it interpolates the vertex normals, and the colours of
        vertices are multiplied by the albedo of each, their alpha by the opacity. Without, it has face normals, and the
        vertex normals are an attribute for our own plugin.
    forward
        Moves the surface towards its front, by less than the offset of a spawned ray. Of two coincident surfaces
        whose back faces are culled and that face opposite ways, a ray then meets the front face first.
    """
    smooth = bool(factors)
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    positions = geometry.positions @ matrix[:3, :3].T + matrix[:3, 3]
    if forward:
        positions = positions + _FORWARD * np.abs(positions).max() * _fronts(positions, geometry.triangles, mirrored)
    columns: Columns = dict(zip("xyz", positions.T, strict=True))
    if geometry.normals is not None:
        # The inverse transposed, but for its length; there is none for a node that is flat.
        cofactors = np.cross(matrix[[1, 2, 0], :3], matrix[[2, 0, 1], :3]) * (-1 if mirrored else 1)
        normals = _unit(geometry.normals.astype(np.float64) @ cofactors.T)
        columns |= dict(zip(("nx", "ny", "nz") if smooth else _names("shading"), normals.T, strict=True))
    sets = [geometry.uvs, geometry.uvs_1]
    main, other = sets[attributes.uv], sets[1 - attributes.uv]
    if main is not None:
        columns |= {"u": main[:, 0], "v": main[:, 1]}
    if other is not None and not smooth:
        columns |= dict(zip(_names("other"), [*other.T, np.zeros(len(other))], strict=True))
    if attributes.tangent and geometry.tangents is not None and not smooth:
        tangents = geometry.tangents.astype(np.float64)
        columns |= dict(zip(_names("tangent"), _unit(tangents[:, :3] @ matrix[:3, :3].T).T, strict=True))
        columns["handed_x"] = -tangents[:, 3] if mirrored else tangents[:, 3]
    if geometry.colors is not None:
        colors = [np.clip(geometry.colors[:, :3] * part.base_color, 0, 1) for part in factors]
        for names, color in zip(("rgb", _names("blended")), colors or [geometry.colors[:, :3]], strict=False):
            columns |= dict(zip(names, color.T, strict=True))
        if attributes.alpha:
            alpha = geometry.colors[:, 3]
            columns["alpha_x"] = opacity_at(factors[0], alpha) if factors else alpha
    write_ply(path, columns, geometry.triangles[:, ::-1] if mirrored else geometry.triangles)
    return {"type": "ply", "filename": str(path), "face_normals": not (smooth and geometry.normals is not None)}


def _fronts(positions: NDArray[np.float64], triangles: NDArray[np.int32], mirrored: bool) -> NDArray[np.float64]:
    """Unit vertex normals, the means of those of the adjacent triangles."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    sums = np.zeros_like(positions)
    np.add.at(sums, triangles, np.cross(b - a, c - a)[:, None] * (-1 if mirrored else 1))
    return _unit(sums)


def _names(attribute: str) -> tuple[str, str, str]:
    return (f"{attribute}_x", f"{attribute}_y", f"{attribute}_z")


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    units: NDArray[np.float64] = vectors / np.where(lengths > 0, lengths, 1.0)
    return units
