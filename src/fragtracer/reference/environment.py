# SPDX-License-Identifier: MIT
"""Translates an environment to Mitsuba.

Where the two renderers differ:

- The first column of Mitsuba's map is at -z, of ours at +z: half a turn.
- Mitsuba's first and last rows lie at the poles, ours half a row from them. So it gets a row for each of ours,
  one for the middle between two, and one for each pole: 2 h + 1, which interpolate to the very same values.
- Mitsuba takes one emitter at infinity, so ambient light is added to the map.
- The sun is a sphere so far away that its direction is the same all over the scene. It occludes the map behind
  it, to which our sun is added: so it also emits the mean radiance that it occludes. Without our plugin Mitsuba
  computes 1 - cos of the sphere's cone by subtraction in float32: then the sphere has the nearest size at which that
  is exact, and its radiance is scaled to keep its power.
- An environment that is not visible, or a black ``render.background``, hides every emitter from Mitsuba's camera
  (``hide_emitters``).
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.images import write_image
from fragtracer.reference.lights import black_sphere
from fragtracer.reference.shapes import Tree, bounding_radius
from fragtracer.scene import Environment, Material, Scene
from fragtracer.scene.environment import Sun, lookup

_SUN_DISTANCE = 1e6  # in bounding radii of the scene


def environment_emitters(scene: Scene, folder: Path, plugins: bool) -> dict[str, Tree]:
    """The emitters at infinity by their keys, with the map written into ``folder``."""
    environment = scene.environment
    if environment is None:
        return {}
    path = folder / "environment.exr"
    radiance = environment.pixels * np.array(environment.scale) + np.array(scene.ambient.radiance)
    write_image(path, map_rows(radiance))
    turn = np.eye(4)
    turn[:3, :3] = environment.rotation @ np.diag((-1.0, 1.0, -1.0))
    emitters: dict[str, Tree] = {"environment": {"type": "envmap", "filename": str(path), "to_world": turn}}
    if (sun := environment.sun) is not None:
        distance = sun_distance(scene)
        one_minus_cos = sun.one_minus_cos if plugins else max(1.0, np.round(sun.one_minus_cos * 2**24)) / 2**24
        own = np.array(sun.radiance) * (sun.one_minus_cos / one_minus_cos)
        hidden = _mean_over(replace(sun, one_minus_cos=one_minus_cos), radiance, environment.rotation)
        center, radius = distance * np.array(sun.direction), distance * np.sqrt(one_minus_cos * (2 - one_minus_cos))
        emitters["sun"] = black_sphere(center, radius, own + hidden, plugins)
    return emitters


def _mean_over(sun: Sun, radiance: NDArray[np.floating], rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The mean over the sun's disc of a map that is turned by ``rotation``."""
    steps = (np.arange(64) + 0.5) / 64
    cosine, phi = np.meshgrid(1 - sun.one_minus_cos * steps, 2 * np.pi * steps)
    sine = np.sqrt(1 - cosine**2)
    z = np.array(sun.direction)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    around = np.cos(phi)[..., None] * x + np.sin(phi)[..., None] * np.cross(z, x)
    directions = sine[..., None] * around + cosine[..., None] * z
    mean: NDArray[np.float64] = lookup(radiance, directions @ rotation).mean((0, 1))
    return mean


def sun_distance(scene: Scene) -> float:
    """Where the sphere that stands for the sun is, in metres from the origin; 0 where there is no sun."""
    environment: Environment | None = scene.environment
    return _SUN_DISTANCE * bounding_radius(scene) if environment and environment.sun else 0.0


def map_rows(pixels: NDArray[np.floating]) -> NDArray[np.float32]:
    """The map as Mitsuba wants it, (2 h + 1, w, 3)."""
    rows = np.empty((2 * len(pixels) + 1, *pixels.shape[1:]), np.float32)
    rows[1::2] = pixels
    rows[2:-1:2] = (pixels[1:] + pixels[:-1]) / 2
    rows[0], rows[-1] = pixels[0], pixels[-1]
    return rows


def hides_emitters(scene: Scene, used: Iterable[Material]) -> bool:
    """Whether the camera sees no emitters, of surfaces of the materials ``used`` among them.

    Raises
    ------
    FragtracerError
        If it should see some but not the environment, or the environment otherwise than it is, which Mitsuba cannot do.
    """
    environment, background = scene.environment, scene.render.background
    if environment is None:
        return False
    if background in ("prefiltered", "irradiance"):
        raise FragtracerError(
            f'Mitsuba cannot show render.background = "{background}"; make it "environment" or "black"'
        )
    if environment.visible and background == "environment":
        return False
    is_lit = any(m.is_emissive or m.unlit for m in used) or any(light.radius > 0 for light in scene.lights)
    is_black = environment.visible or max(environment.background) == 0
    if is_lit or max(scene.ambient.radiance) > 0 or not is_black:
        raise FragtracerError(
            "Mitsuba cannot hide the environment alone: make it visible, in environment.visible and render.background, "
            "or give the scene no other light that is seen, no unlit material, and a black environment.background"
        )
    return True
