# SPDX-License-Identifier: MIT
"""Moves a camera; every function returns another :class:`Camera` and knows nothing of windows.

Angles are in radians, distances in metres. The picture follows the mouse: a positive ``right`` moves it to
the right.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.scene import Camera

Vector = NDArray[np.float64]
_NEAREST_POLE = np.radians(1.0)
_FARTHEST = 1e14  # metres from the origin to a target along each axis, and from there to a camera
_NEAREST = 1e-9  # metres from a target to a camera
_PRECISION = 1e-10  # of the target's coordinates, between which doubles still tell directions apart


def axes(camera: Camera) -> tuple[Vector, Vector, Vector]:
    """Unit vectors to the right, up and forward, as seen in the picture."""
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    return right, np.cross(right, forward), forward


def distance(camera: Camera) -> float:
    """From the camera to its target."""
    return float(np.linalg.norm(np.subtract(camera.position, camera.target)))


def orbit(camera: Camera, right: float, down: float) -> Camera:
    """Turn the scene about the target, to the ``right`` and ``down``."""
    back = np.subtract(camera.position, camera.target)
    return replace(camera, position=_triple(camera.target + _turned(camera, back, -right, -down)))


def look_around(camera: Camera, right: float, down: float) -> Camera:
    """Turn the camera where it stands, to its ``right`` and ``down``; the target moves along."""
    ahead = np.subtract(camera.target, camera.position)
    return replace(camera, target=_triple(camera.position + _turned(camera, ahead, -right, down)))


def pan(camera: Camera, right: float, down: float) -> Camera:
    """Shift the scene in the plane of the target, by parts of the picture's height."""
    height = 2 * distance(camera) * np.tan(np.radians(camera.fov_degrees) / 2)
    x, y, _ = axes(camera)
    return _moved(camera, height * (y * down - x * right))


def dolly(camera: Camera, factor: float) -> Camera:
    """Multiply the distance to the target, within what can be rendered."""
    return _looking(camera, camera.target, factor * distance(camera))


def fly(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """Walk by so many metres; the target comes along."""
    x, y, z = axes(camera)
    return _moved(camera, right * x + up * y + forward * z)


def frame(camera: Camera, center: Sequence[float], radius: float) -> Camera:
    """Look at a bounding sphere from the current direction, at a distance where it fills most of the height."""
    return _looking(camera, center, 1.3 * radius / np.sin(np.radians(camera.fov_degrees) / 2))


def ray(camera: Camera, x: float, y: float, aspect: float) -> tuple[Vector, Vector]:
    """Origin and unit direction through a place of the picture: x to the right and y down, from 0 to 1."""
    right, up, forward = axes(camera)
    tangent = np.tan(np.radians(camera.fov_degrees) / 2)
    across = (2 * x - 1) * tangent * aspect * right + (1 - 2 * y) * tangent * up
    return np.asarray(camera.position), _unit(forward + across)


def project(camera: Camera, point: Sequence[float], aspect: float) -> tuple[float, float] | None:
    """The place in the picture, as for :func:`ray`, of a point of the world; None behind the camera."""
    right, up, forward = axes(camera)
    offset = np.subtract(point, camera.position)
    depth = float(offset @ forward)
    if depth <= 0:
        return None
    tangent = np.tan(np.radians(camera.fov_degrees) / 2) * depth
    return float(0.5 + offset @ right / (2 * tangent * aspect)), float(0.5 - offset @ up / (2 * tangent))


def _turned(camera: Camera, arm: Vector, yaw: float, pitch: float) -> Vector:
    """``arm`` turned about the up vector, and towards it, but not over it."""
    up = _unit(np.asarray(camera.up, np.float64))
    length = np.linalg.norm(arm)
    elevation = np.arcsin(np.clip(arm @ up / length, -1, 1)) - pitch
    limit = np.pi / 2 - _NEAREST_POLE
    elevation = float(np.clip(elevation, -limit, limit))
    level = _unit(arm - (arm @ up) * up)
    level = np.cos(yaw) * level + np.sin(yaw) * np.cross(up, level)
    turned: Vector = length * (np.cos(elevation) * level + np.sin(elevation) * up)
    return turned


def _looking(camera: Camera, target: Sequence[float], away: float) -> Camera:
    """Look at ``target`` from the current direction and so far ``away``, both within what can be rendered."""
    back = _unit(np.subtract(camera.position, camera.target))
    place: Vector = np.clip(target, -_FARTHEST, _FARTHEST)
    nearest = max(_NEAREST, _PRECISION * np.abs(place).max())
    return replace(camera, position=_triple(place + np.clip(away, nearest, _FARTHEST) * back), target=_triple(place))


def _moved(camera: Camera, step: Vector) -> Camera:
    return replace(camera, position=_triple(camera.position + step), target=_triple(camera.target + step))


def _unit(v: ArrayLike) -> Vector:
    unit: Vector = np.asarray(v, np.float64) / np.linalg.norm(v)
    return unit


def _triple(v: Vector) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])
