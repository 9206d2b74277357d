# SPDX-License-Identifier: MIT
"""The look of the panels: dark, quiet, one accent colour."""

import os
from collections.abc import Iterator
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

from imgui_bundle import imgui, implot

FONT_SIZE = 15.0
ACCENT = (0.98, 0.62, 0.22)
MUTED = imgui.ImVec4(0.56, 0.58, 0.62, 1.0)
BAD = imgui.ImVec4(0.98, 0.45, 0.40, 1.0)

_BACKGROUND = (0.105, 0.110, 0.122)
_RAISED = (0.165, 0.172, 0.190)
_LINE = (0.235, 0.245, 0.270)
# Of other scripts than those of Europe, as systems have them; the first that has a letter draws it.
_SYSTEM_FONTS = (
    *("NotoSansCJK-Regular.ttc", "wqy-zenhei.ttc", "wqy-microhei.ttc", "DejaVuSans.ttf"),
    *("Hiragino Sans GB.ttc", "AppleSDGothicNeo.ttc", "Arial Unicode.ttf"),
    *("msyh.ttc", "YuGothM.ttc", "malgun.ttf", "segoeui.ttf"),
)


def apply(scale: float) -> None:
    """Set colours and spacing for a monitor whose content is scaled by ``scale``."""
    style = imgui.get_style()
    imgui.style_colors_dark()
    style.font_scale_dpi = scale
    style.window_rounding = style.child_rounding = 0.0
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 4.0
    style.tab_rounding = 4.0
    style.frame_border_size = style.window_border_size = 0.0
    style.popup_border_size = 1.0
    style.window_padding = imgui.ImVec2(10, 8)
    style.frame_padding = imgui.ImVec2(7, 4)
    style.item_spacing = imgui.ImVec2(8, 6)
    style.item_inner_spacing = imgui.ImVec2(6, 4)
    style.scrollbar_size = 11.0
    style.grab_min_size = 9.0
    style.docking_separator_size = 1.0
    style.window_menu_button_position = imgui.Dir.none
    style.scale_all_sizes(scale)
    _color(style)
    implot.get_style().plot_padding = imgui.ImVec2(4, 4)


def load_font() -> None:
    """Once, for all scales: imgui draws the letters again in each size that it needs. Letters that its font lacks, of
    names in other scripts, are drawn in those of the system."""
    roboto = Path(str(files("imgui_bundle"))) / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    fonts = imgui.get_io().fonts
    for path in (roboto, *_system_fonts()):
        if path.is_file():
            configuration = imgui.ImFontConfig()
            configuration.merge_mode = len(fonts.fonts) > 0
            with suppress(RuntimeError):  # of a damaged file
                fonts.add_font_from_file_ttf(str(path), FONT_SIZE, configuration)
    imgui.get_style().font_size_base = FONT_SIZE


def _system_fonts() -> Iterator[Path]:
    folders = ["/usr/share/fonts", "/usr/local/share/fonts", "~/.local/share/fonts"]
    folders += ["/System/Library/Fonts", "/Library/Fonts", f"{os.environ.get('WINDIR', 'C:/Windows')}/Fonts"]
    there = {path.name: path for folder in folders for path in Path(folder).expanduser().rglob("*.tt[cf]")}
    return (there[name] for name in _SYSTEM_FONTS if name in there)


def _color(style: imgui.Style) -> None:
    def put(rgb: tuple[float, float, float], *names: imgui.Col_, alpha: float = 1.0) -> None:
        for name in names:
            style.set_color_(name, imgui.ImVec4(*rgb, alpha))

    col = imgui.Col_
    put(_BACKGROUND, col.window_bg, col.title_bg, col.title_bg_active, col.title_bg_collapsed, col.menu_bar_bg)
    put(_BACKGROUND, col.tab, col.tab_dimmed, col.docking_empty_bg)
    put((0.13, 0.135, 0.15), col.popup_bg, alpha=0.98)
    put(_RAISED, col.frame_bg, col.button, col.header, col.tab_hovered, col.tab_selected, col.tab_dimmed_selected)
    put((0.21, 0.22, 0.245), col.frame_bg_hovered, col.button_hovered, col.header_hovered)
    put((0.26, 0.27, 0.30), col.frame_bg_active, col.button_active, col.header_active)
    put(_LINE, col.border, col.separator)
    put((0.88, 0.89, 0.91), col.text)
    put((0.50, 0.52, 0.56), col.text_disabled)
    put(ACCENT, col.check_mark, col.slider_grab_active, col.tab_selected_overline, col.plot_lines)
    put(ACCENT, col.slider_grab, alpha=0.75)  # numbers lie over it
    put(ACCENT, col.tab_dimmed_selected_overline, col.docking_preview, alpha=0.4)
    put(ACCENT, col.separator_hovered, col.separator_active, col.resize_grip_hovered, col.nav_cursor, alpha=0.7)
    put((1.0, 1.0, 1.0), col.resize_grip, col.scrollbar_bg, alpha=0.03)
