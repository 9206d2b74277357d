# SPDX-License-Identifier: MIT
"""A camera for the shader (camera/); web/src/camera.ts says the same for pages."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.scene import Camera


def camera_uniforms(camera: Camera, origin: NDArray[np.float64], width: int, height: int) -> dict[str, Any]:
    """What the shader needs of ``camera`` for an image of ``width`` x ``height`` pixels, by name.

    ``origin`` is that of the :class:`PackedScene` it looks at. Matrices are column by column; the projection has its
    near plane at 1 and its far one at 2, by which nothing is clipped.
    """
    eye = np.subtract(camera.position, origin)
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    up = np.cross(right, forward)
    high = float(np.tan(np.radians(camera.fov_degrees) / 2))
    return {
        "u_inverse_view": (*_column(right), *_column(up), *_column(-forward), *_column(eye)[:3], 1.0),
        "u_inverse_projection": (high * width / height, *[0.0] * 4, high, *[0.0] * 5, -0.25, 0.0, 0.0, -1.0, 0.75),
        "u_lens_radius": camera.aperture_radius,
        "u_focus_distance": camera.focal_distance,
        "u_inverse_image_size": (1 / width, 1 / height),
    }


def pixel_matrix(camera: Camera, origin: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """(4, 4): from homogeneous points about ``origin`` to pixels of a picture of ``width`` x ``height``, row 0 at the
    bottom: (x w, y w, 0, w), where w is the distance along the axis of view, below 0 behind the camera."""
    eye = np.subtract(camera.position, origin)
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    high = float(np.tan(np.radians(camera.fov_degrees) / 2))
    x, y, w = (np.append(axis, -axis @ eye) for axis in (right, np.cross(right, forward), forward))
    scale = height / (2 * high)
    return np.stack([scale * x + width / 2 * w, scale * y + height / 2 * w, np.zeros(4), w])


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = vector / np.linalg.norm(vector)
    return unit


def _column(vector: NDArray[np.float64]) -> tuple[float, ...]:
    return (*map(float, vector), 0.0)
