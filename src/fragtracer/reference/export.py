# SPDX-License-Identifier: MIT
"""Writes a scene for Mitsuba users: ``scene.xml`` and its meshes. Needs no Mitsuba itself."""

import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import OutputError
from fragtracer.reference import bsdf
from fragtracer.reference.nearest import nearest_bsdf, note
from fragtracer.reference.shapes import Tree
from fragtracer.reference.translate import exact_bsdf, scene_tree
from fragtracer.scene import Scene

_TAGS = {
    **dict.fromkeys(("sphere", "disk", "rectangle", "ply"), "shape"),
    **dict.fromkeys(("area", "point", "constant"), "emitter"),
    **dict.fromkeys(("perspective", "thinlens"), "sensor"),
    **dict.fromkeys(("box", "tent", "gaussian"), "rfilter"),
    **dict.fromkeys(("diffuse", "twosided", "blendbsdf", bsdf.NAME), "bsdf"),
    **dict.fromkeys(("conductor", "roughconductor", "plastic", "principled"), "bsdf"),
    "path": "integrator",
    "independent": "sampler",
    "hdrfilm": "film",
}


def export_mitsuba(scene: Scene, folder: Path | str, plugin: bool = False) -> list[str]:
    """Writes ``folder/scene.xml``, with ``.ply`` files beside it where there are triangles.

    Parameters
    ----------
    scene
        Any scene.
    folder
        Made if it is not there; files of the same names are replaced.
    plugin
        Materials as ``fragtracer_cooktorrance``, which is exact; its source is written beside the scene
        as ``fragtracer_bsdf.py``. Otherwise as Mitsuba's nearest own materials, which any Mitsuba opens.

    Returns
    -------
    list of str
        What each material became and how near that is; then how to open the scene. The materials'
        notes are also comments in the file.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tree = scene_tree(scene, folder, exact_bsdf if plugin else nearest_bsdf)
        notes = [
            f"{name}: {note(material, scene.render.geometry, plugin)}" for name, material in scene.materials.items()
        ]
        document = ET.ElementTree(_scene_element(tree, dict(zip(_material_keys(tree), notes, strict=True))))
        ET.indent(document)
        document.write(folder / "scene.xml", encoding="utf-8", xml_declaration=True)
        if plugin:
            shutil.copyfile(bsdf.__file__, folder / "fragtracer_bsdf.py")
    except OSError as error:
        raise OutputError(f"cannot write the Mitsuba scene to {folder}: {error}") from error
    python = "open it from Python, as the first lines of fragtracer_bsdf.py show"
    return [*notes, python if plugin else "open it with: mitsuba -m llvm_ad_rgb scene.xml"]


def _material_keys(tree: Tree) -> list[str]:
    return [key for key in tree if key.startswith("material_")]


def _scene_element(tree: Tree, notes: dict[str, str]) -> ET.Element:
    root = ET.Element("scene", version="3.0.0")
    for key, value in tree.items():
        if key in notes:
            root.append(ET.Comment(f" {re.sub('-(?=-)', '- ', notes[key])} "))  # XML forbids two dashes
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
