# SPDX-License-Identifier: MIT
"""The display panel: tone mapping, bloom and views."""

from typing import get_args

from fragtracer.apps.viewer.display import DisplaySettings, ToneCurve, View
from fragtracer.apps.viewer.panels import widgets


def edit(settings: DisplaySettings, compares: bool) -> DisplaySettings:
    """Controls for the picture on the screen; ``compares`` if there is another picture to wipe to."""
    new: dict[str, object] = {}
    if widgets.header("Tone"):
        new["auto_exposure"] = widgets.check("Auto exposure", settings.auto_exposure)
        if not settings.auto_exposure:
            new["exposure"] = widgets.slider("Exposure", settings.exposure, -8.0, 8.0, "%+.2f stops")
        new["gamma"] = widgets.slider("Gamma", settings.gamma, 0.4, 2.5, "%.2f")
        new["tone_curve"] = widgets.choice("Tone curve", settings.tone_curve, get_args(ToneCurve))
    if widgets.header("Bloom"):
        new["bloom"] = widgets.check("Glare", settings.bloom)
        if settings.bloom or settings.view == "bloom":
            new["bloom_strength"] = widgets.slider("Strength", settings.bloom_strength, 0.01, 4.0, "%.2f", log=True)
            new["bloom_threshold"] = widgets.slider("Threshold", settings.bloom_threshold, 0.0, 16.0, "%.2f")
    if widgets.header("View"):
        new["view"] = widgets.choice("Show", settings.view, get_args(View))
        if settings.view == "standard error":
            new["error_range"] = widgets.slider("Top of scale", settings.error_range, 0.01, 2.0, "%.2f", log=True)
        if settings.view == "depth":
            new["depth_range"] = widgets.slider("Far end", settings.depth_range, 0.01, 1000.0, "%.2f m", log=True)
        if compares:
            new["wipe"] = widgets.slider("Wipe", settings.wipe, 0.0, 1.0, "%.2f")
    return widgets.edited(settings, **new)
