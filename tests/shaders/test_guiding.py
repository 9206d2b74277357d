# SPDX-License-Identifier: MIT
"""guiding/: what guide_scatter() draws, and its density, against the same lobes in float64."""

from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.guiding import Guide, learn
from fragtracer.guiding.lobes import LOBES
from fragtracer.io.toml import load
from fragtracer.packing import pack

from . import Floats
from .chi_square import assert_likely, chi_square
from .scene_probe import scene_probe

SCENES = {"three-spheres": 20, "mirror": 15, "roughness-grid": 15}  # and how many places
DRAWS = 1 << 13  # at each
MOST = 0.5  # GUIDING_MOST
ALBEDO = 0.6


def places_in(guide: Guide, count: int) -> Floats:
    """Points (count, 3) in cells that have lobes, every other one in a fine cell, about the guide's origin."""
    rng, lobes = np.random.default_rng(2), guide.lobes
    fine = np.flatnonzero(lobes.edges == lobes.edges.max())
    coarse = rng.choice(np.flatnonzero(lobes.ratios.any(axis=1)[lobes.first]), count)
    coarse[::2] = rng.choice(fine, len(coarse[::2]))
    index = np.stack(np.unravel_index(coarse, lobes.size[::-1])[::-1], axis=1)
    return lobes.low + (index + rng.uniform(0.01, 0.99, (count, 3))) * lobes.edge


def mixture_at(guide: Guide, place: Floats, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """Directions (LOBES, 3), widths and probabilities (LOBES,) there, of a matte surface."""
    lobes = guide.lobes
    where = (place - lobes.low) / lobes.edge
    index = np.floor(where).astype(int)
    coarse = np.ravel_multi_index(tuple(index[::-1]), tuple(lobes.size[::-1]))
    edge = lobes.edges[coarse]
    fine = np.floor((where - index) * edge).astype(int)
    cell = lobes.first[coarse] + np.ravel_multi_index(tuple(fine[::-1]), (edge,) * 3)
    to_point = lobes.points[cell] - place
    distance = np.linalg.norm(to_point, axis=1)
    direction = to_point / distance[:, None]
    alpha = np.clip(upper_half(lobes.widths[cell]) / distance, 0.01, 1)
    ratio = np.where(direction @ normal > -alpha, upper_half(lobes.ratios[cell]), 0)
    total = ratio.sum()
    return direction, alpha, ratio * min(MOST, total / (1 + total)) / max(total, 1e-20)


def upper_half(values: Floats) -> Floats:
    """As the texture has them: float32 without the lower half."""
    bits = values.astype(np.float32).view(np.uint32) & np.uint32(0xFFFF0000)
    return bits.view(np.float32).astype(np.float64)


def lobe_density(direction: Floats, alpha: Floats, wi: Floats) -> Floats:
    """(n, LOBES): GGX's D over the half space about each lobe, which is D cos over directions of normals."""
    z = wi @ direction.T
    slope = np.maximum(1 - z**2, 0) / np.maximum(z**2, 1e-30)
    density: Floats = np.where(
        z > 0, 1 / (np.pi * alpha**2 * np.maximum(z, 1e-9) ** 3 * (1 + slope / alpha**2) ** 2), 0
    )
    return density


@pytest.mark.parametrize("name", SCENES)
def test_directions_have_the_density_of_the_mixture(ctx: moderngl.Context, name: str) -> None:
    """Weight times density is the BSDF. And a direction that is given to one of the lobes or to the BSDF, by the chance
    that it came from there, is distributed as that lobe is; so no integral is needed."""
    scene = load(name)
    guide = learn(ctx, scene)
    assert guide is not None
    packed = guide.applied(pack(scene, scene.render, 8, 8))
    rng = np.random.default_rng(3)
    places = places_in(guide, SCENES[name])
    normals = np.array([mixture_at(guide, place, np.zeros(3))[0][0] for place in places]) + rng.normal(
        scale=0.4, size=(len(places), 3)
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    u = rng.random((len(places) * DRAWS, 2), np.float32)
    inputs = {"place": np.repeat(places + guide.origin - packed.origin, DRAWS, axis=0), "u": u}
    inputs["normal"] = np.repeat(normals, DRAWS, axis=0)
    body = f"""
        Frame frame = frame_from_normal(normal);
        Bsdf bsdf = bsdf_of(BSDF_COOK_TORRANCE, vec3({ALBEDO}), 0.25, vec3(0.0), vec3(0.0));
        Guide guide = guide_at(place, frame, bsdf, true);
        BsdfSample s = guide_scatter(guide, frame, bsdf, vec3(0.0, 0.0, 1.0), u);
        wi = frame_to_world(frame, s.wi); weight = s.weight.x; sums = vec2(s.pdf, guide.sum);"""
    found: dict[str, Any] = scene_probe(
        ctx, packed, ["guiding/guide.glsl"], body, inputs, {"wi": 3, "weight": 1, "sums": 2}
    )
    p_values, guided = {}, 0
    for i, (place, normal) in enumerate(zip(places, normals, strict=True)):
        part = slice(i * DRAWS, (i + 1) * DRAWS)
        wi, weight = found["wi"][part], found["weight"][part]
        direction, alpha, probability = mixture_at(guide, place, normal)
        cosine = np.maximum(wi @ normal, 0) / np.pi
        parts = np.column_stack([probability * lobe_density(direction, alpha, wi), (1 - probability.sum()) * cosine])
        density = parts.sum(axis=1)
        inside = wi @ normal > 1e-3
        np.testing.assert_allclose(found["sums"][part, 1], probability.sum(), rtol=1e-3)
        np.testing.assert_allclose((weight * density)[inside], ALBEDO * cosine[inside], rtol=0.02)
        whence = (np.cumsum(parts, axis=1) < rng.random(DRAWS)[:, None] * density[:, None]).sum(axis=1)
        expected = DRAWS * np.append(probability, 1 - probability.sum())
        if expected[:-1].sum() > 20:
            p_values[f"{i}: choice"] = chi_square(np.bincount(whence, minlength=LOBES + 1).astype(float), expected)
        for k in range(LOBES):
            own = wi[whence == k] @ direction[k]
            slope = (1 - own**2) / own**2 / alpha[k] ** 2
            counts = np.bincount((8 * slope / (1 + slope)).astype(int).clip(0, 7), minlength=8).astype(float)
            if counts.sum() > 200:
                p_values[f"{i}: lobe {k}"] = chi_square(counts, np.full(8, counts.sum() / 8))
                guided += 1
    assert guided > len(places) / 3
    assert_likely(p_values)
