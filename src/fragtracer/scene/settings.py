# SPDX-License-Identifier: MIT
"""Render settings."""

from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import CONFIG, Fraction, Whole

# The settings of which "auto" decides, all off: paths from the camera alone, as many in every pixel.
PLAIN: dict[str, Any] = dict.fromkeys(("adaptive", "guiding", "light_tracing", "gradient_domain"), "off")


@dataclass(frozen=True, config=CONFIG)
class RenderSettings:
    """How to render, with the defaults of a scene file.

    ``bounces`` counts scattering events on a path: 0 shows emitters only, 1 adds direct light.
    ``rays`` is the number of paths per pixel in one pass, ``light_samples`` the number of shadow
    rays at each vertex. Russian roulette may end a path from vertex ``russian_roulette_depth`` on.
    ``adaptive`` places samples where the relative error is, without bias (docs/sampling.md), for the integrator "path";
    "auto" does so where that promises less error in the same time.
    ``geometry`` is the masking and shadowing of microfacets: Smith's, "smith" without correlation of the two and
    "smith-height-correlated" with it, or one of two approximations (docs/material.md).
    ``multiple_scattering`` compensates rough specular lobes for the energy of multiple scattering between
    microfacets. The ``integrator`` "split-sum" is the approximation of game engines (Karis 2013): the first hit,
    shaded by lookups of the prefiltered environment and by lights without shadows. Camera rays that leave the scene
    see the ``background``: the environment itself, the map prefiltered for ``background_roughness``, its irradiance
    over pi, or black.

    ``guiding`` sends part of the paths where light arrives from few directions, as photons have found before the
    picture begins (docs/sampling.md); "auto" does so where it promises less noise in the same time.
    ``light_tracing`` traces what surfaces throw narrowly onto others, caustics above all, from the lights to the pixels
    that see it (docs/sampling.md); "auto" does so where that promises less noise in the same time.
    ``gradient_domain`` makes the picture from differences of neighbouring pixels that take the same random numbers,
    without bias and without adaptive sampling (docs/sampling.md); "auto" does so where that promises less error.
    """

    width: Annotated[Whole, Field(ge=1, le=16384)] = 640
    height: Annotated[Whole, Field(ge=1, le=16384)] = 480
    spp: Annotated[Whole, Field(ge=1, le=2**24)] = 256
    bounces: Annotated[Whole, Field(ge=0, le=10000)] = 5
    rays: Annotated[Whole, Field(ge=1, le=1024)] = 16
    light_samples: Annotated[Whole, Field(ge=1, le=1024)] = 1
    russian_roulette: bool = True
    russian_roulette_depth: Annotated[Whole, Field(ge=1, lt=2**31)] = 5
    geometry: Literal["smith", "smith-height-correlated", "schlick-beckmann", "karis"] = "smith"
    multiple_scattering: bool = False
    estimator: Literal["mis", "nee", "bsdf"] = "mis"
    sampler: Literal["texture", "hash"] = "texture"
    pixel_filter: Literal["box", "tent", "gaussian"] = "box"
    adaptive: Literal["auto", "on", "off"] = "auto"
    seed: Annotated[Whole, Field(ge=0, lt=2**32)] = 0
    integrator: Literal["path", "split-sum"] = "path"
    background: Literal["environment", "prefiltered", "irradiance", "black"] = "environment"
    background_roughness: Fraction = 0.0
    guiding: Literal["auto", "on", "off"] = "auto"
    light_tracing: Literal["auto", "on", "off"] = "auto"
    gradient_domain: Literal["auto", "on", "off"] = "auto"

    def __post_init__(self) -> None:
        if self.multiple_scattering and self.geometry != "smith":
            raise ValueError('multiple_scattering must be false unless geometry is "smith"; it is fitted to that term')
        if self.adaptive == self.gradient_domain == "on":
            raise ValueError(
                'adaptive and gradient_domain must not both be "on": differences need as many samples of each pixel'
            )
