# SPDX-License-Identifier: MIT
"""Media as records of shaders/medium/, and the voxels of their grids."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.interiors import dielectrics
from fragtracer.packing.records import ROW, Words
from fragtracer.scene import Density, Material, Medium, Scene
from fragtracer.scene.interiors import has_media, passed_by_fog
from fragtracer.scene.medium import Box

Floats = NDArray[np.float64]
_CELLS = (1, 2, 4, 8, 16)  # along the longest edge, as many as are tried
_VACUUM = Medium(extinction=(0.0, 0.0, 0.0))


@dataclass(frozen=True, eq=False)
class PackedMedia:
    """Rows of records by kind, and the texels (n, 4) of each grid."""

    rows: Mapping[str, list[dict[str, Any]]]
    voxels: Sequence[Words]

    @property
    def flags(self) -> dict[str, int]:
        return {"u_has_grids": int(bool(self.voxels))}

    def placed(self, texels: int) -> dict[str, list[dict[str, Any]]]:
        """The rows where the grids lie after so many ``texels`` of records, each from the beginning of a row."""
        first, grids = _rows(texels), []
        for row, voxels in zip(self.rows["Grid"], self.voxels, strict=True):
            grids.append({**row, "first": first * ROW})
            first += _rows(len(voxels))
        return {**self.rows, "Grid": grids}


def pack_media(scene: Scene, origin: Floats) -> PackedMedia:
    """The fog and what is inside of each dielectric, in the order of their records; nothing where there is no medium.
    Boxes are relative to ``origin``."""
    if not has_media(scene):
        return PackedMedia({"Medium": [], "Grid": []}, [])
    _warn_of_light_from_afar(scene)
    found = [scene.media[scene.fog.medium] if scene.fog else _VACUUM]
    names = list(dielectrics(scene.materials))
    found += [_inside(scene, scene.materials[name]) for name in names]
    grids = list(dict.fromkeys((m.density, m.bounds) for m in found if m.density and m.bounds))
    numbers: dict[tuple[Density | None, Box | None], int] = {grid: i for i, grid in enumerate(grids)}
    is_null = [False] + [scene.materials[name].model == "null" for name in names]
    rows: list[dict[str, Any]] = [
        {
            "extinction": medium.sigma_t,
            "g": medium.g,
            "albedo": medium.single_albedo,
            "is_null": null,
            "grid": numbers.get((medium.density, medium.bounds), -1),
        }
        for medium, null in zip(found, is_null, strict=True)
    ]
    boxes: list[dict[str, Any]] = []
    words: list[Words] = []
    for number, (density, bounds) in enumerate(grids):
        box = np.array(bounds) - origin
        extinction = max(max(row["extinction"]) for row in rows if row["grid"] == number)
        cells = grid_cells(density, box[1] - box[0], extinction)
        size = density.values.shape[::-1]
        boxes.append({"low": box[0], "inverse_size": 1 / (box[1] - box[0]), "voxels": size, "cells": cells.shape[::-1]})
        words.append(np.concatenate([_voxels(density), _cell_texels(cells)]))
    return PackedMedia({"Medium": rows, "Grid": boxes}, words)


def _inside(scene: Scene, material: Material) -> Medium:
    if material.interior is not None:
        return scene.media[material.interior]
    return Medium(extinction=material.absorption, albedo=(0.0, 0.0, 0.0))


def grid_cells(density: Density, size: Floats, extinction: float) -> NDArray[np.float32]:
    """The largest densities of the cells (z, y, x) that rays go through, of as many as cost least: a ray through the
    box, of ``size`` in m, stops at each side of a cell and at each collision with the largest density.

    The mean way through a convex body is four times its volume over its surface (Cauchy), and a section of it is met
    with the probability of twice its area over that surface (Crofton)."""
    sections = size.prod() / size
    surface = 2 * sections.sum()

    def stops(cells: NDArray[np.float32]) -> float:
        sides = ((np.array(cells.shape[::-1]) - 1) * 2 * sections / surface).sum()
        return float(sides + extinction * cells.mean() * 4 * size.prod() / surface)

    return min((largest_densities(density, most) for most in _CELLS), key=stops)


@lru_cache(maxsize=4 * len(_CELLS))
def largest_densities(density: Density, most: int) -> NDArray[np.float32]:
    """Of the interpolated density in ``most`` equal parts of each edge of the box, or as many as there are voxels
    (z, y, x); of one part of all, exactly the largest."""
    found: NDArray[np.float32] = density.values
    for axis in range(3):
        count = found.shape[axis]
        parts = min(most, count)
        ends = np.arange(parts + 1) * count / parts - 0.5  # in voxels, from the centre of the first
        first = np.clip(np.floor(ends[:-1]), 0, None).astype(int)
        last = np.clip(np.floor(ends[1:]) + 1, None, count - 1).astype(int)
        before = (slice(None),) * axis
        found = np.stack([found[*before, a : b + 1].max(axis) for a, b in zip(first, last, strict=True)], axis)
    return found


def _cell_texels(cells: NDArray[np.float32]) -> Words:
    texels = np.zeros((cells.size, 4), np.float32)
    texels[:, 0] = cells.ravel()
    return texels.view(np.uint32)


@lru_cache(maxsize=4)
def _voxels(density: Density) -> Words:
    """Texels of each voxel with its neighbours in y, in z, and in both; those at the border are their own."""
    values = np.pad(density.values, ((0, 1), (0, 1), (0, 0)), mode="edge")
    corners = values[:-1, :-1], values[:-1, 1:], values[1:, :-1], values[1:, 1:]
    return np.ascontiguousarray(np.stack(corners, axis=-1)).reshape(-1, 4).view(np.uint32)


def _rows(texels: int) -> int:
    return -(-texels // ROW)


def _warn_of_light_from_afar(scene: Scene) -> None:
    is_lit = scene.environment is not None or scene.directional_lights or max(scene.ambient.radiance) > 0
    if is_lit and max(passed_by_fog(scene)) == 0:
        warnings.warn(
            "no light from infinitely far away arrives through [fog], which has no end: environment, ambient and "
            "directional lights are dark in it; make the medium the interior of a large sphere of model null instead",
            stacklevel=3,
        )
