# SPDX-License-Identifier: MIT
"""A small picture with every feature whose breaking must show, beside Mitsuba's."""

from functools import cache
from typing import Any

import pytest
from rendering import in_long_passes

from fragtracer.apps.compare.rendering import Rendering, render_ours, render_reference
from fragtracer.apps.compare.verdict import judge
from fragtracer.scene import (
    Ambient,
    Camera,
    Light,
    Material,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    Triangle,
)

SIZE = (48, 36)
BATCHES = 16
SPP = 256 * BATCHES


def studio() -> Scene:
    materials = {
        "floor": Material(albedo=(0.7, 0.65, 0.6), specular=0.0),
        "plastic": Material(albedo=(0.7, 0.1, 0.1), roughness=0.4),
        "gold": Material(metal="gold", roughness=0.5),
        "mirror": Material(albedo=(0.5, 0.5, 0.6), roughness=0.0, f0=0.3),
        "blue": Material(albedo=(0.2, 0.3, 0.8), roughness=1.0, metallic=0.5),
        "panel": Material(albedo=0.2, specular=0.0, emission=(3.0, 3.0, 2.0)),
        "sail": Material(albedo=0.3, specular=0.0, emission=(0.5, 1.0, 1.5)),
    }
    spheres = ("plastic", "gold", "mirror", "blue")
    return Scene(
        camera=Camera(position=(0.0, 1.6, 4.0), target=(0.0, 0.6, 0.0), fov_degrees=45.0),
        materials=materials,
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "floor"),),
        spheres=tuple(Sphere((1.1 * i - 1.65, 0.5, -0.2 * i), 0.5, name) for i, name in enumerate(spheres)),
        rectangles=(Rectangle((-1.0, 2.0, -1.5), (2.0, 0.0, 0.0), (0.0, 0.5, 0.5), "panel"),),
        triangles=(Triangle(((-2.5, 0.0, 0.5), (-1.5, 0.0, -1.5), (-2.2, 1.5, -0.5)), "sail"),),
        lights=(Light((1.5, 2.5, 1.5), 0.5, power=60.0), Light((-1.0, 1.5, 2.0), 0.0, power=20.0)),
        ambient=Ambient(0.1),
        render=RenderSettings(bounces=4, light_samples=2, russian_roulette_depth=1, multiple_scattering=True),
        name="studio",
    )


@cache
def reference() -> Rendering:
    return render_reference(studio(), SIZE, SPP, BATCHES, is_timed=False)


def comparison_with_mitsuba(ctx: Any) -> None:
    """No difference is found."""
    pytest.importorskip("mitsuba", reason="Mitsuba is not installed: nothing to compare with")
    ours = render_ours(in_long_passes(studio()), SIZE, SPP, BATCHES, context=ctx)
    assert judge(ours.pictures, reference().pictures, non_finite=ours.non_finite).outcome != "disagreement"
