# SPDX-License-Identifier: MIT
"""Animations of a glTF model (glTF 2.0, section 3.11 and appendix C): where nodes are at a time."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.accessors import Accessors
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.materials import unique
from fragtracer.io.model import AnimationError

Floats = NDArray[np.float64]

_POINTER = "KHR_animation_pointer"
# What a channel moves, and the accessor type of its values.
_PATHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}


@dataclass(frozen=True)
class Curve:
    """Values at ``times`` (keys,), seconds, which increase, and the way between them.

    ``values`` are (keys, width), or of a CUBICSPLINE (keys, 3, width): the tangent before a key, its value, and the
    tangent after it, by the second. Of rotations they are quaternions, xyzw.
    """

    times: Floats
    values: Floats
    interpolation: str
    turns: bool = False

    def at(self, time: float) -> Floats:
        """(width,) at ``time``, in seconds; before the first key its value, and after the last that one's."""
        key = int(np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.times) - 1))
        values = self.values[:, 1] if self.interpolation == "CUBICSPLINE" else self.values
        if self.interpolation == "STEP" or key == len(self.times) - 1 or time <= self.times[key]:
            return np.asarray(values[key])
        step = self.times[key + 1] - self.times[key]
        s = (time - self.times[key]) / step
        if self.interpolation == "LINEAR":
            return (_slerp if self.turns else _lerp)(values[key], values[key + 1], s)
        (_, start, leaving), (arriving, end, _) = self.values[key : key + 2]
        found = _hermite(start, step * leaving, end, step * arriving, s)
        return found / (np.linalg.norm(found) or 1.0) if self.turns else found


def _lerp(start: Floats, end: Floats, s: float) -> Floats:
    return (1 - s) * start + s * end


def _slerp(start: Floats, end: Floats, s: float) -> Floats:
    """Along the shorter of the two arcs between unit quaternions (appendix C.4)."""
    cosine = float(start @ end)
    end = end if cosine >= 0 else -end
    angle = 2 * np.arctan2(np.linalg.norm(end - start), np.linalg.norm(end + start))
    if angle == 0:
        return start
    return np.asarray((np.sin((1 - s) * angle) * start + np.sin(s * angle) * end) / np.sin(angle))


def _hermite(start: Floats, leaving: Floats, end: Floats, arriving: Floats, s: float) -> Floats:
    """The cubic with these values and derivatives at s = 0 and 1 (appendix C.5)."""
    change = end - start
    return np.asarray(start + s * change + s * (1 - s) * ((1 - s) * (leaving - change) - s * (arriving - change)))


@dataclass(frozen=True)
class Animation:
    """``curves`` by the node and the property of it that each moves."""

    name: str
    curves: dict[tuple[int, str], Curve]

    @cached_property
    def duration(self) -> float:
        """Seconds from 0 to the last key of all."""
        return max((float(curve.times[-1]) for curve in self.curves.values()), default=0.0)

    def posed(self, nodes: Sequence[gltf.Node], time: float) -> list[gltf.Node]:
        """The ``nodes`` of the document as they are at ``time``, in seconds."""
        found = list(nodes)
        for (index, path), curve in self.curves.items():
            found[index] = found[index].model_copy(update={path: curve.at(time).tolist()})
        return found


class Animations:
    """The animations of one model, each read when it is asked for. ``notes`` takes what is ignored."""

    def __init__(self, container: Container, accessors: Accessors, notes: list[str]) -> None:
        self._container, self._accessors, self._notes = container, accessors, notes
        self.names = _names(container.document.animations)
        self._read: dict[int, Animation] = {}

    def get(self, name: str) -> Animation:
        """The animation of this name, or, if there is none, of this number.

        Raises
        ------
        AnimationError
            If there is no such animation.
        SceneError
            If it is damaged.
        """
        index = self.index(name)
        if index not in self._read:
            self._read[index] = self._animation(index)
        return self._read[index]

    def index(self, name: str) -> int:
        """The number of the animation of this name, or number; raises :class:`AnimationError` if there is none."""
        if name in self.names:
            return self.names.index(name)
        if re.fullmatch(r"\d{1,9}", name) and int(name) < len(self.names):
            return int(name)
        there = f"choose from {', '.join(self.names)}" if self.names else "it has none"
        raise AnimationError(f"{self._container.path}: there is no animation {name[:60]!r}; {there}")

    def _animation(self, index: int) -> Animation:
        place = f"animations[{index}]"
        try:
            item = gltf.Animation.model_validate(self._container.document.animations[index])
        except ValidationError as error:
            raise self._container.error(place, gltf.first_mistake(error)) from error
        curves: dict[tuple[int, str], Curve] = {}
        for number, channel in enumerate(item.channels):
            where, target = f"{place}.channels[{number}]", channel.target
            sampler = self._container.item(item.samplers, channel.sampler, f"{where}.sampler")
            if target.path not in _PATHS:
                self._notes.append(_POINTER if target.path == "pointer" else f"{target.path} of animations")
            elif target.node is not None:
                node = self._container.item(self._container.document.nodes, target.node, f"{where}.target.node")
                if node.matrix is not None and target.path != "weights":
                    raise self._container.error(f"{where}.target", "its node has a matrix, which cannot be animated")
                if (target.node, target.path) in curves:
                    raise self._container.error(f"{where}.target", "another channel has it, too")
                targets = self._targets(node, f"{where}.target") if target.path == "weights" else 1
                curve = self._curve(sampler, target.path, targets, f"{place}.samplers[{channel.sampler}]")
                curves[target.node, target.path] = curve
        return Animation(self.names[index], curves)

    def _targets(self, node: gltf.Node, place: str) -> int:
        """How many morph targets a node has, one at least."""
        meshes = self._container.document.meshes
        mesh = None if node.mesh is None else self._container.item(meshes, node.mesh, f"{place}.node.mesh")
        if mesh is None or not any(primitive.targets for primitive in mesh.primitives):
            raise self._container.error(place, "its node has no morph targets")
        return max(len(primitive.targets) for primitive in mesh.primitives)

    def _curve(self, sampler: gltf.AnimationSampler, path: str, targets: int, place: str) -> Curve:
        times = self._accessors.get(sampler.input, f"{place}.input", ("SCALAR",))
        values = self._accessors.get(sampler.output, f"{place}.output", (_PATHS[path],))
        for name, array in (("input", times), ("output", values)):
            if array.dtype.kind != "f":
                raise self._container.error(f"{place}.{name}", "must be floats, or integers that are normalized")
            if not np.isfinite(array).all():
                raise self._container.error(f"{place}.{name}", "has a number that is not finite")
        keys, is_cubic = len(times), sampler.interpolation == "CUBICSPLINE"
        if keys < 1 + is_cubic:
            raise self._container.error(f"{place}.input", f"must have {1 + is_cubic} keys at least, not {keys}")
        if not (np.diff(times[:, 0]) > 0).all():
            raise self._container.error(f"{place}.input", "each time must be greater than the one before")
        rows = keys * targets * (3 if is_cubic else 1)
        if len(values) != rows:
            problem = f"must have {rows} elements for {keys} keys, not {len(values)}"
            raise self._container.error(f"{place}.output", problem)
        shape = (keys, 3, -1) if is_cubic else (keys, -1)
        curve = values.astype(np.float64).reshape(shape)
        if path == "rotation":
            quaternions = curve[:, 1] if is_cubic else curve
            lengths = np.linalg.norm(quaternions, axis=1, keepdims=True)
            if not lengths.all():
                raise self._container.error(f"{place}.output", "has a quaternion of length 0")
            if not is_cubic:
                curve = curve / lengths
        return Curve(times[:, 0].astype(np.float64), curve, sampler.interpolation, path == "rotation")


def _names(items: Iterable[Any]) -> list[str]:
    """A unique name for each animation."""
    found: list[str] = []
    for index, item in enumerate(items):
        name = item.get("name") if isinstance(item, dict) else None
        found.append(unique(name if name and isinstance(name, str) else f"animation {index}", index, found))
    return found
