# SPDX-License-Identifier: MIT
"""All that emits, as records of shaders/scene/light.glsl."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing.alias import choice_probabilities
from fragtracer.packing.materials import plain_emission
from fragtracer.packing.records import Kind, LightKind
from fragtracer.packing.shapes import Shape, disk_axes
from fragtracer.scene import Disk, Material, Rectangle, Scene, Sphere, Triangle

Floats = NDArray[np.float64]
_TABLES = {
    LightKind.POINT: "PointLight",
    LightKind.SPOT: "SpotLight",
    LightKind.DIRECTIONAL: "DirectionalLight",
    LightKind.SPHERE: "SphereLight",
    LightKind.AREA: "AreaLight",
    LightKind.SUN: "SunLight",
}
_FEATURES = {
    LightKind.POINT: "HAS_POINT_LIGHT",
    LightKind.SPOT: "HAS_SPOT_LIGHT",
    LightKind.DIRECTIONAL: "HAS_DIRECTIONAL_LIGHT",
    LightKind.SPHERE: "HAS_SPHERE_LIGHT",
    LightKind.AREA: "HAS_AREA_LIGHT",
    LightKind.MESH: "HAS_MESH_LIGHT",
    LightKind.SUN: "HAS_SUN",
    LightKind.ENVIRONMENT: "HAS_ENVIRONMENT",
}
# Probabilities are multiples of the step between random numbers, so that each light is chosen exactly as often as said.
_STEPS = 2**23


@dataclass(frozen=True)
class LightSource:
    """A light before its choice is known: its record, if its kind has any, and the power that it is chosen by."""

    kind: LightKind
    power: float
    record: Mapping[str, Any]


@dataclass(frozen=True)
class PackedLights:
    """Records by kind, features and uniforms."""

    records: Mapping[str, list[dict[str, Any]]]
    features: Mapping[str, int]
    uniforms: Mapping[str, Any]


def emissive_shapes(shapes: Sequence[Shape], materials: Mapping[str, Material]) -> NDArray[np.int64]:
    """The number of the light that each shape is, (n,), or -1: shapes are the first of all lights."""
    emissive = _emissions(materials).keys()
    emits = np.array([shape.material in emissive for shape in shapes], bool)
    return np.where(emits, np.cumsum(emits) - 1, -1)


def _emissions(materials: Mapping[str, Material]) -> dict[str, tuple[float, float, float]]:
    """The radiance of those that emit, by name."""
    found = {name: plain_emission(material) for name, material in materials.items()}
    return {name: radiance for name, radiance in found.items() if max(radiance) > 0}


def pack_lights(
    scene: Scene,
    shapes: Sequence[Shape],
    materials: Mapping[str, Material],
    primitives: NDArray[np.int64],
    origin: Floats,
    extent: float,
    mesh_power: float,
    distant: Sequence[LightSource],
) -> PackedLights:
    """Pack all lights: emissive ``shapes`` first, whose records are ``primitives`` (n,), then the meshes together."""
    emissions = _emissions(materials)
    sources = [
        _shape_light(shape, emissions[shape.material], origin, int(primitive))
        for shape, primitive in zip(shapes, primitives, strict=True)
        if shape.material in emissions
    ]
    mesh_light = len(sources) if mesh_power > 0 else -1
    if mesh_power > 0:
        sources.append(LightSource(LightKind.MESH, mesh_power, {}))
    sources += _punctual_lights(scene, origin, extent)
    sources += distant
    steps = _steps(np.array([source.power for source in sources]))
    records: dict[str, list[dict[str, Any]]] = {name: [] for name in ("LightChoice", *_TABLES.values())}
    cumulative = np.concatenate([[0], np.cumsum(steps)])
    guide = _guide(cumulative)
    for i, source in enumerate(sources):
        table = records.get(_TABLES.get(source.kind, ""), [])
        choice = {"cumulative": cumulative[i] / _STEPS, "probability": steps[i] / _STEPS}
        choice |= {"kind": source.kind, "record": len(table)}
        records["LightChoice"].append(choice | {"guide_first": guide[i, 0], "guide_last": guide[i, 1]})
        table.append(dict(source.record))
    kinds = [source.kind for source in sources]
    probability = {
        kind: steps[kinds.index(kind)] / _STEPS for kind in (LightKind.SUN, LightKind.ENVIRONMENT) if kind in kinds
    }
    return PackedLights(
        records,
        {name: int(kind in kinds) for kind, name in _FEATURES.items()},
        {
            "u_light_count": len(sources),
            "u_mesh_light": mesh_light,
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


def _shape_light(shape: Shape, radiance: Sequence[float], origin: Floats, primitive: int) -> LightSource:
    record: dict[str, Any] = {"radiance": radiance, "primitive": primitive}
    if isinstance(shape, Sphere):
        record |= {"center": np.subtract(shape.center, origin), "radius": shape.radius}
        return LightSource(LightKind.SPHERE, 4 * np.pi**2 * shape.radius**2 * sum(radiance), record)
    kind, a, edge_u, edge_v = _area_light(shape)
    normal = np.cross(edge_u, edge_v)
    record |= {"kind": kind, "a": a - origin, "edge_u": edge_u, "edge_v": edge_v, "area": shape.area}
    record |= {"normal": normal / np.linalg.norm(normal)}
    return LightSource(LightKind.AREA, np.pi * shape.area * sum(radiance), record)


def _area_light(shape: Rectangle | Disk | Triangle) -> tuple[Kind, Floats, Floats, Floats]:
    match shape:
        case Rectangle():
            a, edge_u, edge_v = (np.asarray(v, np.float64) for v in (shape.corner, shape.edge_u, shape.edge_v))
            return Kind.RECTANGLE, a, edge_u, edge_v
        case Disk():
            (u,), (v,) = disk_axes([shape.normal])
            return Kind.DISK, np.asarray(shape.center, np.float64), shape.radius * u, shape.radius * v
        case Triangle():
            a, b, c = (np.asarray(v, np.float64) for v in shape.vertices)
            return Kind.SINGLE_TRIANGLE, a, b - a, c - a


def _punctual_lights(scene: Scene, origin: Floats, extent: float) -> list[LightSource]:
    """Lights that no ray meets; a directional one is chosen by what it shines onto a disk as large as the scene."""
    sources = [
        LightSource(
            LightKind.POINT,
            4 * np.pi * sum(light.intensity),
            {"position": np.subtract(light.position, origin), "intensity": light.intensity},
        )
        for light in scene.lights
        if light.radius == 0 and max(light.intensity) > 0
    ]
    for spot in scene.spot_lights:
        inner, outer = np.cos(np.radians([spot.inner_degrees, spot.outer_degrees]))
        scale = 1 / max(inner - outer, 1e-6)
        record = {"position": np.subtract(spot.position, origin), "intensity": spot.intensity}
        record |= {"direction": np.asarray(spot.direction) / np.linalg.norm(spot.direction)}
        record |= {"cos_scale": scale, "cos_offset": -outer * scale}
        if max(spot.intensity) > 0:
            sources.append(LightSource(LightKind.SPOT, sum(spot.power), record))
    for light in scene.directional_lights:
        wi = -np.asarray(light.direction) / np.linalg.norm(light.direction)
        if max(light.irradiance) > 0:
            power = np.pi * extent**2 * sum(light.irradiance)
            sources.append(LightSource(LightKind.DIRECTIONAL, power, {"wi": wi, "irradiance": light.irradiance}))
    return sources
