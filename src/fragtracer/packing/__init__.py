# SPDX-License-Identifier: MIT
"""Scene -> float32 texels, feature defines and uniforms for the shader.

The layout of every record is written once, in :data:`.records.RECORDS`; the GLSL structs and the functions
that read them are generated from it (``generated/scene_layout.glsl``). Positions are packed
relative to the middle of the scene, so that a scene far from the origin keeps its precision.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.packing.atlas import Atlas
from fragtracer.packing.camera import camera_uniforms
from fragtracer.packing.copies import MeshMaterial
from fragtracer.packing.environment import EnvironmentTables, pack_environment
from fragtracer.packing.gather import gather_triangles
from fragtracer.packing.lights import light_records
from fragtracer.packing.materials import (
    MATERIAL_RECORDS,
    apart,
    has_colors,
    has_one_sided_shapes,
    mean_emission,
    pack_materials,
)
from fragtracer.packing.meshes import CULLED, PackedMeshes, pack_meshes
from fragtracer.packing.records import MESH_RECORDS, RECORDS, SHAPES, loop_rounds, mesh_layout, scene_layout, texels_of
from fragtracer.packing.settings import settings_defines, settings_uniforms
from fragtracer.packing.shapes import shape_records
from fragtracer.scene import Camera, Material, Mesh, RenderSettings, Scene, Sphere
from fragtracer.scene.tangents import with_tangents
from fragtracer.shader_composer import CONSTANTS

Floats = NDArray[np.float64]

# Above this, code made for each record grows faster than it gains.
_MAX_BAKED = 256
# Areas, and products of them, must be float32.
_MOST_EXTENT = 1e15
# The limit that every OpenGL 3.3 and WebGL2 driver grants a uniform block.
_MAX_UNIFORM_TEXELS = 1024


@dataclass(frozen=True)
class PackedScene:
    """What the shader needs of a scene: ``texels`` float32 (n, 4), defines, uniforms, and the values
    of the uniforms that are compiled in as constants instead."""

    texels: NDArray[np.float32]
    defines: Mapping[str, int]
    uniforms: Mapping[str, Any]
    constants: Mapping[str, Any]
    layout: str  # the text of generated/scene_layout.glsl
    environment: EnvironmentTables | None
    meshes: PackedMeshes | None
    atlas: Atlas  # of the images of textures
    path_rounds: int  # of all loops along one path, at most; with meshes, mostly
    origin: Floats  # the point of the world that is the shader's (0, 0, 0)

    @property
    def program(self) -> tuple[object, ...]:
        """What decides over the program: scenes with equal values share one."""
        return self.defines, self.layout, self.constants


def pack(
    scene: Scene,
    settings: RenderSettings,
    width: int,
    height: int,
    baked: bool = False,
    home: Camera | None = None,
) -> PackedScene:
    """Pack ``scene`` for an image of ``width`` x ``height`` pixels rendered with ``settings``.

    ``baked`` compiles the values into the program as constants, those of a small scene too. A
    software renderer is then about twice as fast, but every edit compiles. For a camera that moves,
    ``home`` is where it began: the origin is chosen with that one, and the camera stays in uniforms
    (:func:`fragtracer.packing.camera.camera_uniforms`), so that nothing but these changes on its way.
    """
    scene = gather_triangles(scene)
    points = _points(scene if home is None else replace(scene, camera=home))
    origin = _middle(points)
    extent = float(max(np.abs(points - origin).max(), np.finfo(np.float32).tiny))
    spheres, materials = _spheres_with_lights(scene)
    materials, on_meshes = apart(scene, materials)
    surfaces = pack_materials(materials.values(), has_colors(scene), has_one_sided_shapes(scene))
    index = {name: i for i, name in enumerate(materials)}
    surroundings = pack_environment(scene.environment, extent)
    meshes = _meshes(scene, {name: index[packed] for name, packed in on_meshes.items()}, origin, extent)
    lights = light_records(scene, spheres, materials, origin, meshes.power if meshes else 0.0, surroundings.lights)
    light_of = {light["primitive"]: i for i, light in enumerate(lights) if light["primitive"] >= 0}

    records: dict[str, list[dict[str, Any]]] = {
        **shape_records(scene, spheres, index, light_of, origin, extent),
        **surfaces.records,
        "Light": lights,
    }
    texels = np.concatenate([texels_of(name, rows) for name, rows in records.items()])
    defines = _scene_defines(records, scene) | settings_defines(settings) | surroundings.defines(lights)
    defines |= {**surfaces.defines, **(meshes.defines if meshes else {"HAS_MESHES": 0})}
    defines |= {"SCENE_TEXELS": len(texels), "SCENE_IN_UNIFORMS": int(len(texels) <= _MAX_UNIFORM_TEXELS)}
    movable = camera_uniforms(scene.camera, origin, width, height) | surroundings.movable
    others = settings_uniforms(settings) | {"u_ambient_radiance": scene.ambient.radiance} | surroundings.uniforms
    constants = ({} if home else movable) | others if baked else {}
    constants.pop("u_seed", None)  # batches of one scene differ in their seed alone
    uniforms = {name: value for name, value in (movable | others).items() if name not in constants}
    primitives = sum(len(records[kind]) for kind in SHAPES)
    baked = baked and primitives <= _MAX_BAKED
    layout = scene_layout(records, texels, baked) + (mesh_layout(meshes.vertex_fields) if meshes else "")
    rounds = 0 if baked else sum(loop_rounds(len(records[kind])) for kind in SHAPES)
    rounds += meshes.usual_rounds if meshes else 0
    sample_rounds = 1 + rounds + (surroundings.tables.levels if surroundings.tables else 0)
    vertex_rounds = 1 + len(lights) + rounds + sample_rounds * (settings.light_samples + 1)
    path_rounds = vertex_rounds * (settings.bounces + 2)
    tables = (surroundings.tables, meshes, surfaces.atlas)
    return PackedScene(texels, defines, uniforms, constants, layout, *tables, path_rounds, origin)


def _meshes(scene: Scene, index: Mapping[str, int], origin: Floats, extent: float) -> PackedMeshes | None:
    placed = [(mesh.material_of(part), part.geometry) for mesh in scene.meshes for _, part in mesh.placed()]
    if not placed:
        return None
    if extent > _MOST_EXTENT:
        raise SceneError(
            f"meshes reach {extent:.3g} m from the middle of the scene, more than the {_MOST_EXTENT:.0e} m "
            "that can be traced; use a smaller scale"
        )
    used, materials = {name for name, _ in placed}, scene.materials
    of_meshes = tuple(
        (name, MeshMaterial(index[name], sum(mean_emission(m)), 0 if m.double_sided else CULLED))
        for name, m in materials.items()
        if name in used
    )
    geometries = [geometry for _, geometry in placed]
    textures = [texture for name in used for texture in materials[name].textures.values()]
    bumpy = any(materials[name].normal_texture is not None for name in used)
    needed = {
        "normal": bumpy or any(g.normals is not None for g in geometries),
        "uv": any(texture.coordinates == 0 for texture in textures),
        "uv_1": any(texture.coordinates == 1 for texture in textures),
        "tangent": bumpy,
        "color": any(g.colors is not None for g in geometries),
    }
    fields = tuple(name for name, _ in MESH_RECORDS["MeshVertex"] if needed[name])
    x, y, z = origin.tolist()
    meshes = tuple(_with_tangents(mesh, materials) for mesh in scene.meshes) if bumpy else scene.meshes
    return pack_meshes(meshes, of_meshes, fields, (x, y, z), extent)


def _with_tangents(mesh: Mesh, materials: Mapping[str, Material]) -> Mesh:
    """The mesh with tangents where a normal map needs them."""
    parts = []
    for part in mesh.parts:
        bumps = materials[mesh.material_of(part)].normal_texture
        parts.append(replace(part, geometry=with_tangents(part.geometry, bumps.coordinates)) if bumps else part)
    return replace(mesh, parts=tuple(parts))


def _points(scene: Scene) -> Floats:
    """The corners of everything finite, the camera included, (n, 3); but not of the lights, nor of spheres that
    shine: a sun far away loses nothing by its distance, and would take the precision from what it shines on."""
    points: list[Any] = [scene.camera.position]
    for s in scene.spheres:
        if scene.materials[s.material].is_emissive:
            continue
        points += [np.subtract(s.center, s.radius), np.add(s.center, s.radius)]
    for r in scene.rectangles:
        far = np.add(r.edge_u, r.edge_v)
        points += [np.add(r.corner, step) for step in ((0.0, 0.0, 0.0), r.edge_u, r.edge_v, far)]
    for t in scene.triangles:
        points += t.vertices
    for mesh in scene.meshes:
        points += list(mesh.box_corners())
    return np.asarray(points, np.float64)


def _middle(points: Floats) -> Floats:
    middle: Floats = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle


def _spheres_with_lights(scene: Scene) -> tuple[list[Sphere], dict[str, Material]]:
    """The spheres with those of the lights after them, and the materials with theirs."""
    spheres, materials = list(scene.spheres), dict(scene.materials) or {"none": Material()}  # GLSL has no empty array
    for i, light in enumerate(scene.lights):
        if light.radius > 0:
            name = f"light[{i}]"
            materials[name] = Material(albedo=(0.0, 0.0, 0.0), specular=0.0, emission=light.surface_radiance)
            spheres.append(Sphere(light.position, light.radius, name))
    return spheres, materials


def _scene_defines(records: Mapping[str, Sequence[Mapping[str, Any]]], scene: Scene) -> dict[str, int]:
    kinds = {light["kind"] for light in records["Light"]}
    return {
        **{f"{kind.upper()}_COUNT": len(records[kind]) for kind in RECORDS if kind not in MATERIAL_RECORDS},
        "HAS_AMBIENT": int(max(scene.ambient.radiance) > 0),
        "HAS_LENS": int(scene.camera.aperture_radius > 0),
        "HAS_POINT_LIGHT": int(CONSTANTS["LIGHT_POINT"] in kinds),
        "HAS_SPHERE_LIGHT": int(CONSTANTS["LIGHT_SPHERE"] in kinds),
        "HAS_AREA_LIGHT": int(bool(kinds & {CONSTANTS["LIGHT_RECTANGLE"], CONSTANTS["LIGHT_TRIANGLE"]})),
    }
