# SPDX-License-Identifier: MIT
"""What a model of shaders/bsdf/ must be by its formulas, and what it is tried with."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fragtracer import scene
from fragtracer.packing.records import BsdfModel

from .. import Floats
from ..bsdf_oracle import Direction
from ..domains import Cone, Domain

# The parameters of a model: a dataclass whose fields are named as those of the shader's Bsdf.
Parameters = Any
Values = Callable[[Parameters, Floats, Floats], Floats]

WHITE = (1.0, 1.0, 1.0)
ALPHAS = [1e-3, 1e-2, 0.1, 0.5, 1.0]


def no_slack(_: Parameters, wo: Floats, wi: Floats) -> Floats:
    return np.full(np.broadcast_shapes(wo.shape, wi.shape)[:-1], 1e-4)


def hemisphere(_: Parameters, wo: Direction) -> Domain:
    return Cone()


@dataclass(frozen=True)
class Delta:
    """A delta lobe seen from n directions: where it goes to (n, 3), f |cos_i| (n, 3), the chance to sample it (n,), and
    the index of refraction there over that on the side of the viewer; ``null`` says that it is no scattering."""

    wi: Floats
    value: Floats
    chance: Floats
    eta: float = 1.0
    null: bool = False


def no_delta(_: Parameters, wo: Floats) -> Sequence[Delta]:
    return ()


def mirror_image(wo: Floats) -> Floats:
    return wo * (-1, -1, 1)


@dataclass(frozen=True)
class Model:
    """A BSDF, with one choice of its features.

    Attributes
    ----------
    name
        Of its constant BSDF_... in the shader, and of packing.records.BsdfModel, which knows its feature.
    materials
        Parameter sets by name; all of one material are tried one after the other.
    value, pdf
        f |cos_i| (n, 3) and density (n,) of parameters, wo and wi (n, 3), without delta lobes; wo is above the surface,
        and wi where it has to be for the model.
    features
        Defines of the program.
    deltas
        Of parameters and wo (n, 3): the delta lobes.
    transmits
        Whether light passes the surface.
    refracts
        Whether it does so into a medium of the index ``eta`` of the parameters.
    makes_energy
        Whether it reflects more than it receives, at some angle.
    domain
        Cells for directions from a viewer, smaller where the density is high.
    tolerance
        Relative, of values and densities in float32 at wo and wi.
    whitest
        Parameter sets that reflect the most, one by one; ``lossless`` are those that must reflect everything.
    scene_materials
        Two that test_reference_scenes.py compares with Mitsuba; none where bundled scenes have such materials.
    largest_weight
        Of parameters and cosines (n,) of wo: no sample may weigh more, (n, 3).
    """

    name: str
    materials: Mapping[str, Sequence[Parameters]]
    value: Values
    pdf: Values
    largest_weight: Callable[[Parameters, Floats], Floats]
    features: Mapping[str, int | str] = field(default_factory=dict)
    deltas: Callable[[Parameters, Floats], Sequence[Delta]] = no_delta
    transmits: bool = False
    refracts: bool = False
    makes_energy: bool = False
    domain: Callable[[Parameters, Direction], Domain] = hemisphere
    tolerance: Values = no_slack
    whitest: Sequence[Parameters] = ()
    lossless: Sequence[Parameters] = ()
    scene_materials: Sequence[scene.Material] = ()

    @property
    def feature(self) -> str:
        return BsdfModel[self.name].feature

    @property
    def glossy(self) -> dict[str, list[Parameters]]:
        """The parameter sets without a delta lobe."""
        up = np.array([(0.0, 0.0, 1.0)])
        return {name: [p for p in some if not self.deltas(p, up)] for name, some in self.materials.items()}

    def delta_chance(self, parameters: Parameters, wo: Floats) -> float:
        """The chance to sample a delta lobe from one direction (3,)."""
        return float(sum(delta.chance[0] for delta in self.deltas(parameters, np.array([wo]))))

    def power(self, parameters: Parameters, wi: Floats) -> Floats:
        """Power over radiance of what comes from wi (n, 3): eta² where it is refracted (n,)."""
        return np.where(wi[..., 2] < 0, parameters.eta**2, 1.0) if self.refracts else np.ones(wi.shape[:-1])
