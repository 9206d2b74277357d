# SPDX-License-Identifier: MIT
"""Participating media of a Mitsuba scene."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.io.mitsuba.nodes import Node, fresh
from fragtracer.io.mitsuba.textures import Textures
from fragtracer.io.volumes import read_density
from fragtracer.scene import Medium
from fragtracer.scene.fields import Triple
from fragtracer.scene.medium import ALBEDO


@dataclass
class Media:
    """The media of a scene, each made where a shape asks for it. ``notes`` are what is not as in Mitsuba."""

    textures: Textures
    notes: list[str]
    found: dict[str, Medium] = field(default_factory=dict)
    _names: dict[Node, str] = field(default_factory=dict)

    def name(self, node: Node) -> str:
        """That of a medium."""
        if node not in self._names:
            name = fresh(node.id or node.plugin, self.found)
            with node.checked():
                self.found[name] = self._made(node)
            self._names[node] = name
        return self._names[node]

    def _made(self, node: Node) -> Medium:
        if node.plugin not in ("homogeneous", "heterogeneous"):
            raise node.error("this medium is not known; use a homogeneous one")
        scale = node.number("scale", 1.0)
        albedo, _ = self._volume(node, "albedo", ALBEDO)
        color, density = self._volume(node, "sigma_t", 1.0)
        r, g, b = (scale * max(channel, 0.0) for channel in color)
        found: dict[str, Any] = {"extinction": (r, g, b), "albedo": tuple(min(max(a, 0.0), 1.0) for a in albedo)}
        found["g"] = self._mean_cosine(node)
        return Medium(**found | (density or {}))

    def _volume(self, node: Node, name: str, default: float) -> tuple[Triple, dict[str, Any] | None]:
        """A colour, and the grid that it is multiplied by, if there is one."""
        volume = node.named.get(name)
        if volume is None:
            return self.textures.unbounded(node, name, default), None
        node.asked.add(name)
        if volume.plugin == "constvolume":
            return self.textures.unbounded(volume, "value", default), None
        if volume.plugin != "gridvolume" or name == "albedo":
            self.notes.append(f"{volume.line}: {volume.title} for {name}, {default:g} in its place")
            return (default, default, default), None
        matrix = volume.matrix()
        low, high = matrix[:3, 3], matrix[:3, :3].sum(axis=1) + matrix[:3, 3]
        if not np.allclose(matrix[:3, :3], np.diag(high - low), atol=1e-6 * np.abs(high - low).max()):
            raise volume.error("to_world must not turn the grid; a box along the axes is possible")
        volume.asked.update(("raw", "filter_type", "wrap_mode", "accel"))
        try:
            density = read_density(volume.file())
        except FragtracerError as error:
            raise volume.error(str(error)) from None
        if volume.flag("use_grid_bbox", False):
            raise volume.error("use_grid_bbox is not known; say by to_world where the grid is")
        return (1.0, 1.0, 1.0), {"density": density, "bounds": (tuple(low.tolist()), tuple(high.tolist()))}

    def _mean_cosine(self, node: Node) -> float:
        phase = node.child("phase")
        if phase is None or phase.plugin == "isotropic":
            return 0.0
        if phase.plugin != "hg":
            self.notes.append(f"{phase.line}: {phase.title}, an isotropic one in its place")
            return 0.0
        return float(np.clip(phase.number("g", 0.8), -0.99, 0.99))
