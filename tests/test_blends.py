# SPDX-License-Identifier: MIT
"""Two materials blended by a weight, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from agreement import ROUNDING, assert_mean
from rendering import rendered
from scene_builders import lambert, stare

from fragtracer.errors import SceneError
from fragtracer.io.toml import parse
from fragtracer.renderer import Renderer
from fragtracer.scene import (
    Ambient,
    Camera,
    Geometry,
    Image,
    Material,
    Mesh,
    Part,
    Rectangle,
    Scene,
    Sphere,
    Texture,
)

WEIGHT = 0.3
RED, COLOR = np.array((0.8, 0.3, 0.1)), np.array((0.2, 0.9, 0.5))
PANE = Material(model="thin-dielectric", ior=2.0, transmittance=tuple(COLOR))
REFLECTED = 2 / 9 / (1 + 1 / 9)  # of the pane
OF_PANE = REFLECTED + (1 - REFLECTED) * COLOR
PATHS = {"bounces": 500, "russian_roulette": False}


def wall(**blend):
    """A red wall, blended with a pane, in white light from everywhere."""
    materials = {"wall": replace(lambert(tuple(RED)), blend="pane", **blend), "pane": PANE}
    quad = Geometry([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)], uvs=np.full((4, 2), 0.75))
    camera = stare((0.1, 0.0, 0.0), (0.1, 0.0, 3.0))
    return Scene(camera, materials, meshes=[Mesh((Part(quad, "wall"),))], ambient=Ambient(1.0))


def varying(weight):
    """A texture that is 1 but where the wall has its coordinates: there its green is ``weight``."""
    pixels = np.ones((2, 2, 3), np.float32)
    pixels[1, 1, 1] = weight
    return Texture(Image(pixels, "linear"), channel="g", filter="nearest")


@pytest.mark.parametrize(("texture", "estimator"), [(None, "nee"), (None, "mis"), (0.6, "bsdf"), (0.6, "mis")])
def test_a_surface_scatters_by_both_with_their_weights(ctx, estimator, texture):
    scene = wall(blend_weight=WEIGHT, blend_weight_texture=texture and varying(texture))
    weight = WEIGHT * (texture or 1.0)
    image = rendered(ctx, scene, 1024, bounces=1, estimator=estimator)
    assert_mean(image, (1 - weight) * RED + weight * OF_PANE, 0.01)


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_of_weight_0_or_1_there_is_one(ctx, weight):
    alone = replace(wall(), materials={"wall": PANE if weight else lambert(tuple(RED))})
    images = [rendered(ctx, scene, 16, bounces=1) for scene in (wall(blend_weight=weight), alone)]
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("bubble", [False, True])
def test_what_loses_nothing_vanishes_in_a_white_furnace(ctx, bubble):
    """White plaster over glass, exactly, in every path; in the glass is a bubble of plaster over air, too."""
    glass = Material(model="dielectric", roughness=0.0, abbe_number=20.0 if bubble else None)
    materials = {"glass": glass, "air": replace(glass, ior=1.0, priority=1)}
    materials |= {f"on {name}": replace(lambert(1.0), blend=name, blend_weight=0.6) for name in materials}
    spheres = [Sphere((0.0, 0.0, 0.0), 1.0, "on glass"), Sphere((0.2, 0.1, 0.0), 0.6, "on air")][: 1 + bubble]
    scene = Scene(Camera((0, 0, 3), (0, 0, 0), fov_degrees=40.0), materials, spheres=spheres, ambient=Ambient(0.5))
    image = rendered(ctx, scene, 1024 if bubble else 16, (8, 8), **PATHS)
    if bubble:  # dispersion makes colours of white
        assert_mean(image, 0.5, 0.02)
    else:
        np.testing.assert_allclose(image, 0.5, rtol=ROUNDING)


def test_a_ray_meets_one_of_the_two_where_it_enters_and_where_it_leaves(ctx):
    """Half of a ball is black paint: what enters by the other half is absorbed on its way, and leaves by half again."""
    filter_ = Material(model="dielectric", ior=1.0, roughness=0.0, attenuation_color=tuple(COLOR))
    materials = {"ball": replace(lambert(0.0), blend="filter"), "filter": filter_}
    spheres = [Sphere((0.0, 0.0, 0.0), 0.5, "ball")]
    scene = Scene(stare((0, 0, 0), (0, 0, 3)), materials, spheres=spheres, ambient=Ambient(1.0))
    assert_mean(rendered(ctx, scene, 1024, **PATHS), 0.25 * COLOR, 0.01)


def test_emission_is_that_of_the_first(ctx):
    materials = {
        "lamp": Material(albedo=0.0, specular=0.0, emission=(1.0, 2.0, 3.0), blend="pane"),
        "pane": replace(PANE, emission=9.0),
    }
    lamp = Rectangle((-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), "lamp")
    scene = Scene(stare((0, 0, 0), (0, 0, 3)), materials, rectangles=[lamp])
    np.testing.assert_allclose(rendered(ctx, scene, 16, bounces=1), np.full((32, 32, 3), (1.0, 2.0, 3.0)), rtol=1e-6)


def test_layers_are_those_of_both_with_their_weights(ctx):
    with Renderer(wall(blend_weight=WEIGHT), (32, 32), context=ctx) as renderer:
        renderer.sample(1024)
        albedo = renderer.aov("albedo")
    assert_mean(albedo, (1 - WEIGHT) * RED + WEIGHT * COLOR, 0.01)


MATERIALS = '[material.red]\nblend = "{blend}"\n{keys}\n[material.pane]\nmodel = "thin-dielectric"\n'
MATERIALS += '[material.glass]\nmodel = "dielectric"\n[material.mix]\nblend = "pane"\n[material.flat]\nunlit = true\n'
MISTAKES = {
    ("pain", ""): "material.red.blend: there is no material 'pain'; the materials are: flat, glass, mix, pane, red",
    ("mix", ""): "material.red.blend: 'mix' is a blend itself; name a material that is not",
    ("red", ""): "material.red.blend: 'red' is a blend itself; name a material that is not",
    ("flat", ""): "material.red.blend: 'flat' is unlit, and scatters nothing; name a material that is not",
    ("pane", "blend_weight = 1.5"): "material.red.blend_weight: must be at most 1, got 1.5",
    ("pane", "unlit = true"): "material.red: unlit scatters nothing, which cannot be blended; leave blend or unlit out",
    ("pane", "double_sided = false"): "material.red.double_sided: must stay true; light leaves 'pane' by its back",
    ("glass", 'model = "thin-dielectric"'): "material.red.blend: light passes 'red' and 'glass', so that nothing says "
    "what is behind them; blend a solid with what light does not pass, or two panes",
}


@pytest.mark.parametrize(("blend", "keys"), MISTAKES)
def test_mistakes_are_named(blend, keys):
    text = MATERIALS.format(blend=blend, keys=keys) + '[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "red"\n'
    with pytest.raises(SceneError) as raised:
        parse(text, "x.toml")
    assert f"x.toml: {MISTAKES[blend, keys]}" in str(raised.value)


def test_a_weight_needs_a_blend():
    with pytest.raises(ValueError, match="blend_weight means nothing without blend"):
        Material(blend_weight=0.2)
