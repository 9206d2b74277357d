# SPDX-License-Identifier: MIT
"""Media as records of shaders/medium/medium.glsl."""

import warnings
from typing import Any

from fragtracer.packing.interiors import dielectrics
from fragtracer.scene import Material, Medium, Scene
from fragtracer.scene.interiors import has_media

_VACUUM = Medium(extinction=(0.0, 0.0, 0.0))


def media_rows(scene: Scene) -> list[dict[str, Any]]:
    """Records of the fog and of what is inside of each dielectric, in the order of their records; none where there is
    no medium."""
    if not has_media(scene):
        return []
    fog = scene.media[scene.fog.medium] if scene.fog else _VACUUM
    return [_row(fog)] + [
        {**_row(_inside(scene, scene.materials[name])), "is_null": scene.materials[name].model == "null"}
        for name in dielectrics(scene.materials)
    ]


def _inside(scene: Scene, material: Material) -> Medium:
    if material.interior is not None:
        return scene.media[material.interior]
    return Medium(extinction=material.absorption, albedo=(0.0, 0.0, 0.0))


def _row(medium: Medium) -> dict[str, Any]:
    return {"extinction": medium.sigma_t, "g": medium.g, "albedo": medium.single_albedo}


def warn_of_light_from_afar(scene: Scene) -> None:
    """Nothing passes a fog without an end."""
    if scene.fog is None or min(scene.media[scene.fog.medium].sigma_t) <= 0:
        return
    if scene.environment is not None or scene.directional_lights or max(scene.ambient.radiance) > 0:
        warnings.warn(
            "no light from infinitely far away arrives through [fog], which has no end: environment, ambient and "
            "directional lights are dark in it; make the medium the interior of a large sphere of model null instead",
            stacklevel=3,
        )
