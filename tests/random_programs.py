# SPDX-License-Identifier: MIT
"""Programs of random scenes, so many that every two features that can have occurred together."""

import functools
import itertools
import random
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from shaders.bsdf_models import MODELS
from shaders.light_oracle import LIGHTS
from shaders.scene_oracle import SHAPES

from fragtracer.gpu.reachable import reachable
from fragtracer.gpu.specialise import Level, Specialisation, specialise
from fragtracer.packing import PackedScene, hierarchy, instances, pack
from fragtracer.packing.environment import environment_tables
from fragtracer.resources import folder
from fragtracer.scene import (
    Ambient,
    Camera,
    Density,
    Environment,
    Fog,
    Geometry,
    Image,
    Material,
    Medium,
    Mesh,
    Part,
    Placement,
    RenderSettings,
    Scene,
    Sky,
    Texture,
)
from fragtracer.shader_composer import compose

MATERIALS = {
    "lambert": Material(specular=0.0),
    "plastic": Material(),
    "smooth plastic": Material(roughness=0.0),
    "metal": Material(metal="gold", roughness=0.4),
    "mirror": Material(metal="silver", roughness=0.0),
    "black": Material(albedo=0.0, specular=0.0),
    "cloud": Material(model="null", interior="haze", priority=1),
    **{name: model.scene_materials[0] for name, model in MODELS.items() if model.scene_materials},
}
SMOKE = Medium(density=Density(np.ones((2, 2, 2))), bounds=((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)))
IMAGE = Image(np.zeros((1, 1, 3), np.uint8))
BYTES = Texture(IMAGE)
FLOATS = Texture(Image(np.ones((1, 1, 3), np.float32), "linear"), coordinates=1)
MESH_MATERIALS = {
    "matte": Material(specular=0.0),
    "glowing": Material(emission=1.0, black_back=True),
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
ATTRIBUTES = {"normals": 3, "uvs": 2, "uvs_1": 2, "tangents": 4, "colors": 4}
CHOICES = {
    "geometry": ["smith", "smith-height-correlated", "schlick-beckmann", "karis"],
    "estimator": ["mis", "nee", "bsdf"],
    "sampler": ["texture", "hash"],
    "pixel_filter": ["box", "tent", "gaussian"],
    "integrator": ["path", "path", "split-sum"],
    "background": ["environment", "environment", "prefiltered", "irradiance", "black"],
}
# What no scene asks for, but the viewer and the study of the split-sum approximation do; of every program a part.
SWITCHES: dict[str, list[Any]] = {
    "GUIDING": ["GUIDING_OFF", "GUIDING_ON", "GUIDING_MEASURED"],
    "FILM_LIGHT": ["FILM_LIGHT_ALL", "FILM_LIGHT_ALL", "FILM_LIGHT_PARTS", "FILM_LIGHT_UNTRACED"],
}
PROGRAMS: dict[str, dict[str, list[Any]]] = {
    "pathtracer.frag": SWITCHES,
    "photons.frag": SWITCHES,
    "light_tracing.frag": SWITCHES,
    "split_sum.frag": {
        **SWITCHES,
        "SPLIT_SUM_STEP": [9, 9, 1, 2, 3, 4, 5, 6, 7, 8],
        "GEOMETRY_TERM": ["GEOMETRY_KARIS_ENVIRONMENT", "GEOMETRY_SMITH", "GEOMETRY_SMITH_HEIGHT_CORRELATED"],
    },
    "auxiliary.frag": {"AUXILIARY": ["AUXILIARY_NORMALS", "AUXILIARY_DEPTH", "AUXILIARY_ALBEDO"]},
    "layers.frag": {
        **SWITCHES,
        "LAYERS": ["LAYERS_GEOMETRY", "LAYERS_OBJECTS", "LAYERS_MATERIALS", "LAYERS_DENOISING"],
    },
}
ENVIRONMENTS = [None, None, Environment(radiance=1.0), Environment(radiance=1.0, visible=False), Environment(sky=Sky())]


@dataclass(frozen=True)
class Program:
    """A top file, the values of its features, and what is compiled in."""

    name: str
    defines: Mapping[str, int | str]
    specialisation: Specialisation
    traits: Mapping[str, Any]  # that decide over the text, but for numbers in it

    def source(self, language: str) -> str:
        """The text as drivers get it."""
        text = compose(self.name, self.defines, folder("shaders"), language=language).text
        return reachable(self.specialisation.apply(text))


@functools.cache
def features_of(name: str) -> Mapping[str, str]:
    return compose(name, {}, folder("shaders")).features


def program_of(
    packed: PackedScene, name: str = "pathtracer.frag", level: Level = Level.NOTHING, **defines: int | str
) -> Program:
    """As :class:`fragtracer.gpu.tracer.Tracer` makes it of a scene."""
    asked = {key: value for key, value in packed.features.items() if key in features_of(name)} | defines
    kinds = packed.flags if level is not Level.NOTHING else specialise(packed, level).constants
    # Of counts it matters whether loops are unrolled at all, and whether records are chosen by comparisons.
    counts = {key: len(words) for key, words in packed.scene_records.items()} | {"listed": len(packed.listed)}
    counts = {key: (count > 0) + (count > 8) for key, count in counts.items()}
    if level in (Level.NOTHING, Level.KINDS):
        counts = {}
    traits = {"program": name, "level": level.name, **asked, **kinds, **counts}
    return Program(name, asked, specialise(packed, level), traits)


def shape_of(kind: str, material: str) -> Any:
    return SHAPES[kind](np.random.default_rng(1), np.zeros(3), 1.0, material)


@contextmanager
def plain_skies() -> Iterator[None]:
    """A sky is another texture, and no other program: none is computed in the block, and none of it is kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fragtracer.scene.environment.sky_pixels", lambda *_: np.ones((8, 16, 3), np.float32))
        try:
            yield
        finally:
            environment_tables.cache_clear()


def random_program(rng: random.Random) -> Program:
    """Of a scene with a few features out of all there are."""
    names = rng.sample(sorted(MATERIALS), rng.choice([1, 1, 2, 6]))
    materials = {name: MATERIALS[name] for name in names}
    kinds = rng.sample(sorted(SHAPES), rng.choice([0, 1, 1, 2, 3, 5]))
    shapes: dict[str, Any] = {
        kind: [shape_of(kind, rng.choice(names)) for _ in range(rng.choice([1, 3]))] for kind in kinds
    }
    for kind in kinds:
        if kind != "planes" and rng.random() < 0.3:
            materials["lamp"] = Material(emission=1.0)
            shapes[kind].append(shape_of(kind, "lamp"))
    if "rectangles" in shapes and rng.random() < 0.05:
        shapes["rectangles"] *= 30  # too many for a short list
    lights = {
        kind: rng.sample(list(model.examples.values()), rng.choice([0, 0, 1, len(model.examples)]))
        * rng.choice([1, 1, 12])
        for kind, model in LIGHTS.items()
    }
    meshes = []
    shared = rng.random() < 0.3
    if rng.random() < 0.5:
        names = rng.sample(sorted(MESH_MATERIALS), 2)
        materials |= {name: MESH_MATERIALS[name] for name in names}
        attributes = rng.sample(sorted(ATTRIBUTES), rng.choice([0, 1, 2, 5]))
        geometry = Geometry(np.eye(3), [[0, 1, 2]], **{name: np.ones((3, ATTRIBUTES[name])) for name in attributes})
        places = (Placement(), Placement((2.0, 0.0, 0.0)))
        meshes = [Mesh((Part(geometry, name),), places) for name in names]
    scene = Scene(
        meshes=meshes,
        camera=Camera(aperture_radius=rng.choice([0.0, 0.1])),
        materials=materials,
        media={"haze": rng.choice([Medium(), SMOKE]), "nothing": Medium(extinction=0.0)},
        fog=Fog("nothing") if rng.random() < 0.1 else None,
        ambient=Ambient(rng.choice([0.0, 1.0])),
        environment=rng.choice(ENVIRONMENTS),
        **shapes,
        **lights,
    )
    settings = RenderSettings(**{name: rng.choice(values) for name, values in CHOICES.items()})
    settings = replace(settings, multiple_scattering=settings.geometry == "smith" and rng.random() < 0.5)
    hierarchy.pack_bvh.cache_clear()
    with pytest.MonkeyPatch.context() as patch, plain_skies():
        patch.setattr(instances, "MOST_REPEATED", 0 if shared else 10)
        packed = pack(scene, settings, 64, 48, rng.choice([0, 8, 64]))
    hierarchy.pack_bvh.cache_clear()
    name = rng.choice(["pathtracer.frag", "pathtracer.frag", *PROGRAMS])
    switches = {key: rng.choice(values) for key, values in PROGRAMS[name].items() if rng.random() < 0.8}
    return program_of(packed, name, rng.choice(list(Level)), **switches)


_RNG, _RANDOM = random.Random(4), list[Program]()


@functools.cache
def candidates(count: int) -> list[Program]:
    """Those of nothing at all, and random ones, of which those of fewer are the beginning."""
    packed = pack(Scene(), RenderSettings(), 64, 48)
    _RANDOM.extend(random_program(_RNG) for _ in range(count - len(_RANDOM)))
    return [program_of(packed, name, level) for name in PROGRAMS for level in Level] + _RANDOM[:count]


@functools.cache
def covering_programs(count: int, together: int) -> list[Program]:
    """Programs with all sets of ``together`` traits that occur together in :func:`candidates`; none can be left out."""
    sets = [set(itertools.combinations(sorted(p.traits.items()), together)) for p in candidates(count)]
    times = Counter(itertools.chain.from_iterable(sets))
    chosen = []
    for program, its in zip(candidates(count), sets, strict=True):
        if all(times[one] > 1 for one in its):
            times.subtract(its)
        else:
            chosen.append(program)
    return chosen
