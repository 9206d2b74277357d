# SPDX-License-Identifier: MIT
"""The scene model: what is in the world, without OpenGL and without files.

Units are metres and radians unless a name says otherwise, colours linear Rec. 709, y is up.
Every class validates its values when it is made, from Python as from a scene file, and raises
``pydantic.ValidationError`` (a ``ValueError``) that names the field.
"""

from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field
from pydantic.dataclasses import dataclass

from fragtracer.materials import METAL_F0, grazing_reflectance, reflectance_from_ior

_CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def _as_triple(value: Any) -> Any:
    if isinstance(value, str) or not isinstance(value, Iterable):
        return value
    return tuple(float(v) if isinstance(v, int | np.number) and not isinstance(v, bool) else v for v in value)


def _as_color(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (float(value),) * 3
    return _as_triple(value)


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Triple = tuple[float, float, float]
NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Vector = Annotated[Triple, BeforeValidator(_as_triple)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], BeforeValidator(_as_color)]
Strength = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(_as_color)]


def _length(v: Triple) -> float:
    return float(np.linalg.norm(v))


@dataclass(frozen=True, config=_CONFIG)
class Camera:
    """A perspective camera that looks from ``position`` to ``target``.

    ``fov_degrees`` is the vertical field of view. ``aperture_radius`` is the radius of a thin lens
    in metres; 0 is a pinhole, sharp everywhere. ``focus_distance`` is measured in metres along the
    optical axis; left out, it is the distance to the target.
    """

    position: Vector = (0.0, 1.0, 4.0)
    target: Vector = (0.0, 0.5, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov_degrees: Annotated[float, Field(gt=0, lt=180)] = 40.0
    aperture_radius: NonNegative = 0.0
    focus_distance: Positive | None = None

    def __post_init__(self) -> None:
        view = np.subtract(self.target, self.position)
        if not _length(self.up) > 0:
            raise ValueError("up must not have length zero; [0, 1, 0] is usual")
        if not np.linalg.norm(view) > 0:
            raise ValueError("position and target are the same point; the camera must look somewhere")
        sine = np.linalg.norm(np.cross(view, self.up)) / (np.linalg.norm(view) * _length(self.up))
        if sine < 1e-6:
            raise ValueError("the camera looks along its up vector; choose an up across the view, as [0, 0, 1]")

    @property
    def focal_distance(self) -> float:
        """Distance of the plane in focus from the lens, in metres."""
        if self.focus_distance is not None:
            return self.focus_distance
        return float(np.linalg.norm(np.subtract(self.target, self.position)))


@dataclass(frozen=True, config=_CONFIG)
class Material:
    """A Cook-Torrance specular lobe over a Lambert base (shaders/bsdf/cook_torrance.glsl).

    ``albedo`` is the colour of the base, and the specular colour of the metallic part. The GGX
    width is ``roughness**2``; roughness below 0.01 is a perfect mirror. The dielectric part's
    reflectance at normal incidence comes from ``ior`` (index of refraction against air, 1.5 where
    nothing is given) or directly from ``f0``. ``metal`` names a metal of :data:`METAL_F0` and takes
    the place of albedo, metallic, ior and f0. ``specular`` scales the dielectric reflection: 0
    leaves pure Lambert. ``emission`` is radiance in W/m²/sr from the front of a surface.
    """

    albedo: Reflectance = (0.5, 0.5, 0.5)
    roughness: Fraction = 0.5
    metallic: Fraction = 0.0
    ior: Annotated[float, Field(ge=1)] | None = None
    f0: Reflectance | None = None
    metal: str | None = None
    specular: Fraction = 1.0
    emission: Strength = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.ior is not None and self.f0 is not None:
            raise ValueError("ior and f0 both say how much is reflected; give one of them")
        if self.metal is None:
            return
        if self.metal not in METAL_F0:
            raise ValueError(f"metal {self.metal!r} is not known; choose from {', '.join(sorted(METAL_F0))}")
        default = Material()
        for name in ("albedo", "metallic", "ior", "f0", "specular"):
            if getattr(self, name) != getattr(default, name):
                raise ValueError(f"metal = {self.metal!r} already says what {name} is; leave {name} out")

    @property
    def alpha(self) -> float:
        """GGX width."""
        return self.roughness**2

    @property
    def diffuse_albedo(self) -> Triple:
        """Albedo of the Lambert base."""
        base = 0.0 if self.metal else 1.0 - self.metallic
        r, g, b = self.albedo
        return (base * r, base * g, base * b)

    @property
    def specular_f0(self) -> Triple:
        """Specular reflectance at normal incidence."""
        if self.metal:
            return METAL_F0[self.metal]
        dielectric, metallic = (1 - self.metallic) * self.specular, self.metallic
        r, g, b = (dielectric * d + metallic * a for d, a in zip(self._dielectric_f0, self.albedo, strict=True))
        return (r, g, b)

    @property
    def _dielectric_f0(self) -> Triple:
        return self.f0 or (reflectance_from_ior(1.5 if self.ior is None else self.ior),) * 3

    @property
    def specular_f90(self) -> float:
        """Specular reflectance at grazing incidence."""
        if self.metal:
            return 1.0
        dielectric = grazing_reflectance(self._dielectric_f0)
        return (1 - self.metallic) * self.specular * dielectric + self.metallic * grazing_reflectance(self.albedo)

    @property
    def is_emissive(self) -> bool:
        return max(self.emission) > 0


@dataclass(frozen=True, config=_CONFIG)
class Sphere:
    """A sphere; its front is outside."""

    center: Vector
    radius: Positive
    material: str


@dataclass(frozen=True, config=_CONFIG)
class Plane:
    """An infinite plane through ``point``, its front on the side of ``normal`` (of any length)."""

    point: Vector
    normal: Vector
    material: str

    def __post_init__(self) -> None:
        if not _length(self.normal) > 0:
            raise ValueError("normal must not have length zero; [0, 1, 0] is a floor")


@dataclass(frozen=True, config=_CONFIG)
class Rectangle:
    """A rectangle ``corner + s edge_u + t edge_v``, 0 ≤ s, t ≤ 1; its front is along edge_u × edge_v."""

    corner: Vector
    edge_u: Vector
    edge_v: Vector
    material: str

    def __post_init__(self) -> None:
        lengths = _length(self.edge_u) * _length(self.edge_v)
        if not lengths > 0:
            raise ValueError("edge_u and edge_v must not have length zero")
        if abs(float(np.dot(self.edge_u, self.edge_v))) > 1e-4 * lengths:
            raise ValueError("edge_u and edge_v must be perpendicular; use two triangles for another shape")

    @property
    def area(self) -> float:
        return float(np.linalg.norm(np.cross(self.edge_u, self.edge_v)))


@dataclass(frozen=True, config=_CONFIG)
class Triangle:
    """A triangle; seen from its front the ``vertices`` run counter-clockwise."""

    vertices: Annotated[tuple[Vector, Vector, Vector], BeforeValidator(_as_tuple)]
    material: str

    def __post_init__(self) -> None:
        a, b, c = (np.asarray(v) for v in self.vertices)
        longest = max(np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b))
        if not np.linalg.norm(np.cross(b - a, c - a)) > 1e-12 * longest**2:
            raise ValueError("the three vertices lie on a line or in a point; a triangle needs an area")

    @property
    def area(self) -> float:
        a, b, c = (np.asarray(v) for v in self.vertices)
        return float(np.linalg.norm(np.cross(b - a, c - a))) / 2


@dataclass(frozen=True, config=_CONFIG)
class Light:
    """A spherical light, black where it is lit itself.

    Exactly one of ``power`` (watts in all directions together, per colour channel; unchanged by the
    radius) and ``radiance`` (W/m²/sr at its surface) is given. Radius 0 is a point light, which
    casts hard shadows, cannot be seen and needs ``power``.
    """

    position: Vector
    radius: NonNegative = 0.0
    power: Strength | None = None
    radiance: Strength | None = None

    def __post_init__(self) -> None:
        if (self.power is None) == (self.radiance is None):
            raise ValueError("give either power (watts) or radiance (W/m²/sr), and only one of them")
        if self.radius == 0 and self.power is None:
            raise ValueError("a light of radius 0 has no surface to have a radiance; give its power instead")

    @property
    def surface_radiance(self) -> Triple:
        """Radiance of the surface in W/m²/sr, power / (4 π² radius²); needs a radius above 0."""
        if self.radiance is not None:
            return self.radiance
        assert self.power is not None
        r, g, b = (p / (4 * np.pi**2 * self.radius**2) for p in self.power)
        return (r, g, b)

    @property
    def intensity(self) -> Triple:
        """Radiant intensity of a point light in W/sr, power / 4 π."""
        assert self.power is not None
        r, g, b = (p / (4 * np.pi) for p in self.power)
        return (r, g, b)


@dataclass(frozen=True, config=_CONFIG)
class Ambient:
    """The same radiance (W/m²/sr) from everywhere that no object hides."""

    radiance: Strength = (0.0, 0.0, 0.0)


@dataclass(frozen=True, config=_CONFIG)
class RenderSettings:
    """How to render; what a scene leaves out has these values.

    ``bounces`` counts scattering events on a path: 0 shows emitters only, 1 adds direct light.
    ``rays`` is the number of paths per pixel in one pass, ``light_samples`` the number of shadow
    rays at each vertex. Russian roulette may end a path from vertex ``russian_roulette_depth`` on.
    """

    width: Annotated[int, Field(ge=1, le=16384)] = 640
    height: Annotated[int, Field(ge=1, le=16384)] = 480
    spp: Annotated[int, Field(ge=1, le=2**24)] = 256
    bounces: Annotated[int, Field(ge=0, le=10000)] = 5
    rays: Annotated[int, Field(ge=1, le=1024)] = 16
    light_samples: Annotated[int, Field(ge=1, le=1024)] = 1
    russian_roulette: bool = True
    russian_roulette_depth: Annotated[int, Field(ge=1)] = 5
    geometry: Literal["smith", "schlick-beckmann", "karis"] = "smith"
    estimator: Literal["mis", "nee", "bsdf"] = "mis"
    sampler: Literal["texture", "hash"] = "texture"
    pixel_filter: Literal["box", "tent", "gaussian"] = "box"
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0


@dataclass(frozen=True, config=_CONFIG)
class Scene:
    """Everything there is to render, and from where. ``materials`` maps the names that shapes use."""

    camera: Camera = Camera()
    materials: Mapping[str, Material] = field(default_factory=dict)
    spheres: Annotated[tuple[Sphere, ...], BeforeValidator(_as_tuple)] = ()
    planes: Annotated[tuple[Plane, ...], BeforeValidator(_as_tuple)] = ()
    rectangles: Annotated[tuple[Rectangle, ...], BeforeValidator(_as_tuple)] = ()
    triangles: Annotated[tuple[Triangle, ...], BeforeValidator(_as_tuple)] = ()
    lights: Annotated[tuple[Light, ...], BeforeValidator(_as_tuple)] = ()
    ambient: Ambient = Ambient()
    render: RenderSettings = RenderSettings()
    name: str = "scene"
    description: str = ""

    def __post_init__(self) -> None:
        known = ", ".join(sorted(self.materials)) or "none is defined"
        for kind in ("spheres", "planes", "rectangles", "triangles"):
            for index, shape in enumerate(getattr(self, kind)):
                where = f"{kind.removesuffix('s')}[{index}].material"
                if shape.material not in self.materials:
                    raise ValueError(f"{where}: there is no material {shape.material!r}; the materials are: {known}")
                if kind == "planes" and self.materials[shape.material].is_emissive:
                    raise ValueError(f"{where}: an infinite plane cannot emit light; use a rectangle or ambient light")
