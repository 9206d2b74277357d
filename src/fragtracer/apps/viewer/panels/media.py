# SPDX-License-Identifier: MIT
"""Controls of media, and of which of them is the fog."""

from collections.abc import Sequence

from fragtracer.apps.viewer.panels import widgets
from fragtracer.scene import Fog, Medium

NONE = "none"
_MOST_G = 0.99
_SHORTEST = 1e-5  # mean free path in m


def edit(medium: Medium) -> Medium:
    """Controls for ``medium``, of the coefficients that it is given by."""
    new: dict[str, object] = {}
    if medium.scattering is not None and medium.absorption is not None:
        new["scattering"] = widgets.color("Scattering", medium.scattering, hdr=True)
        new["absorption"] = widgets.color("Absorption", medium.absorption, hdr=True)
    elif medium.mean_free_path is not None:
        lengths = widgets.color("Mean free path", medium.mean_free_path, hdr=True)
        new["mean_free_path"] = widgets.at_least(_SHORTEST, medium.mean_free_path, lengths)
    else:
        extinction = widgets.color("Extinction", medium.sigma_t, hdr=True)
        new["extinction"] = extinction if extinction != medium.sigma_t else medium.extinction
    if medium.scattering is None:
        albedo = widgets.color("Albedo", medium.single_albedo)
        new["albedo"] = albedo if albedo != medium.single_albedo else medium.albedo
    new["g"] = widgets.slider("g", medium.g, -_MOST_G, _MOST_G, "%.2f")
    return widgets.edited(medium, **new)


def choose(text: str, name: str | None, media: Sequence[str]) -> str | None:
    """A control for one of ``media`` or none."""
    chosen = widgets.choice(text, name or NONE, (NONE, *media))
    return None if chosen == NONE else chosen


def fog(before: Fog | None, media: Sequence[str]) -> Fog | None:
    """A control for what is everywhere."""
    name = choose("Fog", before.medium if before else None, media)
    return Fog(name) if name else None


def new_name(media: Sequence[str]) -> str:
    """A name that none has yet."""
    return next(name for i in range(len(media) + 1) if (name := f"medium-{i + 1}") not in media)
