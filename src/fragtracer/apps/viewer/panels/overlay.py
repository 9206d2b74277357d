# SPDX-License-Identifier: MIT
"""Overlays on the picture: the status bar, messages, the list of keys."""

from imgui_bundle import imgui

from fragtracer.apps.viewer.input import HELP
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels.statistics import Figures, error_text
from fragtracer.apps.viewer.panels.widgets import units
from fragtracer.apps.viewer.theme import BAD, MUTED

_BARE = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_docking
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.always_auto_resize
)


def status(area: Area, figures: Figures, fps: float) -> float:
    """One line at the lower edge of the picture, or several where it is narrow. Returns where it begins."""
    plain = imgui.get_style_color_vec4(imgui.Col_.text)
    parts = [
        (plain, f"{figures.spp:,} spp"),
        (plain, f"error {error_text(figures.relative_error)}"),
        (plain, f"{fps:.0f} fps"),
        (plain, f"{figures.samples_per_second / 1e6:.1f} Msamples/s"),
        (plain, f"{figures.full_size[0]} × {figures.full_size[1]}"),
        (MUTED, figures.state),
    ]
    if figures.non_finite:
        parts.append((BAD, f"{figures.non_finite:,} samples not finite"))
    gap, end = units(16), 0.0
    room = area.width - units(20) - 2 * imgui.get_style().window_padding.x
    if _begin("status", area.x + units(10), area.y + area.height - units(10), 0.0, 1.0, 0.75):
        for color, text in parts:
            width = imgui.calc_text_size(text).x
            fits = end > 0.0 and end + gap + width <= room
            if fits:
                imgui.same_line(0, gap)
            end = width + (end + gap if fits else 0.0)
            imgui.text_colored(color, text)
    top = imgui.get_window_pos().y
    imgui.end()
    return top


def messages(area: Area, bottom: float, toast: str, problem: str) -> None:
    """A message for some seconds, which ends above ``bottom``, and a problem that stays until it is solved."""
    if problem:
        _wrapped("problem", area, (area.x + units(10), area.y + units(10)), (0.0, 0.0), 0.92, problem, BAD)
    if toast:
        plain = imgui.get_style_color_vec4(imgui.Col_.text)
        _wrapped("toast", area, (area.x + area.width / 2, bottom - units(8)), (0.5, 1.0), 0.8, toast, plain)


def help_window(area: Area) -> None:
    """The list of keys and gestures."""
    center = (area.x + area.width / 2, area.y + area.height / 2)
    if _begin("help", *center, 0.5, 0.5, 0.94):
        imgui.text("Mouse and keys")
        imgui.separator()
        if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_fixed_fit):
            for what, how in HELP:
                imgui.table_next_column()
                imgui.text_colored(MUTED, what)
                imgui.table_next_column()
                imgui.text(f"   {how}")
            imgui.end_table()
    imgui.end()


def _wrapped(
    name: str,
    area: Area,
    place: tuple[float, float],
    pivot: tuple[float, float],
    alpha: float,
    text: str,
    color: imgui.ImVec4,
) -> None:
    """A text no wider than the picture."""
    width = area.width - units(20)
    imgui.set_next_window_size_constraints(imgui.ImVec2(0, 0), imgui.ImVec2(width, area.height * 0.6))
    if _begin(name, *place, *pivot, alpha):
        imgui.push_text_wrap_pos(max(width - units(24), 80.0))
        imgui.text_colored(color, text)
        imgui.pop_text_wrap_pos()
    imgui.end()


def _begin(name: str, x: float, y: float, pivot_x: float, pivot_y: float, alpha: float) -> bool:
    imgui.set_next_window_pos(imgui.ImVec2(x, y), imgui.Cond_.always, imgui.ImVec2(pivot_x, pivot_y))
    imgui.set_next_window_bg_alpha(alpha)
    flags = _BARE | (imgui.WindowFlags_.no_inputs if name in ("status", "toast", "help") else 0)
    return imgui.begin(f"##{name}", None, flags)[0]
