# SPDX-License-Identifier: MIT
"""The integrator of reference/plugins/path.py against Mitsuba's own ``path`` and ``volpath``."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.apps.compare.verdict import judge
from fragtracer.io.toml import load
from fragtracer.reference.render import render_reference
from fragtracer.reference.translate import scene_tree, to_mitsuba
from fragtracer.scene import Camera, Material, RenderSettings, Scene, Sphere

SIZE, BATCHES = (32, 24), 16
ROULETTE = {"russian_roulette": True, "russian_roulette_depth": 1}
CASES = [
    ("three-spheres", ROULETTE, 1024),
    ("leaves", {"bounces": 1}, 256),
    ("grille", ROULETTE, 512),
    ("glass", {"bounces": 8}, 1024),
]


def with_settings(name: str, **settings: object) -> Scene:
    scene = load(name)
    return replace(scene, render=replace(scene.render, width=SIZE[0], height=SIZE[1], **settings))


def by_mitsuba(mi, scene, spp, folder):
    """Batches by Mitsuba's own integrator, the scene being the same."""
    own = scene_tree(scene, folder, plugins=False)["integrator"]
    world = mi.load_dict(to_mitsuba(scene, folder) | {"integrator": own})
    seeds = np.random.SeedSequence(1).generate_state(BATCHES).tolist()
    return np.stack([np.array(mi.render(world, spp=spp // BATCHES, seed=seed)) for seed in seeds])


@pytest.mark.parametrize(("name", "settings", "spp"), CASES)
def test_the_mean_is_that_of_mitsubas_integrators(mi, name, settings, spp, tmp_path):
    """Of the whole image: in small parts Mitsuba's own ray offsets show."""
    scene = with_settings(name, **settings)
    theirs = by_mitsuba(mi, scene, spp, tmp_path)
    ours = render_reference(scene, SIZE, spp, seed=2, batches=BATCHES)
    verdict = judge(ours, theirs, margin=0.02)
    assert verdict.equivalent_image.all()
    assert not verdict.image.differs.any()
    assert all(judge(factor * ours, theirs).image.differs.any() for factor in (0.98, 1.02))


def test_points_of_a_pixel_are_uniform_and_those_of_batches_independent(mi):
    """In pixels at the edge of a lamp that only emits: their means are right, and much less noisy than those of
    independent points."""
    lamp = {"lamp": Material(albedo=0.0, specular=0.0, emission=1.0)}
    ball = Sphere((0.0, 0.0, 0.0), 1.0, "lamp")
    camera = Camera((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), fov_degrees=15.0)
    scene = Scene(camera, lamp, spheres=[ball], render=RenderSettings(bounces=0))
    batches, spp = 128, 64
    pictures = render_reference(scene, (32, 32), batches * spp, 3, batches)[..., 0].astype(float)
    x = (2 * (np.arange(32 * 64) + 0.5) / (32 * 64) - 1) * np.tan(np.radians(7.5))
    truth = (np.hypot(*np.meshgrid(x, x)) < 1 / np.sqrt(99)).reshape(32, 64, 32, 64).mean((1, 3))
    edge = (truth > 0.1) & (truth < 0.9)
    deviation = pictures.std(0, ddof=1)[edge]
    assert edge.sum() > 30
    assert np.abs((pictures.mean(0)[edge] - truth[edge]) / (deviation / np.sqrt(batches) + 5e-4)).max() < 4.5
    assert (deviation**2).mean() < 0.2 * (truth * (1 - truth))[edge].mean() / spp
    noise = pictures[:, edge] - pictures[:, edge].mean(0)
    correlation = np.corrcoef(noise)[~np.eye(batches, dtype=bool)]
    assert correlation.mean() == pytest.approx(-1 / (batches - 1), abs=0.01)
    assert correlation.std() == pytest.approx(1 / np.sqrt(edge.sum()), rel=0.2)
