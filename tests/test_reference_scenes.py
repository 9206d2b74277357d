# SPDX-License-Identifier: MIT
"""Every bundled scene, and every setting that changes the mean image, agrees with Mitsuba.

docs/correctness.md (scripts/correctness.py) has the same comparisons with more samples and a smaller margin.
"""

from dataclasses import replace

import pytest

from fragtracer.apps.compare.rendering import render_ours, render_reference
from fragtracer.apps.compare.verdict import judge
from fragtracer.io.toml import bundled, load

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
pytestmark = pytest.mark.slow

SPECULAR = ("three-spheres", "mirror", "roughness-grid")
CASES = [(name, {}) for name in bundled()]
CASES += [(name, {"geometry": geometry}) for name in SPECULAR for geometry in ("schlick-beckmann", "karis")]
CASES += [
    (name, {"bounces": bounces, "light_samples": light_samples})
    for name in ("three-spheres", "three-spheres-ambient", "cornell-box")
    for bounces, light_samples in ((0, 1), (1, 1), (1, 8), (2, 8), (10, 1))
]
CASES += [(name, {"multiple_scattering": True}) for name in ("three-spheres", "roughness-grid")]
CASES += [("furnace", {"estimator": "bsdf"}), ("cornell-box", {"estimator": "nee"})]
CASES += [("red-bounce", {"pixel_filter": kind}) for kind in ("tent", "gaussian")]

SIZE, BATCHES = (48, 36), 16
SPP, SPP_OF_MESHES = 4096, 1024
LEVEL = 0.01 / len(CASES)
RESOLUTION = 0.04  # detectable bias of the image mean, at most


@pytest.mark.parametrize(("name", "settings"), CASES, ids=[f"{n}-{list(s.values())}" for n, s in CASES])
def test_a_scene_agrees_with_the_reference(ctx, name, settings):
    scene = load(name)
    scene = replace(scene, render=replace(scene.render, **settings))
    spp = SPP_OF_MESHES if scene.meshes else SPP
    reference = render_reference(scene, SIZE, spp, BATCHES)
    ours = render_ours(scene, SIZE, spp, BATCHES, context=ctx)
    verdict = judge(ours.pictures, reference.pictures, alpha=LEVEL, non_finite=ours.non_finite)
    assert verdict.outcome != "disagreement", (verdict.differing, verdict.image.pair.relative_difference)
    assert verdict.detectable_bias.max() < RESOLUTION
