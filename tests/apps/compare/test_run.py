# SPDX-License-Identifier: MIT
"""Comparisons that render: the same scene, and a changed one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fast_mitsuba import need_fast_mitsuba
from rendering import in_long_passes

from fragtracer.apps.compare import compare_renderings, compare_scene
from fragtracer.apps.compare.rendering import render_ours, render_reference
from fragtracer.apps.compare.run import default_size, rounded_up
from fragtracer.errors import FragtracerError
from fragtracer.io.toml import load
from fragtracer.scene import Camera, Environment, Material, RenderSettings, Scene, Sphere

SIZE = (64, 64)


@pytest.fixture(scope="module", autouse=True)
def _mitsuba():
    need_fast_mitsuba()


def lighter(scene: Scene, factor: float) -> Scene:
    """The scene with all albedos multiplied."""

    def changed(material):
        return replace(material, albedo=tuple(np.multiply(material.albedo, factor).tolist()))

    return replace(scene, materials={name: changed(material) for name, material in scene.materials.items()})


def test_cornell_box_agrees_and_lighter_walls_do_not():
    scene = in_long_passes(load("cornell-box"))
    heard = []
    comparison = compare_scene(scene, SIZE, 1020, progress=lambda *step: heard.append(step))
    assert comparison.verdict.outcome == "agreement"
    assert comparison.exit_status == 0
    assert comparison.spp == comparison.spp_needed == 1024
    assert max(comparison.verdict.detectable_bias) < 0.02
    assert {renderer for renderer, _, _ in heard} == {"Mitsuba", "fragtracer"}
    assert [heard[-1], *[step for step in heard if step[0] == "Mitsuba"][-1:]] == [
        ("fragtracer", 1024, 1024),
        ("Mitsuba", 1024, 1024),
    ]
    assert all(before[1] <= after[1] for before, after in pairwise(heard) if before[0] == after[0])

    ours = render_ours(lighter(scene, 1.02), SIZE, 256, 16)
    changed = compare_renderings(scene, ours, comparison.reference)
    assert changed.verdict.outcome == "disagreement"
    assert changed.exit_status == 1
    pair = changed.verdict.image.pair
    error = np.sqrt(pair.ours_error2 + pair.reference_error2) / pair.reference
    # By 65,536 samples of each pixel. Student's t of 15 degrees of freedom at least: 1e-3 over three colours (Šidák).
    assert (np.abs(pair.relative_difference - (0.0206, 0.0173, 0.0117)) < 4.8 * error).all()


def test_a_black_background_agrees():
    ball = Sphere((0.0, 0.0, 0.0), 1.0, "clay")
    scene = Scene(
        Camera((0.0, 1.0, 5.0), (0.0, 0.0, 0.0)),
        {"clay": Material(albedo=0.6, specular=0.0)},
        spheres=[ball],
        environment=Environment(radiance=(1.0, 0.8, 0.5)),
        render=RenderSettings(background="black"),
    )
    comparison = compare_scene(scene, (32, 24), 512)
    assert comparison.exit_status == 0
    assert comparison.ours.pictures.mean() < 0.2


def test_too_few_samples_are_inconclusive():
    comparison = compare_scene(load("mirror"), (32, 18), 32)
    assert comparison.verdict.outcome == "inconclusive"
    assert comparison.exit_status == 2
    assert comparison.spp_needed > 32


def test_batches_are_independent_and_a_seed_repeats_them():
    scene = load("cornell-box")
    first, again, other = (render_ours(scene, (48, 48), 64, 8, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.pictures, again.pictures)
    stack = np.concatenate([first.pictures, other.pictures]).astype(np.float64)
    noise = ((stack - stack.mean(axis=0)) / np.maximum(stack.std(axis=0), 1e-9)).reshape(16, -1)
    correlation = np.corrcoef(noise)[~np.eye(16, dtype=bool)]
    assert correlation == pytest.approx(np.full(240, -1 / 15), abs=0.1)  # taking off the mean leaves -1/15


@pytest.mark.parametrize("render", [render_ours, render_reference])
def test_batches_must_divide_the_samples(render):
    for spp, batches in ((10, 4), (4, 1), (0, 2)):
        with pytest.raises(ValueError, match="multiple of batches"):
            render(load("cornell-box"), (8, 8), spp, batches)


def test_nothing_is_rendered_for_a_margin_that_cannot_be():
    with pytest.raises(ValueError, match="margin"):
        compare_scene(load("cornell-box"), margin=1.5)


def test_a_missing_variant_is_an_error():
    with pytest.raises(FragtracerError, match="does not start"):
        compare_scene(load("cornell-box"), (8, 8), 4, batches=2, variant="abacus_rgb")


def test_pictures_of_mitsuba_must_be_finite(monkeypatch):
    monkeypatch.setattr(
        "fragtracer.reference.render.ReferenceRenderer.batches", lambda *_: np.full((2, 8, 8, 3), np.nan)
    )
    with pytest.raises(FragtracerError, match="NaN"):
        render_reference(load("cornell-box"), (8, 8), 4, 2)


def test_default_size_keeps_the_shape():
    assert default_size(load("three-spheres")) == (320, 180)
    assert default_size(load("cornell-box")) == (240, 240)
    assert [rounded_up(spp, 16) for spp in (1, 16, 17, 100.5)] == [16, 16, 32, 112]
