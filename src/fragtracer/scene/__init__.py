# SPDX-License-Identifier: MIT
"""The scene model, independent of OpenGL and of files.

Units are metres and radians unless a name says otherwise, colours linear Rec. 709, y is up.
Every class validates its values when it is made, from Python as from a scene file, and raises
``pydantic.ValidationError`` (a ``ValueError``) that names the field.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import Annotated

from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass

from fragtracer.scene.camera import Camera
from fragtracer.scene.environment import Environment, Gradient, Panorama, Sky
from fragtracer.scene.fields import CONFIG, Reflectance, Strength, Vector, as_tuple
from fragtracer.scene.light import Ambient, DirectionalLight, Light, SpotLight
from fragtracer.scene.material import Material
from fragtracer.scene.mesh import Geometry, Mesh, Part, Placement
from fragtracer.scene.settings import RenderSettings
from fragtracer.scene.shapes import Disk, Plane, Rectangle, Sphere, Triangle
from fragtracer.scene.texture import Image, Texture

__all__ = [
    "Ambient",
    "Camera",
    "DirectionalLight",
    "Disk",
    "Environment",
    "Geometry",
    "Gradient",
    "Image",
    "Light",
    "Material",
    "Mesh",
    "Panorama",
    "Part",
    "Placement",
    "Plane",
    "Rectangle",
    "Reflectance",
    "RenderSettings",
    "Scene",
    "Sky",
    "Sphere",
    "SpotLight",
    "Strength",
    "Texture",
    "Triangle",
    "Vector",
]


@dataclass(frozen=True, config=CONFIG)
class Scene:
    """A camera, shapes, lights and render settings. Shapes name their material, a key of ``materials``."""

    camera: Camera = Camera()
    materials: Mapping[str, Material] = field(default_factory=dict)
    spheres: Annotated[tuple[Sphere, ...], BeforeValidator(as_tuple)] = ()
    planes: Annotated[tuple[Plane, ...], BeforeValidator(as_tuple)] = ()
    rectangles: Annotated[tuple[Rectangle, ...], BeforeValidator(as_tuple)] = ()
    disks: Annotated[tuple[Disk, ...], BeforeValidator(as_tuple)] = ()
    triangles: Annotated[tuple[Triangle, ...], BeforeValidator(as_tuple)] = ()
    meshes: Annotated[tuple[Mesh, ...], BeforeValidator(as_tuple)] = ()
    lights: Annotated[tuple[Light, ...], BeforeValidator(as_tuple)] = ()
    spot_lights: Annotated[tuple[SpotLight, ...], BeforeValidator(as_tuple)] = ()
    directional_lights: Annotated[tuple[DirectionalLight, ...], BeforeValidator(as_tuple)] = ()
    ambient: Ambient = Ambient()
    environment: Environment | None = None
    render: RenderSettings = RenderSettings()
    name: str = "scene"
    description: str = ""

    def __post_init__(self) -> None:
        known = ", ".join(sorted(self.materials)) or "none is defined"
        for kind in ("spheres", "planes", "rectangles", "disks", "triangles"):
            for index, shape in enumerate(getattr(self, kind)):
                where = f"{kind.removesuffix('s')}[{index}].material"
                if shape.material not in self.materials:
                    raise ValueError(f"{where}: there is no material {shape.material!r}; the materials are: {known}")
                if kind == "planes" and self.materials[shape.material].is_emissive:
                    raise ValueError(f"{where}: an infinite plane cannot emit light; use a rectangle or ambient light")
        for index, mesh in enumerate(self.meshes):
            for name in map(mesh.material_of, mesh.parts):
                if name not in self.materials:
                    where = f"mesh[{index}].material"
                    raise ValueError(f"{where}: there is no material {name!r}; the materials are: {known}")
