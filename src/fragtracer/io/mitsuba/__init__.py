# SPDX-License-Identifier: MIT
"""Mitsuba's scene files, .xml, read by Mitsuba itself and translated as nearly as our materials and lights can be.

What is not as in Mitsuba is said in one warning.
"""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.io.mitsuba.bsdfs import Materials
from fragtracer.io.mitsuba.emitters import Emitters
from fragtracer.io.mitsuba.media import Media
from fragtracer.io.mitsuba.nodes import Node, instantiated, mitsuba, parse, reason
from fragtracer.io.mitsuba.sensor import camera_of, inner_integrator, settings_of
from fragtracer.io.mitsuba.shapes import Shapes
from fragtracer.io.mitsuba.textures import Textures
from fragtracer.io.model import listed, stem
from fragtracer.scene import LIGHTS, SHAPES, Fog, Material, Scene
from fragtracer.scene.interiors import has_interiors, solids

__all__ = ["instantiated", "read_scene", "reason"]

_MOST_NOTES = 12  # in the warning
# Parameters that change no picture here: of files, of how to sample, and of what a camera would not see.
_IRRELEVANT = {"near_clip", "far_clip", "pixel_format", "component_format", "file_format", "sample_border", "banner"}
_IRRELEVANT |= {"gamma", "exposure", "tonemap_method", "high_quality_edges", "seed", "sampling_weight", "compensate"}
_IRRELEVANT |= {"accel", "format", "jitter"}


def read_scene(path: Path) -> tuple[Scene, list[Path]]:
    """Read a Mitsuba scene.

    Returns
    -------
    scene : Scene
        As nearly as we can show it (docs/mitsuba.md).
    files : list of Path
        What else it was read from: files that it includes, meshes, images and grids.

    Raises
    ------
    SceneError
        If Mitsuba is not installed, if it refuses the file, or if the file has what we cannot show at all.

    Warns
    -----
    UserWarning
        One line with what is not as in Mitsuba.
    """
    notes: list[str] = []
    with mitsuba(path) as mi:
        root = parse(mi, path)
        textures = Textures(mi, notes)
        media, emitters = Media(textures, notes), Emitters(mi, textures, notes)
        materials = Materials(mi, textures, notes)
        shapes = Shapes(mi, materials, media, notes)
        for node in root.all("shape"):
            shapes.add(node)
        for node in root.all("emitter"):
            emitters.add(node)
        sensors = root.all("sensor")
        if not sensors:
            raise SceneError(f'{path}: there is no camera; add a <sensor type="perspective">')
        notes += [f"{node.line}: {node.title}, another camera" for node in sensors[1:]]
        integrator = root.child("integrator")
        settings = settings_of(sensors[0], integrator, notes)
        environment = emitters.environment
        if integrator is not None and inner_integrator(integrator).flag("hide_emitters", False):
            environment = environment and replace(environment, visible=False)
            notes += ["hide_emitters, but for the environment"] * any(m.is_emissive for m in materials.found.values())
        outside = sensors[0].child("medium")
        fog = None if outside is None else Fog(media.name(outside))
        shapes.add_instances()
        found: dict[str, Any] = {kind: tuple(getattr(shapes, kind, ())) for kind in (*SHAPES, "meshes")}
        found |= {kind: tuple(getattr(emitters, kind)) for kind in LIGHTS}
        with root.checked():
            solid = _as_solids(materials.found, found, notes) if media.found else None
            scene = Scene(
                materials=solid or _as_interfaces(materials.found, found),
                media=media.found,
                fog=fog,
                environment=environment,
                render=settings,
                name=stem(path),
                **found,
            )
        low, high = _bounds(scene)
        camera = camera_of(sensors[0], settings, low, high)
        scene = replace(scene, camera=camera, lights=(*scene.lights, *emitters.sun(low, high)))
        notes += _unused(root)
    if notes := list(listed(notes)):
        shown, rest = notes[:_MOST_NOTES], len(notes) - _MOST_NOTES
        more = f"; and {rest} more" if rest > 0 else ""
        warnings.warn(f"{path}: not as in Mitsuba: {'; '.join(shown)}{more}", stacklevel=2)
    return scene, root.files


def _as_solids(materials: dict[str, Material], shapes: dict[str, Any], notes: list[str]) -> dict[str, Material]:
    """The ``materials``, of which dielectrics are solids: media need to know what they are in. Of those within each
    other smaller ones have a higher priority, since Mitsuba has none."""
    interfaces = [name for name, material in materials.items() if material.exterior_ior is not None]
    notes += [f"{name!r} is taken to lie within what is outside of it" for name in interfaces]
    sizes = {name: 0.0 for name, material in materials.items() if material.is_dielectric and not material.is_pane}
    boxes = [(shape.material, np.array(shape.bounds)) for kind in SHAPES for shape in shapes[kind]]
    boxes += [(part.material, part.geometry.bounds) for mesh in shapes["meshes"] for part in mesh.parts]
    for name, (low, high) in boxes:
        if name in sizes:
            sizes[name] = max(sizes[name], float(np.linalg.norm(high - low)))
    ranked = sorted(sizes, key=sizes.__getitem__, reverse=True)
    made = {name: replace(materials[name], priority=rank, exterior_ior=None) for rank, name in enumerate(ranked)}
    return materials | made


def _as_interfaces(materials: dict[str, Material], shapes: dict[str, Any]) -> dict[str, Material]:
    """The ``materials``, of which dielectrics are interfaces alone, as in Mitsuba, where that makes a difference: where
    one of them is between two, or solids may overlap."""
    found = {name: material for name, material in materials.items() if material.model == "dielectric"}
    made = {name: replace(material, exterior_ior=material.exterior_ior or 1.0) for name, material in found.items()}
    if any(material.exterior_ior for material in found.values()):
        return materials | made
    apart = {name: replace(material, priority=rank) for rank, (name, material) in enumerate(found.items())}
    scene = Scene(materials=materials | apart, **shapes)
    inside = [solid for solid in solids(scene) if solid.material in apart]
    return materials | made if has_interiors(apart, inside) else materials


def _bounds(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The least and the greatest corner of the bounding box of all shapes."""
    corners = [np.array(shape.bounds) for kind in SHAPES if kind != "planes" for shape in getattr(scene, kind)]
    corners += [mesh.box_corners() for mesh in scene.meshes]
    points = np.concatenate(corners) if corners else np.zeros((1, 3))
    return points.min(axis=0), points.max(axis=0)


def _unused(root: Node) -> list[str]:
    """Parameters of plugins that were not asked for."""
    found: dict[Node, None] = {}
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if node not in found:
            found[node] = None
            waiting += [*node.children, *node.named.values()]
    unused = {node: [name for name in node.unused if name not in _IRRELEVANT] for node in found if node.asked}
    return [f"{node.line}: {', '.join(names)} of {node.title}" for node, names in unused.items() if names]
