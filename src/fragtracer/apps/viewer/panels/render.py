# SPDX-License-Identifier: MIT
"""The render panel: integrator, paths, light, sampling, and when to stop."""

from typing import get_args, get_type_hints

from imgui_bundle import imgui

from fragtracer.apps.viewer.panels import widgets
from fragtracer.apps.viewer.session import Session
from fragtracer.scene import RenderSettings

_HINTS = get_type_hints(RenderSettings)
GEOMETRY, ESTIMATOR, SAMPLER, FILTER, INTEGRATOR, BACKGROUND, WHERE_IT_PAYS = (
    get_args(_HINTS[name])
    for name in ("geometry", "estimator", "sampler", "pixel_filter", "integrator", "background", "guiding")
)


def edit(settings: RenderSettings) -> RenderSettings:
    """Controls for the render settings."""
    new: dict[str, object] = {}
    if widgets.header("Integrator"):
        new["integrator"] = widgets.choice("Light by", settings.integrator, INTEGRATOR, "Paths, or the split sum.")
        new["background"] = widgets.choice("Background", settings.background, BACKGROUND, "What camera rays see.")
        if settings.background == "prefiltered":
            roughness = settings.background_roughness
            new["background_roughness"] = widgets.slider("  for roughness", roughness, 0.0, 1.0, "%.2f")
    if widgets.header("Paths"):
        new["bounces"] = widgets.whole("Bounces", settings.bounces, 0, 64, "Scattering events on a path.")
        new["rays"] = widgets.whole("Rays a pass", settings.rays, 1, 64, "Paths per pixel, at most, in one pass.")
        new["russian_roulette"] = widgets.check("Russian roulette", settings.russian_roulette)
        if settings.russian_roulette:
            new["russian_roulette_depth"] = widgets.whole("  from vertex", settings.russian_roulette_depth, 1, 64)
    if widgets.header("Light"):
        new["light_samples"] = widgets.whole("Light samples", settings.light_samples, 1, 16, "Shadow rays at a vertex.")
        new["estimator"] = widgets.choice("Estimator", settings.estimator, ESTIMATOR)
        new["geometry"] = widgets.choice("Geometry term", settings.geometry, GEOMETRY)
        smith = new["geometry"] == "smith"
        new["multiple_scattering"] = smith and widgets.check("Multiple scatter", settings.multiple_scattering)
    if widgets.header("Sampling"):
        new["sampler"] = widgets.choice("Sampler", settings.sampler, SAMPLER)
        new["adaptive"] = widgets.choice("Adaptive", settings.adaptive, WHERE_IT_PAYS, "Sample where the error is.")
        new["guiding"] = widgets.choice(
            "Guiding", settings.guiding, WHERE_IT_PAYS, "Send paths where photons found light."
        )
        new["light_tracing"] = widgets.choice(
            "Light tracing",
            settings.light_tracing,
            WHERE_IT_PAYS,
            "Send photons once the picture rests.",
        )
        new["pixel_filter"] = widgets.choice("Pixel filter", settings.pixel_filter, FILTER)
        new["seed"] = widgets.whole("Seed", settings.seed, 0, 9999)
    return widgets.edited(settings, **new)


def limits(session: Session) -> None:
    """When to stop refining."""
    if not widgets.header("Until"):
        return
    session.max_samples = widgets.whole(
        "Samples", session.max_samples, 0, 65536, "Per pixel; 0 for no limit.", log=True
    )
    before = 100 * session.target_error
    percent = widgets.slider("Error", before, 0.0, 10.0, "%.2f %%")
    if percent != before:
        session.target_error = percent / 100
    label = "Resume" if session.paused else "Pause"
    if imgui.button(label, imgui.ImVec2(-1, 0)):
        session.paused = not session.paused
