# SPDX-License-Identifier: MIT
"""``fragtracer_beside``: pictures of one sensor side by side, each with random numbers of its own.

Dr.Jit traces and starts a kernel for each rendering, which takes longer than the samples of a small picture: a film of
several is rendered at once. Its parameters: the sensor, its medium, the ``count`` of pictures, and a film so many times
as wide as that of the sensor, whose reconstruction filter must be a box, since others reach into the next picture.
"""

from typing import Any


def beside_class(mi: Any, dr: Any) -> type:
    """The plugin's class for the active variant of Mitsuba ``mi`` with Dr.Jit ``dr``."""

    class Beside(mi.Sensor):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.sensor, self.count = props["sensor"], int(props["count"])

        def needs_aperture_sample(self) -> bool:
            return bool(self.sensor.needs_aperture_sample())

        def sample_ray(self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True) -> Any:
            return self.sensor.sample_ray(time, sample1, self._place(sample2), sample3, active)

        def sample_ray_differential(
            self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
        ) -> Any:
            return self.sensor.sample_ray_differential(time, sample1, self._place(sample2), sample3, active)

        def _place(self, place: Any) -> Any:
            """In the picture that a place in the film belongs to."""
            x = place.x * self.count
            return mi.Point2f(x - dr.floor(x), place.y)

        def to_string(self) -> str:
            return f"FragtracerBeside[count={self.count}, sensor={self.sensor}]"

    return Beside
