# SPDX-License-Identifier: MIT
"""The translation gizmo on the selected object or light."""

from typing import Any

from imgui_bundle import imgui, imguizmo
from pyglm import glm

from fragtracer.apps.viewer import picking
from fragtracer.apps.viewer.layout import Area
from fragtracer.scene import Camera

_gizmo = imguizmo.im_guizmo
Triple = tuple[float, float, float]


class Gizmo:
    """Draws over the picture; ``takes_mouse`` says whether the mouse is on it."""

    def __init__(self) -> None:
        self.takes_mouse = False

    def drag(self, camera: Camera, area: Area, part: Any) -> Triple | None:
        """The step in metres by which the user drags ``part`` in this frame; None while they do not."""
        _gizmo.begin_frame()
        ball = None if part is None else picking.bounds(part)
        if ball is None:
            self.takes_mouse = False
            return None
        _gizmo.set_drawlist(imgui.get_background_draw_list())
        _gizmo.set_rect(area.x, area.y, area.width, area.height)
        center = ball[0]
        place = _gizmo.Matrix16(_flat(glm.translate(glm.vec3(*center))))
        before = [float(x) for x in place.values[12:15]]  # the centre as float32
        view, projection = _matrices(camera, area.width / area.height, center)
        moved = _gizmo.manipulate(view, projection, _gizmo.OPERATION.translate, _gizmo.MODE.world, place)
        self.takes_mouse = _gizmo.is_using() or _gizmo.is_over()
        if not moved:
            return None
        x, y, z = (float(place.values[12 + k]) - before[k] for k in range(3))
        return x, y, z


def _matrices(camera: Camera, aspect: float, center: Triple) -> tuple[Any, Any]:
    eye, target = glm.vec3(*camera.position), glm.vec3(*camera.target)
    distance = max(glm.length(glm.vec3(*center) - eye), 1e-6)
    view = glm.lookAt(eye, target, glm.vec3(*camera.up))
    projection = glm.perspective(glm.radians(camera.fov_degrees), aspect, 0.01 * distance, 100 * distance)
    return _gizmo.Matrix16(_flat(view)), _gizmo.Matrix16(_flat(projection))


def _flat(matrix: Any) -> list[float]:
    return [float(x) for column in matrix.to_list() for x in column]
