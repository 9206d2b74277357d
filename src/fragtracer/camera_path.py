# SPDX-License-Identifier: MIT
"""Cameras that move from frame to frame: through keyframes, or once around what they look at."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass as plain_dataclass
from dataclasses import fields, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.camera import Camera
from fragtracer.scene.fields import CONFIG, NonNegative, Positive, Vector

Floats = NDArray[np.float64]
Tangents = Callable[[Floats, Floats, int], Floats]

FIRST_FRAME, LAST_FRAME = 0, 9_999_999
_VECTORS = ("position", "target", "up")
_NUMBERS = ("fov_degrees", "aperture_radius", "focus_distance")


@dataclass(frozen=True, config=CONFIG)
class Keyframe:
    """The camera at a ``frame``; what is left out is that of the scene's camera."""

    frame: Annotated[int, Field(ge=FIRST_FRAME, le=LAST_FRAME)]
    position: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None
    fov_degrees: Annotated[float, Field(gt=0, lt=180)] | None = None
    aperture_radius: NonNegative | None = None
    focus_distance: Positive | None = None

    def camera(self, base: Camera) -> Camera:
        """``base`` with what this key gives; raises pydantic.ValidationError where that is no camera."""
        given = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "frame"}
        return replace(base, **{name: value for name, value in given.items() if value is not None})


@plain_dataclass(frozen=True)
class CameraPath:
    """Cameras at some frames, the first of them first, and smooth ways between them.

    Cubic Hermite curves, once continuously differentiable in the number of the frame. The tangent of places, targets
    and up vectors at a key is that of the parabola through it and its two neighbours, which for keys that are equally
    far apart is Catmull and Rom's (1974, A Class of Local Interpolating Splines), and zero where a vector is the same
    in two keys, so that a camera can rest. Numbers never leave the range between two keys (Fritsch and Butland 1984, A
    Method for Constructing Local Monotone Piecewise Cubic Interpolants).
    """

    keys: Mapping[int, Camera]

    @cached_property
    def frames(self) -> range:
        """From the first key to the last."""
        return range(min(self.keys), max(self.keys) + 1)

    def camera(self, frame: float) -> Camera:
        """At one of the :attr:`frames`, or between two. Raises pydantic.ValidationError where the way leads through no
        camera."""
        if (number := int(frame)) == frame and number in self.keys:
            return self.keys[number]
        base = self.keys[self.frames[0]]
        times, cameras = np.array(list(self.keys), np.float64), self.keys.values()
        vectors = _hermite(
            times, np.array([[getattr(c, name) for name in _VECTORS] for c in cameras]), frame, _parabola
        )
        table = np.array([[c.fov_degrees, c.aperture_radius, c.focal_distance] for c in cameras])
        numbers = dict(zip(_NUMBERS, _hermite(times, table, frame, _monotone).tolist(), strict=True))
        if all(camera.focus_distance is None for camera in cameras):
            del numbers["focus_distance"]  # which goes on to follow the target
        return replace(base, **dict(zip(_VECTORS, vectors.tolist(), strict=True)), **numbers)


def turntable(camera: Camera, frames: int) -> CameraPath:
    """A path of ``frames`` frames, from 1 on, once around the target of ``camera``, about its up vector and
    counter-clockwise seen from there; the frame that would follow is the first again."""
    return CameraPath({frame: turned(camera, (frame - 1) / frames) for frame in range(1, frames + 1)})


def turned(camera: Camera, share: float) -> Camera:
    """``camera`` after a ``share`` of the turn of a :func:`turntable`."""
    axis = np.divide(camera.up, np.linalg.norm(camera.up))
    arm = np.subtract(camera.position, camera.target)
    along = axis * (axis @ arm)
    angle = 2 * np.pi * share
    moved = along + np.cos(angle) * (arm - along) + np.sin(angle) * np.cross(axis, arm)
    return replace(camera, position=tuple((camera.target + moved).tolist()))


def _hermite(times: Floats, values: Floats, time: float, tangents: Tangents) -> Floats:
    """The value at ``time`` of the curve through ``values`` (n, ...) at ``times`` (n,), which increase."""
    i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    steps = np.diff(times)
    slopes = np.diff(values, axis=0) / steps.reshape(-1, *[1] * (values.ndim - 1))
    ends = [tangents(slopes, steps, k) for k in (i, i + 1)]
    s = (time - times[i]) / steps[i]
    change = values[i + 1] - values[i]
    bend = s * (1 - s) * ((1 - s) * (ends[0] * steps[i] - change) - s * (ends[1] * steps[i] - change))
    return np.asarray(values[i] + s * change + bend)


def _parabola(slopes: Floats, steps: Floats, key: int) -> Floats:
    """At a key, of vectors."""
    if key in (0, len(steps)):
        return np.asarray(slopes[min(key, len(steps) - 1)])
    before, after = slopes[key - 1], slopes[key]
    rests = ~(before.any(axis=-1, keepdims=True) & after.any(axis=-1, keepdims=True))
    mean = (before * steps[key] + after * steps[key - 1]) / (steps[key - 1] + steps[key])
    return np.where(rests, 0.0, mean)


def _monotone(slopes: Floats, steps: Floats, key: int) -> Floats:
    """At a key, of numbers: the weighted harmonic mean of the slopes, zero at an extremum."""
    if key in (0, len(steps)):
        return np.asarray(slopes[min(key, len(steps) - 1)])
    before, after = slopes[key - 1], slopes[key]
    weight = (steps[key - 1] + 2 * steps[key]) / (3 * (steps[key - 1] + steps[key]))
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = before * after / (weight * after + (1 - weight) * before)
    return np.where(before * after > 0, mean, 0.0)
