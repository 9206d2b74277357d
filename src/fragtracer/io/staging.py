# SPDX-License-Identifier: MIT
"""The scene of a bare model: its camera and lights, or default ones."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.model import Model, bounds, farthest, triple
from fragtracer.scene import Ambient, Camera, Light, Material, Mesh, RenderSettings, Scene

Floats = NDArray[np.float64]
_FOV = 35.0  # degrees
_MARGIN = 1.08  # times the distance at which the model just fills the image
_VIEW = (0.5, 0.35, 1.0)  # from the model to the camera: its front is +z, y is up
_KEY = (-0.55, 0.8, 0.65)  # from the model to the key light
_KEY_DISTANCE, _KEY_RADIUS = 3.0, 0.5  # in radii of the model
_KEY_IRRADIANCE = 2.4  # W/m² at the centre: with the ambient light, a white surface that faces it shows about 1
_AMBIENT = 0.3  # W/m²/sr


def stage(model: Model, name: str, light: bool = True, moments: Sequence[Mesh] = ()) -> Scene:
    """Make a scene of a model.

    The camera is the first of the file, with its aspect ratio, or one that frames the model from the front, the right
    and above; of one that moves, all that it is at some ``moments``. A model without lights and without untextured
    emissive materials gets a large spherical key light, on the left above, and ambient light, unless ``light`` is
    false. Distances are proportional to the bounds of the model, so that its unit does not matter.
    """
    missing = {model.mesh.material_of(part) for part in model.mesh.parts} - model.materials.keys()
    materials = {**model.materials, **{name: Material() for name in sorted(missing)}}
    framed = Mesh(parts=tuple(part for mesh in moments or (model.mesh,) for part in mesh.parts))
    low, high = bounds(framed)
    emits = any(item.is_emissive and item.emission_texture is None for item in materials.values())
    lit = model.has_lights or emits or not light
    return Scene(
        camera=model.cameras[0] if model.cameras else _camera(framed, low, high),
        render=_settings(model.aspect),
        materials=materials,
        meshes=(model.mesh,),
        lights=model.lights if lit else (_key_light(low, high),),
        spot_lights=model.spot_lights,
        directional_lights=model.directional_lights,
        ambient=Ambient() if lit else Ambient((_AMBIENT,) * 3),
        name=name,
    )


def _settings(aspect: float | None) -> RenderSettings:
    """An image of the aspect ratio ``aspect`` that fits into the default size."""
    usual = RenderSettings()
    if aspect is None:
        return usual
    width = max(1, round(min(usual.width, aspect * usual.height)))
    return replace(usual, width=width, height=max(1, round(min(usual.height, usual.width / aspect))))


def _camera(mesh: Mesh, low: Floats, high: Floats) -> Camera:
    """As near as possible with all vertices in view, for the default aspect ratio."""
    settings = RenderSettings()
    center, size = (low + high) / 2, float(np.linalg.norm(high - low)) or 1.0
    towards = np.divide(_VIEW, np.linalg.norm(_VIEW))
    right = np.cross((0.0, 1.0, 0.0), towards)
    right = right / np.linalg.norm(right)
    axes = np.stack([right, np.cross(towards, right), towards], axis=1)
    vertical = np.tan(np.radians(_FOV) / 2)
    horizontal = vertical * settings.width / settings.height
    x, y, z = axes.T
    sides = np.array([x / horizontal, -x / horizontal, y / vertical, -y / vertical]) + z
    distance = max(1e-3 * size, _MARGIN * float((farthest(mesh, sides) - sides @ center).max()))
    return Camera(triple(center + distance * towards), triple(center), fov_degrees=_FOV)


def _key_light(low: Floats, high: Floats) -> Light:
    """A spherical light of irradiance :data:`_KEY_IRRADIANCE` at the centre of the bounds."""
    center, radius = (low + high) / 2, (float(np.linalg.norm(high - low)) or 1.0) / 2
    distance = _KEY_DISTANCE * radius
    position = center + distance * np.divide(_KEY, np.linalg.norm(_KEY))
    power = 4 * np.pi * distance**2 * _KEY_IRRADIANCE
    return Light(triple(position), _KEY_RADIUS * radius, power=(power, power, power))
