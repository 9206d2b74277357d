# SPDX-License-Identifier: MIT
"""A file for each BSDF model, named as :attr:`fragtracer.scene.Material.model` with underscores.

Each has a class ``Lobes`` with ``of(parameters)``, ``eval_pdf(wo, wi)`` and ``sample(wo, choice, u)``, as
metallic_roughness.py describes them. Directions are local, on the front.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from ..thin_film import ThinFilm


@dataclass(frozen=True)
class Parameters:
    """A material at a point: colours and numbers of Dr.Jit."""

    albedo: Any  # of the diffuse part
    f0: Any
    f90: Any
    alpha: Any  # roughness squared
    geometry: str
    specular_range: tuple[float, float]  # of the probability to choose the specular lobe
    diffuse_factor: str = "interface"  # or "half-vector"
    film: ThinFilm | None = None


def lobes_of(model: str, parameters: Parameters) -> Any:
    """What a material of ``model`` scatters."""
    return import_module(f".{model.replace('-', '_')}", __name__).Lobes.of(parameters)
