# SPDX-License-Identifier: MIT
"""Scenes whose models move: what an animation moves from frame to frame."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragtracer.io import open_gltf
from fragtracer.io.model import LIGHT_KINDS, Model
from fragtracer.scene import Mesh, Part, Pose, Scene

if TYPE_CHECKING:
    from fragtracer.io.gltf import GltfFile

_MOMENTS = 9  # of an animation that a camera is to see


def in_pose(mesh: Mesh, model: Model) -> Mesh:
    """``mesh``, which is of this ``model`` in another pose, with its parts where they are now."""
    parts = zip(mesh.parts, model.mesh.parts, strict=True)
    moved = tuple(Part(other.geometry, part.material, other.matrix) for part, other in parts)
    return replace(mesh, parts=moved)


def moments(file: "GltfFile", animation: str) -> list[Mesh]:
    """The mesh of a model at some moments of an animation."""
    times = np.linspace(0.0, file.animations.get(animation).duration, _MOMENTS)
    return [file.model(Pose(animation, time)).mesh for time in times.tolist()]


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
        self._scene, self._repeats = scene, repeats
        poses = {i: (mesh.file, mesh.pose) for i, mesh in enumerate(scene.meshes) if mesh.file and mesh.pose}
        animations = {i: (file, pose.animation) for i, (file, pose) in poses.items() if pose.time is None}
        files = {file: open_gltf(file) for file, _ in animations.values()}
        self._moving = {index: (files[file], animation) for index, (file, animation) in animations.items()}
        self._has_camera = self._has_lights = False
        if is_model and self._moving:
            file, animation = self._moving[0]
            model = file.model(Pose(animation, 0.0))
            self._has_camera, self._has_lights = bool(model.cameras), model.has_lights

    def __bool__(self) -> bool:
        return bool(self._moving)

    @property
    def duration(self) -> float:
        """Seconds from the beginning to the end of the longest animation."""
        return max(file.animations.get(animation).duration for file, animation in self._moving.values())

    def _model(self, file: "GltfFile", animation: str, time: float) -> Model:
        duration = file.animations.get(animation).duration
        again = self._repeats and time > duration > 0
        return file.model(Pose(animation, time % duration if again else time))

    def at(self, time: float) -> Scene:
        """The scene ``time`` seconds after the beginning."""
        models = {key: self._model(*key, time) for key in dict.fromkeys(self._moving.values())}
        meshes = list(self._scene.meshes)
        for index, key in self._moving.items():
            meshes[index] = in_pose(meshes[index], models[key])
        changes: dict[str, Any] = {"meshes": tuple(meshes)}
        if self._has_camera:
            changes["camera"] = models[self._moving[0]].cameras[0]
        if self._has_lights:
            changes |= {kind: getattr(models[self._moving[0]], kind) for kind in LIGHT_KINDS}
        return replace(self._scene, **changes)
