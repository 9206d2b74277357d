# SPDX-License-Identifier: MIT
"""The controls of a page: what each shows, and which uniforms and words of u_scene it changes (web/src/controls.ts)."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from fragtracer.display.look import Look
from fragtracer.display.tone import TONE_CURVES, srgb_encode
from fragtracer.packing import PackedScene
from fragtracer.packing.lights import LIGHT_RECORDS, emissions_of
from fragtracer.packing.materials import pack_materials, plain_emission
from fragtracer.packing.records import MATERIAL_RECORDS, Record, places, texel_count
from fragtracer.packing.shapes import SHAPE_RECORDS, SHAPE_TEXELS, Shape, finite_shapes
from fragtracer.scene import Environment, Material, RenderSettings, Scene, Sphere
from fragtracer.scene.material import DEFAULT_MODEL

Control = dict[str, Any]


def controls(scene: Scene, settings: RenderSettings, packed: PackedScene, look: Look) -> list[Control]:
    """The controls that a scene has, with their first values."""
    stops = round(float(look.exposure), 3)
    found = [
        _slider("exposure", "Exposure", "exposure", stops, min(-8.0, stops), max(8.0, stops), 0.1, unit="stops"),
        {
            "id": "tonemap",
            "label": "Tone curve",
            "effect": "tonemap",
            "value": look.tonemap,
            "choices": list(TONE_CURVES),
            "targets": [],
        },
        _number("bounces", "Bounces", settings.bounces, 0, 32, "u_bounces"),
        _number("light_samples", "Light samples", settings.light_samples, 1, 16, "u_light_samples"),
    ]
    if scene.environment is not None:
        found += _environment(scene.environment, packed)
    return [*found, *_objects(scene, packed)]


def _slider(
    name: str, label: str, effect: str, value: float, least: float, most: float, step: float, **more: Any
) -> Control:
    shown = {"id": name, "label": label, "effect": effect, "value": value, "min": least, "max": most, "step": step}
    return {**shown, "targets": [], **more}


def _number(name: str, label: str, value: int, least: int, most: int, uniform: str) -> Control:
    return _slider(name, label, "set", value, least, max(most, value), 1, targets=[{"uniform": uniform}])


def _environment(environment: Environment, packed: PackedScene) -> Iterator[Control]:
    """What turns an environment and makes it brighter, its sun too, where it is one of the lights."""
    turned: list[dict[str, Any]] = []
    scaled: list[dict[str, Any]] = []
    strength = environment.strength
    if packed.environment is not None:
        turned.append({"uniform": "u_environment_rotation"})
        scale = [packed.environment.unit * tint for tint in environment.tint]
        scaled.append({"uniform": "u_environment_scale", "value": scale})
    disc = environment.sky.disc if environment.sky else None
    if disc is not None and environment.sun is not None:
        word = _words(packed, "sun_light", LIGHT_RECORDS["SunLight"], 0)
        turned.append({"word": word["direction"], "value": list(disc.direction)})
        radiance = [c * tint for c, tint in zip(disc.radiance, environment.tint, strict=True)]
        scaled.append({"word": word["radiance"], "value": radiance})
    if turned:
        degrees = environment.rotation_degrees % 360
        yield _slider("rotation", "Environment turned", "turn", degrees, 0, 360, 1, unit="°", targets=turned)
        most = 4 * strength
        yield _slider("strength", "Environment strength", "scale", strength, 0, most, most / 400, targets=scaled)


def _words(packed: PackedScene, table: str, record: Record, number: int) -> dict[str, int]:
    """The words of u_scene where the fields of a record of a table are."""
    first = 4 * (packed.uniforms[f"u_first_{table}"] + number * texel_count(record))
    return {name: first + place for name, _, place in places(record)}


def _objects(scene: Scene, packed: PackedScene) -> Iterator[Control]:
    """Of each material, by its number, what can be changed where it is picked."""
    shapes, materials = finite_shapes(scene)
    surfaces = pack_materials(scene, materials)
    numbers = {number: name for of in (surfaces.of_meshes, surfaces.of_shapes) for name, number in of.items()}
    emissive = [(i, shape) for i, shape in enumerate(shapes) if shape.material in emissions_of(materials)]
    for number, name in sorted(numbers.items()):
        material = materials[name]
        own = [(i, shape) for i, shape in emissive if shape.material == name]
        blended = [number, *filter(None, [surfaces.others.get(number)])]
        found = [*_surface(material, packed, number), *_emission(material, packed, blended, emissive, own)]
        for control in found:
            yield {**control, "id": f"{control['id']}-{number}", "object": number, "name": name}


def _surface(material: Material, packed: PackedScene, number: int) -> Iterator[Control]:
    """Colour, roughness, metallic, coat, sheen, film and diffuse transmission; the program has no specular lobe where
    no material had one. What transmits knows by itself how metallic it is, which stays."""
    if material.unlit or material.is_emissive or material.model not in (DEFAULT_MODEL, "eon"):
        return
    words = _words(packed, "material", MATERIAL_RECORDS["Material"], number)
    maps = _words(packed, "maps", MATERIAL_RECORDS["Maps"], number) if packed.flags["u_has_maps"] else {}
    dielectric = replace(material, metal=None, metallic=0.0)
    surface = {
        "words": {name: words[name] for name in ("diffuse", "alpha", "f0", "f90")},
        "maps": {name: maps[name] for name in ("albedo", "roughness", "metallic") if maps},
        "before": {
            "diffuse": material.diffuse_albedo,
            "alpha": material.alpha,
            "f0": material.specular_f0,
            "f90": material.specular_f90,
        },
        "albedo": material.base_color,
        "roughness": material.roughness,
        "metallic": material.metalness,
        "dielectric_f0": dielectric.specular_f0,
        "dielectric_f90": dielectric.specular_f90,
    }
    encoded = srgb_encode(np.array(material.base_color, np.float32))
    color = "#" + "".join(f"{round(255 * float(channel)):02x}" for channel in encoded)
    yield {"id": "albedo", "label": "Colour", "effect": "surface", "value": color, "targets": [{"surface": surface}]}
    is_layered = material.is_coated or material.has_sheen or material.has_iridescence or material.is_translucent
    if is_layered or (material.model == DEFAULT_MODEL and packed.features["HAS_COOK_TORRANCE"]):
        least = min(0.02, material.roughness)  # smoother ones are deltas, which the program may not have
        numbers = [("roughness", material.roughness, least), ("metallic", material.metalness, 0.0)]
        for name, value, low in numbers[:1] if material.is_translucent else numbers:
            yield _slider(name, name.capitalize(), "surface", value, low, 1.0, 0.01, targets=[{"surface": surface}])
    if material.is_coated:
        record = int(packed.tables["u_scene"][0].flat[words["record"]])
        coat = _words(packed, "clear_coat", MATERIAL_RECORDS["ClearCoat"], record)
        for field, label, value in (
            ("weight", "Coat", material.coat),
            ("roughness", "Coat roughness", material.coat_roughness),
        ):
            target = {"word": coat[field], "value": [1.0]}
            yield _slider(label.lower().replace(" ", "_"), label, "scale", value, 0.0, 1.0, 0.01, targets=[target])
    if material.is_translucent:
        record = int(packed.tables["u_scene"][0].flat[words["record"]])
        target = {
            "word": _words(packed, "translucency", MATERIAL_RECORDS["Translucency"], record)["factor"],
            "value": [1.0],
        }
        value, name = material.diffuse_transmission, "diffuse_transmission"
        yield _slider(name, "Diffuse transmission", "scale", value, 0.0, 1.0, 0.01, targets=[target])
    if material.has_sheen:
        sheen, most = _words(packed, "sheen", MATERIAL_RECORDS["Sheen"], number), max(material.sheen_color)
        scaled = {"word": sheen["color"], "value": [channel / most for channel in material.sheen_color]}
        yield _slider("sheen", "Sheen", "scale", most, 0.0, 1.0, 0.01, targets=[scaled])
        roughness = {"word": sheen["roughness"], "value": [1.0]}
        value = material.sheen_roughness
        yield _slider("sheen_roughness", "Sheen roughness", "scale", value, 0.0, 1.0, 0.01, targets=[roughness])
    if material.has_iridescence:
        film, thickness = (
            _words(packed, "iridescence", MATERIAL_RECORDS["Iridescence"], number),
            material.iridescence_thickness,
        )
        weight, thick = ({"word": film[field], "value": [1.0]} for field in ("weight", "thickness"))
        value = material.iridescence
        yield _slider("iridescence", "Iridescence", "scale", value, 0.0, 1.0, 0.01, targets=[weight])
        yield _slider("film_thickness", "Film thickness (nm)", "scale", thickness, 0.0, 1200.0, 1.0, targets=[thick])


def _emission(
    material: Material,
    packed: PackedScene,
    numbers: list[int],
    emissive: list[tuple[int, Shape]],
    own: list[tuple[int, Shape]],
) -> Iterator[Control]:
    """The power of what emits, and the size of spheres that do, which leaves the power as it is. ``emissive`` are the
    shapes that emit, with their places among all, ``own`` those of this material, whose emission is in the records of
    ``numbers``."""
    if not material.is_emissive or material.unlit:
        return
    records = [_words(packed, "material", MATERIAL_RECORDS["Material"], number) for number in numbers]
    radiance: list[dict[str, Any]] = [{"word": r["emission"], "value": list(material.emission)} for r in records]
    radii: list[dict[str, Any]] = []
    spheres = [i for i, shape in emissive if isinstance(shape, Sphere)]
    flats = [i for i, shape in emissive if not isinstance(shape, Sphere)]
    sphere_words = {name: place for name, _, place in places(SHAPE_RECORDS["Sphere"])}
    for i, shape in own:
        kind, table = ("SphereLight", spheres) if isinstance(shape, Sphere) else ("AreaLight", flats)
        snake = kind.replace("Light", "_light").lower()
        words = _words(packed, snake, LIGHT_RECORDS[kind], table.index(i))
        radiance.append({"word": words["radiance"], "value": list(plain_emission(material))})
        if isinstance(shape, Sphere):
            record = 4 * SHAPE_TEXELS * int(packed.tables["u_scene"][0].flat[words["primitive"]])
            radii.append({"word": words["radius"], "value": [shape.radius]})
            radii.append({"table": "u_shapes", "word": record + sphere_words["radius"], "value": [shape.radius]})
    yield _slider("power", "Power", "scale", 1.0, 0.0, 10.0, 0.05, unit="×", targets=radiance)
    if radii and len(radii) == 2 * len(own) and packed.uniforms["u_sphere_count"]:
        dimmed = [{**target, "exponent": -2} for target in radiance]
        yield _slider("size", "Size", "scale", 1.0, 0.1, 4.0, 0.05, unit="×", targets=radii + dimmed)
