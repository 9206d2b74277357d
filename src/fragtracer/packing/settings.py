# SPDX-License-Identifier: MIT
"""Render settings for the shader."""

from typing import Any

from fragtracer.packing.random_texture import LAYERS, WIDTH
from fragtracer.scene import RenderSettings
from fragtracer.shader_composer import CONSTANTS

# The backgrounds that are looked up in maps of the split-sum approximation.
_MAPS = ("prefiltered", "irradiance")


def settings_defines(settings: RenderSettings) -> dict[str, int]:
    """The features that ``settings`` ask for."""

    def value(prefix: str, choice: str) -> int:
        return CONSTANTS[f"{prefix}_{choice.upper().replace('-', '_')}"]

    return {
        "GEOMETRY_TERM": value("GEOMETRY", settings.geometry),
        "MULTIPLE_SCATTERING": int(settings.multiple_scattering),
        "ESTIMATOR": value("ESTIMATOR", settings.estimator),
        "INTEGRATOR": value("INTEGRATOR", settings.integrator),
        "BACKGROUND": value("BACKGROUND", settings.background),
        "HAS_SPLIT_SUM_MAPS": int(settings.integrator == "split-sum" or settings.background in _MAPS),
        "SAMPLER": value("SAMPLER", settings.sampler),
        "PIXEL_FILTER": value("PIXEL_FILTER", settings.pixel_filter),
        "RANDOM_TEXTURE_WIDTH": WIDTH,
        "RANDOM_TEXTURE_LAYERS": LAYERS,
    }


def settings_uniforms(settings: RenderSettings) -> dict[str, Any]:
    """The numbers of ``settings``, by the names of their uniforms."""
    never = 2**31 - 1
    return {
        "u_bounces": settings.bounces,
        "u_light_samples": settings.light_samples,
        "u_russian_roulette_vertex": settings.russian_roulette_depth if settings.russian_roulette else never,
        "u_seed": settings.seed,
        "u_background_roughness": settings.background_roughness,
    }
