# SPDX-License-Identifier: MIT
"""The default layout of the panels, and the area that they leave to the picture."""

from dataclasses import dataclass

from imgui_bundle import imgui

UPPER = ("Scene", "Render", "Display")
LOWER = ("Statistics",)
_SIDE_WIDTH = 330.0
_LOWER_SHARE = 0.33


@dataclass(frozen=True)
class Area:
    """A rectangle of the window in imgui's units, its origin at the top left."""

    x: float
    y: float
    width: float
    height: float

    def holds(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


def dock_panels(reset: bool = False) -> Area:
    """Make the dock space, and return the area that the panels leave to the picture."""
    known = imgui.internal.dock_builder_get_node(imgui.get_id("panels")) is not None
    space = imgui.get_id("panels")
    viewport = imgui.get_main_viewport()
    if reset or not known:
        _build(space, viewport.work_size)
    imgui.dock_space_over_viewport(space, viewport, imgui.DockNodeFlags_.passthru_central_node)
    center = imgui.internal.dock_builder_get_central_node(space)
    return Area(center.pos.x, center.pos.y, center.size.x, center.size.y)


def rescale(factor: float) -> None:
    """Scale docked panels by ``factor``, as text is on a monitor of another density."""
    nodes = {}
    for name in (*UPPER, *LOWER):
        window = imgui.internal.find_window_by_name(name)
        node = None if window is None else window.dock_node
        while node is not None:
            nodes[node.id_] = imgui.ImVec2(node.size.x * factor, node.size.y * factor)
            node = node.parent_node
    for number, size in nodes.items():
        imgui.internal.dock_builder_set_node_size(number, size)


def whole_window() -> Area:
    """The area of the picture without panels."""
    viewport = imgui.get_main_viewport()
    return Area(viewport.pos.x, viewport.pos.y, viewport.size.x, viewport.size.y)


def _build(space: int, size: imgui.ImVec2) -> None:
    build = imgui.internal
    build.dock_builder_remove_node(space)
    build.dock_builder_add_node(space, build.DockNodeFlagsPrivate_.dock_space)
    build.dock_builder_set_node_size(space, size)
    width = _SIDE_WIDTH * imgui.get_style().font_scale_dpi
    share = min(0.5, width / max(size.x, 1.0))
    _, side, _ = build.dock_builder_split_node_py(space, imgui.Dir.right, share)
    _, lower, upper = build.dock_builder_split_node_py(side, imgui.Dir.down, _LOWER_SHARE)
    for name in UPPER:
        build.dock_builder_dock_window(name, upper)
    for name in LOWER:
        build.dock_builder_dock_window(name, lower)
    build.dock_builder_finish(space)
