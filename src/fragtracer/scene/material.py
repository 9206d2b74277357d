# SPDX-License-Identifier: MIT
"""Materials."""

import math
from dataclasses import replace
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.fields import (
    CONFIG,
    LARGEST,
    Fraction,
    Number,
    Positive,
    Reflectance,
    Strength,
    Triple,
    Whole,
    as_number,
)
from fragtracer.scene.reflectance import (
    METAL_F0,
    METAL_INDEX,
    conductor_reflectance,
    grazing_reflectance,
    reflectance_from_ior,
)
from fragtracer.scene.texture import Texture

# The parameters that can be textured, by the field NAME_texture.
DEFAULT_MODEL: Final = "metallic-roughness"
_BRUSHED = ("anisotropy", "anisotropy_rotation_degrees")
_COAT = ("coat", "coat_roughness", "coat_ior", "coat_normal_scale")
_SHEEN = ("sheen_color", "sheen_roughness")
_IRIDESCENCE = ("iridescence", "iridescence_ior", "iridescence_thickness", "iridescence_thickness_minimum")
_TRANSLUCENT = ("diffuse_transmission", "diffuse_transmission_color")
LEAST_COAT_ALPHA = 1e-4  # a coat is never a perfect mirror
# The keys that mean something to each model besides those of all: textures of these, emission, opacity, sides, normals.
MODELS: dict[str, tuple[str, ...]] = {
    DEFAULT_MODEL: (
        *("albedo", "roughness", "metallic", "ior", "f0", "metal", "specular", "diffuse_factor"),
        *_BRUSHED,
        *_COAT,
        *_SHEEN,
        *_IRIDESCENCE,
        *_TRANSLUCENT,
    ),
    "eon": ("albedo", "roughness"),
    "dielectric": (
        "roughness",
        *_BRUSHED,
        "ior",
        "exterior_ior",
        "transmittance",
        "attenuation_color",
        "attenuation_distance",
        "abbe_number",
        "priority",
        "interior",
    ),
    "thin-dielectric": ("ior", "transmittance"),
    "rough-thin-dielectric": ("roughness", *_BRUSHED, "ior", "transmittance"),
    "null": ("priority", "interior"),
    "conductor": ("roughness", *_BRUSHED, "metal", "eta", "k"),
    "plastic": ("albedo", "ior", "nonlinear"),
    "rough-plastic": ("albedo", "roughness", "ior", "nonlinear"),
}
SOLIDS = ("dielectric", "null")  # whose surfaces bound something that light passes: a dielectric or a medium
PANES = ("thin-dielectric", "rough-thin-dielectric")  # whose surfaces are both interfaces of a dielectric
_OF_MODELS = {key for keys in MODELS.values() for key in keys}
_OF_OTHERS = {model: sorted(_OF_MODELS - set(keys)) for model, keys in MODELS.items()}  # keys that mean nothing to it
TEXTURED = (
    *("albedo", "roughness", "metallic", "normal", "occlusion", "emission", "transmittance", "anisotropy"),
    *("blend_weight", "coat", "coat_roughness", "coat_normal", "sheen_color", "sheen_roughness"),
    *("iridescence", "iridescence_thickness"),
    *_TRANSLUCENT,
)
_TEXTURE_FIELDS = {name: f"{name}_texture" for name in TEXTURED}
# Of a thin film: thicker ones have no colours, and larger indices would be no numbers in single precision.
FilmIndex = Annotated[float, Field(ge=1, le=100), BeforeValidator(as_number)]
FilmThickness = Annotated[float, Field(ge=0, le=1e6), BeforeValidator(as_number)]


@dataclass(frozen=True, config=CONFIG)
class Material:
    """How a surface scatters and emits.

    ``model`` says by what BSDF. "metallic-roughness" is a Cook-Torrance specular lobe over a Lambert base
    (shaders/bsdf/cook_torrance.glsl), "eon" a rough diffuse surface without a specular lobe, such as clay
    (shaders/bsdf/eon.glsl), whose roughness of 0 is Lambert's. "dielectric" is the surface of a solid or a liquid that
    light passes, such as glass or water (shaders/bsdf/dielectric.glsl), "thin-dielectric" a pane of it, and
    "rough-thin-dielectric" a frosted one (shaders/bsdf/thin_dielectric.glsl).
    "conductor" is a metal of a measured complex index ``eta`` + i ``k``, or of that of the ``metal`` of a name in
    :data:`METAL_INDEX`. "plastic" is a Lambert base under a smooth coat (shaders/bsdf/plastic.glsl), "rough-plastic"
    one under a coat of GGX facets (shaders/bsdf/rough_plastic.glsl): what the coat reflects back to the base is
    scattered again, ``nonlinear`` in its colour. "null" is no surface at all, but the boundary of a medium.

    ``albedo`` is the colour of the base, and the specular colour of the metallic part. The GGX
    width is ``roughness**2``; roughness below 0.01 is a perfect mirror. The dielectric part's
    reflectance at normal incidence comes from ``ior`` (index of refraction against air, 1.5 where
    nothing is given) or directly from ``f0``. ``metal`` names a metal of :data:`METAL_F0` and
    replaces albedo, metallic, ior and f0. ``specular`` scales the dielectric reflection: 0
    is pure Lambert. ``diffuse_factor`` says what of the light the base gets and gives: what passes the "interface", in
    and out, or 1 - F at the "half-vector", which is more at grazing angles than there is (docs/material.md).
    ``emission`` is the radiance in W/m²/sr of the front of a surface.

    With an ``anisotropy`` the facets are wider along the tangent, as those of brushed metal across the strokes:
    α + (1 - α) ``anisotropy``², which is Mitsuba's ``alpha_u``, where α, its ``alpha_v``, is the width across it
    (glTF's ``KHR_materials_anisotropy``). The tangent is that of a mesh, or, where there is none, the horizontal
    direction to the right as seen from outside, +x where the surface is horizontal; ``anisotropy_rotation_degrees``
    turns it counter-clockwise.

    Behind the front of a dielectric, ``attenuation_color`` is what is left of white light after
    ``attenuation_distance`` metres (Beer and Lambert); ``transmittance`` is the colour of what passes the surface.
    ``abbe_number`` says how much its index of refraction, which is that of yellow light, differs between colours: 20 is
    a strong dispersion, 60 a weak one. Where two dielectrics overlap, the one with the higher ``priority`` is there.
    With an ``exterior_ior``, the index of refraction of what lies in front of it, the surface is an interface alone, as
    Mitsuba's: nothing is within, and it refracts so wherever it is, as water in a glass is met.
    ``interior`` names the medium behind the front, a key of ``Scene.media``.

    ``coat`` is the weight of a clear coat over a metallic-roughness material, as lacquer on paint: of a dielectric of
    the index ``coat_ior``, by facets of a GGX width of ``coat_roughness**2``, which is never a perfect mirror
    (shaders/bsdf/coated.glsl; glTF's ``KHR_materials_clearcoat``). ``normal_texture`` bends the base, and
    ``coat_normal_texture``, with its ``coat_normal_scale``, the coat.

    ``sheen_color`` is the reflectance of a sheen over a metallic-roughness material, below its coat, as of velvet: of
    fibres that stand about upright, the more so the smaller ``sheen_roughness`` is, which is taken for at least 0.1
    (Estevez and Kulla 2017, "Production friendly microfacet sheen BRDF"; shaders/bsdf/sheen.glsl; glTF's
    ``KHR_materials_sheen``).

    ``iridescence`` is the weight of a thin film on the facets of a metallic-roughness material, below sheen and coat,
    as of soap, oil or oxide: of the index ``iridescence_ior``, and ``iridescence_thickness`` nanometres thick (Belcour
    and Barla 2017, "A practical extension to microfacet theory for the modeling of varying iridescence";
    shaders/bsdf/iridescence.glsl; glTF's ``KHR_materials_iridescence``). Where ``iridescence_thickness_texture`` is 0,
    it is ``iridescence_thickness_minimum`` thick, and between linearly as much as the texture says.

    ``diffuse_transmission`` is the share of the base of a metallic-roughness material that transmits light diffusely
    in the colour ``diffuse_transmission_color``, as leaves and paper do, in place of reflecting it; the surface is so
    thin that nothing is refracted (shaders/bsdf/translucent.glsl; glTF's ``KHR_materials_diffuse_transmission``).

    A texture multiplies the parameter of its name; those of numbers, such as roughness, use one channel of it. Of
    ``anisotropy_texture`` that is blue, while red and green, times 2 less 1, are the direction from the tangent along
    which the facets are wider. ``normal_texture`` holds tangent-space normals (glTF 2.0, section 3.9.3), their x and y
    scaled by ``normal_scale``. Only meshes have texture coordinates; other shapes ignore textures.

    ``opacity``, times the alpha of the albedo texture and of the vertex colours, is ignored if ``alpha_mode`` is
    "opaque", thresholded at ``alpha_cutoff`` if "mask", and the probability of a hit if "blend" (stochastic
    alpha). A surface that is not ``double_sided`` is back-face culled, for all rays; one with a ``black_back`` is met
    from behind, and scatters nothing there, as Mitsuba's opaque BSDFs without ``twosided``. ``unlit``, of a model that
    has an albedo, emits that as radiance and scatters nothing.

    ``blend`` names another material, with which this one is blended, as by Mitsuba's ``blendbsdf``: ``blend_weight`` is
    the weight of the other one, from 0, this material alone, to 1, the other one. The other one says how the surface
    scatters, its normals, and whether its back is black; emission, opacity and sides are those of this material.
    """

    model: Literal[
        "metallic-roughness",
        "eon",
        "dielectric",
        "thin-dielectric",
        "rough-thin-dielectric",
        "null",
        "conductor",
        "plastic",
        "rough-plastic",
    ] = "metallic-roughness"
    albedo: Reflectance = (0.5, 0.5, 0.5)
    roughness: Fraction = 0.5
    metallic: Fraction = 0.0
    anisotropy: Fraction = 0.0
    anisotropy_rotation_degrees: Number = 0.0
    anisotropy_texture: Texture | None = None
    ior: Annotated[float, Field(ge=1, le=LARGEST)] | None = None
    exterior_ior: Annotated[float, Field(ge=1, le=LARGEST)] | None = None
    f0: Reflectance | None = None
    metal: str | None = None
    specular: Fraction = 1.0
    diffuse_factor: Literal["interface", "half-vector"] = "interface"
    coat: Fraction = 0.0
    coat_roughness: Fraction = 0.0
    coat_ior: Annotated[float, Field(ge=1, le=LARGEST)] = 1.5
    coat_texture: Texture | None = None
    coat_roughness_texture: Texture | None = None
    coat_normal_texture: Texture | None = None
    coat_normal_scale: Number = 1.0
    sheen_color: Reflectance = (0.0, 0.0, 0.0)
    sheen_roughness: Fraction = 0.0
    sheen_color_texture: Texture | None = None
    sheen_roughness_texture: Texture | None = None
    iridescence: Fraction = 0.0
    iridescence_ior: FilmIndex = 1.3
    iridescence_thickness: FilmThickness = 400.0
    iridescence_thickness_minimum: FilmThickness = 100.0
    iridescence_texture: Texture | None = None
    iridescence_thickness_texture: Texture | None = None
    diffuse_transmission: Fraction = 0.0
    diffuse_transmission_color: Reflectance = (1.0, 1.0, 1.0)
    diffuse_transmission_texture: Texture | None = None
    diffuse_transmission_color_texture: Texture | None = None
    transmittance: Reflectance = (1.0, 1.0, 1.0)
    attenuation_color: Reflectance = (1.0, 1.0, 1.0)
    attenuation_distance: Positive = 1.0
    abbe_number: Positive | None = None
    priority: Whole = 0
    interior: str | None = None
    eta: Strength | None = None
    k: Strength | None = None
    nonlinear: bool = True
    emission: Strength = (0.0, 0.0, 0.0)
    albedo_texture: Texture | None = None
    roughness_texture: Texture | None = None
    metallic_texture: Texture | None = None
    normal_texture: Texture | None = None
    normal_scale: Number = 1.0
    transmittance_texture: Texture | None = None
    occlusion_texture: Texture | None = None
    occlusion_strength: Fraction = 1.0
    emission_texture: Texture | None = None
    opacity: Fraction = 1.0
    alpha_mode: Literal["opaque", "mask", "blend"] = "opaque"
    alpha_cutoff: Fraction = 0.5
    double_sided: bool = True
    black_back: bool = False
    unlit: bool = False
    blend: str | None = None
    blend_weight: Fraction = 0.5
    blend_weight_texture: Texture | None = None

    def __post_init__(self) -> None:
        self._check_model()
        self._check_blend()
        self._check_translucency()
        if len({texture.coordinates for texture in self.normal_maps}) > 1:
            raise ValueError(
                "normal_texture and coat_normal_texture must have the same coordinates, which the tangents follow"
            )
        if min(self.attenuation_color) <= 0:
            raise ValueError("attenuation_color must be greater than 0; 0.001 is all but black")
        if self.interior is not None and min(self.attenuation_color) < 1:
            raise ValueError("attenuation_color and interior both say what is inside; give one of them")
        if self.exterior_ior is not None:
            self._check_interface()
        if self.is_dielectric and not self.double_sided:
            raise ValueError("double_sided must stay true; light leaves a dielectric by the back of its surface")
        if self.black_back and (self.is_dielectric or self.is_translucent or not self.double_sided):
            what = "is passed" if self.double_sided else "is not met, without double_sided"
            raise ValueError(f"black_back must stay false; the back of this surface {what}")
        if self.model == "conductor":
            self._check_conductor()
            return
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

    def _check_interface(self) -> None:
        given = {"attenuation_color": min(self.attenuation_color) < 1, "interior": self.interior is not None}
        given |= {"abbe_number": self.abbe_number is not None, "priority": self.priority != 0}
        for key in (key for key, is_given in given.items() if is_given):
            raise ValueError(f"exterior_ior makes an interface, which has nothing within; leave {key} or it out")

    def _check_conductor(self) -> None:
        if self.metal is not None and self.metal not in METAL_INDEX:
            raise ValueError(
                f"metal {self.metal!r} has no measured index; choose from {', '.join(sorted(METAL_INDEX))}"
            )
        if (self.metal is None) == (self.eta is None) or (self.eta is None) != (self.k is None):
            raise ValueError("a conductor needs either metal, the name of one, or both eta and k")
        if self.eta is not None and min(self.eta) <= 0:
            raise ValueError("eta must be greater than 0; metals have indices from 0.1 to 5")

    def _check_model(self) -> None:
        for key in _OF_OTHERS[self.model]:
            names = (key, f"{key.removesuffix('_scale')}_texture")
            given = next((k for k in names if getattr(self, k, None) != getattr(Material, k, None)), None)
            if given:
                keys = ", ".join(MODELS[self.model])
                raise ValueError(f"{given} means nothing to model = {self.model!r}; leave it out; its keys are {keys}")
        if self.unlit and "albedo" not in MODELS[self.model]:
            raise ValueError(f"unlit shows the albedo, which means nothing to model = {self.model!r}; leave unlit out")

    def _check_translucency(self) -> None:
        if not self.is_translucent:
            return
        others = {"coat": self.coat > 0, "sheen_color": max(self.sheen_color) > 0, "iridescence": self.iridescence > 0}
        others["unlit"] = self.unlit
        others['diffuse_factor = "half-vector"'] = self.diffuse_factor == "half-vector"
        for other in (key for key, is_given in others.items() if is_given):
            raise ValueError(f"diffuse_transmission is not possible together with {other}; leave one of them out")

    def _check_blend(self) -> None:
        if self.blend is not None and self.unlit:
            raise ValueError("unlit scatters nothing, which cannot be blended; leave blend or unlit out")
        weights = (self.blend_weight, self.blend_weight_texture)
        if self.blend is None and weights != (Material.blend_weight, None):
            raise ValueError("blend_weight means nothing without blend, the name of another material")

    @property
    def alpha(self) -> float:
        """GGX width, 0 of a model without roughness; across the tangent, of anisotropic facets, which are never a
        perfect mirror."""
        if "roughness" not in MODELS[self.model]:
            return 0.0
        return max(self.roughness**2, 1e-4) if self.anisotropy > 0 else self.roughness**2

    @property
    def least_alpha(self) -> float:
        """``alpha_cutoff`` less what interpolation in single precision may lose of an alpha that is equal to it."""
        return self.alpha_cutoff * (1 - 2**-20)

    @property
    def is_coated(self) -> bool:
        """Whether it has a coat, perhaps somewhere."""
        return self.coat > 0 and not self.unlit

    @property
    def has_sheen(self) -> bool:
        """Whether it has a sheen, perhaps somewhere."""
        return max(self.sheen_color) > 0 and not self.unlit

    @property
    def has_iridescence(self) -> bool:
        """Whether it has a thin film, perhaps somewhere."""
        return self.iridescence > 0 and not self.unlit

    @property
    def is_translucent(self) -> bool:
        """Whether it transmits light diffusely, perhaps somewhere."""
        return self.diffuse_transmission > 0

    @property
    def coat_alpha(self) -> float:
        """GGX width of the coat."""
        return max(self.coat_roughness**2, LEAST_COAT_ALPHA)

    @property
    def coat_f0(self) -> float:
        """Reflectance of the coat at normal incidence."""
        return reflectance_from_ior(self.coat_ior)

    @property
    def alpha_along(self) -> float:
        """GGX width along the tangent."""
        return self.alpha + (1 - self.alpha) * self.anisotropy**2

    @property
    def normal_maps(self) -> list[Texture]:
        """Those of base and coat, as far as it has them."""
        of_coat = self.coat_normal_texture if self.is_coated else None
        return [texture for texture in (self.normal_texture, of_coat) if texture is not None]

    @property
    def tangent_coordinates(self) -> int | None:
        """The set of texture coordinates that tangents follow, None where it needs no tangents."""
        if self.normal_maps:
            return self.normal_maps[0].coordinates
        if self.anisotropy > 0 and self.anisotropy_texture is not None:
            return self.anisotropy_texture.coordinates
        return 0 if self.anisotropy > 0 else None

    @property
    def base_color(self) -> Triple:
        """The albedo, or the reflectance of the named metal."""
        return self.specular_f0 if self.model == "conductor" else METAL_F0[self.metal] if self.metal else self.albedo

    @property
    def metalness(self) -> float:
        """``metallic``, or 1 for a named metal."""
        return 1.0 if self.metal or self.model == "conductor" else self.metallic

    @property
    def is_dielectric(self) -> bool:
        """Whether light passes its surface."""
        return self.model in SOLIDS or self.is_pane

    @property
    def is_pane(self) -> bool:
        """Whether its surface is both interfaces of a dielectric."""
        return self.model in PANES

    @property
    def is_solid(self) -> bool:
        """Whether its surface bounds something that light passes: a dielectric or a medium."""
        return self.model in SOLIDS and self.exterior_ior is None

    @property
    def index(self) -> float:
        """Index of refraction."""
        if self.model == "null":
            return 1.0
        return 1.5 if self.ior is None else self.ior

    @property
    def relative_index(self) -> float:
        """Index of refraction over that of what lies in front of the surface."""
        return self.index / (self.exterior_ior or 1.0)

    @property
    def dispersion(self) -> float:
        """1 over the Abbe number, 0 where there is no dispersion."""
        return 1 / self.abbe_number if self.abbe_number else 0.0

    @property
    def complex_index(self) -> tuple[Triple, Triple]:
        """Index of refraction and extinction coefficient of a conductor."""
        return METAL_INDEX[self.metal] if self.metal else (self.eta or (1.0, 1.0, 1.0), self.k or (0.0, 0.0, 0.0))

    @property
    def absorption(self) -> Triple:
        """Absorption coefficient in 1/m behind the surface."""
        r, g, b = (-math.log(c) / self.attenuation_distance for c in self.attenuation_color)
        return (r, g, b)

    @property
    def diffuse_albedo(self) -> Triple:
        """Albedo of the Lambert base."""
        if self.is_dielectric or self.model == "conductor":
            return (0.0, 0.0, 0.0)
        base = 1.0 - self.metalness
        r, g, b = self.base_color
        return (base * r, base * g, base * b)

    @property
    def dielectric_f0(self) -> Triple:
        """Reflectance at normal incidence of the dielectric part, before ``specular``."""
        return self.f0 or (reflectance_from_ior(self.index),) * 3

    @property
    def specular_f0(self) -> Triple:
        """Specular reflectance at normal incidence."""
        if self.model == "eon":
            return (0.0, 0.0, 0.0)
        if self.model == "conductor":
            return conductor_reflectance(*self.complex_index)
        if self.metal:
            return METAL_F0[self.metal]
        dielectric, metallic = (1 - self.metallic) * self.specular, self.metallic
        (r0, g0, b0), (r, g, b) = self.dielectric_f0, self.albedo
        return (dielectric * r0 + metallic * r, dielectric * g0 + metallic * g, dielectric * b0 + metallic * b)

    @property
    def specular_f90(self) -> Triple:
        """Specular reflectance at grazing incidence, per channel for a dielectric, 1 for a metal."""
        if self.model == "eon":
            return (0.0, 0.0, 0.0)
        if self.metal or self.model in ("conductor", "plastic", "rough-plastic"):
            return (1.0, 1.0, 1.0)
        dielectric = (1 - self.metallic) * self.specular
        metallic = self.metallic * grazing_reflectance(max(self.albedo))
        r, g, b = map(grazing_reflectance, self.dielectric_f0)
        return (dielectric * r + metallic, dielectric * g + metallic, dielectric * b + metallic)

    @property
    def textures(self) -> dict[str, Texture]:
        """Its textures by the name of the parameter, of :data:`TEXTURED`."""
        values = vars(self)
        return {name: values[field] for name, field in _TEXTURE_FIELDS.items() if values[field] is not None}

    def without_textures(self) -> "Material":
        """The same, as it is on a shape without texture coordinates."""
        none: dict[str, Any] = {_TEXTURE_FIELDS[name]: None for name in self.textures}
        return replace(self, **none) if none else self

    @property
    def is_emissive(self) -> bool:
        return max(self.emission) > 0 and not self.unlit
