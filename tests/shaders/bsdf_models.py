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
from fragtracer.packing.coats import coat
from fragtracer.packing.records import BsdfModel
from fragtracer.scene.reflectance import METAL_INDEX

from . import Floats, bsdf_oracle
from .bsdf_oracle import Direction, Filmed, Lambert, Material
from .domains import Cone, Domain, Grazing, Reflections, Sides

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
    """What reflects the most: white bases under all interfaces that a scene can ask for, and metals; each channel of a
    material is that of one of these."""
    reflectances = (0.0, 0.001, 0.01, 0.02, 0.04, 0.17, 0.5, 1.0)
    chosen = [scene.Material(albedo=WHITE, f0=f0, specular=s) for f0 in reflectances for s in (1.0, 0.3)]
    odd = ((0.04, 0.0, 0.0), (0.0, 1.0, 0.02), (0.2, 0.01, 0.001))
    chosen += [scene.Material(albedo=WHITE, f0=f0, metallic=metallic) for f0 in odd for metallic in (0.0, 0.5)]
    chosen += [scene.Material(albedo=(1.0, 0.5, 0.0), metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    chosen += [scene.Material(albedo=WHITE, metallic=metallic) for metallic in (0.1, 0.5, 0.9, 1.0)]
    # A channel knows nothing of the others: three materials of which each is all of one channel are as good as one.
    colors = [zip(m.diffuse_albedo, m.specular_f0, m.specular_f90, strict=True) for m in chosen]
    channels = list(dict.fromkeys(channel for color in colors for channel in color))
    channels += channels[-1:] * (-len(channels) % 3)
    packed = [tuple(zip(*channels[i : i + 3], strict=True)) for i in range(0, len(channels), 3)]
    return [Material(diffuse, 1.0, f0, f90) for diffuse, f0, f90 in packed]


WIDTHS = [1e-3, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]


def cook_torrance(term: str) -> Model:
    smith = "SMITH" in term
    # The other terms are nowhere larger than Smith's (test_ggx.py), and share its base.
    whitest = white_materials() if smith else [COOK_TORRANCE["white metal"]]

    def value(m: Material, wo: Floats, wi: Floats) -> Floats:
        return bsdf_oracle.bsdf_eval(m, term, wo, wi) if m.alpha > 0 else bsdf_oracle.bsdf_eval_diffuse(m, wo, wi)

    def deltas(m: Material, wo: Floats) -> Sequence[Delta]:
        if m.alpha > 0 or max(*m.f0, *m.f90, getattr(m, "iridescence", 0.0)) == 0:
            return ()
        mirrored = bsdf_oracle.facet_fresnel(m, wo[..., 2])
        masking = bsdf_oracle.g(term, 0.0, wo[..., 2], wo[..., 2])[..., None]
        return [Delta(mirror_image(wo), mirrored * masking, bsdf_oracle.specular_probability(m, wo))]

    def largest_weight(m: Material, cosine: Floats) -> Floats:
        """The larger one of the two lobes alone, each divided by its chance, with the most that Fresnel and masking
        leave. A film has colors of its own, whose rounding what passes does not share with the chance."""
        wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
        chance = bsdf_oracle.specular_probability(m, wo, term)[:, None]
        masking = bsdf_oracle.g1(term, m.alpha, wo[:, 2]) / bsdf_oracle.g1_smith(m.alpha, wo[:, 2])
        has_film = getattr(m, "iridescence", 0.0) > 0
        most = WHITE if has_film else np.maximum(m.f0, m.f90)
        specular = most * masking[:, None]
        base = np.multiply(m.diffuse, 1 - bsdf_oracle.interface_reflectance(m, wo[:, 2], term))
        with np.errstate(divide="ignore", invalid="ignore"):
            left = 1 - chance - (2**-24 if has_film else 0)
            return np.fmax(np.where(chance > 0, specular / chance, 0), np.where(left > 0, base / left, 0))

    return Model(
        "COOK_TORRANCE",
        of_all_widths(COOK_TORRANCE if term == "SMITH" else {name: COOK_TORRANCE[name] for name in OF_EACH_TERM}),
        value,
        partial(bsdf_oracle.bsdf_pdf, term=term),
        largest_weight,
        {"GEOMETRY_TERM": f"GEOMETRY_{term}"},
        deltas,
        domain=lambda m, wo: Reflections(m.alpha or 1.0, wo),
        tolerance=float32_tolerance,
        whitest=[replace(m, alpha=alpha) for m in whitest for alpha in (0.0, *WIDTHS)],
        lossless=[replace(COOK_TORRANCE["white metal"], alpha=1e-3)] if smith else [],
    )


def float32_tolerance(m: Material, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what the distribution makes of rounding the half vector: its slope is at most 2 / alpha. Under a
    mirror, what a rounded reflectance leaves of the little that is let through."""
    tolerance = no_slack(m, wo, wi)
    if m.alpha > 0:
        return tolerance + 4e-7 / (m.alpha * np.linalg.norm(wo + wi, axis=-1))
    passed = [1 - bsdf_oracle.interface_reflectance(m, w[..., 2]).max(axis=-1) for w in (wo, wi)]
    return tolerance + 2e-7 / np.maximum(np.minimum(*passed), 1e-30)


@dataclass(frozen=True)
class HalfVector(Material):
    """Whose base has 1 - F(wo . wh) in place of what passes the interface."""

    half_vector: int = 1


def half_vector_eval(m: HalfVector, wo: Floats, wi: Floats) -> Floats:
    cosine = np.linalg.norm(wo + wi, axis=-1) / 2
    base = np.asarray(m.diffuse) * (1 - bsdf_oracle.fresnel(m.f0, m.f90, cosine)) * wi[..., 2:] / np.pi
    if m.alpha == 0:
        return base
    return base + bsdf_oracle.bsdf_eval(replace(m, diffuse=(0.0, 0.0, 0.0)), "SMITH", wo, wi)


def half_vector_largest_weight(m: HalfVector, cosine: Floats) -> Floats:
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance = bsdf_oracle.specular_probability(m, wo)[:, None]
    with np.errstate(divide="ignore"):
        return np.maximum(np.maximum(m.f0, m.f90) / chance, np.asarray(m.diffuse) / (1 - chance))


def half_vector_tolerance(m: HalfVector, wo: Floats, wi: Floats) -> Floats:
    """As without, and what rounding the half vector makes of 1 - F where that is little."""
    size = np.linalg.norm(wo + wi, axis=-1)
    passed = 1 - bsdf_oracle.fresnel(m.f0, m.f90, size / 2).max(axis=-1)
    return float32_tolerance(m, wo, wi) + 1e-6 / np.maximum(passed * size, 1e-30)


@dataclass(frozen=True)
class Brushed(Material):
    """With facets of two widths."""

    anisotropy: float = 0.5


def brushed_eval(m: Brushed, term: str, wo: Floats, wi: Floats) -> Floats:
    """The specular lobe with the width along each direction in the term of masking and shadowing."""
    wh = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    one, other = (bsdf_oracle.g1(term, bsdf_oracle.width_along(m.alpha, m.anisotropy, w), w[..., 2]) for w in (wo, wi))
    masking = 1 / (1 / one + 1 / other - 1) if term == "SMITH_HEIGHT_CORRELATED" else one * other
    d = bsdf_oracle.facets_d(m.alpha, m.anisotropy, wh) / (4 * wo[..., 2])
    fresnel = bsdf_oracle.fresnel(m.f0, m.f90, (wo * wh).sum(-1))
    return bsdf_oracle.bsdf_eval_diffuse(m, wo, wi, term) + fresnel * (d * masking)[..., None]


def brushed_pdf(m: Brushed, wo: Floats, wi: Floats, term: str) -> Floats:
    facets = conductor_pdf(Conductor(WHITE, WHITE, m.alpha, m.anisotropy), wo, wi)
    chance = bsdf_oracle.specular_probability(m, wo, term)
    return chance * facets + (1 - chance) * wi[..., 2] / np.pi


def brushed(term: str) -> Model:
    model = cook_torrance(term)
    some = {
        name: [Brushed(m.diffuse, alpha, m.f0, m.f90, anisotropy) for alpha, anisotropy in BRUSHED]
        for name, m in COOK_TORRANCE.items()
        if name in ("plastic", "gold")
    }
    white = [COOK_TORRANCE[name] for name in ("white dielectric", "white metal")] if "SMITH" in term else []

    def largest_weight(m: Brushed, cosine: Floats) -> Floats:
        return np.fmax(model.largest_weight(m, cosine), model.largest_weight(replace(m, alpha=1.0), cosine))

    return replace(
        model,
        materials=some,
        value=lambda m, wo, wi: brushed_eval(m, term, wo, wi),
        pdf=partial(brushed_pdf, term=term),
        largest_weight=largest_weight,
        deltas=no_delta,
        whitest=[Brushed(m.diffuse, alpha, m.f0, m.f90, by) for m in white for alpha, by in BRUSHED],
        lossless=[],
        scene_materials=[
            scene.Material(albedo=(0.8, 0.5, 0.3), roughness=0.4, anisotropy=0.8),
            scene.Material(
                model="conductor", metal="gold", roughness=0.3, anisotropy=0.7, anisotropy_rotation_degrees=90.0
            ),
        ]
        if term == "SMITH"
        else [],
    )


HALF_VECTOR = replace(
    cook_torrance("SMITH"),
    materials={
        name: [HalfVector(m.diffuse, alpha, m.f0, m.f90) for alpha in (0.0, 0.01, 0.5)]
        for name, m in COOK_TORRANCE.items()
        if name in ("plastic", "half metallic")
    },
    value=half_vector_eval,
    largest_weight=half_vector_largest_weight,
    tolerance=half_vector_tolerance,
    whitest=[],
    lossless=[],
    makes_energy=True,
    scene_materials=[
        scene.Material(albedo=(0.8, 0.6, 0.4), roughness=0.2, diffuse_factor="half-vector"),
        scene.Material(albedo=(0.8, 0.6, 0.4), roughness=0.6, metallic=0.3, diffuse_factor="half-vector"),
    ],
)


def filmed(name: str, alpha: float, iridescence: float = 1.0, ior: float = 1.3, thickness: float = 400.0) -> Filmed:
    m = COOK_TORRANCE[name]
    return Filmed(m.diffuse, alpha, m.f0, m.f90, iridescence, ior, thickness)


def iridescent_tolerance(m: Filmed, wo: Floats, wi: Floats) -> Floats:
    """As without, and what rounding makes of what the film leaves small, reflected or passed to the base."""
    facets = bsdf_oracle.facet_fresnel(m, np.linalg.norm(wo + wi, axis=-1) / 2)
    there, back = (bsdf_oracle.interface_reflectance(m, w[..., 2]) for w in (wo, wi))
    reflected = np.minimum(facets, there).min(axis=-1)
    passed = [(1 - r).min(axis=-1) for r in (there, back)]
    rounding = 1e-6 / np.maximum(reflected, 1e-30) + sum(4e-6 / np.maximum(p, 1e-30) for p in passed)
    return float32_tolerance(m, wo, wi) + rounding


# Interfaces of all contrasts under films of all thicknesses, white below.
SOME_F0 = [(0.0, 0.001, 0.02), (0.04, 0.17, 0.5)]
IRIDESCENT = replace(
    cook_torrance("SMITH"),
    materials={
        "oil": [filmed("plastic", alpha, thickness=350.0) for alpha in (0.0, 0.1, 0.5)],
        "oxide": [filmed("gold", alpha, 0.7, 2.4, 120.0) for alpha in (0.0, 0.01, 1.0)],
        "soap": [Filmed((0.8, 0.5, 0.2), alpha, iridescence=1.0, iridescence_thickness=120.0) for alpha in (0.0, 0.3)],
    },
    features={"GEOMETRY_TERM": "GEOMETRY_SMITH", "HAS_EXACT_FRESNEL": 1},
    tolerance=iridescent_tolerance,
    whitest=[
        Filmed(WHITE, alpha, f0, tuple(min(1, 50 * f) for f in f0), 1.0, ior, thickness)
        for f0 in SOME_F0
        for ior, thickness in ((1.1, 1200.0), (1.3, 200.0), (1.3, 500.0), (1.6, 400.0), (2.1, 330.0), (2.5, 100.0))
        for alpha in (0.0, 0.03, 0.1, 0.3, 0.6, 1.0)
    ],
    lossless=[],
    scene_materials=[],  # test_reference_meshes.py compares one
)


@dataclass(frozen=True)
class Sheened(Filmed):
    """Of BSDF_SHEEN."""

    sheen_color: Direction = (0.0, 0.0, 0.0)
    sheen_roughness: float = 1.0


def sheen_factors(m: Sheened, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| of the sheen (..., 3), and the factor of the base (..., 1)."""
    albedos = [bsdf_oracle.sheen_albedo(m.sheen_roughness, w[..., 2:]) for w in (wo, wi)]
    most = np.maximum(*albedos)
    lobe = bsdf_oracle.sheen_lobe(m.sheen_roughness, wo, wi)[..., None]
    return lobe / np.maximum(most, 1) * m.sheen_color, 1 - max(m.sheen_color) * np.minimum(most, 1)


def sheen_shares(m: Sheened, wo: Floats) -> tuple[Floats, Floats]:
    """Estimates of what the sheen and the base reflect (...,)."""
    white = np.minimum(1, bsdf_oracle.sheen_albedo(m.sheen_roughness, wo[..., 2]))
    r = bsdf_oracle.interface_reflectance(m, wo[..., 2])
    base = (r + np.asarray(m.diffuse) * (1 - r) * (1 - np.asarray(m.f0))) @ bsdf_oracle.REC_709
    return white * (m.sheen_color @ bsdf_oracle.REC_709), (1 - max(m.sheen_color) * white) * base


def sheen_probability(m: Sheened, wo: Floats) -> Floats:
    sheen, base = sheen_shares(m, wo)
    return sheen / np.maximum(sheen + base, 1e-300)


def sheen_eval(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    sheen, kept = sheen_factors(m, wo, wi)
    return sheen + kept * cook_torrance("SMITH").value(m, wo, wi)


def sheen_pdf(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    chance = sheen_probability(m, wo)
    return chance / (2 * np.pi) + (1 - chance) * bsdf_oracle.bsdf_pdf(m, wo, wi)


def sheen_deltas(m: Sheened, wo: Floats) -> Sequence[Delta]:
    """Of a mirror below the sheen."""
    return [
        Delta(d.wi, d.value * sheen_factors(m, wo, d.wi)[1], d.chance * (1 - sheen_probability(m, wo)))
        for d in cook_torrance("SMITH").deltas(m, wo)
    ]


def sheen_largest_weight(m: Sheened, cosine: Floats) -> Floats:
    """The larger one of sheen and base alone, each divided by its chance; D is at most (2 + 1 / alpha) / 2 pi."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, o = sheen_probability(m, wo)[:, None], np.maximum(wo[:, 2:], 1e-3)
    masked = 4 * o * (1 + bsdf_oracle.sheen_lambda(m.sheen_roughness, o))
    with np.errstate(divide="ignore", invalid="ignore"):
        sheen = (2 + m.sheen_roughness**-2) / masked * m.sheen_color / chance
        return np.fmax(sheen, np.where(chance < 1, cook_torrance("SMITH").largest_weight(m, cosine) / (1 - chance), 0))


def sheen_tolerance(m: Sheened, wo: Floats, wi: Floats) -> Floats:
    """What the exponent 1 / alpha makes of rounding the half vector."""
    return float32_tolerance(m, wo, wi) + 4e-7 / (m.sheen_roughness**2 * np.linalg.norm(wo + wi, axis=-1))


def sheened(name: str, alpha: float, color: Direction, roughness: float) -> Sheened:
    m = COOK_TORRANCE[name]
    return Sheened(m.diffuse, alpha, m.f0, m.f90, sheen_color=color, sheen_roughness=roughness)


RED = (0.8, 0.2, 0.1)
GRAZING = Grazing()
SHEEN = Model(
    "SHEEN",
    {
        "cloth": [sheened("lambert", 1.0, RED, roughness) for roughness in (0.1, 0.3, 1.0)],
        "over plastic": [sheened("plastic", 0.3, RED, roughness) for roughness in (0.15, 0.6)],
        "over a mirror": [sheened("gold", 0.0, RED, 0.4)],
        "velvet": [Sheened(sheen_color=RED, sheen_roughness=0.5)],
    },
    sheen_eval,
    sheen_pdf,
    sheen_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    sheen_deltas,
    domain=lambda m, wo: GRAZING if m.alpha in (0.0, 1.0) else Reflections(m.alpha, wo),
    tolerance=sheen_tolerance,
    whitest=[
        replace(m, sheen_color=WHITE, sheen_roughness=roughness)
        for m in (sheened("white dielectric", 0.0, WHITE, 1.0), Sheened(WHITE), sheened("white metal", 0.0, WHITE, 1.0))
        for roughness in (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 0.8, 1.0)
    ],
    scene_materials=[
        scene.Material(albedo=(0.1, 0.02, 0.02), roughness=0.8, sheen_color=RED, sheen_roughness=0.5),
        scene.Material(
            albedo=0.3, metallic=0.5, roughness=0.5, sheen_color=0.9, sheen_roughness=0.2, coat=0.5, coat_roughness=0.3
        ),
    ],
)


@dataclass(frozen=True)
class Coated(Sheened):
    """Of BSDF_COATED, whose coat has the normal of the base; without sheen."""

    coat_weight: float = 1.0
    coat_alpha: float = 0.1
    coat_f0: float = 0.04
    base_normal: Direction = (0.0, 0.0, 1.0)
    base_tangent: Direction = (1.0, 0.0, 0.0)
    geometric: Direction = (0.0, 0.0, 1.0)

    @property
    def lacquer(self) -> Material:
        """The coat alone."""
        return Material((0.0, 0.0, 0.0), self.coat_alpha, (self.coat_f0,) * 3, WHITE)

    def passed(self, w: Floats) -> Floats:
        """What the coat lets through (...,)."""
        return 1 - self.coat_weight * bsdf_oracle.interface_reflectance(self.lacquer, w[..., 2])[..., 0]


def coated_probability(m: Coated, wo: Floats) -> Floats:
    """How often the coat is sampled."""
    passed, base = m.passed(wo), sum(sheen_shares(m, wo))
    return (1 - passed) / np.maximum(1 - passed + passed**2 * base, 1e-300)


def coated_eval(m: Coated, wo: Floats, wi: Floats) -> Floats:
    base = sheen_eval(m, wo, wi) * (m.passed(wo) * m.passed(wi))[..., None]
    return base + m.coat_weight * bsdf_oracle.bsdf_eval(m.lacquer, "SMITH", wo, wi)


def coated_pdf(m: Coated, wo: Floats, wi: Floats) -> Floats:
    chance = coated_probability(m, wo)
    return chance * bsdf_oracle.bsdf_pdf(m.lacquer, wo, wi) + (1 - chance) * sheen_pdf(m, wo, wi)


def coated_deltas(m: Coated, wo: Floats) -> Sequence[Delta]:
    """Of a mirror below the coat."""
    return [
        Delta(d.wi, d.value * m.passed(wo)[:, None] ** 2, d.chance * (1 - coated_probability(m, wo)))
        for d in sheen_deltas(m, wo)
    ]


def coated_largest_weight(m: Coated, cosine: Floats) -> Floats:
    """The larger one of coat and base alone, each divided by its chance."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = coated_probability(m, wo)[:, None], m.passed(wo)[:, None] * (1 - m.coat_weight * m.coat_f0)
    base = sheen_largest_weight(m, cosine) * passed
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.fmax(m.coat_weight / chance, np.where(chance < 1, base / (1 - chance), 0))


def coated_tolerance(m: Coated, wo: Floats, wi: Floats) -> Floats:
    return sheen_tolerance(m, wo, wi) + 4e-7 / (m.coat_alpha * np.linalg.norm(wo + wi, axis=-1))


def coated(name: str, alpha: float, weight: float, coat_alpha: float, f0: float = 0.04) -> Coated:
    m = COOK_TORRANCE[name]
    return Coated(m.diffuse, alpha, m.f0, m.f90, coat_weight=weight, coat_alpha=coat_alpha, coat_f0=f0)


COATED = Model(
    "COATED",
    {
        "lacquer": [coated("plastic", 0.5, 1.0, alpha) for alpha in (1e-3, 0.1, 1.0)],
        "thin": [coated("half metallic", 0.1, 0.3, 0.01, 0.1)],
        "over matte": [coated("lambert", 1.0, 1.0, 0.3)],
        "over a mirror": [coated("gold", 0.0, 1.0, 0.1), coated("gold", 0.0, 0.5, 0.5)],
        "over sheen": [replace(coated("plastic", 0.5, 0.7, 0.3), sheen_color=RED, sheen_roughness=0.5)],
    },
    coated_eval,
    coated_pdf,
    coated_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    coated_deltas,
    domain=lambda m, wo: Reflections(min(m.alpha or 1.0, m.coat_alpha), wo),
    tolerance=coated_tolerance,
    whitest=[
        coated(name, alpha, weight, coat_alpha, f0)
        for name in ("white dielectric", "white metal")
        for alpha in (0.0, 0.5)
        for weight, f0 in ((1.0, 0.04), (0.5, 0.2))
        for coat_alpha in (1e-3, 0.1, 0.3, 1.0)
    ],
    scene_materials=[
        scene.Material(albedo=(0.8, 0.2, 0.1), roughness=0.6, metallic=0.5, coat=1.0, coat_roughness=0.2),
        scene.Material(albedo=(0.3, 0.5, 0.8), roughness=0.9, coat=0.6, coat_roughness=0.5, coat_ior=1.8),
    ],
)


@dataclass(frozen=True)
class Translucent(Material):
    """Of BSDF_TRANSLUCENT; ``diffuse`` is what its base does not transmit."""

    transmitted: Direction = WHITE


def translucent(name: str, alpha: float, factor: float, color: Direction = WHITE) -> Translucent:
    """Of the material of this ``name``, with white or black in the place of its base's share of it."""
    m = COOK_TORRANCE[name]
    diffuse, transmitted = ((1 - factor) * np.array(m.diffuse), factor * np.array(color) * (max(m.diffuse) > 0))
    return Translucent(tuple(diffuse), alpha, m.f0, m.f90, tuple(transmitted))


def raised(wi: Floats) -> Floats:
    """Directions, and the mirror images of those below the surface."""
    return wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)


def translucent_probability(m: Translucent, wo: Floats) -> Floats:
    """How often transmission is sampled."""
    r = bsdf_oracle.interface_reflectance(m, wo[..., 2])
    base = (1 - r) * (1 - np.asarray(m.f0))
    reflected, transmitted = ((part @ bsdf_oracle.REC_709) for part in (r + m.diffuse * base, m.transmitted * base))
    return transmitted / np.maximum(reflected + transmitted, 1e-300)


def translucent_eval(m: Translucent, wo: Floats, wi: Floats) -> Floats:
    """That of the reflecting base, and below its mirror image in another colour."""
    reflected = cook_torrance("SMITH").value(m, wo, raised(wi))
    transmitted = bsdf_oracle.bsdf_eval_diffuse(replace(m, diffuse=m.transmitted), wo, raised(wi))
    return np.where(wi[..., 2:] < 0, transmitted, reflected)


def translucent_pdf(m: Translucent, wo: Floats, wi: Floats) -> Floats:
    chance = translucent_probability(m, wo)
    reflected = (1 - chance) * bsdf_oracle.bsdf_pdf(m, wo, raised(wi))
    return np.where(wi[..., 2] < 0, -chance * wi[..., 2] / np.pi, reflected)


def translucent_deltas(m: Translucent, wo: Floats) -> Sequence[Delta]:
    """Of a mirror over the base."""
    kept = 1 - translucent_probability(m, wo)
    return [replace(d, chance=d.chance * kept) for d in cook_torrance("SMITH").deltas(m, wo)]


def translucent_largest_weight(m: Translucent, cosine: Floats) -> Floats:
    """The larger one of what is transmitted and what is reflected alone, each divided by its chance."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = translucent_probability(m, wo)[:, None], 1 - bsdf_oracle.interface_reflectance(m, wo[:, 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        reflected = np.where(chance < 1, cook_torrance("SMITH").largest_weight(m, cosine) / (1 - chance), 0)
        return np.fmax(np.where(chance > 0, m.transmitted * passed / chance, 0), reflected)


TRANSLUCENT = Model(
    "TRANSLUCENT",
    {
        "leaf": [translucent("plastic", alpha, 0.4, (0.5, 0.8, 0.1)) for alpha in (0.1, 0.5, 1.0)],
        "paper": [translucent("lambert", 1.0, factor, (0.9, 0.8, 0.6)) for factor in (0.5, 1.0)],
        "half metallic": [translucent("half metallic", 0.3, 0.6, (0.4, 0.3, 0.5))],
        "glossy": [translucent("plastic", 0.0, 0.5, (0.2, 0.5, 0.8)), translucent("diamond", 0.0, 1.0)],
        "black": [Translucent(transmitted=(0.0, 0.0, 0.0))],
    },
    translucent_eval,
    translucent_pdf,
    translucent_largest_weight,
    {"GEOMETRY_TERM": "GEOMETRY_SMITH"},
    translucent_deltas,
    transmits=True,
    domain=lambda m, wo: Sides(m.alpha, None, wo),
    tolerance=lambda m, wo, wi: float32_tolerance(m, wo, raised(wi)),
    whitest=[
        Translucent(tuple(kept), alpha, m.f0, m.f90, tuple(passed))
        for m in white_materials()[::3]
        for factor in (0.4, 1.0)
        for kept, passed in [((1 - factor) * np.array(m.diffuse), factor * np.array(m.diffuse))]
        for alpha in (0.0, 0.1, 1.0)
    ],
    lossless=[Translucent((1 - share,) * 3, transmitted=(share,) * 3) for share in (0.3, 1.0)],
    scene_materials=[
        scene.Material(
            albedo=(0.2, 0.5, 0.1), roughness=0.4, diffuse_transmission=0.5, diffuse_transmission_color=(0.6, 0.9, 0.2)
        ),
        scene.Material(
            albedo=0.8,
            roughness=0.0,
            metallic=0.2,
            diffuse_transmission=0.8,
            diffuse_transmission_color=(0.9, 0.7, 0.5),
        ),
    ],
)

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


@dataclass(frozen=True)
class Dielectric:
    """Of BSDF_DIELECTRIC and BSDF_THIN_DIELECTRIC."""

    eta: float
    alpha: float = 0.0
    transmittance: Direction = WHITE
    anisotropy: float = 0.0


def dielectric_lobes(p: Dielectric, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| and density of the facets (Walter et al. 2007, equations 20, 21, 13, 14, 16 and 17); of transmitted
    radiance."""
    wo, wi = np.broadcast_arrays(wo, wi)
    if p.alpha == 0:
        return np.zeros(wi.shape), np.zeros(wi.shape[:-1])
    reflects = wi[..., 2] > 0
    wh = dielectric_half(p, wo, wi)
    co, ci = (wo * wh).sum(-1), (wi * wh).sum(-1)
    faces = (co > 0) & ((ci > 0) == reflects)
    fresnel = bsdf_oracle.fresnel_dielectric(np.abs(co), p.eta)
    d = bsdf_oracle.facets_d(p.alpha, p.anisotropy, wh) * faces
    g1o, g1i = (bsdf_oracle.facets_g1(p.alpha, p.anisotropy, w) for w in (wo, wi))
    with np.errstate(divide="ignore", invalid="ignore"):
        reflected = fresnel * d * g1o / (4 * wo[..., 2])
        transmitted = (1 - fresnel) * d * g1o * np.abs(co * ci) * p.eta**2 / (wo[..., 2] * (co + p.eta * ci) ** 2)
    pdf = np.where(reflects, reflected, np.where(faces, transmitted, 0.0))
    value = (pdf * g1i)[..., None] * np.where(reflects[..., None], 1.0, np.asarray(p.transmittance) / p.eta**2)
    return value, pdf


def dielectric_half(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    wh = wo + np.where(wi[..., 2:] > 0, 1.0, p.eta) * wi
    wh = wh / np.linalg.norm(wh, axis=-1, keepdims=True)
    return wh * np.where(wh[..., 2:] < 0, -1.0, 1.0)


def dielectric_deltas(p: Dielectric, wo: Floats) -> Sequence[Delta]:
    if p.alpha > 0:
        return ()
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    sine2 = (1 - wo[..., 2] ** 2) / p.eta**2
    refracted = np.column_stack([-wo[..., :2] / p.eta, -np.sqrt(np.maximum(1 - sine2, 0))])
    passed = (1 - reflected)[:, None] * np.asarray(p.transmittance) / p.eta**2
    mirror = Delta(mirror_image(wo), reflected[:, None] * np.ones(3), reflected)
    return [mirror, Delta(refracted, passed, 1 - reflected, p.eta)] if (reflected < 1).all() else [mirror]


def dielectric_tolerance(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    """1e-4, what the distribution makes of rounding the half vector, and what rounding makes of the Fresnel term close
    to the critical angle."""
    if p.alpha == 0:
        return no_slack(p, wo, wi)
    half = np.linalg.norm(wo + np.where(wi[..., 2:] > 0, 1.0, p.eta) * wi, axis=-1)
    cosine = (wo * dielectric_half(p, wo, wi)).sum(-1)
    beyond = np.abs(1 - (1 - cosine**2) / p.eta**2)
    slip = 3e-7 / min(1.0, p.eta**2)
    fresnel = 4 * np.minimum(slip / np.sqrt(np.maximum(beyond, 1e-30)), np.sqrt(slip))
    passed = np.where(wi[..., 2] < 0, slip / np.maximum(beyond, 1e-30), 0.0)
    return 1e-4 + 8e-7 / (p.alpha * half) + 4e-7 / np.maximum(np.abs(cosine), 1e-30) + fresnel + passed


DIELECTRIC_ALPHAS = (0.0, 1e-3, 0.05, 0.3, 1.0)
DIELECTRIC = Model(
    "DIELECTRIC",
    {
        "glass": [Dielectric(1.5, alpha) for alpha in DIELECTRIC_ALPHAS],
        "glass from within": [Dielectric(1 / 1.5, alpha) for alpha in DIELECTRIC_ALPHAS],
        "red glass": [Dielectric(1.9, alpha, (0.9, 0.2, 0.1)) for alpha in (0.0, 0.3)],
        "brushed glass": [Dielectric(eta, 0.1, anisotropy=0.5) for eta in (1.5, 1 / 1.5)],
    },
    lambda p, wo, wi: dielectric_lobes(p, wo, wi)[0],
    lambda p, wo, wi: dielectric_lobes(p, wo, wi)[1],
    lambda p, cosine: np.full((len(cosine), 3), max(1.0, p.eta**-2)),
    deltas=dielectric_deltas,
    transmits=True,
    refracts=True,
    domain=lambda p, wo: Sides(p.alpha, p.eta, wo),
    tolerance=dielectric_tolerance,
    whitest=[Dielectric(eta, alpha) for eta in (1.1, 1.5, 2.4, 1 / 1.5) for alpha in (0.0, 1e-3, 0.1, 0.3, 0.6, 1.0)],
    lossless=[Dielectric(1.5), Dielectric(1 / 1.5), Dielectric(1.5, 1e-3)],
    scene_materials=[
        scene.Material(model="dielectric", roughness=0.5, attenuation_color=(0.9, 0.5, 0.3)),
        scene.Material(model="dielectric", roughness=0.0, ior=1.33, transmittance=(0.7, 0.9, 1.0)),
    ],
)


def pane_reflectance(p: Dielectric, cosine: Floats) -> Floats:
    """The sum of all orders of reflection within the pane."""
    once = bsdf_oracle.fresnel_dielectric(cosine, p.eta)
    return once + (1 - once) ** 2 * once / (1 - once**2)


def pane_lobes(p: Dielectric, wo: Floats, wi: Floats) -> tuple[Floats, Floats]:
    """f |cos_i| and density of the facets, as of a conductor above, and below its mirror image."""
    wo, wi = np.broadcast_arrays(wo, wi)
    if p.alpha == 0:
        return np.zeros(wi.shape), np.zeros(wi.shape[:-1])
    reflects, above = wi[..., 2] > 0, wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)
    reflected = pane_reflectance(p, np.linalg.norm(wo + above, axis=-1) / 2)
    chance = np.where(reflects, reflected, 1 - reflected)
    pdf = chance * conductor_pdf(Conductor(WHITE, WHITE, p.alpha, p.anisotropy), wo, above)
    value = pdf * bsdf_oracle.facets_g1(p.alpha, p.anisotropy, above)
    return value[..., None] * np.where(reflects[..., None], 1.0, np.asarray(p.transmittance)), pdf


def pane_tolerance(p: Dielectric, wo: Floats, wi: Floats) -> Floats:
    """As of a conductor, and what rounding makes of the little that is transmitted at grazing angles."""
    above = wi * np.where(wi[..., 2:] < 0, (1, 1, -1), 1)
    size = np.linalg.norm(wo + above, axis=-1)
    passed = np.where(wi[..., 2] < 0, 1 - pane_reflectance(p, size / 2), 1.0)
    return conductor_tolerance(Conductor(WHITE, WHITE, p.alpha), wo, above) + 1e-6 / (passed * size)


def pane_deltas(p: Dielectric, wo: Floats) -> Sequence[Delta]:
    if p.alpha > 0:
        return ()
    reflected = pane_reflectance(p, wo[..., 2])
    passed = (1 - reflected)[:, None] * np.asarray(p.transmittance)
    mirror = Delta(mirror_image(wo), reflected[:, None] * np.ones(3), reflected)
    return [mirror, Delta(-wo, passed, 1 - reflected, null=True)]


THIN_DIELECTRIC = Model(
    "THIN_DIELECTRIC",
    {
        "window": [Dielectric(1.5)],
        "green pane": [Dielectric(1.7, transmittance=(0.5, 0.9, 0.6))],
        "frosted pane": [Dielectric(1.5, alpha) for alpha in DIELECTRIC_ALPHAS[1:]],
        "green frosted pane": [Dielectric(1.7, 0.1, (0.5, 0.9, 0.6)), Dielectric(1.7, 0.1, (0.5, 0.9, 0.6), 0.5)],
    },
    lambda p, wo, wi: pane_lobes(p, wo, wi)[0],
    lambda p, wo, wi: pane_lobes(p, wo, wi)[1],
    lambda p, cosine: np.ones((len(cosine), 3)),
    deltas=pane_deltas,
    transmits=True,
    domain=lambda p, wo: Sides(p.alpha, None, wo),
    tolerance=pane_tolerance,
    whitest=[Dielectric(eta, alpha) for eta in (1.1, 2.4) for alpha in (0.0, 1e-3, 0.1, 0.6, 1.0)],
    lossless=[Dielectric(1.5), Dielectric(1.5, 1e-3)],
    scene_materials=[
        scene.Material(model="rough-thin-dielectric", roughness=0.4),
        scene.Material(model="thin-dielectric", ior=2.0, transmittance=(0.5, 0.9, 0.6)),
    ],
)


@dataclass(frozen=True)
class Conductor:
    """Of BSDF_CONDUCTOR."""

    index: Direction
    extinction: Direction
    alpha: float
    anisotropy: float = 0.0


def conductor_pdf(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    wh = wo + wi
    wh = wh / np.linalg.norm(wh, axis=-1, keepdims=True)
    if p.alpha == 0:
        return np.zeros(wh.shape[:-1])
    facets = p.alpha, p.anisotropy
    return bsdf_oracle.facets_d(*facets, wh) * bsdf_oracle.facets_g1(*facets, wo) / (4 * wo[..., 2])


def conductor_eval(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    """F D G1(wo) G1(wi) / (4 cos_o)."""
    cosine = np.linalg.norm(wo + wi, axis=-1) / 2
    shadowed = conductor_pdf(p, wo, wi) * bsdf_oracle.facets_g1(p.alpha, p.anisotropy, wi)
    return bsdf_oracle.fresnel_conductor(cosine, p.index, p.extinction) * shadowed[..., None]


def conductor_deltas(p: Conductor, wo: Floats) -> Sequence[Delta]:
    mirrored = bsdf_oracle.fresnel_conductor(wo[..., 2], p.index, p.extinction)
    return () if p.alpha > 0 else [Delta(mirror_image(wo), mirrored, np.ones(len(wo)))]


def conductor_tolerance(p: Conductor, wo: Floats, wi: Floats) -> Floats:
    return 1e-4 + 4e-7 / (p.alpha or 1.0) / np.linalg.norm(wo + wi, axis=-1)


# Width across the tangent, and anisotropy.
BRUSHED = ((0.05, 0.4), (0.3, 0.8))
CONDUCTORS = {
    "measured gold": METAL_INDEX["gold"],
    "all but lossless": ((2e-3, 2e-3, 2e-3), (10.0, 10.0, 10.0)),
    "barely a metal": ((1.0, 1.5, 3.0), (0.5, 0.1, 1.0)),
}
CONDUCTOR = Model(
    "CONDUCTOR",
    {name: [Conductor(*index, alpha) for alpha in (0.0, 1e-2, 0.3, 1.0)] for name, index in CONDUCTORS.items()}
    | {"brushed gold": [Conductor(*METAL_INDEX["gold"], *facets) for facets in BRUSHED]},
    conductor_eval,
    conductor_pdf,
    lambda p, cosine: np.ones((len(cosine), 3)),
    deltas=conductor_deltas,
    domain=lambda p, wo: Reflections(p.alpha or 1.0, wo),
    tolerance=conductor_tolerance,
    whitest=[Conductor(*CONDUCTORS["all but lossless"], alpha) for alpha in (0.0, 1e-2, 0.1, 0.5, 1.0)]
    + [Conductor(*CONDUCTORS["all but lossless"], *facets) for facets in BRUSHED],
    lossless=[Conductor(*CONDUCTORS["all but lossless"], alpha) for alpha in (0.0, 1e-3)],
    scene_materials=[
        scene.Material(model="conductor", metal="gold", roughness=0.3),
        scene.Material(model="conductor", eta=(1.5, 1.0, 0.5), k=(2.0, 3.0, 4.0), roughness=0.0),
    ],
)


@dataclass(frozen=True)
class Plastic:
    """Of BSDF_PLASTIC; ``diffuse`` as the shader's BSDF has it."""

    diffuse: Direction
    eta: float


def plastic_of(albedo: Direction, eta: float, nonlinear: bool = True) -> Plastic:
    """A base of that albedo: 1 - internal = (1 - external) / eta², with the means of the Fresnel term over the
    hemisphere."""
    cosine = (np.arange(20000) + 0.5) / 20000
    external = float(np.mean(2 * cosine * bsdf_oracle.fresnel_dielectric(cosine, eta)))
    internal = 1 - (1 - external) / eta**2
    rho = np.asarray(albedo)
    r, g, b = rho / (1 - (rho if nonlinear else 1) * internal) / eta**2
    return Plastic((r, g, b), eta)


def plastic_eval(p: Plastic, wo: Floats, wi: Floats) -> Floats:
    passed = [1 - bsdf_oracle.fresnel_dielectric(w[..., 2], p.eta) for w in (wo, wi)]
    return np.multiply(p.diffuse, (passed[0] * passed[1] * wi[..., 2] / np.pi)[..., None])


def plastic_chance(p: Plastic, wo: Floats) -> Floats:
    """Of the mirror lobe."""
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    return reflected / (reflected + (1 - reflected) * (np.asarray(p.diffuse) @ bsdf_oracle.REC_709))


def plastic_deltas(p: Plastic, wo: Floats) -> Sequence[Delta]:
    reflected = bsdf_oracle.fresnel_dielectric(wo[..., 2], p.eta)
    return [Delta(mirror_image(wo), reflected[:, None] * np.ones(3), plastic_chance(p, wo))]


def plastic_largest_weight(p: Plastic, cosine: Floats) -> Floats:
    """Of the mirror, and of the base where light enters straight."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, reflected = plastic_chance(p, wo), bsdf_oracle.fresnel_dielectric(wo[:, 2], p.eta)
    with np.errstate(divide="ignore", invalid="ignore"):
        base = np.multiply(p.diffuse, ((1 - reflected) / (1 - chance))[:, None])
        return np.fmax(np.nan_to_num(base), (reflected / chance)[:, None])


PLASTIC = Model(
    "PLASTIC",
    {
        "varnish": [plastic_of((0.6, 0.3, 0.1), 1.5), plastic_of((0.6, 0.3, 0.1), 1.5, False)],
        "white plastic": [plastic_of(WHITE, 1.3), plastic_of(WHITE, 2.0)],
    },
    plastic_eval,
    lambda p, wo, wi: (1 - plastic_chance(p, wo)) * wi[..., 2] / np.pi,
    plastic_largest_weight,
    deltas=plastic_deltas,
    whitest=[plastic_of(WHITE, eta) for eta in (1.01, 1.3, 1.5, 2.5)],
    scene_materials=[
        scene.Material(model="plastic", albedo=(0.8, 0.4, 0.2)),
        scene.Material(model="plastic", albedo=(0.3, 0.5, 0.8), ior=1.8, nonlinear=False),
    ],
)


@dataclass(frozen=True)
class RoughPlastic:
    """Of BSDF_ROUGH_PLASTIC; ``diffuse`` and the coefficients of the coat as the shader's BSDF has them."""

    diffuse: Direction
    alpha: float
    eta: float
    coat_facets: tuple[float, ...]
    coat_angles: Direction


def rough_plastic_of(albedo: Direction, alpha: float, eta: float = 1.5, nonlinear: bool = True) -> RoughPlastic:
    """A base of that albedo; test_coats.py holds the coat to its integrals."""
    record = coat(alpha, eta)
    rho = np.asarray(albedo)
    r, g, b = rho / (1 - (rho if nonlinear else 1) * (1 - record["leaving"])) / eta**2
    return RoughPlastic((r, g, b), alpha, eta, tuple(record["facets"]), tuple(record["angles"]))


def rough_plastic_interface(p: RoughPlastic, cosine: Floats) -> tuple[Floats, Floats]:
    """What a smooth coat reflects at the angle to a facet, and what the coat passes."""
    facet = cosine / bsdf_oracle.g1_smith(p.alpha, cosine)
    ratio = p.alpha / facet
    fit = np.polynomial.polynomial.polyval(ratio, [*p.coat_facets, p.coat_angles[0]])
    fit = fit + p.coat_angles[1] * cosine + p.coat_angles[2] * np.sqrt(np.maximum(0, 1 - cosine**2))
    reflected = bsdf_oracle.fresnel_dielectric(facet, p.eta)
    return reflected, (1 - reflected) * fit


def rough_plastic_chance(p: RoughPlastic, wo: Floats) -> Floats:
    """Of the facets."""
    reflected, passed = rough_plastic_interface(p, wo[..., 2])
    return reflected / (reflected + passed * (np.asarray(p.diffuse) @ bsdf_oracle.REC_709))


def rough_plastic_eval(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    facets, _ = dielectric_lobes(Dielectric(p.eta, p.alpha), wo, wi)
    passed = [rough_plastic_interface(p, w[..., 2])[1] for w in (wo, wi)]
    return facets + np.multiply(p.diffuse, (passed[0] * passed[1] * wi[..., 2] / np.pi)[..., None])


def rough_plastic_pdf(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    chance = rough_plastic_chance(p, wo)
    wh = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    facets = bsdf_oracle.visible_normal_pdf(p.alpha, wo, wh) / (4 * (wo * wh).sum(-1))
    return chance * facets + (1 - chance) * wi[..., 2] / np.pi


def rough_plastic_largest_weight(p: RoughPlastic, cosine: Floats) -> Floats:
    """Of facets that reflect all, and of the base where light enters straight."""
    wo = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, np.maximum(cosine, 1e-30)], -1)
    chance, passed = rough_plastic_chance(p, wo)[:, None], rough_plastic_interface(p, wo[:, 2])[1][:, None]
    return np.maximum(1 / chance, np.multiply(p.diffuse, passed / (1 - chance)))


def rough_plastic_tolerance(p: RoughPlastic, wo: Floats, wi: Floats) -> Floats:
    """1e-4, and what the distribution makes of rounding the half vector."""
    return 1e-4 + 8e-7 / (p.alpha * np.linalg.norm(wo + wi, axis=-1))


ROUGH_PLASTIC = Model(
    "ROUGH_PLASTIC",
    {
        "satin": [rough_plastic_of((0.6, 0.3, 0.1), alpha) for alpha in (1e-3, 0.05, 0.3, 1.0)],
        "linear satin": [rough_plastic_of((0.6, 0.3, 0.1), 0.3, nonlinear=False)],
        "white satin": [rough_plastic_of(WHITE, 0.1, eta) for eta in (1.3, 2.0)],
    },
    rough_plastic_eval,
    rough_plastic_pdf,
    rough_plastic_largest_weight,
    domain=lambda p, wo: Reflections(p.alpha, wo),
    tolerance=rough_plastic_tolerance,
    whitest=[rough_plastic_of(WHITE, alpha, eta) for eta in (1.1, 1.5, 2.4) for alpha in (0.01, 0.1, 0.4, 1.0)],
    scene_materials=[
        scene.Material(model="rough-plastic", albedo=(0.8, 0.4, 0.2), roughness=0.3),
        scene.Material(model="rough-plastic", albedo=(0.3, 0.5, 0.8), roughness=0.7, ior=1.8, nonlinear=False),
    ],
)

MODELS: dict[str, Model] = {
    "eon": EON,
    "rough-plastic": ROUGH_PLASTIC,
    "half-vector": HALF_VECTOR,
    "coated": COATED,
    "sheen": SHEEN,
    "iridescent": IRIDESCENT,
    "translucent": TRANSLUCENT,
    **{f"brushed {term}": brushed(term) for term in TERMS[:2]},
    "plastic": PLASTIC,
    "conductor": CONDUCTOR,
    "dielectric": DIELECTRIC,
    "thin-dielectric": THIN_DIELECTRIC,
    "diffuse": DIFFUSE,
    **{f"cook-torrance {term}": cook_torrance(term) for term in TERMS},
}
CASES = [(name, material) for name, model in MODELS.items() for material in model.materials]
