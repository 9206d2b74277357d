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
from fragtracer.scene.mesh import Geometry, Mesh, Part, Placement, Pose
from fragtracer.scene.settings import PLAIN, RenderSettings
from fragtracer.scene.shapes import *
from fragtracer.scene.shapes import SHAPES, ShapeLists
from fragtracer.scene.texture import Image, Texture

__all__ = [
    *light.__all__,
    *shapes.__all__,
    "LIGHTS",
    "PLAIN",
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
    "Pose",
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
        for name in self.materials:
            self._check_blend(name)
        used = {f"material.{name}.interior": m.interior for name, m in self.materials.items() if m.interior is not None}
        for where, name in (used | ({"fog.medium": self.fog.medium} if self.fog else {})).items():
            if name not in self.media:
                known = ", ".join(sorted(self.media)) or "none is defined; write a table [medium.NAME]"
                raise ValueError(f"{where}: there is no medium {name!r}; the media are: {known}")
        if problem := conflict(self):
            raise ValueError(problem)

    @property
    def has_light(self) -> bool:
        """Whether there is any: without, a picture is black."""
        shaped = {shape.material for kind in SHAPES for shape in getattr(self, kind)}
        used = shaped | {mesh.material_of(part) for mesh in self.meshes for part in mesh.parts}
        shown = [self.materials[name] for own in used for name in self.blended(own)]
        return (
            any(getattr(self, kind) for kind in LIGHTS)
            or max(self.ambient.radiance) > 0
            or self.environment is not None
            or any(material.is_emissive or material.unlit for material in shown)
        )

    def blended(self, name: str) -> tuple[str, ...]:
        """The materials by which a surface of the material ``name`` scatters: this one, and that of its blend."""
        other = self.materials[name].blend
        return (name,) if other is None else (name, other)

    def _check_blend(self, name: str) -> None:
        material = self.materials[name]
        if material.blend is None:
            return
        where = f"material.{name}.blend"
        if material.blend not in self.materials:
            raise ValueError(f"{where}: {self._no_material(material.blend)}")
        other = self.materials[material.blend]
        if other.blend is not None or other.unlit:
            what = "unlit, and scatters nothing" if other.unlit else "a blend itself"
            raise ValueError(f"{where}: {material.blend!r} is {what}; name a material that is not")
        if material.is_dielectric and other.is_dielectric and (material.is_solid or other.is_solid):
            raise ValueError(
                f"{where}: light passes {name!r} and {material.blend!r}, so that nothing says what is behind them; "
                "blend a solid with what light does not pass, or two panes"
            )
        if other.is_dielectric and not material.double_sided:
            raise ValueError(
                f"material.{name}.double_sided: must stay true; light leaves {material.blend!r} by its back"
            )

    def _no_material(self, name: str) -> str:
        known = ", ".join(sorted(self.materials)) or "none is defined"
        return f"there is no material {name!r}; the materials are: {known}"
