# SPDX-License-Identifier: MIT
"""Translates a scene to Mitsuba.

:func:`scene_tree` gives the nested dictionary of ``mi.load_dict``, but with numpy matrices in place
of Mitsuba's transforms, so that it needs no Mitsuba; :func:`to_mitsuba` replaces them.

Where the two renderers differ:

- Depth: Mitsuba's ``max_depth`` counts the segments of a path, ours the scattering events between
  them: ``max_depth = bounces + 1``. With 0 bounces both show emitters only.
- Russian roulette: Mitsuba may end a path after its ``rr_depth``-th scattering event. Off is a depth that
  no path reaches. It changes the noise, never the mean.
- An infinite plane is a disk around the foot of the camera, so large that its rim lies less than
  1/50000 pixel under the horizon. It is Mitsuba's one flat shape that is intersected analytically: a
  rectangle is two triangles, whose float32 vertices lose the digits that a nearby hit needs.
- A sphere that is a ground, so large and near to the camera that Mitsuba would shade it by itself, is a mesh.
- A light is a black sphere that emits; one of radius 0 is a ``point`` emitter. Mitsuba rounds the cone of a small or
  far sphere: our plugin (plugins/sphere_light.py) does not.
- Mitsuba starts rays some tenths of a millimetre off a surface: :func:`to_mitsuba` has our integrator
  (plugins/path.py), which starts them nearer, except in scalar variants.
- Mitsuba's ``spot`` falls off linearly in the angle: our plugin (plugins/spot.py) has the falloff of glTF.
- A mesh is a PLY file for each part of each instance, with face normals: shading normals, normal maps and
  alpha are our plugin's (plugins/surface.py), since Mitsuba's own differ.
- Where a material has alpha or culled back faces, the integrator is ``volpath``: null transmission is not
  counted as scattering there, and shadow rays pass through it too.
- Mitsuba's gaussian filter is cut off at 4 standard deviations and lowered to 0 there; ours is not.
- Media that scatter need Mitsuba's own ``volpathmis``, whose channels are weighed against each other; ours
  (plugins/path.py) knows those that absorb. It has a bias with roulette: a grey cube of 4 mean free paths and an
  albedo of 0.8 is 0.3 % darker than without, so there is none. Another with a ``rectangle`` as the boundary of a
  medium: that cube is 0.6 % brighter than a random walk in numpy, so such a rectangle is two triangles. It finds
  NaN where Mitsuba rounds the cone of a sphere to 0: without our plugins the integrator is ``volpath``. And it finds
  too much light through surfaces that pass some as it is, 0.1 % through coloured panes, up to 17 % through the back of
  an emitter with alpha: where there are such, ``volpath``, too.
- Path choices (``rays``, ``light_samples``, ``estimator``, ``sampler``) have no counterpart: they
  change the noise, not the mean.
"""

import atexit
import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.reference import dielectrics, lights, shapes
from fragtracer.reference.environment import environment_emitters, hides_emitters, sun_distance
from fragtracer.reference.materials import (
    OR_NEAREST,
    blended_bsdf,
    emitter_of,
    exact_bsdf,
    geometry_term,
    has_null_transmission,
)
from fragtracer.reference.meshes import (
    VERTEX_COLORS,
    MeshAttributes,
    with_needed_coordinates,
    with_needed_tangents,
    world_mesh,
)
from fragtracer.reference.nearest import nearest_bsdf, with_base_as_bright
from fragtracer.reference.plugins import PATH, SPHERE_LIGHT, UNLIT
from fragtracer.reference.shapes import Tree, rgb
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import LIGHTS, SHAPES, Material, RenderSettings, Scene
from fragtracer.scene.interiors import fillings, halves, has_media, passed_by_fog

NEVER = 1_000_000  # a depth that no path reaches
Found = dict[str, tuple[Tree, str, MeshAttributes]]  # shapes by their keys, with their materials and what these read


def scene_tree(scene: Scene, folder: Path, plugins: bool = True) -> Tree:
    """The scene as a nested dictionary of plugins.

    Parameters
    ----------
    scene
        Any scene.
    folder
        Where triangles and images are written; the folder exists.
    plugins
        Whether materials, spot lights and the emitters of spheres are fragtracer's own plugins, which are exact.
        Otherwise they are the nearest ones of Mitsuba, which interpolates the vertex normals itself.

    Returns
    -------
    dict
        As ``mi.load_dict`` takes it, except that ``to_world`` and ``to_uv`` values are float64 matrices,
        shape (4, 4). Material i, in the order of ``scene.materials``, is called ``material_i``, or
        ``material_i_x`` where x names the vertex attributes that it reads.

    Raises
    ------
    FragtracerError
        If Mitsuba cannot show a material.
    """
    scene = _as_fog_lets_it(scene)
    numbers = {name: i for i, name in enumerate(scene.materials)}
    textures = TextureFolder(folder)

    def bsdf(name: str, attributes: MeshAttributes, around: str = "") -> Tree:
        """Of a surface of the material ``name``, which lies in the dielectric ``around``."""
        own, *others = (_seen(scene, n, attributes) for n in scene.blended(name))
        parts = [own, *(replace(other, alpha_mode="opaque", double_sided=True) for other in others)]

        def scattering(part: Material, vertex_color: str) -> Tree:
            if around and part.is_dielectric:
                return dielectrics.dielectric_bsdf(part, scene.materials[around])
            if plugins:
                return exact_bsdf(part, geometry_term(scene.render), attributes, textures)
            return nearest_bsdf(part, attributes, textures, vertex_color)

        trees = [scattering(part, color) for part, color in zip(parts, VERTEX_COLORS, strict=False)]
        return trees[0] if len(parts) == 1 else blended_bsdf(parts[0], trees, attributes, textures, plugins)

    inside = fillings(scene)
    found = _shapes(scene, folder, plugins)
    tree: Tree = {"type": "scene", "integrator": _integrator(scene, found, plugins), "sensor": sensor_tree(scene)}
    media = dielectrics.media(scene)
    tree |= {key: dielectrics.medium_tree(medium, folder / f"{key}.vol") for key, medium in media.items()}
    tree["sensor"] |= _medium(scene, media, "medium", dielectrics.of_camera(scene))
    surroundings = dielectrics.surroundings(scene)
    used = {(name, attributes) for _, name, attributes in found.values()}
    unused = {(name, MeshAttributes()) for name in scene.materials.keys() - {name for name, _ in used}}
    keys = {(name, attributes): _material_key(numbers[name], attributes) for name, attributes in used | unused}
    for name, attributes in sorted(keys, key=lambda pair: (numbers[pair[0]], pair[1].key)):
        with _named(name):
            tree[keys[name, attributes]] = bsdf(name, attributes)
    for key, (shape, name, attributes) in found.items():
        tree[key] = {**shape, "bsdf": {"type": "ref", "id": keys[name, attributes]}}
        material = _seen(scene, name, attributes)
        around = surroundings.get(_solid_name(key, inside.get(name, name)), "")
        if around:
            tree[key]["bsdf"] = bsdf(name, attributes, around)
        if name in inside:
            tree[key] |= _medium(scene, media, "interior", inside[name]) | _medium(scene, media, "exterior", around)
        with _named(name):
            emitter = emitter_of(material, attributes, textures, plugins)
        is_anisotropic = any(scene.materials[n].anisotropy for n in scene.blended(name))
        if is_anisotropic and shape["type"] == "sphere":
            tree[key] = {**tree[key], **shapes.upright_sphere(shape)}
            del tree[key]["center"], tree[key]["radius"]
        elif is_anisotropic and plugins and not _has_tangents(scene, name, key):
            raise FragtracerError(
                f"material {name!r}: Mitsuba turns the facets otherwise on flat shapes, and on meshes without texture "
                f"coordinates; put it on spheres and other meshes, {OR_NEAREST}"
            )
        if emitter:
            tree[key]["emitter"] = lights.sphere_light(shape, emitter) if plugins else emitter
        if emitter and emitter["type"] == UNLIT:
            tree[key]["emitter"]["of"] = key
    for kind in LIGHTS:
        for i, light in enumerate(getattr(scene, kind)):
            tree[f"{kind.removesuffix('s')}_{i}"] = lights.emitter(light, scene.camera.target, plugins)
    tree |= environment_emitters(scene, folder, plugins)
    if scene.environment is None and max(scene.ambient.radiance) > 0:
        tree["ambient"] = {"type": "constant", "radiance": rgb(scene.ambient.radiance)}
    return tree


@contextmanager
def _named(material: str) -> Iterator[None]:
    """Open the message of what Mitsuba cannot show with the name of the material."""
    try:
        yield
    except FragtracerError as error:
        raise FragtracerError(f"material {material!r}: {error}") from None


def _as_fog_lets_it(scene: Scene) -> Scene:
    """The scene without what fog keeps of light from infinitely far away, of which in Mitsuba some arrives, since fog
    ends where the scene does."""
    passed = np.array(passed_by_fog(scene))
    if passed.all():
        return scene
    environment, directional = scene.environment, []
    if environment is not None:
        environment = replace(environment, tint=tuple(passed * environment.tint)) if passed.any() else None
    for light in scene.directional_lights:
        if (passed * light.irradiance).any():
            directional.append(replace(light, irradiance=tuple(passed * light.irradiance)))
    ambient = replace(scene.ambient, radiance=tuple(passed * scene.ambient.radiance))
    return replace(scene, environment=environment, directional_lights=tuple(directional), ambient=ambient)


def _seen(scene: Scene, name: str, attributes: MeshAttributes) -> Material:
    """The material ``name`` on a surface of these attributes."""
    material = scene.materials[name]
    return material.without_textures() if attributes.bare else material


def _has_tangents(scene: Scene, name: str, key: str) -> bool:
    """Whether the meshes of a material have tangents that Mitsuba finds, too: from their texture coordinates."""
    parts = [part for mesh in scene.meshes for part in mesh.parts if mesh.material_of(part) == name]
    return key.startswith("mesh") and all(part.geometry.uvs is not None for part in parts)


def _medium(scene: Scene, media: Collection[str], side: str, name: str) -> Tree:
    """What absorbs or scatters on a side of a shape, if anything does: in the dielectric ``name``, which is empty for
    air."""
    key = dielectrics.medium_key(scene, name)
    return {side: {"type": "ref", "id": key}} if key in media else {}


def _solid_name(key: str, material: str) -> str:
    """The name of the solid that a shape belongs to."""
    return f"flat_{material}" if key.startswith(("rectangle", "triangles")) else key


def _material_key(number: int, attributes: MeshAttributes) -> str:
    return "_".join(["material", str(number), *filter(None, [attributes.key])])


def _integrator(scene: Scene, found: Found, plugins: bool) -> Tree:
    settings = scene.render
    hidden = hides_emitters(scene, [scene.materials[name] for _, name, _ in found.values()])
    has_roulette = settings.russian_roulette and not has_media(scene)
    rr_depth = settings.russian_roulette_depth if has_roulette else NEVER
    null = any(map(has_null_transmission, scene.materials.values()))
    kind = "volpath" if null or dielectrics.media(scene) or has_media(scene) else "path"
    used = (scene.materials[n] for _, name, _ in found.values() for n in scene.blended(name))
    has_holes = any(has_null_transmission(m) or (m.is_emissive and m.model == "null") for m in used)
    kind = "volpathmis" if has_media(scene) and plugins and not has_holes else kind
    return {"type": kind, "max_depth": settings.bounces + 1, "rr_depth": rr_depth, "hide_emitters": hidden}


def sensor_tree(scene: Scene) -> Tree:
    """The camera and the film, as :func:`scene_tree` has them."""
    camera, settings = scene.camera, scene.render
    rims = [shapes.plane_radius(scene, plane) for plane in scene.planes]
    far = max([sun_distance(scene), shapes.bounding_radius(scene), *rims])
    sensor: Tree = {
        "type": "thinlens" if camera.aperture_radius > 0 else "perspective",
        "to_world": shapes.camera_to_world(camera),
        "fov": float(camera.fov_degrees),
        "fov_axis": "y",
        "near_clip": 1e-4 * camera.focal_distance,
        "far_clip": 10 * far,
        "film": _film(settings),
        "sampler": {"type": "independent", "sample_count": settings.spp},
    }
    if camera.aperture_radius > 0:
        sensor |= {"aperture_radius": float(camera.aperture_radius), "focus_distance": float(camera.focal_distance)}
    return sensor


def _film(settings: RenderSettings) -> Tree:
    filters = {
        "box": {"type": "box"},
        "tent": {"type": "tent", "radius": 1.0},
        "gaussian": {"type": "gaussian", "stddev": 0.5},
    }
    return {
        "type": "hdrfilm",
        "width": settings.width,
        "height": settings.height,
        "pixel_format": "rgb",
        "component_format": "float32",
        "sample_border": settings.pixel_filter != "box",
        "rfilter": filters[settings.pixel_filter],
    }


def _shapes(scene: Scene, folder: Path, plugins: bool) -> Found:
    """Every shape by its key, with the name of its material and the attributes that this reads."""
    inside = fillings(scene)

    def bare(name: str) -> MeshAttributes:
        """Of a shape that is no mesh."""
        return MeshAttributes(bare=any(scene.materials[n].textures for n in scene.blended(name)))

    has_medium = {name for name, solid in inside.items() if scene.materials[solid].interior is not None}
    around_media = [r for r in scene.rectangles if r.material in has_medium]
    found = {
        f"{kind.removesuffix('s')}_{i}": (shapes.shape(scene, shape), shape.material, bare(shape.material))
        for kind in SHAPES
        for i, shape in enumerate(getattr(scene, kind))
        if kind != "triangles" and shape not in around_media
    }
    for i, sphere in enumerate(scene.spheres):
        parts = [scene.materials[name] for name in scene.blended(sphere.material)]
        if shapes.is_ground(scene, sphere) and not any(part.is_emissive or part.anisotropy for part in parts):
            key = f"sphere_{i}"
            found[key] = (shapes.ground(folder / f"{key}.ply", scene, sphere), *found[key][1:])
    flats = [(t.material, t.vertices) for t in scene.triangles]
    flats += [(r.material, vertices) for r in around_media for vertices in halves(r)]
    for i, name in enumerate(dict.fromkeys(name for name, _ in flats)):
        vertices = [vertices for material, vertices in flats if material == name]
        found[f"triangles_{i}"] = (shapes.triangle_mesh(folder / f"triangles_{i}.ply", vertices), name, bare(name))
    for i, mesh in enumerate(scene.meshes):
        for (j, part), (k, placement) in product(enumerate(mesh.parts), enumerate(mesh.instances)):
            name, key = mesh.material_of(part), f"mesh_{i}_{j}_{k}"
            material, blended = scene.materials[name], [scene.materials[n] for n in scene.blended(name)]
            geometry = with_needed_coordinates(with_needed_tangents(part.geometry, blended), blended)
            attributes = MeshAttributes.of(geometry, blended)
            matrix = placement.matrix @ np.asarray(part.matrix)
            if len(geometry.triangles):
                forward = material.is_emissive and not material.double_sided
                factors = [] if plugins else [with_base_as_bright(each) for each in blended]
                tree = world_mesh(folder / f"{key}.ply", geometry, matrix, attributes, factors, forward)
                found[key] = (tree, name, attributes)
    return found


def to_mitsuba(scene: Scene, folder: Path | None = None, plugins: bool = True, exact: bool = True) -> Tree:
    """The scene as a dictionary for ``mi.load_dict``, for the variant that is active.

    ``folder`` is for the triangles, which Mitsuba reads when it loads the dictionary; left out, it is a
    temporary one that lasts as long as the process. ``plugins`` is as for :func:`scene_tree`. Unless it is to be
    ``exact``, integrator and emitters of spheres are Mitsuba's own, which are faster, where no medium scatters.
    """
    import mitsuba as mi

    from fragtracer.reference.plugins import register

    register()
    tree = scene_tree(scene, folder or _temporary_folder(), plugins)
    scatters = has_media(scene)  # by Mitsuba's own integrator, which needs our emitters
    if not exact and not scatters:
        tree = _with_own_emitters(tree)
    elif exact and plugins and not scatters and not str(mi.variant()).startswith("scalar"):
        own = tree["integrator"]
        null = any(map(has_null_transmission, scene.materials.values()))
        media = any(key.startswith("medium_") for key in tree)
        tree["integrator"] = own | {"type": PATH, "null_transmission": null, "media": media}
    world: Tree = loadable(tree)
    return world


def loadable(value: Any) -> Any:
    """A part of a :data:`Tree` for ``mi.load_dict``, in the variant that is active."""
    import mitsuba as mi

    if isinstance(value, dict):
        return {key: loadable(v) for key, v in value.items()}
    return mi.ScalarTransform4f(value) if isinstance(value, np.ndarray) else value


def _with_own_emitters(tree: Tree) -> Tree:
    found = {key: _with_own_emitters(value) if isinstance(value, dict) else value for key, value in tree.items()}
    return {"type": "area", "radiance": rgb(found["radiance"])} if found["type"] == SPHERE_LIGHT else found


def _temporary_folder() -> Path:
    folder = tempfile.mkdtemp(prefix="fragtracer-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)
