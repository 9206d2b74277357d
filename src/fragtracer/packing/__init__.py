# SPDX-License-Identifier: MIT
"""Scene -> textures of 32-bit words, features and uniforms for the shader.

Positions are packed relative to the middle of the scene (:mod:`fragtracer.packing.space`), so that a scene far from the
origin keeps its precision.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import SceneError
from fragtracer.packing.camera import camera_uniforms
from fragtracer.packing.environment import EnvironmentTables, compensates, pack_environment
from fragtracer.packing.hierarchy import ATTRIBUTES, PackedBvh, pack_bvh, rows_of
from fragtracer.packing.instances import MeshMaterial
from fragtracer.packing.interiors import camera_interiors, interior_flags
from fragtracer.packing.light_tree import MOST_DEPTH
from fragtracer.packing.lights import LIGHT_RECORDS, emissions_of, local_lights, pack_lights
from fragtracer.packing.materials import (
    ALPHA_DELTA,
    PackedMaterials,
    material_names,
    mean_emission,
    needed_attributes,
    pack_materials,
)
from fragtracer.packing.media import PackedMedia, pack_media
from fragtracer.packing.mirrors import mirror_uniforms
from fragtracer.packing.openness import is_open, walls_of
from fragtracer.packing.records import MATERIAL_RECORDS, MEDIUM_RECORDS, ROW, Words, texel_count, words_of_rows
from fragtracer.packing.settings import needs_maps, settings_features, settings_uniforms
from fragtracer.packing.shapes import CULLED, Shapes, finite_shapes, object_names, plane_records, shape_records
from fragtracer.packing.space import Space, space_of
from fragtracer.packing.sphere_grid import NO_UNIFORMS as NO_SPHERE_GRID
from fragtracer.packing.sphere_grid import pack_sphere_grid
from fragtracer.scene import Material, Mesh, RenderSettings, Scene
from fragtracer.scene.tangents import with_tangents

Floats = NDArray[np.float64]

# Areas, and products of them, must be float32.
_MOST_EXTENT = 1e15
# Lanes in step of the driver that ends loops early (llvmpipe): where a path ends in one of them, all trace again.
_LANES = 8
# Texels (n, 4) of one texture in parts, each of which begins a row; or the layers of an array (n, height, width, 4).
Table = tuple[NDArray[Any], ...]


@dataclass(frozen=True)
class PackedScene:
    """What the shader needs of a scene.

    ``tables`` are textures by the name of their sampler, ``features`` what the program has to be able to do. ``flags``
    are uniforms that say what kinds of things there are, ``movable`` those that change as the camera moves or the
    environment turns, ``uniforms`` all others. ``scene_records`` and ``listed`` are the records of u_scene by kind and
    of the short list of shapes, ``bvh_root`` that of the node which the BVH begins with. ``path_rounds`` are those of
    all loops along one path, at most; with a BVH, mostly.
    """

    tables: Mapping[str, Table]
    features: Mapping[str, int | str]
    flags: Mapping[str, int]
    movable: Mapping[str, Any]
    uniforms: Mapping[str, Any]
    scene_records: Mapping[str, Words]
    listed: Words
    bvh_root: Mapping[str, Words]
    environment: EnvironmentTables | None
    needs_maps: bool
    path_rounds: int
    space: Space

    @property
    def origin(self) -> Floats:
        """(3,): the point of the world that is the shader's (0, 0, 0)."""
        return self.space.origin

    @property
    def all_uniforms(self) -> dict[str, Any]:
        return {**self.uniforms, **self.flags, **self.movable}


def pack(
    scene: Scene,
    settings: RenderSettings,
    width: int,
    height: int,
    most_listed: int = 0,
    space: Space | None = None,
    most_outside_grid: int | None = None,
) -> PackedScene:
    """Pack ``scene`` for an image of ``width`` x ``height`` pixels rendered with ``settings``.

    Where there are at most ``most_listed`` shapes besides planes and meshes, every ray is tested against each, without
    a BVH. More than ``most_outside_grid`` of them, by default more than that, may be in a grid (:mod:`.sphere_grid`).
    ``space`` are the coordinates of an earlier packing, kept while they serve: nothing but
    :attr:`PackedScene.movable` changes while the camera moves, and meshes are not packed again when something beside
    them is edited.
    """
    space = space_of(scene, space)
    origin, extent = space.origin, space.extent
    shapes, materials = finite_shapes(scene)
    surfaces = pack_materials(scene, materials)
    emissions = emissions_of(materials)
    local = local_lights(scene, shapes, emissions, origin)
    plane_objects = len(scene.meshes)
    shape_objects = plane_objects + len(scene.planes)
    light_of = local.of_shapes(len(shapes))
    records = shape_records(
        shapes, materials, surfaces.of_shapes, light_of, origin, extent, space.detail, shape_objects
    )
    planes = plane_records(scene.planes, materials, surfaces.of_shapes, origin, plane_objects)
    outside_grid = most_listed if most_outside_grid is None else most_outside_grid
    grid = pack_sphere_grid(records, extent) if len(shapes) > outside_grid else None
    in_bvh = len(shapes) > most_listed and grid is None
    in_list = np.arange(0 if in_bvh else len(shapes))
    in_grid = grid.members if grid else in_list[:0]
    in_list = np.setdiff1d(in_list, in_grid)
    listed = np.concatenate([planes, records.words[in_list]])
    spheres_in_list = int((in_list < records.counts["sphere"]).sum())
    with_grid = np.concatenate([listed, records.words[in_grid]])
    bvh = _bvh(scene, surfaces, records if in_bvh else _NO_SHAPES, rows_of(len(with_grid)), origin, extent)
    if in_bvh:
        assert bvh is not None
        primitives = bvh.shape_records
    else:
        primitives = np.empty(len(shapes), np.int64)
        primitives[np.concatenate([in_list, in_grid])] = len(planes) + np.arange(len(shapes))
    environment = pack_environment(scene.environment, extent, compensates(settings))
    mesh_power = bvh.mesh_power if bvh else 0.0
    lights = pack_lights(scene, local, primitives, origin, extent, mesh_power, environment.lights)

    media = pack_media(scene, origin)

    scene_records, offsets = _scene_words(surfaces.words, lights.records, media)
    scene_parts = [np.concatenate([words.reshape(-1, 4) for words in scene_records.values()]), *media.voxels]
    first_of_grid = ROW * sum(-(-len(part) // ROW) for part in scene_parts)
    attributes, attribute_flags = _attributes(bvh)
    tables: dict[str, Table] = {
        "u_scene": (*scene_parts, grid.texels) if grid else tuple(scene_parts),
        "u_shapes": _parts(with_grid, bvh),
        "u_byte_texels": (surfaces.atlas.bytes,),
        "u_float_texels": (surfaces.atlas.floats,),
    }
    if bvh:
        tables |= {"u_vertices": attributes.parts, "u_mesh_lights": (bvh.mesh_light_texels,)}
    if environment.tables:
        tables |= {"u_environment": (environment.tables.texels,), "u_environment_tree": (environment.tables.tree,)}
    uniforms: dict[str, Any] = {
        "u_plane_count": len(planes),
        "u_first_traced": len(planes),
        "u_sphere_count": spheres_in_list,
        "u_flat_count": len(in_list) - spheres_in_list,
        **(grid.uniforms(len(listed), first_of_grid) if grid else NO_SPHERE_GRID),
        **_NO_BVH,
        **(bvh.uniforms if bvh else {}),
        **offsets,
        **attributes.offsets,
        **lights.uniforms,
        **mirror_uniforms(scene.planes, shapes, materials, np.where(records.is_globe, -1, primitives)),
        **settings_uniforms(settings),
        "u_ambient_radiance": scene.ambient.radiance,
        "u_background_radiance": (0.0, 0.0, 0.0),
        **environment.uniforms,
    }
    walls = [walls_of(listed), *([bvh.walls] if bvh else [])]
    flags = {
        **surfaces.flags,
        **interior_flags(scene),
        **media.flags,
        **attribute_flags,
        "u_bvh_shapes": uniforms.pop("u_bvh_shapes"),
        "u_has_sphere_grid": int(grid is not None),
        "u_has_globes": int(records.is_globe.any()),
        "u_has_panes": int(any(m.is_pane and m.alpha < ALPHA_DELTA for m in scene.materials.values())),
        "u_is_open": int(is_open(np.concatenate(walls), space.low - origin, space.high - origin)),
    }
    features = {**settings_features(settings, environment.hidden), **surfaces.features, **lights.features}
    features["HAS_ENVIRONMENT"] = int(environment.tables is not None)
    features["HAS_MEDIA"] = int(bool(media.rows["Medium"]))
    features |= bvh.features if bvh else {"HAS_MESHES": 0, "HAS_INSTANCES": 0}
    rounds = 4 + len(listed) + (bvh.usual_rounds if bvh else 0) + (grid.usual_rounds if grid else 0)
    tree_rounds = MOST_DEPTH if local.tree else 0
    sample_rounds = 1 + rounds + 24 + tree_rounds + (environment.tables.levels if environment.tables else 0)
    vertex_rounds = 1 + rounds + tree_rounds + sample_rounds * (settings.light_samples + 1)
    path_rounds = vertex_rounds * (settings.bounces + 2)
    if flags["u_is_open"] and not bvh:
        path_rounds += _LANES * (1 + rounds)
    return PackedScene(
        tables,
        features,
        flags,
        {**view_uniforms(scene, origin, width, height), **environment.movable},
        uniforms,
        scene_records,
        listed,
        bvh.root if bvh else {},
        environment.tables,
        needs_maps(settings),
        path_rounds,
        space,
    )


def matte_names(scene: Scene) -> tuple[list[str], list[str]]:
    """The names of the objects and of the materials of ``scene`` by their numbers in its records."""
    return object_names(scene), material_names(scene, finite_shapes(scene)[1])


def view_uniforms(scene: Scene, origin: Floats, width: int, height: int) -> dict[str, Any]:
    """The uniforms that depend on where the camera is, for an image of ``width`` x ``height`` pixels."""
    return camera_uniforms(scene.camera, origin, width, height) | camera_interiors(scene)


_NO_SHAPES = Shapes(np.zeros((0, 4, 4), np.uint32), np.zeros((6, 0), np.float32), {})
_NO_BVH = {"u_bvh_root": -1, "u_bvh_stack": 0, "u_mesh_light_count": 0, "u_bvh_shapes": 0}
_ATTRIBUTE_FLAGS = {name: 1 << i for i, name in enumerate(ATTRIBUTES)}  # ATTRIBUTE_... of scene/vertex.glsl


def _bvh(
    scene: Scene, surfaces: PackedMaterials, shapes: Shapes, first: int, origin: Floats, extent: float
) -> PackedBvh | None:
    parts = [(mesh.material_of(part), part.geometry) for mesh in scene.meshes for _, part in mesh.placed()]
    if not parts and not len(shapes):
        return None
    if extent > _MOST_EXTENT:
        raise SceneError(
            f"shapes, meshes or the camera lie {extent:.3g} m from the middle of the scene, more than the "
            f"{_MOST_EXTENT:.0e} m that can be traced; use a smaller scale"
        )
    materials = tuple(
        (name, _mesh_material(scene.materials[name], number)) for name, number in surfaces.of_meshes.items()
    )
    attributes = tuple(name for name in ATTRIBUTES if name in set(needed_attributes(scene)))
    meshes = _with_tangents(scene) if "tangent" in attributes else scene.meshes
    x, y, z = origin.tolist()
    return pack_bvh(meshes, materials, attributes, shapes, first, (x, y, z), extent)


def _mesh_material(material: Material, number: int) -> MeshMaterial:
    return MeshMaterial(number, sum(mean_emission(material)), 0 if material.double_sided else CULLED)


def _with_tangents(scene: Scene) -> tuple[Mesh, ...]:
    """The meshes with tangents where a normal map or anisotropic facets need them; of two materials that are blended
    they follow the coordinates of the first that does."""
    own = {name: material.tangent_coordinates for name, material in scene.materials.items()}

    def part_with(mesh: Mesh, part: Any) -> Any:
        found = next((own[n] for n in scene.blended(mesh.material_of(part)) if own[n] is not None), None)
        return part if found is None else replace(part, geometry=with_tangents(part.geometry, found))

    return tuple(replace(mesh, parts=tuple(part_with(mesh, part) for part in mesh.parts)) for mesh in scene.meshes)


def _scene_words(
    known: Mapping[str, Words], records: Mapping[str, list[dict[str, Any]]], media: PackedMedia
) -> tuple[dict[str, Words], dict[str, int]]:
    """The words of records by kind, some of them ``known``, and the uniforms with the texels where they begin."""
    kinds = MATERIAL_RECORDS | MEDIUM_RECORDS | LIGHT_RECORDS
    known = {**known, **{name: words_of_rows(kinds[name], rows) for name, rows in media.rows.items()}}
    words, offsets, first = {}, {}, 0
    for name, record in kinds.items():
        words[name] = known[name] if name in known else words_of_rows(record, records.get(name, []))
        offsets[f"u_first_{_snake(name)}"] = first
        first += texel_count(record) * len(words[name])
    words["Grid"] = words_of_rows(kinds["Grid"], media.placed(first)["Grid"])
    return words, offsets


def _snake(name: str) -> str:
    return "".join("_" + c.lower() if c.isupper() else c for c in name).removeprefix("_")


@dataclass(frozen=True)
class _Attributes:
    parts: Table
    offsets: Mapping[str, int]


@lru_cache(maxsize=2)
def _attribute_tables(bvh: PackedBvh) -> _Attributes:
    offsets, first = {f"u_first_{name}": 0 for name in ATTRIBUTES}, 0
    for name, table in bvh.vertices.items():
        offsets[f"u_first_{name}"] = first
        first += len(table)
    parts = (np.concatenate(list(bvh.vertices.values())),) if bvh.vertices else ()
    return _Attributes(parts, offsets)


def _attributes(bvh: PackedBvh | None) -> tuple[_Attributes, dict[str, int]]:
    if bvh is None:
        return _Attributes((), {f"u_first_{name}": 0 for name in ATTRIBUTES}), {
            "u_vertex_attributes": 0,
            "u_has_shading_normals": 0,
        }
    has = sum(_ATTRIBUTE_FLAGS[name] for name in bvh.vertices)
    flags = {"u_vertex_attributes": has, "u_has_shading_normals": int("normal" in bvh.vertices)}
    return _attribute_tables(bvh), flags


def _parts(listed: Words, bvh: PackedBvh | None) -> Table:
    """The short list and the BVH, each from the beginning of a row."""
    parts = [listed.reshape(-1, 4)] if len(listed) or bvh else []
    return (*parts, bvh.texels) if bvh else tuple(parts)
