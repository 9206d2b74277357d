# SPDX-License-Identifier: MIT
"""Controls of the camera, and saved viewpoints."""

from collections.abc import Mapping

from imgui_bundle import imgui

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.panels import widgets
from fragtracer.scene import Camera


def edit(camera: Camera) -> Camera:
    """Controls for ``camera``."""
    around = cameras.distance(camera)
    new: dict[str, object] = {
        "fov_degrees": widgets.slider("Field of view", camera.fov_degrees, 2.0, 140.0, "%.1f°"),
        "aperture_radius": widgets.length("Aperture", camera.aperture_radius, 0.1 * around),
    }
    if camera.aperture_radius > 0:
        before = camera.focal_distance
        after = widgets.length("Focus", before, 2 * before, 1e-6, "Or Ctrl+click in the picture.")
        new["focus_distance"] = after if after != before else camera.focus_distance
    new["position"] = widgets.point("Position", camera.position, around)
    new["target"] = widgets.point("Target", camera.target, around)
    return widgets.edited(camera, **new)


def viewpoints(camera: Camera, home: Camera, kept: Mapping[int, Camera]) -> tuple[Camera, int]:
    """Buttons for home and for nine viewpoints; returns the camera, and the number to save it under or 0."""
    keep = 0
    if imgui.small_button("Home"):
        camera = home
    imgui.set_item_tooltip("Click on a number to go to that viewpoint; Ctrl+click saves the camera there.")
    for slot in range(1, 10):
        imgui.same_line(0, 3)
        imgui.begin_disabled(slot not in kept and not imgui.get_io().key_ctrl)
        if imgui.small_button(str(slot)):
            if imgui.get_io().key_ctrl:
                keep = slot
            else:
                camera = kept.get(slot, camera)
        imgui.end_disabled()
    return camera, keep
