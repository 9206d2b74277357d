# SPDX-License-Identifier: MIT
"""All that emits, as records of shaders/scene/light.glsl and shaders/light/."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.packing.alias import choice_probabilities
from fragtracer.packing.light_tree import LightTree, light_tree
from fragtracer.packing.materials import plain_emission
from fragtracer.packing.records import Record
from fragtracer.packing.shapes import Shape, flat_corners
from fragtracer.scene import LIGHTS, DirectionalLight, Light, Material, Scene, Sphere, SpotLight
from fragtracer.scene.fields import Triple

Floats = NDArray[np.float64]


class LightKind(IntEnum):
    """LIGHT_... of light/light.glsl."""

    POINT = 0
    SPOT = 1
    DIRECTIONAL = 2
    SPHERE = 3
    AREA = 4
    MESH = 5
    SUN = 6
    ENVIRONMENT = 7

    @property
    def feature(self) -> str:
        """The define of shaders/light/ that says that there is one."""
        return f"HAS_{self.name}" if self in (LightKind.SUN, LightKind.ENVIRONMENT) else f"HAS_{self.name}_LIGHT"

    @property
    def record(self) -> str:
        """The name of its table, a key of :data:`LIGHT_RECORDS` if it has one."""
        return f"{self.name.capitalize()}Light"


LIGHT_RECORDS: dict[str, Record] = {
    "LightChoice": (
        *(("cumulative", "float"), ("probability", "float"), ("kind", "int"), ("record", "int")),
        *(("guide_first", "int"), ("guide_last", "int")),
    ),
    "LightNode": (
        *(("first_place", "vec3"), ("first_spread", "float"), ("second_place", "vec3"), ("second_spread", "float")),
        *(("split", "float"), ("first", "int"), ("second", "int")),
    ),
    "PointLight": (("position", "vec3"), ("intensity", "vec3")),
    "SpotLight": (
        *(("position", "vec3"), ("one_minus_cos", "float"), ("direction", "vec3"), ("scale", "float")),
        ("intensity", "vec3"),
    ),
    "DirectionalLight": (("wi", "vec3"), ("irradiance", "vec3")),
    "SphereLight": (("center", "vec3"), ("radius", "float"), ("radiance", "vec3"), ("primitive", "int")),
    "AreaLight": (
        *(("a", "vec3"), ("area", "float"), ("edge_u", "vec3"), ("kind", "uint"), ("edge_v", "vec3")),
        *(("primitive", "int"), ("normal", "vec3"), ("radiance", "vec3")),
    ),
    "SunLight": (("direction", "vec3"), ("one_minus_cos", "float"), ("radiance", "vec3")),
}
# A row of the alias table over all triangles of meshes that emit.
MESH_LIGHT: Record = (("threshold", "float"), ("record", "int"), ("other", "int"))
# Probabilities are multiples of the step between random numbers, so that each light is chosen exactly as often as said.
_STEPS = 2**23
FEW_LIGHTS = 8  # of light/light.glsl, which are chosen by power alone


@dataclass(frozen=True)
class LightSource:
    """A light before its choice is known: its record, if its kind has any, and the power that it is chosen by.

    ``place`` (3,) is where it is, if it is anywhere, and ``spread`` its mean squared distance from there, in m².
    ``shape`` is the number of the shape that it is, or -1.
    """

    kind: LightKind
    power: float
    record: Mapping[str, Any]
    place: Floats | None = None
    spread: float = 0.0
    shape: int = -1


@dataclass(frozen=True)
class PackedLights:
    """Records by kind, features and uniforms."""

    records: Mapping[str, list[dict[str, Any]]]
    features: Mapping[str, int]
    uniforms: Mapping[str, Any]


def emissions_of(materials: Mapping[str, Material]) -> dict[str, Triple]:
    """The radiance of those materials that emit, by name."""
    found = {name: plain_emission(material) for name, material in materials.items() if material.is_emissive}
    return {name: radiance for name, radiance in found.items() if max(radiance) > 0}


@dataclass(frozen=True)
class LocalLights:
    """The lights that are somewhere: shapes first, as in the scene. If they are many, the ``tree`` over them orders
    them anew."""

    sources: Sequence[LightSource]
    tree: LightTree | None

    @property
    def order(self) -> NDArray[np.int64]:
        """The sources by the numbers of the lights."""
        return np.arange(len(self.sources)) if self.tree is None else self.tree.order

    def of_shapes(self, count: int) -> NDArray[np.int64]:
        """The number of the light that each of ``count`` shapes is, (count,), or -1."""
        numbers = np.full(count, -1, np.int64)
        for number, i in enumerate(self.order):
            if self.sources[i].shape >= 0:
                numbers[self.sources[i].shape] = number
        return numbers


def local_lights(scene: Scene, shapes: Sequence[Shape], emissions: Mapping[str, Triple], origin: Floats) -> LocalLights:
    """The lights of ``scene`` that are somewhere: ``shapes`` whose materials have ``emissions``, points and spots."""
    sources = [*_shape_lights(shapes, emissions, origin), *_own_lights(scene, (Light, SpotLight), origin, 0.0)]
    if len(sources) <= FEW_LIGHTS:
        return LocalLights(sources, None)
    places, spreads, powers = (np.array([getattr(s, name) for s in sources]) for name in ("place", "spread", "power"))
    return LocalLights(sources, light_tree(places, spreads, powers))


def pack_lights(
    scene: Scene,
    local: LocalLights,
    primitives: NDArray[np.int64],
    origin: Floats,
    extent: float,
    mesh_power: float,
    distant: Sequence[LightSource],
) -> PackedLights:
    """Pack all lights: the ``local`` ones first, whose shapes have the records ``primitives`` (n,), then the meshes
    together, then those from afar."""
    sources = [*local.sources]
    if mesh_power > 0:
        sources.append(LightSource(LightKind.MESH, mesh_power, {}))
    sources += [*_own_lights(scene, (DirectionalLight,), origin, extent), *distant]
    if len(sources) > _STEPS:
        raise SceneError(f"there are {len(sources):,} lights; at most {_STEPS:,} can be told apart when one is chosen")
    records: dict[str, list[dict[str, Any]]] = {name: [] for name in LIGHT_RECORDS}
    choices = []
    for source in sources:
        table = records.get(source.kind.record, [])
        choices.append({"kind": source.kind, "record": len(table)})
        table.append({**source.record, **({"primitive": primitives[source.shape]} if source.shape >= 0 else {})})
    order = np.concatenate([local.order, np.arange(len(local.sources), len(sources))])
    steps = _steps(np.array([sources[i].power for i in order]))
    cumulative = np.concatenate([[0], np.cumsum(steps)])
    guide = _guide(cumulative)
    for number, i in enumerate(order):
        choice = {"cumulative": cumulative[number] / _STEPS, "probability": steps[number] / _STEPS}
        choice |= {"guide_first": guide[number, 0], "guide_last": guide[number, 1]}
        records["LightChoice"].append(choice | choices[i])
    in_tree = len(local.sources) if local.tree else 0
    if local.tree:
        records["LightNode"] = local.tree.nodes(cumulative / _STEPS)
    kinds = [sources[i].kind for i in order]
    probability = {
        kind: steps[kinds.index(kind)] / _STEPS for kind in (LightKind.SUN, LightKind.ENVIRONMENT) if kind in kinds
    }
    return PackedLights(
        records,
        {kind.feature: int(kind in kinds) for kind in LightKind},
        {
            "u_light_count": len(sources),
            "u_light_tree_count": in_tree,
            "u_light_tree_probability": cumulative[in_tree] / _STEPS,
            "u_mesh_light": kinds.index(LightKind.MESH) if LightKind.MESH in kinds else -1,
            "u_sun_probability": float(probability.get(LightKind.SUN, 0.0)),
            "u_environment_probability": float(probability.get(LightKind.ENVIRONMENT, 0.0)),
        },
    )


def _steps(power: Floats) -> NDArray[np.int64]:
    """The probability of each light by its ``power`` (n,) in steps, at least one, all together :data:`_STEPS`."""
    if not len(power):
        return np.zeros(0, np.int64)
    exact = choice_probabilities(power) * (_STEPS - len(power))
    steps = np.floor(exact).astype(np.int64) + 1
    left = _STEPS - int(steps.sum())
    steps[np.argsort(exact - np.floor(exact), kind="stable")[::-1][:left]] += 1
    return steps


def _guide(cumulative: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first and last light, (n, 2), for u in each of n parts of [0, 1), one step wider on both sides: for what the
    shader may round."""
    count = len(cumulative) - 1
    ends = np.arange(count + 1) * _STEPS / max(count, 1)
    first = np.searchsorted(cumulative, np.maximum(ends[:-1] - 1, 0), side="right") - 1
    last = np.searchsorted(cumulative, np.minimum(ends[1:] + 1, _STEPS - 1), side="right") - 1
    return np.stack([first, last], axis=1)


def _shape_lights(shapes: Sequence[Shape], emissions: Mapping[str, Triple], origin: Floats) -> Iterator[LightSource]:
    emissive = [(i, shape) for i, shape in enumerate(shapes) if shape.material in emissions]
    for i, sphere in emissive:
        if isinstance(sphere, Sphere):
            radiance, center = emissions[sphere.material], np.subtract(sphere.center, origin)
            power = 4 * np.pi**2 * sphere.radius**2 * sum(radiance)
            record = {"radiance": radiance, "radius": sphere.radius, "center": center}
            yield LightSource(LightKind.SPHERE, power, record, center, sphere.radius**2, i)
    flats = [(i, shape) for i, shape in emissive if not isinstance(shape, Sphere)]
    kinds, corners = flat_corners([shape for _, shape in flats], origin)
    edges_u, edges_v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normals = np.cross(edges_u, edges_v)
    for k, (i, shape) in enumerate(flats):
        radiance = emissions[shape.material]
        record = {"radiance": radiance, "kind": kinds[k], "area": shape.area, "a": corners[k, 0]}
        record |= {"edge_u": edges_u[k], "edge_v": edges_v[k], "normal": normals[k] / np.linalg.norm(normals[k])}
        middle = np.mean(shape.bounds, axis=0) - origin
        yield LightSource(
            LightKind.AREA, np.pi * shape.area * sum(radiance), record, middle, shape.area / (2 * np.pi), i
        )


def _own_lights(scene: Scene, classes: tuple[type, ...], origin: Floats, extent: float) -> Iterator[LightSource]:
    """The lights of ``scene`` of some classes that are no shapes and not black."""
    for name, cls in LIGHTS.items():
        if cls in classes:
            for light in getattr(scene, name):
                source = _SOURCES[cls](light, origin, extent)
                if source is not None and source.power > 0:
                    yield source


def _point(light: Light, origin: Floats, extent: float) -> LightSource | None:
    if light.radius > 0:
        return None  # one of finite_shapes()
    place = np.subtract(light.position, origin)
    record = {"position": place, "intensity": light.intensity}
    return LightSource(LightKind.POINT, 4 * np.pi * sum(light.intensity), record, place)


def _spot(light: SpotLight, origin: Floats, extent: float) -> LightSource:
    inner, outer = light.inner_degrees, light.outer_degrees
    both, apart, half = np.sin(np.radians([outer + inner, outer - inner, outer]) / 2)  # cosines lose digits
    place = np.subtract(light.position, origin)
    record = {"position": place, "intensity": light.intensity}
    record |= {"direction": np.asarray(light.direction) / np.linalg.norm(light.direction)}
    record |= {"one_minus_cos": 2 * half**2, "scale": 1 / (2 * both * apart)}
    return LightSource(LightKind.SPOT, sum(light.power), record, place)


def _directional(light: DirectionalLight, origin: Floats, extent: float) -> LightSource:
    """Its power is what it shines onto a disk as large as the scene."""
    wi = -np.asarray(light.direction) / np.linalg.norm(light.direction)
    record = {"wi": wi, "irradiance": light.irradiance}
    return LightSource(LightKind.DIRECTIONAL, np.pi * extent**2 * sum(light.irradiance), record)


_SOURCES: Mapping[type, Callable[[Any, Floats, float], LightSource | None]] = {
    Light: _point,
    SpotLight: _spot,
    DirectionalLight: _directional,
}
