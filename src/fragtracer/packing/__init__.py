# SPDX-License-Identifier: MIT
"""Scene -> float32 texels, feature defines and uniforms for the shader.

The layout of every record is written once, in :data:`.records.RECORDS`; the GLSL structs and the functions
that read them are generated from it (``generated/scene_layout.glsl``). Positions are packed
relative to the middle of the scene, so that a scene far from the origin keeps its precision.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from fragtracer.errors import SceneError
from fragtracer.packing.environment import EnvironmentTables, pack_environment
from fragtracer.packing.gather import gather_triangles
from fragtracer.packing.materials import (
    MATERIAL_RECORDS,
    apart,
    has_colors,
    has_one_sided_shapes,
    mean_emission,
    pack_materials,
    plain_emission,
)
from fragtracer.packing.meshes import CULLED, MeshMaterial, PackedMeshes, pack_meshes
from fragtracer.packing.records import MESH_RECORDS, RECORDS, SHAPES, loop_rounds, mesh_layout, scene_layout, texels_of
from fragtracer.random_texture import LAYERS, WIDTH
from fragtracer.scene import Camera, Light, Material, Mesh, Rectangle, RenderSettings, Scene, Sphere, Triangle
from fragtracer.scene.tangents import with_tangents
from fragtracer.shader_composer import CONSTANTS
from fragtracer.textures.atlas import Atlas

Floats = NDArray[np.float64]

# Shapes reach this much beyond their edges, relative to the scene, so that neighbours leave no crack.
_EDGE_GROWTH = 1e-6
# The share of light choices that ignores power, so that a dim light nearby is never starved.
_UNIFORM_LIGHT_CHOICE = 0.1
# Above these, code made for each record grows faster than it gains.
_MAX_BAKED = 256
# The backgrounds that are looked up in maps of the split-sum approximation.
_MAPS = ("prefiltered", "irradiance")
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
    (:func:`camera_uniforms`), so that nothing but these changes on its way.
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
    lights = _lights(scene, spheres, materials, origin, meshes.power if meshes else 0.0, surroundings.lights)
    light_of = {light["primitive"]: i for i, light in enumerate(lights) if light["primitive"] >= 0}

    records: dict[str, list[dict[str, Any]]] = {
        "Sphere": [
            {"center": np.subtract(s.center, origin), "radius": s.radius, "material": index[s.material]}
            for s in spheres
        ],
        "Plane": [],
        "Rectangle": [_rectangle(r, origin, extent) | {"material": index[r.material]} for r in scene.rectangles],
        "Triangle": [_triangle(t, origin, extent) | {"material": index[t.material]} for t in scene.triangles],
        **surfaces.records,
        "Light": lights,
    }
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / np.linalg.norm(plane.normal)
        offset = normal @ np.subtract(plane.point, origin)
        records["Plane"].append({"normal": normal, "offset": offset, "material": index[plane.material]})
    for first, kind in _first_primitives(records):
        for i, record in enumerate(records[kind]):
            record["light"] = light_of.get(first + i, -1)

    texels = np.concatenate([texels_of(name, rows) for name, rows in records.items()])
    defines = _scene_defines(records, scene) | _settings_defines(settings) | surroundings.defines(lights)
    defines |= {**surfaces.defines, **(meshes.defines if meshes else {"HAS_MESHES": 0})}
    defines |= {"SCENE_TEXELS": len(texels), "SCENE_IN_UNIFORMS": int(len(texels) <= _MAX_UNIFORM_TEXELS)}
    movable = camera_uniforms(scene.camera, origin, width, height) | surroundings.movable
    others = _settings_uniforms(settings) | {"u_ambient_radiance": scene.ambient.radiance} | surroundings.uniforms
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


def _lights(
    scene: Scene,
    spheres: Sequence[Sphere],
    materials: Mapping[str, Material],
    origin: Floats,
    mesh_power: float,
    distant: Sequence[dict[str, Any]],
) -> list[dict[str, Any]]:
    """The records of all that emits, the meshes together first and ``distant`` lights last, each with the power
    that decides how often it is chosen."""
    first_rectangle = len(spheres) + len(scene.planes)
    shapes: list[tuple[int, Any]] = list(enumerate(spheres))
    shapes += enumerate([*scene.rectangles, *scene.triangles], first_rectangle)
    found = [{"kind": CONSTANTS["LIGHT_MESH"], "primitive": -1, "power": mesh_power}] if mesh_power > 0 else []
    found += [
        _shape_light(shape, emission, origin) | {"primitive": primitive}
        for primitive, shape in shapes
        if max(emission := plain_emission(materials[shape.material])) > 0
    ]
    found += [_point_light(light, origin) for light in scene.lights if light.radius == 0 and max(light.intensity) > 0]
    found += distant
    power = np.array([light.pop("power") for light in found])
    probability = (1 - _UNIFORM_LIGHT_CHOICE) * power / power.sum() + _UNIFORM_LIGHT_CHOICE / max(1, len(found))
    for light, p, cumulative in zip(found, probability, np.cumsum(probability), strict=True):
        light |= {"probability": p, "cumulative": cumulative}
    return found


def _shape_light(shape: Sphere | Rectangle | Triangle, radiance: Sequence[float], origin: Floats) -> dict[str, Any]:
    light: dict[str, Any] = {"radiance": radiance}
    if isinstance(shape, Sphere):
        light |= {"kind": CONSTANTS["LIGHT_SPHERE"], "radius": shape.radius}
        light |= {"position": np.subtract(shape.center, origin)}
        return light | {"power": 4 * np.pi**2 * shape.radius**2 * sum(radiance)}
    if isinstance(shape, Rectangle):
        corner, edge_u, edge_v = (np.asarray(v, np.float64) for v in (shape.corner, shape.edge_u, shape.edge_v))
        light |= {"kind": CONSTANTS["LIGHT_RECTANGLE"]}
    else:
        corner, b, c = (np.asarray(v, np.float64) for v in shape.vertices)
        edge_u, edge_v = b - corner, c - corner
        light |= {"kind": CONSTANTS["LIGHT_TRIANGLE"]}
    normal = np.cross(edge_u, edge_v)
    light |= {"position": corner - origin, "edge_u": edge_u, "edge_v": edge_v, "area": shape.area}
    return light | {"normal": normal / np.linalg.norm(normal), "power": np.pi * shape.area * sum(radiance)}


def _point_light(light: Light, origin: Floats) -> dict[str, Any]:
    intensity = light.intensity
    place = {"kind": CONSTANTS["LIGHT_POINT"], "position": np.subtract(light.position, origin), "primitive": -1}
    return place | {"radiance": intensity, "power": 4 * np.pi * sum(intensity)}


def _rectangle(r: Rectangle, origin: Floats, extent: float) -> dict[str, Any]:
    u, v = np.asarray(r.edge_u), np.asarray(r.edge_v)
    growth = _EDGE_GROWTH * extent
    step_u, step_v = growth * u / np.linalg.norm(u), growth * v / np.linalg.norm(v)
    return _flat(np.subtract(r.corner, origin) - step_u - step_v, u + 2 * step_u, v + 2 * step_v)


def _triangle(t: Triangle, origin: Floats, extent: float) -> dict[str, Any]:
    vertices = np.asarray(t.vertices) - origin
    sides = np.linalg.norm(np.roll(vertices, -1, 0) - np.roll(vertices, -2, 0), axis=1)
    incenter = sides @ vertices / sides.sum()
    inradius = 2 * t.area / sides.sum()
    a, b, c = incenter + (vertices - incenter) * (1 + _EDGE_GROWTH * extent / inradius)
    return _flat(a, b - a, c - a)


def _flat(corner: Floats, edge_u: Floats, edge_v: Floats) -> dict[str, Any]:
    """Plane and rows so that p = corner + u edge_u + v edge_v has u = u_row . (p, 1), likewise v."""
    normal = np.cross(edge_u, edge_v)
    rows = np.linalg.inv(np.column_stack([edge_u, edge_v, normal]))
    unit = normal / np.linalg.norm(normal)
    return {
        "plane": np.append(unit, unit @ corner),
        "u_row": np.append(rows[0], -rows[0] @ corner),
        "v_row": np.append(rows[1], -rows[1] @ corner),
    }


def _first_primitives(records: Mapping[str, Sequence[Any]]) -> Iterable[tuple[int, str]]:
    """The number of the first primitive of each kind that can be a light (shape/intersect.glsl)."""
    first_rectangle = len(records["Sphere"]) + len(records["Plane"])
    return ((0, "Sphere"), (first_rectangle, "Rectangle"), (first_rectangle + len(records["Rectangle"]), "Triangle"))


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


def _settings_defines(settings: RenderSettings) -> dict[str, int]:
    def value(prefix: str, choice: str) -> int:
        return CONSTANTS[f"{prefix}_{choice.upper().replace('-', '_')}"]

    return {
        "GEOMETRY_TERM": value("GEOMETRY", settings.geometry),
        "MULTIPLE_SCATTERING": int(settings.multiple_scattering),
        "ESTIMATOR": value("ESTIMATOR", settings.estimator),
        "INTEGRATOR": value("INTEGRATOR", settings.integrator),
        "BACKGROUND": value("BACKGROUND", settings.background),
        "HAS_SPLIT_SUM_MAPS": int(settings.integrator == "split-sum" or settings.background in _MAPS),
        "SAMPLER": value("SAMPLER", settings.sampler),
        "PIXEL_FILTER": value("PIXEL_FILTER", settings.pixel_filter),
        "RANDOM_TEXTURE_WIDTH": WIDTH,
        "RANDOM_TEXTURE_LAYERS": LAYERS,
    }


def _settings_uniforms(settings: RenderSettings) -> dict[str, Any]:
    never = 2**31 - 1
    return {
        "u_bounces": settings.bounces,
        "u_light_samples": settings.light_samples,
        "u_russian_roulette_vertex": settings.russian_roulette_depth if settings.russian_roulette else never,
        "u_seed": settings.seed,
        "u_background_roughness": settings.background_roughness,
    }


def camera_uniforms(camera: Camera, origin: Floats, width: int, height: int) -> dict[str, Any]:
    """What the shader needs of ``camera`` for an image of ``width`` x ``height`` pixels, by name.

    ``origin`` is that of the :class:`PackedScene` it looks at.
    """
    eye, target = (glm.dvec3(*np.subtract(p, origin)) for p in (camera.position, camera.target))
    view = glm.lookAt(eye, target, glm.dvec3(*camera.up))
    projection = glm.perspective(np.radians(camera.fov_degrees), width / height, 1.0, 2.0)
    return {
        "u_inverse_view": _column_major(glm.inverse(view)),
        "u_inverse_projection": _column_major(glm.inverse(projection)),
        "u_lens_radius": camera.aperture_radius,
        "u_focus_distance": camera.focal_distance,
        "u_inverse_image_size": (1 / width, 1 / height),
    }


def _column_major(matrix: Any) -> tuple[float, ...]:
    return tuple(float(x) for column in matrix.to_list() for x in column)
