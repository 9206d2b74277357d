# SPDX-License-Identifier: MIT
"""Writes a scene for Mitsuba users: ``scene.xml`` and its meshes. Needs no Mitsuba itself."""

import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import OutputError
from fragtracer.reference import dielectrics, lights, plugins, shapes
from fragtracer.reference.materials import geometry_term
from fragtracer.reference.meshes import MeshAttributes
from fragtracer.reference.nearest import note
from fragtracer.reference.shapes import Tree
from fragtracer.reference.translate import scene_tree
from fragtracer.scene import LIGHTS, Scene

_TAGS = {
    **dict.fromkeys(shapes.TYPES, "shape"),
    **dict.fromkeys((*lights.TYPES, "constant", "envmap", plugins.UNLIT), "emitter"),
    **dict.fromkeys(("perspective", "thinlens"), "sensor"),
    **dict.fromkeys(("box", "tent", "gaussian"), "rfilter"),
    **dict.fromkeys(("diffuse", "twosided", "blendbsdf", "mask", "normalmap"), "bsdf"),
    **dict.fromkeys((plugins.BLEND, plugins.NAME, plugins.ONE_SIDED, plugins.ROUGH_PANE, plugins.SURFACE), "bsdf"),
    **dict.fromkeys(("bitmap", "mesh_attribute", plugins.TEXTURE), "texture"),
    **dict.fromkeys(("conductor", "roughconductor", "plastic", "roughplastic", "principled", "principledthin"), "bsdf"),
    **dict.fromkeys(("path", "volpath", "volpathmis"), "integrator"),
    **dict.fromkeys((*dielectrics.KINDS, "null"), "bsdf"),
    **dict.fromkeys(("homogeneous", "heterogeneous"), "medium"),
    "gridvolume": "volume",
    "hg": "phase",
    "independent": "sampler",
    "hdrfilm": "film",
}


def export_mitsuba(scene: Scene, folder: Path | str, plugin: bool = False) -> list[str]:
    """Writes ``folder/scene.xml``, with ``.ply`` and image files beside it where there are triangles and textures.

    Parameters
    ----------
    scene
        Any scene.
    folder
        Made if it is not there; files of the same names are replaced.
    plugin
        Materials and spot lights as fragtracer's own plugins, which are exact; their source is written beside
        the scene as ``fragtracer_plugins/``. Otherwise as Mitsuba's nearest own ones, which any Mitsuba opens.

    Returns
    -------
    list of str
        What each material and each light that is not the same became, and how near that is; then how to open the scene.
        The former are also comments in the file.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tree = scene_tree(scene, folder, plugin)
        notes = _notes(scene, plugin, tree)
        document = ET.ElementTree(_scene_element(tree, notes))
        ET.indent(document)
        document.write(folder / "scene.xml", encoding="utf-8", xml_declaration=True)
        if plugin:
            _copy_plugins(folder / "fragtracer_plugins")
    except OSError as error:
        raise OutputError(f"{folder}: cannot write the Mitsuba scene: {error.strerror or error}") from error
    python = "open it from Python, as the first lines of fragtracer_plugins/__init__.py show"
    return [*notes.values(), python if plugin else "open it with: mitsuba -m llvm_ad_rgb scene.xml"]


def _notes(scene: Scene, plugin: bool, tree: Tree) -> dict[str, str]:
    """By its key in the tree one for each material, wherever it is, and each light that changes."""
    read: dict[str, list[MeshAttributes]] = {name: [] for name in scene.materials}
    for mesh in scene.meshes:
        for part in mesh.parts:
            name = mesh.material_of(part)
            read[name].append(MeshAttributes.of(part.geometry, [scene.materials[n] for n in scene.blended(name)]))
    geometry = geometry_term(scene.render)
    notes = {}
    for i, (name, material) in enumerate(scene.materials.items()):
        key = f"material_{i}"
        trees = [found for k, found in tree.items() if re.fullmatch(rf"{key}(_.*)?", k)]
        own = [found["bsdf_0"] for found in trees] if material.blend is not None else trees
        notes[key] = f"{name}: {note(material, geometry, plugin, read[name], own)}"
        if material.blend is not None:
            notes[key] += f"; {_blend_note(material.blend, plugin)}"
    for kind in LIGHTS:
        for i, light in enumerate(getattr(scene, kind)):
            key = f"{kind.removesuffix('s')}_{i}"
            if text := lights.note(light, scene.camera.target, plugin):
                notes[key] = f"{key}: {text}"
    return notes


def _blend_note(other: str, plugin: bool) -> str:
    if plugin:
        return f"blended with {other} by {plugins.BLEND}, the same"
    return f"blended with {other} by blendbsdf, nearly the same: too dark where a mirror or glass reflects"


def _copy_plugins(folder: Path) -> None:
    source = Path(plugins.__file__).parent
    shutil.copytree(source, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))


def _scene_element(tree: Tree, notes: dict[str, str]) -> ET.Element:
    root = ET.Element("scene", version="3.0.0")
    for key, value in tree.items():
        found = re.match(r"[a-z_]+_\d+", key)
        if found and found[0] in notes:
            text = notes[found[0]]
            root.append(ET.Comment(f" {re.sub('-(?=-)', '- ', text)} "))  # XML forbids two dashes
        if key != "type":
            root.append(_element(key, value))
            root[-1].attrib["id"] = root[-1].attrib.pop("name")
    return root


def _element(name: str, value: Any) -> ET.Element:
    """One parameter or plugin of the tree, as the XML element that Mitsuba reads it from."""
    if isinstance(value, np.ndarray):
        element = ET.Element("transform", name=name)
        ET.SubElement(element, "matrix", value=" ".join(repr(float(x)) for x in value.ravel()))
        return element
    if not isinstance(value, dict):
        return _parameter(name, value)
    if value["type"] == "rgb":
        return ET.Element("rgb", name=name, value=_joined(value["value"]))
    if value["type"] == "ref":
        return ET.Element("ref", name=name, id=value["id"])
    element = ET.Element(_TAGS[value["type"]], name=name, type=value["type"])
    element.extend(_element(key, v) for key, v in value.items() if key != "type")
    return element


def _parameter(name: str, value: Any) -> ET.Element:
    if isinstance(value, list):
        return ET.Element("point" if name in ("center", "position") else "vector", name=name, value=_joined(value))
    if name == "filename":
        value = Path(value).name
    tag = {bool: "boolean", int: "integer", float: "float", str: "string"}[type(value)]
    return ET.Element(tag, name=name, value=str(value).lower() if tag == "boolean" else str(value))


def _joined(values: Any) -> str:
    return ", ".join(repr(float(v)) for v in values)
