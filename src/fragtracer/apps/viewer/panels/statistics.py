# SPDX-License-Identifier: MIT
"""The statistics panel: figures, and a plot of frame times."""

from dataclasses import dataclass

import numpy as np
from imgui_bundle import imgui

from fragtracer.apps.viewer.panels import widgets
from fragtracer.apps.viewer.statistics import FrameTimes
from fragtracer.apps.viewer.theme import BAD, MUTED


@dataclass(frozen=True)
class Figures:
    """What the statistics panel and the status bar show."""

    spp: int = 0
    samples_per_second: float = 0.0
    relative_error: float | None = None
    non_finite: int = 0
    size: tuple[int, int] = (0, 0)
    full_size: tuple[int, int] = (0, 0)
    gl_renderer: str = ""
    gpu_bytes: int = 0
    pass_seconds: float = 0.0
    specialised: bool = False
    traces_light: bool = False
    state: str = ""


def error_text(error: float | None) -> str:
    return "–" if error is None or not np.isfinite(error) else f"{100 * error:.2g} %"


def draw(figures: Figures, times: FrameTimes) -> None:
    """Rows of figures over a plot of the time of each frame."""
    imgui.push_style_var(imgui.StyleVar_.frame_padding, imgui.ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, imgui.ImVec2(widgets.units(8), widgets.units(5)))
    widgets.pair("Samples/pixel", f"{figures.spp:,}" + (" and photons" if figures.traces_light else ""))
    widgets.pair("Mean error", error_text(figures.relative_error))
    speed = f"{figures.samples_per_second / 1e6:.2f} Msamples/s"
    widgets.pair("Speed", speed + (" (specialised)" if figures.specialised else ""))
    widgets.pair("Last pass", f"{1000 * figures.pass_seconds:.1f} ms at {figures.size[0]}×{figures.size[1]}")
    widgets.label("Not finite", "Samples that were NaN or infinite; they are left out of the mean.")
    imgui.text_colored(BAD if figures.non_finite else MUTED, f"{figures.non_finite:,} samples")
    widgets.pair("GPU memory", f"{figures.gpu_bytes / 2**20:.1f} MiB")
    last = 1000 * times.recent[-1] if times.recent else 0.0
    widgets.pair("Frames", f"{times.fps:.0f} a second, {last:.0f} ms each")
    _plot(times)
    imgui.text_colored(MUTED, figures.gl_renderer)
    imgui.pop_style_var(2)


def _plot(times: FrameTimes) -> None:
    values = 1000 * np.asarray(times.recent or [0.0], np.float32)
    size = imgui.ImVec2(imgui.get_content_region_avail().x, widgets.units(30))
    imgui.plot_lines("##frames", values, 0, None, 0.0, max(50.0, float(values.max())), size)
