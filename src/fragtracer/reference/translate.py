# SPDX-License-Identifier: MIT
"""Says a fragtracer scene in Mitsuba's words.

:func:`scene_tree` gives the nested dictionary of ``mi.load_dict``, but with numpy matrices in place
of Mitsuba's transforms, so that it needs no Mitsuba; :func:`to_mitsuba` replaces them.

What differs between the two worlds:

- Depth: Mitsuba's ``max_depth`` counts the segments of a path, ours the scattering events between
  them: ``max_depth = bounces + 1``. With 0 bounces both show emitters only.
- Russian roulette: Mitsuba may end a path after its ``rr_depth``-th scattering event. Off is a depth that
  no path reaches. It changes the noise, never the mean.
- An infinite plane is a disk around the foot of the camera, so large that its rim lies less than
  1/50 pixel under the horizon. It is Mitsuba's one flat shape that is intersected analytically: a
  rectangle is two triangles, whose float32 vertices lose the digits that a nearby hit needs.
- A light is an ``area`` emitter on a black sphere; one of radius 0 is a ``point`` emitter.
- A mesh is a PLY file for each part of each copy, with face normals: shading normals, normal maps and
  alpha are our plugin's (bsdf/surface.py), since Mitsuba's own differ.
- Where a surface may let rays pass, the integrator is ``volpath``: it does not count that as scattering,
  and its shadow rays pass too.
- Mitsuba's gaussian filter is cut off at 4 standard deviations and lowered to 0 there; ours is not.
- Path choices (``rays``, ``light_samples``, ``estimator``, ``sampler``) have no counterpart: they
  change the noise, not the mean.
"""

import atexit
import shutil
import tempfile
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.errors import FragtracerError
from fragtracer.materials import METAL_F0, reflectance_from_ior
from fragtracer.reference import shapes
from fragtracer.reference.bsdf import NAME, SURFACE
from fragtracer.reference.environment import environment_emitters, hides_emitters, sun_distance
from fragtracer.reference.meshes import Traits, world_mesh
from fragtracer.reference.shapes import Tree
from fragtracer.reference.textures import TextureFolder
from fragtracer.scene import Light, Material, RenderSettings, Scene, Texture

NEVER = 1_000_000  # a depth that no path reaches

Translator = Callable[[Material, str, Traits, TextureFolder], Tree]


def rgb(color: Any) -> Tree:
    """A colour, linear Rec. 709."""
    return {"type": "rgb", "value": [float(c) for c in color]}


def is_lambert(material: Material) -> bool:
    """Whether the material has no specular lobe at all."""
    return max(*material.specular_f0, *material.specular_f90) == 0


def dielectric_f0(material: Material) -> tuple[float, float, float]:
    """Reflectance at normal incidence of the dielectric part."""
    return material.f0 or (reflectance_from_ior(1.5 if material.ior is None else material.ior),) * 3


def lambert(material: Material) -> Tree:
    """Mitsuba's own diffuse material."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material.diffuse_albedo)}}


def is_plain(material: Material, traits: Traits) -> bool:
    """Whether the material is alike at all points of a mesh, opaque, and without shading normals."""
    textures = (material.albedo_texture, material.roughness_texture, material.metallic_texture, material.normal_texture)
    varies = any(textures) or traits != Traits(uv=traits.uv)
    return not varies and not passes(material)


def passes(material: Material) -> bool:
    """Whether rays may pass the surface as if it was not there."""
    return material.alpha_mode != "opaque" or not material.double_sided


def geometry_term(settings: RenderSettings) -> str:
    """What the plugins call the geometry term, and what it does with light scattered more than once."""
    return "smith-multiple-scattering" if settings.multiple_scattering else settings.geometry


def exact_bsdf(material: Material, geometry: str, traits: Traits, textures: TextureFolder) -> Tree:
    """The same material: Mitsuba's ``diffuse`` where that is exact, our plugins elsewhere."""
    if not is_plain(material, traits):
        return surface(material, geometry, traits, textures)
    if is_lambert(material):
        return lambert(material)
    return {
        "type": NAME,
        "diffuse_albedo": list(material.diffuse_albedo),
        "specular_f0": list(material.specular_f0),
        "specular_f90": list(material.specular_f90),
        "alpha": float(material.alpha),
        "geometry": geometry,
    }


def surface(material: Material, geometry: str, traits: Traits, textures: TextureFolder) -> Tree:
    """The plugin for what varies over a mesh; a metal of a name is one whose albedo is its reflectance."""
    tree: Tree = {
        "type": SURFACE,
        "albedo": list(METAL_F0[material.metal] if material.metal else material.albedo),
        "metallic": 1.0 if material.metal else float(material.metallic),
        "roughness": float(material.roughness),
        "specular": float(material.specular),
        "dielectric_f0": list(dielectric_f0(material)),
        "geometry": geometry,
        "opacity": float(material.opacity),
        "alpha_mode": material.alpha_mode,
        "alpha_cutoff": float(material.alpha_cutoff),
        "double_sided": material.double_sided,
        "normal_scale": float(material.normal_scale),
    }
    images: dict[str, tuple[Texture | None, Any]] = {
        "albedo": (material.albedo_texture, "color"),
        "alpha": (material.albedo_texture if material.alpha_mode != "opaque" else None, "a"),
        "roughness": (t := material.roughness_texture, t and t.channel),
        "metallic": (t := material.metallic_texture, t and t.channel),
        "normal": (material.normal_texture, "color"),
    }
    for name, (texture, use) in images.items():
        if texture:
            tree[f"{name}_texture"] = textures.exact(texture, use)
            tree[f"{name}_set"] = traits.set_of(texture.coordinates)
    return tree | {f"has_{name}": True for name in ("shading", "tangent", "color", "alpha") if getattr(traits, name)}


def scene_tree(scene: Scene, folder: Path, bsdf: Translator = exact_bsdf) -> Tree:
    """The scene as a nested dictionary of plugins.

    Parameters
    ----------
    scene
        Any scene.
    folder
        Where triangles and images are written; the folder exists.
    bsdf
        Gives the plugin of a material under a geometry term. Any but :func:`exact_bsdf` has the
        vertex normals of meshes from Mitsuba.

    Returns
    -------
    dict
        As ``mi.load_dict`` takes it, except that ``to_world`` and ``to_uv`` values are float64 matrices,
        shape (4, 4). Material i, in the order of ``scene.materials``, is called ``material_i``, or
        ``material_i_x`` where x names what a mesh brings to it.

    Raises
    ------
    FragtracerError
        If Mitsuba cannot show a material.
    """
    numbers = {name: i for i, name in enumerate(scene.materials)}
    textures = TextureFolder(folder)
    found = _shapes(scene, folder, smooth=bsdf is not exact_bsdf)
    tree: Tree = {"type": "scene", "integrator": _integrator(scene), "sensor": _sensor(scene)}
    worn = {(name, traits) for _, name, traits in found.values()}
    unworn = {(name, Traits()) for name in scene.materials.keys() - {name for name, _ in worn}}
    keys = {(name, traits): _material_key(numbers[name], traits) for name, traits in worn | unworn}
    for name, traits in sorted(keys, key=lambda pair: (numbers[pair[0]], pair[1].key)):
        tree[keys[name, traits]] = bsdf(scene.materials[name], geometry_term(scene.render), traits, textures)
    for key, (shape, name, traits) in found.items():
        tree[key] = {**shape, "bsdf": {"type": "ref", "id": keys[name, traits]}}
        if scene.materials[name].is_emissive:
            tree[key]["emitter"] = {
                "type": "area",
                "radiance": _radiance(scene.materials[name], textures, bsdf is exact_bsdf),
            }
    for i, light in enumerate(scene.lights):
        tree[f"light_{i}"] = _light(light)
    tree |= environment_emitters(scene, folder)
    if scene.environment is None and max(scene.ambient.radiance) > 0:
        tree["ambient"] = {"type": "constant", "radiance": rgb(scene.ambient.radiance)}
    return tree


def _material_key(number: int, traits: Traits) -> str:
    return "_".join(["material", str(number), *filter(None, [traits.key])])


def _integrator(scene: Scene) -> Tree:
    settings, hidden = scene.render, hides_emitters(scene)
    rr_depth = settings.russian_roulette_depth if settings.russian_roulette else NEVER
    kind = "volpath" if any(map(passes, scene.materials.values())) else "path"
    return {"type": kind, "max_depth": settings.bounces + 1, "rr_depth": rr_depth, "hide_emitters": hidden}


def _sensor(scene: Scene) -> Tree:
    camera, settings = scene.camera, scene.render
    rims = [shapes.plane_radius(scene, plane) for plane in scene.planes]
    far = max([sun_distance(scene), shapes.reach(scene), *rims])
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


def _shapes(scene: Scene, folder: Path, smooth: bool) -> dict[str, tuple[Tree, str, Traits]]:
    """Every shape by its key, with the name of its material and what it brings to it."""
    plain = Traits()
    found = {f"sphere_{i}": (shapes.sphere(s), s.material, plain) for i, s in enumerate(scene.spheres)}
    found |= {f"plane_{i}": (shapes.plane_disk(scene, p), p.material, plain) for i, p in enumerate(scene.planes)}
    found |= {f"rectangle_{i}": (shapes.rectangle(r), r.material, plain) for i, r in enumerate(scene.rectangles)}
    for i, name in enumerate(dict.fromkeys(t.material for t in scene.triangles)):
        vertices = [t.vertices for t in scene.triangles if t.material == name]
        found[f"triangles_{i}"] = (shapes.triangle_mesh(folder / f"triangles_{i}.ply", vertices), name, plain)
    for i, mesh in enumerate(scene.meshes):
        for (j, part), (k, placement) in product(enumerate(mesh.parts), enumerate(mesh.instances)):
            name, key = mesh.material_of(part), f"mesh_{i}_{j}_{k}"
            traits = Traits.of(part.geometry, scene.materials[name])
            matrix = placement.matrix @ np.asarray(part.matrix)
            if len(part.geometry.triangles):
                tree = world_mesh(folder / f"{key}.ply", part.geometry, matrix, traits, smooth)
                found[key] = (tree, name, traits)
    return found


def _radiance(material: Material, textures: TextureFolder, exact: bool) -> Tree:
    """What an emissive surface sends out; of one that is partly there, what its points send out on average.

    Raises
    ------
    FragtracerError
        If the surface has holes: Mitsuba's lights have none.
    """
    if material.alpha_mode != "opaque" and material.albedo_texture:
        raise FragtracerError("Mitsuba cannot show a material that emits light and has holes (alpha_mode, emission)")
    opacity = material.opacity if material.alpha_mode == "blend" else 1.0
    if material.alpha_mode == "mask" and material.opacity < material.alpha_cutoff:
        opacity = 0.0
    emission = np.multiply(material.emission, opacity)
    if material.emission_texture is None:
        return rgb(emission)
    return (textures.exact if exact else textures.nearest)(material.emission_texture, "color", emission)


def _light(light: Light) -> Tree:
    if light.radius == 0:
        return {"type": "point", "position": list(light.position), "intensity": rgb(light.intensity)}
    return {
        "type": "sphere",
        "center": list(light.position),
        "radius": float(light.radius),
        "bsdf": {"type": "diffuse", "reflectance": rgb((0, 0, 0))},
        "emitter": {"type": "area", "radiance": rgb(light.surface_radiance)},
    }


def to_mitsuba(scene: Scene, folder: Path | None = None) -> Tree:
    """The scene as a dictionary for ``mi.load_dict``, for the variant that is active.

    ``folder`` is for the triangles, which Mitsuba reads when it loads the dictionary; left out, it
    is a temporary one that lasts as long as the process.
    """
    import mitsuba as mi

    from fragtracer.reference.bsdf import register

    register()

    def loadable(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: loadable(v) for key, v in value.items()}
        return mi.ScalarTransform4f(value) if isinstance(value, np.ndarray) else value

    tree: Tree = loadable(scene_tree(scene, folder or _temporary_folder()))
    return tree


def _temporary_folder() -> Path:
    folder = tempfile.mkdtemp(prefix="fragtracer-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)
