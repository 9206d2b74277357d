# SPDX-License-Identifier: MIT
"""Render settings for the shader."""

from typing import Any

from fragtracer.scene import RenderSettings

# The backgrounds that are looked up in maps of the split-sum approximation.
_MAPS = ("prefiltered", "irradiance")


def settings_features(settings: RenderSettings, hidden: bool) -> dict[str, int | str]:
    """The features that ``settings`` ask for; ``hidden`` says that camera rays do not see the environment."""

    def value(prefix: str, choice: str) -> str:
        return f"{prefix}_{choice.upper().replace('-', '_')}"

    background = "color" if settings.background == "black" else settings.background
    if hidden and background == "environment":
        background = "color"
    return {
        "GEOMETRY_TERM": value("GEOMETRY", settings.geometry),
        "ESTIMATOR": value("ESTIMATOR", settings.estimator),
        "BACKGROUND": value("BACKGROUND", background),
        "SAMPLER": value("SAMPLER", settings.sampler),
        "PIXEL_FILTER": value("PIXEL_FILTER", settings.pixel_filter),
    }


def needs_maps(settings: RenderSettings) -> bool:
    """Whether the maps of the split-sum approximation are looked up."""
    return settings.integrator == "split-sum" or settings.background in _MAPS


def settings_uniforms(settings: RenderSettings) -> dict[str, Any]:
    """The numbers of ``settings``, by the names of their uniforms."""
    never = 2**31 - 1
    return {
        "u_bounces": settings.bounces,
        "u_light_samples": settings.light_samples,
        "u_russian_roulette_vertex": settings.russian_roulette_depth if settings.russian_roulette else never,
        "u_seed": settings.seed,
        "u_multiple_scattering": int(settings.multiple_scattering),
        "u_background_roughness": settings.background_roughness,
    }
