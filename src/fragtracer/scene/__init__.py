# SPDX-License-Identifier: MIT
"""The scene model, independent of OpenGL and of files.

Units are metres and radians unless a name says otherwise, colours linear Rec. 709, y is up.
Every class validates its values when it is made, from Python as from a scene file, and raises
``pydantic.ValidationError`` (a ``ValueError``) that names the field.
"""

from collections.abc import Mapping
from dataclasses import field

from pydantic.dataclasses import dataclass

from fragtracer.scene import light, shapes
from fragtracer.scene.camera import Camera
from fragtracer.scene.environment import Environment, Gradient, Panorama, Sky
from fragtracer.scene.fields import CONFIG, Many, Reflectance, Strength, Vector
from fragtracer.scene.interiors import conflict
from fragtracer.scene.light import *
from fragtracer.scene.light import LIGHTS, Ambient, LightLists
from fragtracer.scene.material import Material
from fragtracer.scene.mesh import Geometry, Mesh, Part, Placement
from fragtracer.scene.settings import RenderSettings
from fragtracer.scene.shapes import *
from fragtracer.scene.shapes import SHAPES, ShapeLists
from fragtracer.scene.texture import Image, Texture

__all__ = [
    *light.__all__,
    *shapes.__all__,
    "LIGHTS",
    "SHAPES",
    "Camera",
    "Environment",
    "Geometry",
    "Gradient",
    "Image",
    "Material",
    "Mesh",
    "Panorama",
    "Part",
    "Placement",
    "Reflectance",
    "RenderSettings",
    "Scene",
    "Sky",
    "Strength",
    "Texture",
    "Vector",
]


@dataclass(frozen=True, config=CONFIG)
class Scene(ShapeLists, LightLists):
    """A camera, shapes, lights and render settings. Shapes name their material, a key of ``materials``."""

    camera: Camera = Camera()
    materials: Mapping[str, Material] = field(default_factory=dict)
    meshes: Many[Mesh] = ()
    ambient: Ambient = Ambient()
    environment: Environment | None = None
    render: RenderSettings = RenderSettings()
    name: str = "scene"
    description: str = ""

    def __post_init__(self) -> None:
        for kind in SHAPES:
            for index, shape in enumerate(getattr(self, kind)):
                where = f"{kind.removesuffix('s')}[{index}].material"
                if shape.material not in self.materials:
                    raise ValueError(f"{where}: {self._no_material(shape.material)}")
                if kind == "planes" and self.materials[shape.material].is_emissive:
                    raise ValueError(f"{where}: an infinite plane cannot emit light; use a rectangle or ambient light")
        for index, mesh in enumerate(self.meshes):
            for name in map(mesh.material_of, mesh.parts):
                if name not in self.materials:
                    where = f"mesh[{index}].material"
                    raise ValueError(f"{where}: {self._no_material(name)}")
        if problem := conflict(self):
            raise ValueError(problem)

    def _no_material(self, name: str) -> str:
        known = ", ".join(sorted(self.materials)) or "none is defined"
        return f"there is no material {name!r}; the materials are: {known}"
