# SPDX-License-Identifier: MIT
"""glTF 2.0, as .gltf and .glb.

The document is validated by pydantic and the arrays are views of the buffers: the libraries that exist
either trust their input or lose samplers, transforms and sets of texture coordinates.
"""

from pathlib import Path
from threading import Lock

import numpy as np

from fragtracer.errors import SceneError
from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.animations import Animations
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.draco import EXTENSION as DRACO
from fragtracer.io.gltf.geometry import POINTS_AND_LINES, Primitives
from fragtracer.io.gltf.instances import EXTENSION as INSTANCES
from fragtracer.io.gltf.instances import instance_matrices
from fragtracer.io.gltf.lights import EXTENSION as LIGHTS
from fragtracer.io.gltf.lights import read_lights
from fragtracer.io.gltf.materials import DEFAULT, Materials, unique
from fragtracer.io.gltf.meshopt import EXTENSIONS as MESHOPT
from fragtracer.io.gltf.nodes import PlacedNode, placed_nodes
from fragtracer.io.gltf.sides import split_double_sided_emitters
from fragtracer.io.gltf.skins import Skins
from fragtracer.io.model import Model, bounds, check_size, listed, matrix_rows, triple
from fragtracer.io.polygons import Floats
from fragtracer.scene import Camera, Material, Mesh, Part, Pose

_SUPPORTED = {
    "KHR_texture_transform",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_dispersion",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_sheen",
    "KHR_materials_iridescence",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_specular",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    LIGHTS,
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    DRACO,
    *MESHOPT,
    INSTANCES,
}


class GltfFile:
    """A .gltf or .glb file, whose buffers and images are read once for all its poses.

    Raises
    ------
    SceneError
        If a file is missing or damaged, or asks for an extension that is not supported.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._posing = Lock()
        self._container = Container(path, _SUPPORTED)
        document = self._container.document
        self._notes = [name for name in document.extensionsUsed if name not in _SUPPORTED]
        self._primitives = Primitives(self._container, self._notes)
        self._materials = Materials(self._container, _names(document), self._notes)
        self.animations = Animations(self._container, self._primitives.accessors, self._notes)

    @property
    def files(self) -> tuple[Path, ...]:
        """All that were read so far."""
        return tuple(dict.fromkeys(self._container.files))

    def model(self, pose: Pose | None = None) -> Model:
        """The nodes, cameras and lights of its default scene in a pose; left out, as they are without animation.

        Photometric numbers are taken for radiometric ones: 1 cd is 1 W/sr, 1 lx is 1 W/m², and 1 cd/m² of emission is
        1 W/m²/sr.

        Raises
        ------
        AnimationError
            If there is no such animation.
        SceneError
            If something is damaged.
        """
        with self._posing:
            return self._model(pose)

    def _model(self, pose: Pose | None) -> Model:
        container, notes = self._container, self._notes
        document = container.document
        nodes = document.nodes
        if pose is not None:
            nodes = self.animations.get(pose.animation).posed(nodes, pose.time or 0.0)
        elif document.animations:
            notes.append("animations (none is chosen)")
        notes += ["scenes but one"] if len(document.scenes) > 1 else []
        placed = list(placed_nodes(container, nodes))
        parts, used = self._parts(placed)
        if not parts:
            advice = "; points and lines are not drawn, make a mesh of them" if POINTS_AND_LINES in notes else ""
            raise SceneError(f"{self.path}: the scene of this file has no triangles{advice}")
        mesh = Mesh(parts=tuple(parts), pose=pose)
        check_size(self.path, mesh)
        low, high = bounds(mesh)
        cameras, aspects = _cameras(container, placed, low, high, notes)
        lights = read_lights(container, placed, notes)
        ignored = listed(notes)
        notes[:] = ignored
        return Model(
            mesh,
            used,
            cameras,
            aspects[0] if aspects else None,
            tuple(lights.point),
            tuple(lights.spot),
            tuple(lights.directional),
            ignored,
            self.files,
        )

    def _parts(self, placed: list[PlacedNode]) -> tuple[list[Part], dict[str, Material]]:
        """The primitives of all nodes in world space, and their materials."""
        container, primitives = self._container, self._primitives
        primitives.begin_pose()
        skins = Skins(container, primitives.accessors, {index: matrix for index, _, matrix in placed})
        parts: list[Part] = []
        used: dict[str, Material] = {}
        for index, node, matrix in placed:
            if node.mesh is None:
                continue
            mesh: gltf.Mesh = container.item(container.document.meshes, node.mesh, f"nodes[{index}].mesh")
            places = instance_matrices(container, primitives.accessors, node, matrix, f"nodes[{index}]")
            for number, primitive in enumerate(mesh.primitives):
                place = f"meshes[{node.mesh}].primitives[{number}]"
                if (geometry := primitives.get(primitive, node.weights or mesh.weights, place)) is None:
                    continue
                at = places
                if node.skin is not None and (posed := skins.posed(node.skin, primitive, geometry, place)):
                    geometry, at = posed, [np.eye(4)]
                found = self._materials.get(primitive.material, f"{place}.material")
                used |= found
                parts += [Part(geometry, next(iter(found)), matrix_rows(matrix)) for matrix in at]
        return split_double_sided_emitters(parts, used)


def _names(document: gltf.Document) -> list[str]:
    """A unique name for each material."""
    names: list[str] = []
    taken = {DEFAULT}
    for index, material in enumerate(document.materials):
        name = unique(material.name or f"material {index}", index, taken)
        taken.add(name)
        names.append(name)
    return names


def _cameras(
    container: Container, placed: list[PlacedNode], low: Floats, high: Floats, notes: list[str]
) -> tuple[tuple[Camera, ...], list[float | None]]:
    """The perspective cameras, and their aspect ratios."""
    center, found, aspects = (low + high) / 2, [], []
    for index, node, matrix in placed:
        if node.camera is None:
            continue
        item: gltf.Camera = container.item(container.document.cameras, node.camera, f"nodes[{index}].camera")
        if item.perspective is None:
            notes.append("orthographic cameras")
            continue
        position, forward, up = matrix[:3, 3], -matrix[:3, 2], matrix[:3, 1]
        forward = forward / (np.linalg.norm(forward) or 1.0)
        depth = float((center - position) @ forward)
        depth = depth if depth > 0 else float(np.linalg.norm(high - low)) or 1.0
        try:
            found.append(
                Camera(
                    triple(position),
                    triple(position + depth * forward),
                    triple(up),
                    float(np.degrees(item.perspective.yfov)),
                )
            )
        except ValueError as error:
            raise container.error(f"cameras[{node.camera}]", "its node gives it no direction to look in") from error
        aspects.append(item.perspective.aspectRatio)
    notes += ["cameras after the first"] if len(found) > 1 else []
    return tuple(found), aspects
