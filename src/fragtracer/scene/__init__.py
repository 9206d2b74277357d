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
from fragtracer.scene.medium import Density, Fog, Medium
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
    "Density",
    "Environment",
    "Fog",
    "Geometry",
    "Gradient",
    "Image",
    "Material",
    "Medium",
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
    """A camera, shapes, lights and render settings. Shapes name their material, a key of ``materials``; materials name
    the medium within, and the ``fog`` that which is everywhere else, keys of ``media``."""

    camera: Camera = Camera()
    materials: Mapping[str, Material] = field(default_factory=dict)
    media: Mapping[str, Medium] = field(default_factory=dict)
    fog: Fog | None = None
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
        used = {f"material.{name}.interior": m.interior for name, m in self.materials.items() if m.interior is not None}
        for where, name in (used | ({"fog.medium": self.fog.medium} if self.fog else {})).items():
            if name not in self.media:
                known = ", ".join(sorted(self.media)) or "none is defined; write a table [medium.NAME]"
                raise ValueError(f"{where}: there is no medium {name!r}; the media are: {known}")
        if problem := conflict(self):
            raise ValueError(problem)

    def _no_material(self, name: str) -> str:
        known = ", ".join(sorted(self.materials)) or "none is defined"
        return f"there is no material {name!r}; the materials are: {known}"
