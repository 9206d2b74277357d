# SPDX-License-Identifier: MIT
"""Scenes whose models move: what an animation moves from frame to frame."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragtracer.io import open_gltf
from fragtracer.io.model import LIGHT_KINDS, Model
from fragtracer.scene import Mesh, Part, Pose, Scene

if TYPE_CHECKING:
    from fragtracer.io.gltf import GltfFile

_MOMENTS = 9  # of an animation that a camera is to see
Played = tuple[str, str]  # a file, and the name or number of an animation of it


def in_pose(mesh: Mesh, model: Model) -> Mesh:
    """``mesh``, which is of this ``model`` in another pose, with its parts where they are now. Raises ValueError if the
    model has other parts."""
    parts = zip(mesh.parts, model.mesh.parts, strict=True)
    moved = tuple(Part(other.geometry, part.material, other.matrix) for part, other in parts)
    return replace(mesh, parts=moved, pose=model.mesh.pose)


def moments(file: "GltfFile", animation: str) -> list[Mesh]:
    """The mesh of a model at some moments of an animation."""
    times = np.linspace(0.0, file.animations.get(animation).duration, _MOMENTS)
    return [file.model(Pose(animation, time)).mesh for time in times.tolist()]


def played(scene: Scene) -> dict[int, Played]:
    """What plays in ``scene``, by the number of the mesh: meshes whose pose has no time."""
    poses = {i: (mesh.file, mesh.pose) for i, mesh in enumerate(scene.meshes) if mesh.file and mesh.pose}
    return {i: (file, pose.animation) for i, (file, pose) in poses.items() if pose.time is None}


def posed(scene: Scene, models: Mapping[Played, Model], lit_by: Model | None = None) -> Scene:
    """``scene`` with what plays there as in ``models``, and with the lights of the one that it is ``lit_by``. Raises
    ValueError if a model has other parts than its mesh."""
    meshes = list(scene.meshes)
    for index, key in played(scene).items():
        if key in models:
            meshes[index] = in_pose(meshes[index], models[key])
    changes: dict[str, Any] = {"meshes": tuple(meshes)}
    if lit_by is not None:
        changes |= {kind: getattr(lit_by, kind) for kind in LIGHT_KINDS}
    return replace(scene, **changes)


class Animated:
    """The models ``played``, each file of which is read once. When an animation has ended, what it moves rests, or, if
    it ``repeats``, it begins anew.

    Raises
    ------
    SceneError
        If a model cannot be read any more.
    """

    def __init__(self, played: Collection[Played], repeats: bool) -> None:
        files = {file: open_gltf(file) for file in sorted({file for file, _ in played})}
        self._files, self._repeats = {(file, name): files[file] for file, name in sorted(played)}, repeats

    @property
    def duration(self) -> float:
        """Seconds from the beginning to the end of the longest animation."""
        return max((self._duration(key) for key in self._files), default=0.0)

    def _duration(self, key: Played) -> float:
        return self._files[key].animations.get(key[1]).duration

    def models(self, time: float) -> dict[Played, Model]:
        """As they are ``time`` seconds after the beginning."""
        return {key: self._model(key, time) for key in self._files}

    def _model(self, key: Played, time: float) -> Model:
        duration = self._duration(key)
        again = self._repeats and duration > 0 and not 0 <= time <= duration
        return self._files[key].model(Pose(key[1], time % duration if again else time))


class Playing:
    """What moves by itself in ``scene``: meshes whose pose has no time; and, if it ``is_model``, a bare one, the camera
    and the lights that come with it. When an animation has ended, what it moves rests, or, if it ``repeats``, it begins
    anew.

    Raises
    ------
    SceneError
        If a model cannot be read any more.
    """

    def __init__(self, scene: Scene, is_model: bool, repeats: bool = False) -> None:
        self._scene, moving = scene, played(scene)
        self._animated = Animated(moving.values(), repeats)
        self._whole = moving.get(0) if is_model else None  # what the camera and the lights are of
        first = self._animated.models(0.0)[self._whole] if self._whole is not None else None
        self._has_camera = first is not None and bool(first.cameras)
        self._has_lights = first is not None and first.has_lights
        self._is_any = bool(moving)

    def __bool__(self) -> bool:
        return self._is_any

    @property
    def duration(self) -> float:
        """Seconds from the beginning to the end of the longest animation."""
        return self._animated.duration

    def at(self, time: float) -> Scene:
        """The scene ``time`` seconds after the beginning."""
        models = self._animated.models(time)
        whole = models[self._whole] if self._whole is not None else None
        found = posed(self._scene, models, whole if self._has_lights else None)
        return replace(found, camera=whole.cameras[0]) if whole is not None and self._has_camera else found
