# SPDX-License-Identifier: MIT
"""The window learns in the background, and goes on with the samples that it has."""

from dataclasses import replace

import moderngl
import numpy as np

from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution
from fragtracer.apps.viewer.guider import Guider
from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.io.toml import load
from fragtracer.scene import Ambient

from .refining import until


def test_picture_goes_on_and_is_then_guided_or_traced_from_its_lights(ctx: moderngl.Context) -> None:
    both = load("three-spheres")
    scene = replace(both, render=replace(both.render, light_tracing="off"))
    refiner = Refiner(LiveRenderer(scene, (32, 18), ctx), DynamicResolution(), Guider())
    try:
        renderer = refiner.renderer
        assert renderer.metadata()["guiding_decision"] == "off: nothing is learned yet"
        until(refiner, lambda: renderer.spp > 0)
        refiner.look(replace(scene.camera, position=(0.1, 1.4, 4.2)))
        until(refiner, lambda: not refiner.is_moving and renderer.spp > 0)
        before, samples = renderer.spp, []

        def is_guided() -> bool:
            samples.append(renderer.spp)
            return renderer.is_guided

        assert refiner.is_deciding
        until(refiner, is_guided, limit=256)
        assert not refiner.is_deciding
        assert renderer.metadata()["guiding_decision"].startswith("on: the variance falls")
        assert samples[0] == before
        assert (np.diff(samples) >= 0).all()
        refiner.change(replace(scene, ambient=Ambient(0.5)))  # other light: what was learned is out of date
        until(refiner, lambda: not refiner.is_moving)
        assert not renderer.is_guided
        assert refiner.is_deciding
        refiner.change(both)
        until(refiner, lambda: renderer.traces_light, limit=256)
        assert renderer.metadata()["light_tracing_decision"].startswith("on: the variance falls")
        assert not refiner.is_deciding
    finally:
        refiner.close()
