# SPDX-License-Identifier: MIT
"""The table of all models of shaders/bsdf/: what each is tried with, and what it must be by its formulas.

Whatever is asked of every BSDF is asked of each entry of :data:`MODELS` by test_bsdf_values.py and test_bsdf_sample.py:
values and densities, reciprocity, chi² of its samples, weights, albedos, white furnaces, events, and arguments at the
ends of their ranges. A new model needs an entry and its formulas in float64, and no test of its own for these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from fragtracer import scene

from . import Floats, bsdf_oracle
from .bsdf_oracle import Direction, Lambert, Material
from .domains import Cone, Domain, Reflections

# The parameters of a model: a dataclass whose fields are named as those of the shader's Bsdf.
Parameters = Any
Values = Callable[[Parameters, Floats, Floats], Floats]

WHITE = (1.0, 1.0, 1.0)
ALPHAS = [1e-3, 1e-2, 0.1, 0.5, 1.0]
DEGREES = [0, 45, 80, 89]
TERMS = ["SMITH", "SMITH_HEIGHT_CORRELATED", "SCHLICK_BECKMANN", "KARIS"]


def no_slack(_: Parameters, wo: Floats, wi: Floats) -> Floats:
    return np.full(np.broadcast_shapes(wo.shape, wi.shape)[:-1], 1e-4)


def hemisphere(_: Parameters, wo: Direction) -> Domain:
    return Cone()


def no_delta(_: Parameters, wo: Floats) -> tuple[Floats, Floats]:
    return np.zeros(wo.shape), np.zeros(wo.shape[:-1])


@dataclass(frozen=True)
class Model:
    """A BSDF that reflects, with one choice of its features.

    Attributes
    ----------
    name
        Of its constant BSDF_... and its feature HAS_...
    materials
        Parameter sets by name; all of one material are tried one after the other.
    value, pdf
        f |cos_i| (n, 3) and density (n,) of parameters, wo and wi (n, 3), all above the surface, without delta lobes.
    features
        Defines of the program.
    delta
        Of parameters and wo (n, 3): what a mirror lobe reflects (n, 3), and the chance to sample it (n,).
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
    delta: Callable[[Parameters, Floats], tuple[Floats, Floats]] = no_delta
    domain: Callable[[Parameters, Direction], Domain] = hemisphere
    tolerance: Values = no_slack
    whitest: Sequence[Parameters] = ()
    lossless: Sequence[Parameters] = ()
    scene_materials: Sequence[scene.Material] = ()

    @property
    def glossy(self) -> dict[str, list[Parameters]]:
        """The parameter sets without a delta lobe."""
        up = np.array([(0.0, 0.0, 1.0)])
        return {name: [p for p in some if not self.delta(p, up)[0].any()] for name, some in self.materials.items()}


# The material over a Lambert base, of every width, and as a mirror.
COOK_TORRANCE = {
    "lambert": Material(diffuse=(0.8, 0.5, 0.2)),
    "plastic": Material(diffuse=(0.6, 0.3, 0.1), f0=(0.04, 0.04, 0.04), f90=WHITE),
    "white dielectric": Material(diffuse=WHITE, f0=(0.04, 0.04, 0.04), f90=WHITE),
    "diamond": Material(diffuse=WHITE, f0=(0.17, 0.17, 0.17), f90=WHITE),
    "faint plastic": Material(diffuse=WHITE, f0=(0.02, 0.02, 0.02), f90=(0.5, 0.5, 0.5)),
    "red plastic": Material(diffuse=WHITE, f0=(0.04, 0.002, 0.0), f90=(1.0, 0.1, 0.0)),
    "half metallic": Material(diffuse=(0.5, 0.35, 0.15), f0=(0.52, 0.37, 0.165), f90=WHITE),
    "gold": Material(f0=(1.0, 0.71, 0.29), f90=WHITE),
    "white metal": Material(f0=WHITE, f90=WHITE),
}


# Those tried with each other geometry term: a term is no matter of the material's colours.
OF_EACH_TERM = ("plastic", "half metallic", "gold")


def of_all_widths(materials: Mapping[str, Material]) -> dict[str, list[Material]]:
    return {name: [replace(m, alpha=alpha) for alpha in (0.0, *ALPHAS)] for name, m in materials.items()}


def white_materials() -> list[Material]:
    """What reflects the most: white bases under all interfaces that a scene can ask for, and metals."""
    reflectances = (0.0, 0.001, 0.01, 0.02, 0.04, 0.17, 0.5, 1.0)
    chosen = [scene.Material(albedo=WHITE, f0=f0, specular=s) for f0 in reflectances for s in (1.0, 0.3)]
    odd = ((0.04, 0.0, 0.0), (0.0, 1.0, 0.02), (0.2, 0.01, 0.001))
    chosen += [scene.Material(albedo=WHITE, f0=f0, metallic=metallic) for f0 in odd for metallic in (0.0, 0.5)]
    chosen += [scene.Material(albedo=(1.0, 0.5, 0.0), metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    chosen += [scene.Material(albedo=WHITE, metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    return [Material(m.diffuse_albedo, 1.0, m.specular_f0, m.specular_f90) for m in chosen]


WIDTHS = [1e-3, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]


def cook_torrance(term: str) -> Model:
    smith = "SMITH" in term
    # The other terms are nowhere larger than Smith's (test_ggx.py), and share its base.
    whitest = white_materials() if smith else [COOK_TORRANCE["white metal"]]

    def value(m: Material, wo: Floats, wi: Floats) -> Floats:
        return bsdf_oracle.bsdf_eval(m, term, wo, wi) if m.alpha > 0 else bsdf_oracle.bsdf_eval_diffuse(m, wo, wi)

    def delta(m: Material, wo: Floats) -> tuple[Floats, Floats]:
        if m.alpha > 0:
            return no_delta(m, wo)
        mirrored = bsdf_oracle.fresnel(m.f0, m.f90, wo[..., 2])
        masking = bsdf_oracle.g(term, 0.0, wo[..., 2], wo[..., 2])[..., None]
        return mirrored * masking, bsdf_oracle.specular_probability(m, wo)

    def largest_weight(m: Material, cosine: Floats) -> Floats:
        """The larger one of the two lobes alone, each divided by its chance, with the most that Fresnel and masking
        leave."""
        wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
        chance = bsdf_oracle.specular_probability(m, wo, term)[:, None]
        masking = bsdf_oracle.g1(term, m.alpha, wo[:, 2]) / bsdf_oracle.g1_smith(m.alpha, wo[:, 2])
        specular = np.maximum(m.f0, m.f90) * masking[:, None]
        base = np.multiply(m.diffuse, 1 - bsdf_oracle.interface_reflectance(m, wo[:, 2], term))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.fmax(np.where(chance > 0, specular / chance, 0), np.where(chance < 1, base / (1 - chance), 0))

    return Model(
        "COOK_TORRANCE",
        of_all_widths(COOK_TORRANCE if term == "SMITH" else {name: COOK_TORRANCE[name] for name in OF_EACH_TERM}),
        value,
        partial(bsdf_oracle.bsdf_pdf, term=term),
        largest_weight,
        {"GEOMETRY_TERM": f"GEOMETRY_{term}"},
        delta,
        lambda m, wo: Reflections(m.alpha or 1.0, wo),
        float32_tolerance,
        [replace(m, alpha=alpha) for m in whitest for alpha in (0.0, *WIDTHS)],
        [replace(COOK_TORRANCE["white metal"], alpha=1e-3)] if smith else [],
    )


def float32_tolerance(m: Material, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what the distribution makes of rounding the half vector: its slope is at most 2 / alpha. Under a
    mirror, what a rounded reflectance leaves of the little that is let through."""
    tolerance = no_slack(m, wo, wi)
    if m.alpha > 0:
        return tolerance + 4e-7 / (m.alpha * np.linalg.norm(wo + wi, axis=-1))
    passed = [1 - bsdf_oracle.interface_reflectance(m, w[..., 2]).max(axis=-1) for w in (wo, wi)]
    return tolerance + 2e-7 / np.maximum(np.minimum(*passed), 1e-30)


DIFFUSE = Model(
    "DIFFUSE",
    {
        "grey": [Lambert((0.5, 0.5, 0.5))],
        "coloured": [Lambert((0.8, 0.5, 0.2))],
        "white": [Lambert(WHITE)],
        "black": [Lambert((0.0, 0.0, 0.0))],
    },
    bsdf_oracle.lambert_eval,
    bsdf_oracle.lambert_pdf,
    lambda p, cosine: np.broadcast_to(p.diffuse, (len(cosine), 3)),
    whitest=[Lambert(WHITE)],
    lossless=[Lambert(WHITE)],
)


@dataclass(frozen=True)
class Eon:
    """Of BSDF_EON."""

    diffuse: Direction
    alpha: float


def eon_albedo(roughness: float, cosine: Floats) -> Floats:
    """Portsmouth, Kutz and Hill 2025, equations 12 and 13."""
    sine = np.sqrt(1 - cosine**2)
    above = cosine * sine * (1 + sine + sine**2) / (1 + sine)  # sin / cos (1 - sin³)
    g = sine * (np.arccos(cosine) - sine * cosine) + 2 / 3 * (above - sine)
    return (1 + roughness * g / np.pi) / (1 + (1 / 2 - 2 / (3 * np.pi)) * roughness)


def eon_eval(p: Eon, wo: Floats, wi: Floats) -> Floats:
    r, rho = np.sqrt(p.alpha), np.asarray(p.diffuse)
    scale = 1 / (1 + (1 / 2 - 2 / (3 * np.pi)) * r)
    s = (wo * wi).sum(-1) - wo[..., 2] * wi[..., 2]
    single = scale * (1 + r * np.where(s > 0, s / np.maximum(wo[..., 2], wi[..., 2]), s))
    mean = scale * (1 + (2 / 3 - 28 / (15 * np.pi)) * r)
    lost = np.ones(single.shape) * 0
    if r > 0:
        lost = (1 - eon_albedo(r, wo[..., 2])) * (1 - eon_albedo(r, wi[..., 2])) / (1 - mean)
    tint = rho**2 * mean / (1 - rho * (1 - mean))
    return (rho * single[..., None] + tint * lost[..., None]) * wi[..., 2:] / np.pi


def eon_largest_weight(p: Eon, cosine: Floats) -> Floats:
    """What the first lobe can be at most along the horizon, and all of the second."""
    r = np.sqrt(p.alpha)
    weight = 1 + r * np.sqrt(1 - cosine**2) / np.maximum(cosine, 1e-30)
    return np.broadcast_to((weight + 1)[:, None], (len(cosine), 3))


@dataclass(frozen=True)
class EonDomain:
    """The hemisphere, its cells parted where wi is as steep as wo and where it is beside it, which are kinks, and
    crowded towards the first."""

    wo: Direction

    @property
    def _kink(self) -> float:
        """The cosine there; any other where there is none."""
        return self.wo[2] if self.wo[2] < 0.999 else 0.5

    @property
    def _azimuth(self) -> float:
        return float(np.arctan2(self.wo[1], self.wo[0]))

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        x, height = 2 * np.minimum(s, 0.5), np.log(self._kink)
        upper = np.exp(height * x**2)
        cosine = np.where(s < 0.5, upper, self._kink * (2 - 2 * s))
        slope = np.where(s < 0.5, -4 * height * x * upper, 2 * self._kink)
        sine, angle = np.sqrt(1 - cosine**2), self._azimuth + 2 * np.pi * t
        return np.stack([sine * np.cos(angle), sine * np.sin(angle), cosine], -1), 2 * np.pi * slope

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        cosine = np.clip(points[:, 2], 0, 1)
        with np.errstate(divide="ignore"):
            upper = np.sqrt(np.log(cosine) / np.log(self._kink)) / 2
        s = np.where(cosine > self._kink, upper, 1 - cosine / self._kink / 2)
        return np.where(points[:, 2] > 0, s, -1), (np.arctan2(points[:, 1], points[:, 0]) - self._azimuth) / (
            2 * np.pi
        ) % 1


def eon_tolerance(p: Eon, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what rounding makes of the first lobe where it all but vanishes, opposite the viewer."""
    s = (wo * wi).sum(-1) - wo[..., 2] * wi[..., 2]
    return 1e-4 + 2e-7 / np.maximum(1 + np.sqrt(p.alpha) * np.minimum(s, 0), 1e-7)


EON_ALPHAS = (0.0, 0.01, 0.25, 1.0)
EON = Model(
    "EON",
    {
        "clay": [Eon((0.6, 0.3, 0.15), alpha) for alpha in EON_ALPHAS],
        "white clay": [Eon(WHITE, alpha) for alpha in EON_ALPHAS],
        "black clay": [Eon((0.0, 0.0, 0.0), 1.0)],
    },
    eon_eval,
    bsdf_oracle.lambert_pdf,
    eon_largest_weight,
    domain=lambda _, wo: EonDomain(wo),
    tolerance=eon_tolerance,
    whitest=[Eon(WHITE, alpha) for alpha in EON_ALPHAS],
    lossless=[Eon(WHITE, alpha) for alpha in EON_ALPHAS],
    scene_materials=[
        scene.Material(model="eon", albedo=(0.8, 0.4, 0.2), roughness=1.0),
        scene.Material(model="eon", albedo=(0.3, 0.5, 0.8), roughness=0.4),
    ],
)

MODELS: dict[str, Model] = {
    "eon": EON,
    "diffuse": DIFFUSE,
    **{f"cook-torrance {term}": cook_torrance(term) for term in TERMS},
}
CASES = [(name, material) for name, model in MODELS.items() for material in model.materials]
