# SPDX-License-Identifier: MIT
"""Materials of glTF 2.0 (section 3.9) and their extensions to materials of the scene model."""

import math
import os
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from fragtracer.errors import FragtracerError
from fragtracer.io.gltf import document as gltf
from fragtracer.io.gltf.container import Container
from fragtracer.io.gltf.transmission import Varying, blended, is_mapped_alike
from fragtracer.io.textures import read_texture
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.fields import LARGEST
from fragtracer.scene.reflectance import reflectance_from_ior
from fragtracer.scene.texture import ColorSpace, Wrap

DEFAULT = "default"  # the name of what has no material
_WRAPS: dict[int, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_NEAREST = 9728
_LEAST_ATTENUATION = 1e-6  # in place of a black attenuationColor
_MOST_PIXELS = 2**29  # of all images together
# What a surface has by itself, however it scatters.
_OF_SURFACES = ("emission", "emission_texture", "opacity", "alpha_mode", "alpha_cutoff")


def unique(name: str, suffix: object, taken: Collection[str]) -> str:
    """``name``, made another one than all those ``taken``."""
    while name in taken:
        name += f" ({suffix})"
    return name


class Materials:
    """The materials of one model, by the ``names`` of those in the file. ``notes`` takes what is ignored."""

    def __init__(self, container: Container, names: Sequence[str], notes: list[str]) -> None:
        self._container, self._names, self.notes = container, names, notes
        self._images: dict[tuple[str | None, int | None, ColorSpace], Image | None] = {}
        self._found: dict[int, dict[str, Material]] = {}
        self._pixels = 0

    def get(self, index: int | None, place: str) -> dict[str, Material]:
        """The material of this index, for None the default one of the specification, by its name; and after it what
        transmits where that is a part of the surface alone."""
        if index is None:
            return {DEFAULT: Material(albedo=(1, 1, 1), metallic=1.0, roughness=1.0, double_sided=False)}
        if index not in self._found:
            self._found[index] = self._made(index, place)
        return self._found[index]

    def _made(self, index: int, place: str) -> dict[str, Material]:
        item: gltf.Material = self._container.item(self._container.document.materials, index, place)
        place, pbr = f"materials[{index}]", item.pbrMetallicRoughness
        base = pbr.baseColorFactor
        shared = pbr.metallicRoughnessTexture
        occlusion, normal = item.occlusionTexture, item.normalTexture
        strength = self._container.extension(gltf.EmissiveStrength, item, "KHR_materials_emissive_strength", place)
        scale = strength.emissiveStrength if strength else 1.0
        made: dict[str, Any] = {
            "albedo": base[:3],
            "opacity": base[3],
            "metallic": pbr.metallicFactor,
            "roughness": pbr.roughnessFactor,
            "emission": tuple(min(scale * channel, LARGEST) for channel in item.emissiveFactor),
            "albedo_texture": self._texture(pbr.baseColorTexture, place, "srgb"),
            "metallic_texture": self._texture(shared, place, "linear", "b"),
            "roughness_texture": self._texture(shared, place, "linear", "g"),
            "normal_texture": self._texture(normal, place, "linear"),
            "normal_scale": normal.scale if normal else 1.0,
            "occlusion_texture": self._texture(occlusion, place, "linear"),
            "occlusion_strength": occlusion.strength if occlusion else 1.0,
            "emission_texture": self._texture(item.emissiveTexture, place, "srgb"),
            "alpha_mode": item.alphaMode.lower(),
            "alpha_cutoff": min(item.alphaCutoff, 1.0),
            "double_sided": item.doubleSided,
            "unlit": "KHR_materials_unlit" in item.extensions,
        }
        old = self._container.extension(gltf.SpecularGlossiness, item, "KHR_materials_pbrSpecularGlossiness", place)
        made |= self._reflectance(item, place) if old is None else self._specular_glossiness(old, place)
        made |= self._anisotropy(item, place)
        layers = {
            "clearcoat": self._coat(item, place, made["unlit"], made["normal_texture"]),
            "sheen": self._sheen(item, place, made["unlit"]),
            "iridescence": self._iridescence(item, place, made["unlit"]),
        }
        translucency = self._translucency(item, place, made)
        if translucency:
            self.notes += [f"KHR_materials_{n} of {place}, which transmits diffusely" for n in layers if layers[n]]
            layers = {}
        for layer in (*layers.values(), translucency):
            made |= layer
        if item.alphaMode == "MASK" and item.alphaCutoff > 1:  # above every alpha
            made["opacity"] = 0.0
        name = self._names[index]
        weight, metallic = self._transmission(item, place, made)
        if weight.factor == 0 or made["unlit"]:
            return {name: Material(**made)}
        self.notes += [f"KHR_materials_{n} of {place} where it transmits" for n in layers if layers[n]]
        dielectric = self._dielectric(item, place, index, made)
        if weight == Varying(1.0) and not _has_alpha_texture(made):
            return {name: replace(dielectric, **{key: made[key] for key in _OF_SURFACES})}
        other = unique(f"{name}/transmission", index, self._names)
        made |= {"metallic": metallic.factor, "metallic_texture": metallic.texture, "double_sided": True}
        made |= {"blend": other, "blend_weight": weight.factor, "blend_weight_texture": weight.texture}
        return {name: Material(**made), other: dielectric}

    def _transmission(self, item: gltf.Material, place: str, made: dict[str, Any]) -> tuple[Varying, Varying]:
        """The weight of what transmits, and the metallic of the rest."""
        found = self._container.extension(gltf.Transmission, item, "KHR_materials_transmission", place)
        if found is None or found.transmissionFactor == 0:
            return Varying(0.0), Varying(0.0)
        mask = self._texture(found.transmissionTexture, place, "linear")
        transmission = Varying(found.transmissionFactor, mask)
        metallic = Varying(made["metallic"], made["metallic_texture"])
        if metallic.factor > 0 and mask and metallic.texture and not is_mapped_alike(mask, metallic.texture):
            self.notes.append(
                f"metallicRoughnessTexture of {place} where it transmits, not mapped as transmissionTexture"
            )
            return transmission, metallic
        weight, rest = blended(transmission, metallic)
        for image in {made.texture.image for made in (weight, rest) if made.texture}:
            self._count(image)
        return weight, rest

    def _dielectric(self, item: gltf.Material, place: str, index: int, made: dict[str, Any]) -> Material:
        """What transmits, without emission and alpha: with a thickness a solid, without one a pane. Of two that overlap
        that of the later material is there."""
        ior = self._container.extension(gltf.Ior, item, "KHR_materials_ior", place)
        volume = self._container.extension(gltf.Volume, item, "KHR_materials_volume", place) or gltf.Volume()
        kept = {name: made[name] for name in ("normal_texture", "normal_scale")}
        kept |= {"transmittance": made["albedo"], "transmittance_texture": made["albedo_texture"]}
        kept |= {"ior": max(ior.ior, 1.0) if ior else 1.5}
        if volume.thicknessTexture:
            self.notes.append(f"thicknessTexture of {place}, whose thickness is that of its mesh")
        facets = {"roughness": made["roughness"], "roughness_texture": made["roughness_texture"]}
        facets |= self._anisotropy(item, place)
        if volume.thicknessFactor == 0:
            if made["roughness"] == facets["anisotropy"] == 0:
                return Material(model="thin-dielectric", **kept)
            return Material(model="rough-thin-dielectric", **kept, **facets)
        kept |= {**facets, "priority": index}
        dispersion = self._container.extension(gltf.Dispersion, item, "KHR_materials_dispersion", place)
        if dispersion is not None and dispersion.dispersion > 0:
            kept["abbe_number"] = min(20 / dispersion.dispersion, LARGEST)
        if volume.attenuationDistance < LARGEST:
            red, green, blue = (max(c, _LEAST_ATTENUATION) for c in volume.attenuationColor)
            kept |= {"attenuation_color": (red, green, blue), "attenuation_distance": volume.attenuationDistance}
        return Material(model="dielectric", **kept)

    def _anisotropy(self, item: gltf.Material, place: str) -> dict[str, Any]:
        found = self._container.extension(gltf.Anisotropy, item, "KHR_materials_anisotropy", place) or gltf.Anisotropy()
        return {
            "anisotropy": found.anisotropyStrength,
            "anisotropy_rotation_degrees": math.degrees(math.fmod(found.anisotropyRotation, math.tau)),
            "anisotropy_texture": self._texture(found.anisotropyTexture, place, "linear"),
        }

    def _coat(self, item: gltf.Material, place: str, unlit: bool, of_base: Texture | None) -> dict[str, Any]:
        found = self._container.extension(gltf.Clearcoat, item, "KHR_materials_clearcoat", place)
        if found is None or found.clearcoatFactor == 0:
            return {}
        if unlit:
            self.notes.append(f"KHR_materials_clearcoat of {place}, which is unlit")
            return {}
        made: dict[str, Any] = {
            "coat": found.clearcoatFactor,
            "coat_roughness": found.clearcoatRoughnessFactor,
            "coat_texture": self._texture(found.clearcoatTexture, place, "linear"),
            "coat_roughness_texture": self._texture(found.clearcoatRoughnessTexture, place, "linear", "g"),
        }
        normal = self._texture(found.clearcoatNormalTexture, place, "linear")
        if normal and of_base and normal.coordinates != of_base.coordinates:
            self.notes.append(f"clearcoatNormalTexture of {place}, which has not the coordinates of its normalTexture")
        elif normal and found.clearcoatNormalTexture:
            made |= {"coat_normal_texture": normal, "coat_normal_scale": found.clearcoatNormalTexture.scale}
        return made

    def _sheen(self, item: gltf.Material, place: str, unlit: bool) -> dict[str, Any]:
        found = self._container.extension(gltf.Sheen, item, "KHR_materials_sheen", place)
        if found is None or max(found.sheenColorFactor) == 0:
            return {}
        if unlit:
            self.notes.append(f"KHR_materials_sheen of {place}, which is unlit")
            return {}
        return {
            "sheen_color": found.sheenColorFactor,
            "sheen_roughness": found.sheenRoughnessFactor,
            "sheen_color_texture": self._texture(found.sheenColorTexture, place, "srgb"),
            # Alpha is linear in either space, and often of the image of the colour.
            "sheen_roughness_texture": self._texture(found.sheenRoughnessTexture, place, "srgb", "a"),
        }

    def _iridescence(self, item: gltf.Material, place: str, unlit: bool) -> dict[str, Any]:
        found = self._container.extension(gltf.Iridescence, item, "KHR_materials_iridescence", place)
        if found is None or found.iridescenceFactor == 0:
            return {}
        if unlit:
            self.notes.append(f"KHR_materials_iridescence of {place}, which is unlit")
            return {}
        return {
            "iridescence": found.iridescenceFactor,
            "iridescence_ior": found.iridescenceIor,
            "iridescence_thickness": found.iridescenceThicknessMaximum,
            "iridescence_thickness_minimum": found.iridescenceThicknessMinimum,
            "iridescence_texture": self._texture(found.iridescenceTexture, place, "linear"),
            "iridescence_thickness_texture": self._texture(found.iridescenceThicknessTexture, place, "linear", "g"),
        }

    def _translucency(self, item: gltf.Material, place: str, made: dict[str, Any]) -> dict[str, Any]:
        """What it transmits diffusely: a metal nothing."""
        name = "KHR_materials_diffuse_transmission"
        found = self._container.extension(gltf.DiffuseTransmission, item, name, place)
        is_metal = made["metallic"] == 1 and made["metallic_texture"] is None
        if found is None or found.diffuseTransmissionFactor == 0 or is_metal:
            return {}
        if made["unlit"]:
            self.notes.append(f"{name} of {place}, which is unlit")
            return {}
        volume = self._container.extension(gltf.Volume, item, "KHR_materials_volume", place)
        if volume is not None and volume.thicknessFactor > 0:
            self.notes.append(f"KHR_materials_volume of {place} where it transmits diffusely")
        return {
            "diffuse_transmission": found.diffuseTransmissionFactor,
            "diffuse_transmission_color": found.diffuseTransmissionColorFactor,
            # Alpha is linear in either space, and often of the image of the colour.
            "diffuse_transmission_texture": self._texture(found.diffuseTransmissionTexture, place, "srgb", "a"),
            "diffuse_transmission_color_texture": self._texture(found.diffuseTransmissionColorTexture, place, "srgb"),
        }

    def _specular_glossiness(self, old: gltf.SpecularGlossiness, place: str) -> dict[str, Any]:
        """The specular-glossiness workflow, which replaces metallic-roughness."""
        if old.specularGlossinessTexture:
            self.notes.append("specularGlossinessTexture")
        return {
            "albedo": old.diffuseFactor[:3],
            "opacity": old.diffuseFactor[3],
            "albedo_texture": self._texture(old.diffuseTexture, place, "srgb"),
            "metallic": 0.0,
            "metallic_texture": None,
            "roughness": 1 - old.glossinessFactor,
            "roughness_texture": None,
            "f0": old.specularFactor,
        }

    def _reflectance(self, item: gltf.Material, place: str) -> dict[str, Any]:
        ior = self._container.extension(gltf.Ior, item, "KHR_materials_ior", place)
        specular = self._container.extension(gltf.Specular, item, "KHR_materials_specular", place)
        # An index of 0 means total reflection; one between 0 and 1 is not valid.
        index = 1.5 if ior is None else ior.ior
        f0 = reflectance_from_ior(max(index, 1.0)) if index else 1.0
        if specular is None:
            return {"ior": max(index, 1.0)} if ior and index else {"f0": (f0,) * 3} if ior else {}
        if specular.specularTexture or specular.specularColorTexture:
            self.notes.append("textures of KHR_materials_specular")
        color = tuple(min(f0 * channel, 1.0) for channel in specular.specularColorFactor)
        return {"specular": specular.specularFactor, "f0": color}

    def _texture(
        self, info: gltf.TextureInfo | None, place: str, color_space: ColorSpace, channel: str = "r"
    ) -> Texture | None:
        if info is None:
            return None
        document = self._container.document
        item: gltf.Texture = self._container.item(document.textures, info.index, f"{place}: texture")
        image = self._image(item, f"textures[{info.index}]", color_space)
        moved = self._container.extension(gltf.TextureTransform, info, "KHR_texture_transform", place)
        moved = moved or gltf.TextureTransform()
        coordinates = info.texCoord if moved.texCoord is None else moved.texCoord
        if coordinates > 1:
            self.notes.append("textures on TEXCOORD_2 and above")
        if image is None or coordinates > 1:
            return None
        sampler = gltf.Sampler()
        if item.sampler is not None:
            sampler = self._container.item(document.samplers, item.sampler, f"textures[{info.index}].sampler")
        made: dict[str, Any] = {
            "wrap_u": _WRAPS[sampler.wrapS],
            "wrap_v": _WRAPS[sampler.wrapT],
            "filter": "nearest" if sampler.magFilter == _NEAREST else "linear",
            "offset": moved.offset,
            "rotation": moved.rotation,
            "scale": moved.scale,
            "coordinates": coordinates,
            "channel": channel,
        }
        return Texture(image, **made)

    def _image(self, texture: gltf.Texture, place: str, color_space: ColorSpace) -> Image | None:
        source = texture.source
        webp = texture.extensions.get("EXT_texture_webp")
        if isinstance(webp, dict) and isinstance(webp.get("source"), int) and webp["source"] >= 0:
            source = webp["source"]
        if source is None:
            self.notes.append(f"{place} (without an image that can be read)")
            return None
        item: gltf.Image = self._container.item(self._container.document.images, source, f"{place}.source")
        key = item.uri, item.bufferView, color_space
        if key not in self._images:
            image = self._images[key] = self._read(item, f"images[{source}]", color_space)
            if image is not None:
                self._count(image)
        return self._images[key]

    def _count(self, image: Image) -> None:
        self._pixels += image.pixels.shape[0] * image.pixels.shape[1]
        if self._pixels > _MOST_PIXELS:
            raise self._container.error("images", f"more than {_MOST_PIXELS} pixels together; make them smaller")

    def _read(self, item: gltf.Image, place: str, color_space: ColorSpace) -> Image | None:
        """The pixels of an image; None, with a note, if it cannot be read."""
        container = self._container
        try:
            if item.bufferView is not None:
                return _embedded(bytes(container.view(item.bufferView, place)), color_space, place)
            if item.uri is None:
                raise container.error(place, "has neither a uri nor a bufferView")
            data = container.fetch(item.uri, place)
            if item.uri.startswith("data:"):
                return _embedded(data, color_space, place)
            return read_texture(data, color_space, str(container.beside(item.uri, place)))
        except (FragtracerError, ValueError) as error:
            self.notes.append(
                str(error).replace(f"{container.path}: ", "").replace(f"{container.path.parent}{os.sep}", "")
            )
            return None


def _has_alpha_texture(made: dict[str, Any]) -> bool:
    """Whether alpha is in the albedo texture, which a dielectric has none of."""
    texture: Texture | None = made["albedo_texture"]
    return made["alpha_mode"] != "opaque" and texture is not None and texture.image.pixels.shape[2] in (2, 4)


def _embedded(data: bytes, color_space: ColorSpace, name: str) -> Image:
    """An image in a buffer or a data URI."""
    return Image(read_texture(data, color_space, name).pixels, color_space)
