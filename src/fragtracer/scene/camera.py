# SPDX-License-Identifier: MIT
"""The camera."""

from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import CONFIG, NonNegative, Positive, Vector, length


@dataclass(frozen=True, config=CONFIG)
class Camera:
    """A perspective camera that looks from ``position`` to ``target``.

    ``fov_degrees`` is the vertical field of view. ``aperture_radius`` is the radius of a thin lens
    in metres; 0 is a pinhole, sharp everywhere. ``focus_distance`` is measured in metres along the
    optical axis; left out, it is the distance to the target.
    """

    position: Vector = (0.0, 1.0, 4.0)
    target: Vector = (0.0, 0.5, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov_degrees: Annotated[float, Field(gt=0, lt=180)] = 40.0
    aperture_radius: NonNegative = 0.0
    focus_distance: Positive | None = None

    def __post_init__(self) -> None:
        view = np.subtract(self.target, self.position)
        if not length(self.up) > 0:
            raise ValueError("up must not have length zero; [0, 1, 0] is usual")
        if not np.linalg.norm(view) > 0:
            raise ValueError("position and target are the same point; the camera must look somewhere")
        sine = np.linalg.norm(np.cross(view, self.up)) / (np.linalg.norm(view) * length(self.up))
        if sine < 1e-6:
            raise ValueError("the camera looks along its up vector; choose an up across the view, as [0, 0, 1]")

    @property
    def focal_distance(self) -> float:
        """Distance of the plane in focus from the lens, in metres."""
        if self.focus_distance is not None:
            return self.focus_distance
        return float(np.linalg.norm(np.subtract(self.target, self.position)))
