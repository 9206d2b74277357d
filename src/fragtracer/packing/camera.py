# SPDX-License-Identifier: MIT
"""A camera for the shader (camera/)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from fragtracer.scene import Camera


def camera_uniforms(camera: Camera, origin: NDArray[np.float64], width: int, height: int) -> dict[str, Any]:
    """What the shader needs of ``camera`` for an image of ``width`` x ``height`` pixels, by name.

    ``origin`` is that of the :class:`PackedScene` it looks at.
    """
    eye, target = (glm.dvec3(*np.subtract(p, origin)) for p in (camera.position, camera.target))
    view = glm.lookAt(eye, target, glm.dvec3(*camera.up))
    projection = glm.perspective(np.radians(camera.fov_degrees), width / height, 1.0, 2.0)
    return {
        "u_inverse_view": _column_major(glm.inverse(view)),
        "u_inverse_projection": _column_major(glm.inverse(projection)),
        "u_lens_radius": camera.aperture_radius,
        "u_focus_distance": camera.focal_distance,
        "u_inverse_image_size": (1 / width, 1 / height),
    }


def _column_major(matrix: Any) -> tuple[float, ...]:
    return tuple(float(x) for column in matrix.to_list() for x in column)
