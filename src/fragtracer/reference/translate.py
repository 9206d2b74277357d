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
- Mitsuba's gaussian filter is cut off at 4 standard deviations and lowered to 0 there; ours is not.
- Path choices (``rays``, ``light_samples``, ``estimator``, ``sampler``) have no counterpart: they
  change the noise, not the mean.
"""

import atexit
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.reference import shapes
from fragtracer.reference.bsdf import NAME
from fragtracer.reference.shapes import Tree
from fragtracer.scene import Light, Material, RenderSettings, Scene

NEVER = 1_000_000  # a depth that no path reaches


def rgb(color: Any) -> Tree:
    """A colour, linear Rec. 709."""
    return {"type": "rgb", "value": [float(c) for c in color]}


def is_lambert(material: Material) -> bool:
    """Whether the material has no specular lobe at all."""
    return max(*material.specular_f0, *material.specular_f90) == 0


def lambert(material: Material) -> Tree:
    """Mitsuba's own diffuse material."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material.diffuse_albedo)}}


def exact_bsdf(material: Material, geometry: str) -> Tree:
    """The same material: Mitsuba's ``diffuse`` where that is exact, our plugin elsewhere."""
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


def scene_tree(scene: Scene, folder: Path, bsdf: Callable[[Material, str], Tree] = exact_bsdf) -> Tree:
    """The scene as a nested dictionary of plugins.

    Parameters
    ----------
    scene
        Any scene.
    folder
        Where the triangles are written, one PLY file per material; the folder exists.
    bsdf
        Gives the plugin of a material under a geometry term.

    Returns
    -------
    dict
        As ``mi.load_dict`` takes it, except that ``to_world`` values are float64 matrices, shape
        (4, 4). Material i, in the order of ``scene.materials``, is called ``material_i``.
    """
    names = {name: f"material_{i}" for i, name in enumerate(scene.materials)}
    tree: Tree = {"type": "scene", "integrator": _integrator(scene.render), "sensor": _sensor(scene)}
    for name, material in scene.materials.items():
        tree[names[name]] = bsdf(material, scene.render.geometry)
    for key, (shape, name) in _shapes(scene, folder).items():
        tree[key] = {**shape, "bsdf": {"type": "ref", "id": names[name]}}
        if scene.materials[name].is_emissive:
            tree[key]["emitter"] = {"type": "area", "radiance": rgb(scene.materials[name].emission)}
    for i, light in enumerate(scene.lights):
        tree[f"light_{i}"] = _light(light)
    if max(scene.ambient.radiance) > 0:
        tree["ambient"] = {"type": "constant", "radiance": rgb(scene.ambient.radiance)}
    return tree


def _integrator(settings: RenderSettings) -> Tree:
    rr_depth = settings.russian_roulette_depth if settings.russian_roulette else NEVER
    return {"type": "path", "max_depth": settings.bounces + 1, "rr_depth": rr_depth, "hide_emitters": False}


def _sensor(scene: Scene) -> Tree:
    camera, settings = scene.camera, scene.render
    far = max([shapes.reach(scene), *(shapes.plane_radius(scene, plane) for plane in scene.planes)])
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


def _shapes(scene: Scene, folder: Path) -> dict[str, tuple[Tree, str]]:
    """Every shape by its key, with the name of its material."""
    found = {f"sphere_{i}": (shapes.sphere(s), s.material) for i, s in enumerate(scene.spheres)}
    found |= {f"plane_{i}": (shapes.plane_disk(scene, p), p.material) for i, p in enumerate(scene.planes)}
    found |= {f"rectangle_{i}": (shapes.rectangle(r), r.material) for i, r in enumerate(scene.rectangles)}
    for i, name in enumerate(dict.fromkeys(t.material for t in scene.triangles)):
        vertices = [t.vertices for t in scene.triangles if t.material == name]
        found[f"triangles_{i}"] = (shapes.triangle_mesh(folder / f"triangles_{i}.ply", vertices), name)
    return found


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
