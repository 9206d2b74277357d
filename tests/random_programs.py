# SPDX-License-Identifier: MIT
"""Programs of random scenes, until every two features that can have occurred together."""

import functools
import itertools
import random
from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.packing import PackedScene, pack
from fragtracer.packing import copies as mesh_copies
from fragtracer.packing import meshes as mesh_packing
from fragtracer.scene import (
    Ambient,
    Camera,
    Environment,
    Geometry,
    Image,
    Light,
    Material,
    Mesh,
    Part,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
    Texture,
    Triangle,
)

MATERIALS = {
    "lambert": Material(specular=0.0),
    "plastic": Material(),
    "smooth plastic": Material(roughness=0.0),
    "metal": Material(metal="gold", roughness=0.4),
    "mirror": Material(metal="silver", roughness=0.0),
    "black": Material(albedo=0.0, specular=0.0),
}
IMAGE = Image(np.zeros((1, 1, 3), np.uint8))
BYTES = Texture(IMAGE)
FLOATS = Texture(Image(np.ones((1, 1, 3), np.float32), "linear"), coordinates=1)
MESH_MATERIALS = {
    "matte": Material(specular=0.0),
    "glowing": Material(emission=1.0),
    "one-sided": Material(double_sided=False),
    "mapped": Material(albedo_texture=Texture(IMAGE)),
    "mapped twice": Material(albedo_texture=Texture(IMAGE), roughness_texture=Texture(IMAGE, coordinates=1)),
    "bumpy": Material(normal_texture=Texture(IMAGE, coordinates=1)),
    "metal and roughness": Material(roughness_texture=BYTES, metallic_texture=BYTES),
    "maps": Material(metallic_texture=BYTES, occlusion_texture=BYTES),
    "picture": Material(albedo_texture=BYTES, normal_texture=FLOATS),
    "screen": Material(emission=1.0, emission_texture=FLOATS),
    "pane": Material(albedo_texture=BYTES, alpha_mode="blend", opacity=0.5),
    "unlit": Material(unlit=True),
}
SHAPES = {
    "spheres": lambda m: Sphere((0.0, 0.0, 0.0), 1.0, m),
    "planes": lambda m: Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0), m),
    "rectangles": lambda m: Rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), m),
    "triangles": lambda m: Triangle(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), m),
}
LIGHTS = [Light((0.0, 3.0, 0.0), power=1.0), Light((0.0, 4.0, 0.0), radius=0.5, power=1.0)]
ATTRIBUTES = {"normals": 3, "uvs": 2, "uvs_1": 2, "tangents": 4, "colors": 4}
CHOICES = {
    "geometry": ["smith", "schlick-beckmann", "karis"],
    "estimator": ["mis", "nee", "bsdf"],
    "sampler": ["texture", "hash"],
    "pixel_filter": ["box", "tent", "gaussian"],
    "integrator": ["path", "path", "split-sum"],
    "background": ["environment", "environment", "prefiltered", "irradiance", "black"],
}
# What the benchmark and the viewer switch, as no scene does.
SWITCHES = {
    "PATH_REGENERATION": [1, 1, 0],
    "COUNT_WORK": [0, 0, 1],
    "SINGLE_LIGHT_EVALUATION": [0, 0, 1],
    "SPLIT_SUM_STEP": [9, 9, 9, 1, 2, 3, 4, 5, 6, 7, 8],
    "AUXILIARY": [0, 0, 0, 0, 0, 1, 2, 3],
}
ENVIRONMENTS = [None, None, Environment(radiance=1.0), Environment(radiance=1.0, visible=False), Environment(sky=Sky())]


def random_program(rng: random.Random) -> tuple[PackedScene, dict[str, int]]:
    """A scene of a few features out of all there are, packed, and the values of the switches."""
    names = rng.sample(sorted(MATERIALS), rng.choice([1, 1, 2, 6]))
    materials = {name: MATERIALS[name] for name in names}
    kinds = rng.sample(sorted(SHAPES), rng.choice([0, 1, 1, 2, 3, 4]))
    shapes: dict[str, Any] = {
        kind: [SHAPES[kind](rng.choice(names)) for _ in range(rng.choice([1, 3]))] for kind in kinds
    }
    for kind in kinds:
        if kind != "planes" and rng.random() < 0.3:
            materials["lamp"] = Material(emission=1.0)
            shapes[kind].append(SHAPES[kind]("lamp"))
    if "rectangles" in shapes and rng.random() < 0.05:
        shapes["rectangles"] *= 300  # too many for a uniform block
    meshes = []
    if rng.random() < 0.5:
        shared = rng.random() < 0.3
        names = rng.sample(sorted(MESH_MATERIALS), 2)
        materials |= {name: MESH_MATERIALS[name] for name in names}
        attributes = rng.sample(sorted(ATTRIBUTES), rng.choice([0, 1, 2, 5]))
        geometry = Geometry(np.eye(3), [[0, 1, 2]], **{name: np.ones((3, ATTRIBUTES[name])) for name in attributes})
        places = (Placement(), Placement((2.0, 0.0, 0.0)))
        meshes = [Mesh((Part(geometry, name),), places) for name in names]
        mesh_copies.MOST_COPIED = 0 if shared else 10
        mesh_packing.pack_meshes.cache_clear()
    scene = Scene(
        meshes=meshes,
        camera=Camera(aperture_radius=rng.choice([0.0, 0.1])),
        materials=materials,
        lights=rng.sample(LIGHTS, rng.choice([0, 1, 1, 2])),
        ambient=Ambient(rng.choice([0.0, 1.0])),
        environment=rng.choice(ENVIRONMENTS),
        **shapes,
    )
    settings = RenderSettings(**{name: rng.choice(values) for name, values in CHOICES.items()})
    settings = replace(settings, multiple_scattering=settings.geometry == "smith" and rng.random() < 0.5)
    packed = pack(scene, settings, 64, 48, baked=rng.random() < 0.3)
    return packed, {name: rng.choice(values) for name, values in SWITCHES.items()}


@functools.cache
def covering_programs(candidates: int) -> list[tuple[PackedScene, dict[str, int]]]:
    """Those of nothing at all, and of random ones those with two features together that none before has."""
    rng = random.Random(1)
    seen: set[Any] = set()
    chosen = [(pack(Scene(), RenderSettings(), 64, 48, baked), {}) for baked in (False, True)]
    for _ in range(candidates):
        packed, switches = random_program(rng)
        # Counts beyond 3 and the number of texels change no code, only numbers in it.
        features = {k: min(v, 3) for k, v in {**packed.defines, **switches}.items() if k != "SCENE_TEXELS"}
        features["baked"] = len(packed.constants) > 0
        pairs = set(itertools.combinations(sorted(features.items()), 2))
        if not pairs <= seen:
            seen |= pairs
            chosen.append((packed, switches))
    return chosen
