# SPDX-License-Identifier: MIT
"""Light that is traced from the lights while the picture rests."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fragtracer import light_tracing
from fragtracer.apps.viewer import lit_film
from fragtracer.apps.viewer.live import LiveRenderer, Plan
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.decisions import Decided
from fragtracer.errors import DeviceError, FragtracerError, ShaderError
from fragtracer.guiding import Decision
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.scene import (
    Ambient,
    Scene,
)

from .refining import SIZE, Make, until


def learned(refiner: Refiner, scene: Scene) -> LiveRenderer:
    """The renderer of ``refiner``, as if it had been learned that light tracing pays."""
    decisions = light_tracing.Decision(True, "on: as learned", 0.5), Decision(None, "off: as learned")
    refiner.renderer.learn(Decided(scene, scene.render, decisions))
    return refiner.renderer


def test_light_is_traced_from_the_lights_while_the_picture_rests(
    make_refiner: Make, compiled: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load("caustic")
    refiner = make_refiner(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=80)
    until(refiner, lambda: refiner.renderer.spp >= 80, limit=80)
    assert not refiner.is_deciding
    renderer, begun = learned(refiner, scene), refiner.renderer.begun
    assert refiner.is_deciding
    adopt, left = renderer.adopt, list[int]()

    def adopting(plan: Plan) -> None:
        adopt(plan)
        left.append(renderer.spp)

    monkeypatch.setattr(renderer, "adopt", adopting)
    until(refiner, lambda: renderer.traces_light, limit=80)
    assert left == [0], "the samples of before are of all light"
    assert renderer.begun > begun
    assert not refiner.is_deciding
    until(refiner, lambda: renderer.spp > 8)
    assert 0 < refiner.held_weight < 1, "they fade out slowly"
    until(refiner, lambda: refiner.held is None)
    assert renderer.spp >= 20
    assert renderer.metadata()["light_tracing_decision"] == "on: as learned"
    del compiled[:]
    refiner.look(replace(scene.camera, position=(0.1, 2.1, 3.6)))
    assert not renderer.traces_light
    assert renderer.spp == 0, "the samples of before lack the light of the photons"
    assert "once the picture rests" in renderer.metadata()["light_tracing_decision"]
    until(refiner, lambda: renderer.traces_light)
    refiner.compare(True)
    until(refiner, lambda: not refiner.is_moving and renderer.spp > 2)
    assert not renderer.traces_light, "it is compared with pictures of paths"
    refiner.compare(False)
    until(refiner, lambda: renderer.traces_light)
    refiner.resize((48, 32))
    until(refiner, lambda: renderer.traces_light)
    assert renderer.film.size == (48, 32)
    assert compiled == [], "both programs were there"
    refiner.change(replace(scene, ambient=Ambient(0.3)))
    until(refiner, lambda: not refiner.is_moving and renderer.spp > 2)
    assert not renderer.traces_light, "of other light nothing is learned"


@pytest.mark.parametrize("error", [ShaderError, DeviceError, None])
def test_photons_that_fail_leave_all_light_to_paths(
    make_refiner: Make, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, error: type[FragtracerError] | None
) -> None:
    """By a broken file of theirs, for want of memory, or by the broken file that adds them to the paths (None)."""

    def broken(*_: object) -> None:
        assert error is not None
        raise error("a file is broken, or the GPU has no memory")

    if error is not None:
        monkeypatch.setattr(light_tracing.LightTracing, "load", broken)
    else:
        root = tmp_path / "shaders"
        shutil.copytree(folder("shaders"), root)
        (root / "film" / "with_light.frag").write_text("broken", "utf-8")
        monkeypatch.setattr(lit_film, "folder", lambda _: root)
    scene = load("caustic")
    refiner = make_refiner(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    renderer = learned(refiner, scene)
    used = renderer._tracer._key
    assert refiner.is_deciding
    until(refiner, lambda: not refiner._traces)
    assert not refiner.is_deciding
    until(refiner, lambda: renderer.spp > 2)
    assert not renderer.traces_light
    assert renderer._tracer._key == used, "the program leaves no light to photons"


def test_photons_bring_the_light_that_a_resting_picture_lacks(make_refiner: Make) -> None:
    scene = load("caustic")  # with a larger lamp, which paths meet through glass so often that their error is known
    scene = replace(scene, lights=[replace(light, radius=1.0) for light in scene.lights])
    refiner = make_refiner(scene)
    renderer = learned(refiner, scene)
    until(refiner, lambda: renderer.traces_light, limit=1)
    until(refiner, lambda: renderer.spp >= 64)
    whole, paths = renderer._read(), renderer._film.read().mean[..., :3]
    with Renderer(scene, SIZE, light_tracing="off", guiding="off", spp=4096) as reference:
        expected = reference.render()
        error = np.hypot(reference.standard_error(), whole.standard_error())
    lack = np.abs(expected.mean() - paths.mean()) / np.sqrt(np.square(error).sum()) * error.size
    assert lack > 10, "a test of this picture finds out whether there are photons"
    z = (whole.mean[..., :3].mean() - expected.mean()) / np.sqrt(np.square(error).sum()) * error.size
    assert abs(z) < 3.5
