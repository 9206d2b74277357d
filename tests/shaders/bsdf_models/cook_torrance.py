# SPDX-License-Identifier: MIT
"""Cook-Torrance over a Lambert base, for each geometry term."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fragtracer import scene

from .. import Floats, bsdf_oracle
from ..bsdf_oracle import Material
from ..domains import Reflections
from .model import ALPHAS, WHITE, Delta, Model, mirror_image, no_slack

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
