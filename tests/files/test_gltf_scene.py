# SPDX-License-Identifier: MIT
"""Scenes of glTF files: nodes, materials, cameras and lights, and what is not shown."""

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.io import qualified
from fragtracer.io.toml import load, save
from fragtracer.scene import Texture

from .data import PNG, TRIANGLE, Gltf


def test_nodes_multiply_from_the_root(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    gltf = Gltf(
        nodes=[
            {"children": [1, 2], "translation": [10, 0, 0]},
            {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 5, 6, 7, 1]},
            {"mesh": 0},
        ],
        scenes=[{"nodes": [3]}, {"nodes": [0]}],
        scene=1,
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: scenes but one$"):
        model = gltf.read(tmp_path)
    assert model.mesh.parts[0].geometry is model.mesh.parts[1].geometry
    points = [
        part.geometry.positions @ np.array(part.matrix)[:3, :3].T + np.array(part.matrix)[:3, 3]
        for part in model.mesh.parts
    ]
    np.testing.assert_allclose(points[0], [[10, 0, 0], [10, 2, 0], [7, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(points[1], [[15, 6, 7], [16, 6, 7], [15, 6, 6]], atol=1e-12)


def test_materials(tmp_path: Path) -> None:
    transform = {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1, "scale": [2, 3], "texCoord": 1}}
    material: dict[str, Any] = {
        "name": "all",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 1.0000001, 0.4],
            "baseColorTexture": {"index": 0, "extensions": transform},
            "metallicFactor": 0.6,
            "roughnessFactor": 0.7,
            "metallicRoughnessTexture": {"index": 1},
        },
        "normalTexture": {"index": 1, "scale": -2, "texCoord": 1},
        "occlusionTexture": {"index": 1, "strength": 0.5},
        "emissiveTexture": {"index": 0},
        "emissiveFactor": [1, 0.5, 0],
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "doubleSided": True,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 10},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_unlit": {},
        },
    }
    tinted = {"extensions": {"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 30]}}}
    old = {"diffuseFactor": [0.1, 0.2, 0.3, 0.4], "specularFactor": [0.5, 0.6, 0.7], "glossinessFactor": 0.75}
    older = {"extensions": {"KHR_materials_pbrSpecularGlossiness": {**old, "diffuseTexture": {"index": 0}}}}
    gltf = Gltf(
        materials=[material, {"name": "all"}, tinted, {"extensions": {"KHR_materials_ior": {"ior": 0}}}, older],
        samplers=[{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        textures=[{"source": 0, "sampler": 0}, {"source": 1}],
    )
    (tmp_path / "a b.png").write_bytes(PNG)
    gltf.content["images"] = [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}, {"uri": "a%20b.png"}]
    position = gltf.array(TRIANGLE)
    primitives = [{"attributes": {"POSITION": position}, "material": index} for index in range(5)]
    gltf.content |= {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    model = gltf.read(tmp_path)
    made = model.materials["all"]
    assert (made.albedo, made.opacity, made.metallic, made.roughness) == ((0.1, 0.2, 1), 0.4, 0.6, 0.7)
    assert (made.emission, made.ior, made.unlit, made.double_sided) == ((10, 5, 0), 1.33, True, True)
    assert (made.alpha_mode, made.alpha_cutoff, made.normal_scale) == ("mask", 0.3, -2)
    assert made.occlusion_strength == 0.5
    base = made.albedo_texture
    assert base is not None
    assert (base.wrap_u, base.wrap_v, base.filter, base.coordinates) == ("clamp", "mirror", "nearest", 1)
    assert (base.offset, base.rotation, base.scale) == ((0.5, 0.25), 1, (2, 3))
    assert (base.image.color_space, base.image.file) == ("srgb", None)
    np.testing.assert_array_equal(base.image.pixels, np.arange(16).reshape(2, 2, 4))
    for texture, channel in (
        (made.metallic_texture, "b"),
        (made.roughness_texture, "g"),
        (made.occlusion_texture, "r"),
    ):
        assert texture is not None
        assert (texture.channel, texture.image.color_space) == (channel, "linear")
        assert texture.image.file == str(tmp_path / "a b.png")
    assert made.normal_texture is not None
    assert made.normal_texture.coordinates == 1
    assert list(model.materials) == ["all", "all (1)", "material 2", "material 3", "material 4"]
    made = model.materials["material 4"]
    assert (made.albedo, made.opacity, made.f0) == ((0.1, 0.2, 0.3), 0.4, (0.5, 0.6, 0.7))
    assert (made.roughness, made.metallic) == (0.25, 0)
    assert made.albedo_texture is not None
    assert model.materials["material 2"].specular == 0.5
    assert model.materials["material 2"].f0 == pytest.approx((0.04, 0.02, 1))
    assert model.materials["material 3"].f0 == (1, 1, 1)


def test_what_transmits_is_a_dielectric(tmp_path: Path) -> None:
    """With a thickness a solid, without one a pane; what transmits in part is blended with one."""
    volume = {
        "thicknessFactor": 1,
        "thicknessTexture": {"index": 0},
        "attenuationColor": [0.5, 0, 1],
        "attenuationDistance": 2,
    }
    rough = {"baseColorFactor": [0.9, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 0.3}
    rough["baseColorTexture"] = {"index": 0}
    passing = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.2}}
    partly = {"KHR_materials_transmission": {"transmissionFactor": 0.4}}
    gltf = Gltf(
        materials=[
            {"name": "pane", "pbrMetallicRoughness": rough | {"roughnessFactor": 0}, "extensions": passing},
            {
                "name": "glass",
                "pbrMetallicRoughness": rough,
                "extensions": passing
                | {"KHR_materials_volume": volume, "KHR_materials_dispersion": {"dispersion": 0.5}},
            },
            {"name": "veil", "pbrMetallicRoughness": rough, "extensions": partly},
        ]
    )
    gltf.content |= {"textures": [{"source": 0}], "images": [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}]}
    position = gltf.array(TRIANGLE)
    primitives = [{"attributes": {"POSITION": position}, "material": index} for index in range(3)]
    gltf.content |= {"meshes": [{"primitives": primitives}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    with pytest.warns(UserWarning, match=r"thicknessTexture of materials\[1\], whose thickness is that of its mesh"):
        model = gltf.read(tmp_path)
    assert model.materials["glass"].transmittance_texture is not None
    color = pytest.approx((0.9, 1, 1))
    assert (model.materials["pane"].model, model.materials["pane"].ior) == ("thin-dielectric", 1.2)
    glass = model.materials["glass"]
    assert (glass.model, glass.ior, glass.roughness, glass.priority) == ("dielectric", 1.2, 0.3, 1)
    assert (glass.attenuation_color, glass.attenuation_distance) == ((0.5, 1e-6, 1), 2)
    assert glass.abbe_number == 40
    assert glass.transmittance == model.materials["pane"].transmittance == color
    veil = model.materials["veil"]
    assert (veil.model, veil.blend, veil.blend_weight) == ("metallic-roughness", "veil/transmission", 0.4)
    assert veil.double_sided
    other = model.materials["veil/transmission"]
    assert (other.model, other.ior, other.transmittance) == ("rough-thin-dielectric", 1.5, color)
    assert other.roughness == 0.3
    renamed = qualified(model, "x").materials
    assert renamed["x/veil"].blend == "x/veil/transmission" in renamed


def channels(*values: Sequence[float]) -> bytes:
    """A PNG of one row with these colours, as parts of 255."""
    file = io.BytesIO()
    PIL.Image.fromarray(np.array([values], np.uint8)).save(file, "PNG")
    return file.getvalue()


NO_METAL, STRAY = {"metallicFactor": 0}, [7, 7, 7]
TRANSMISSIONS: dict[str, tuple[dict[str, Any], dict[str, Any], Any, Any]] = {
    "none": (NO_METAL, {"transmissionFactor": 0, "transmissionTexture": {"index": 0}}, 0, 0),
    "all": (NO_METAL, {"transmissionFactor": 1}, 1, None),
    "half of a half metal": ({"metallicFactor": 0.5}, {"transmissionFactor": 0.5}, 0.25, 2 / 3),
    "all of a half metal": ({"metallicFactor": 0.5}, {"transmissionFactor": 1}, 0.5, 1),
    "a metal": ({}, {"transmissionFactor": 1}, 0, 1),
    "red of a texture": (NO_METAL, {"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}, [0, 0.2, 0.5], 0),
    "where there is no metal": (
        {"metallicRoughnessTexture": {"index": 1}},
        {"transmissionFactor": 0.5},
        [0.5, 0.3, 0],
        [0, 4 / 7, 1],
    ),
    "of both textures": (
        {"metallicRoughnessTexture": {"index": 1}},
        {"transmissionFactor": 1, "transmissionTexture": {"index": 0}},
        [0, 0.4 * 0.6, 0],
        [0, 0.4 / 0.76, 1],
    ),
}


@pytest.mark.parametrize("name", TRANSMISSIONS)
def test_the_part_that_transmits(tmp_path: Path, name: str) -> None:
    """By its factor and the red of its texture, of what is no metal; the rest is the more metallic."""
    surface, transmission, weight, metallic = TRANSMISSIONS[name]
    item = {"pbrMetallicRoughness": surface, "extensions": {"KHR_materials_transmission": transmission}}
    gltf = Gltf(materials=[item])
    gltf.triangle(material=0)
    images = channels([0, 9, 9], [102, 9, 9], [255, 9, 9]), channels([9, 9, 0], [9, 9, 102], [9, 9, 255])
    gltf.content |= {
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"bufferView": gltf.view(image), "mimeType": "image/png"} for image in images],
    }
    materials = gltf.read(tmp_path).materials
    made = materials["material 0"]
    if weight == 1:
        assert made.model == "rough-thin-dielectric"
        return
    assert made.model == "metallic-roughness"
    assert (made.blend is not None) == (weight != 0) == (len(materials) == 2)
    assert at_texels(made.metallic, made.metallic_texture) == pytest.approx(np.broadcast_to(metallic, 3), abs=0.003)
    if weight != 0:
        found = at_texels(made.blend_weight, made.blend_weight_texture)
        assert found == pytest.approx(np.broadcast_to(weight, 3), abs=0.003)


def at_texels(factor: float, texture: Texture | None) -> Any:
    """The value of a parameter at the three texels of its texture."""
    if texture is None:
        return np.full(3, factor)
    return (
        factor * texture.image.pixels[0, :, min("rgb".index(texture.channel), texture.image.pixels.shape[2] - 1)] / 255
    )


def test_glass_may_glow(tmp_path: Path) -> None:
    """From its front alone: its back is where light leaves it."""
    glowing = {
        "emissiveFactor": [1, 1, 1],
        "doubleSided": True,
        "pbrMetallicRoughness": NO_METAL | {"roughnessFactor": 0},
    }
    parts = [{"KHR_materials_transmission": {"transmissionFactor": t}} for t in (1, 0.5)]
    gltf = Gltf(materials=[glowing | {"extensions": part} for part in parts], nodes=[{"mesh": 0}, {"mesh": 1}])
    gltf.content["scenes"] = [{"nodes": [0, 1]}]
    gltf.triangle(material=0)
    gltf.triangle(material=1)
    model = gltf.read(tmp_path)
    assert len(model.mesh.parts) == 2
    assert [m.is_emissive for m in model.materials.values()] == [True, True, False]


@pytest.mark.parametrize("thickness", [0, 1])
@pytest.mark.parametrize("transmission", [1, 0.9])
@pytest.mark.parametrize(("cutoff", "opacity"), [(0.5, 0.25), (2, 0)])
@pytest.mark.parametrize("mode", ["OPAQUE", "MASK", "BLEND"])
def test_what_transmits_keeps_its_alpha(
    tmp_path: Path, mode: str, cutoff: float, opacity: float, transmission: float, thickness: float
) -> None:
    item = {
        "pbrMetallicRoughness": NO_METAL | {"baseColorFactor": [1, 1, 1, 0.25]},
        "alphaMode": mode,
        "alphaCutoff": cutoff,
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": transmission},
            "KHR_materials_volume": {"thicknessFactor": thickness},
        },
    }
    gltf = Gltf(materials=[item])
    gltf.triangle(material=0)
    made = gltf.read(tmp_path).materials["material 0"]
    expected = opacity if mode == "MASK" else 0.25
    assert (made.alpha_mode, made.opacity, made.alpha_cutoff) == (mode.lower(), expected, min(cutoff, 1))


@pytest.mark.parametrize(("mode", "is_kept"), [("OPAQUE", False), ("MASK", True), ("BLEND", True)])
@pytest.mark.parametrize("pixel", [[9, 9, 9], [9, 9, 9, 128]])
def test_what_transmits_keeps_the_alpha_of_its_texture(
    tmp_path: Path, pixel: list[int], mode: str, is_kept: bool
) -> None:
    """As the alpha of a surface that transmits by a weight of 1."""
    item = {
        "pbrMetallicRoughness": NO_METAL | {"baseColorTexture": {"index": 0}},
        "alphaMode": mode,
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}},
    }
    gltf = Gltf(materials=[item], textures=[{"source": 0}])
    gltf.content["images"] = [{"bufferView": gltf.view(channels(pixel)), "mimeType": "image/png"}]
    gltf.triangle(material=0)
    materials = gltf.read(tmp_path).materials
    made = materials["material 0"]
    if not is_kept or len(pixel) == 3:
        assert list(materials) == ["material 0"]
        assert made.model == "rough-thin-dielectric"
        return
    assert made.albedo_texture is not None
    assert (made.alpha_mode, made.blend, made.blend_weight) == (mode.lower(), "material 0/transmission", 1)
    other = materials["material 0/transmission"]
    assert (other.model, other.alpha_mode) == ("rough-thin-dielectric", "opaque")
    assert other.transmittance_texture == made.albedo_texture


@pytest.mark.parametrize("transmits", [False, True])
def test_anisotropy(tmp_path: Path, transmits: bool) -> None:
    """Of metals and of what transmits, with its texture."""
    brushed = {"anisotropyStrength": 0.6, "anisotropyRotation": 0.5, "anisotropyTexture": {"index": 0}}
    passing = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}
    item = {
        "pbrMetallicRoughness": {"roughnessFactor": 0.4, "metallicFactor": 0.0 if transmits else 1.0},
        "extensions": {"KHR_materials_anisotropy": brushed} | (passing if transmits else {}),
    }
    gltf = Gltf(materials=[item], nodes=[{"mesh": 0}], scenes=[{"nodes": [0]}])
    gltf.triangle(material=0)
    gltf.content |= {"textures": [{"source": 0}], "images": [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}]}
    (material,) = gltf.read(tmp_path).materials.values()
    assert material.anisotropy_texture is not None
    assert material.anisotropy_texture.image.color_space == "linear"
    assert material.model == ("dielectric" if transmits else "metallic-roughness")
    assert (material.anisotropy, material.roughness) == (0.6, 0.4)
    assert material.anisotropy_rotation_degrees == pytest.approx(28.6479, abs=1e-4)


LACQUER: dict[str, Any] = {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.25}
VELVET: dict[str, Any] = {"sheenColorFactor": [0.75, 0.5, 0], "sheenRoughnessFactor": 0.5}
SOAP: dict[str, Any] = {"iridescenceFactor": 0.75, "iridescenceIor": 1.5, "iridescenceThicknessMaximum": 300}
TRANSMITS: dict[str, Any] = {"KHR_materials_transmission": {"transmissionFactor": 1}}


def lacquered(coat: dict[str, Any], **item: Any) -> Gltf:
    """A triangle under a coat, and a texture."""
    return layered({"KHR_materials_clearcoat": coat}, **item)


def layered(layers: dict[str, Any], **item: Any) -> Gltf:
    """A triangle under coats and sheen, by their extensions, and a texture."""
    item["extensions"] = layers | item.get("extensions", {})
    gltf = Gltf(materials=[item], extensionsUsed=list(item["extensions"]), textures=[{"source": 0}])
    gltf.content["images"] = [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}]
    gltf.triangle(material=0)
    return gltf


def test_a_coat(tmp_path: Path) -> None:
    maps = {"clearcoatTexture": {"index": 0}, "clearcoatRoughnessTexture": {"index": 0}}
    maps |= {"clearcoatNormalTexture": {"index": 0, "scale": 0.5}}
    (made,) = lacquered(LACQUER | maps, normalTexture={"index": 0}).read(tmp_path).materials.values()
    assert (made.coat, made.coat_roughness, made.coat_ior) == (0.75, 0.25, 1.5)
    assert made.normal_texture is not None
    assert made.coat_normal_texture == made.normal_texture
    assert (made.normal_scale, made.coat_normal_scale) == (1.0, 0.5)
    for texture, channel in ((made.coat_texture, "r"), (made.coat_roughness_texture, "g")):
        assert texture is not None
        assert (texture.channel, texture.image.color_space) == (channel, "linear")


def test_a_coat_of_factor_0_is_none(tmp_path: Path) -> None:
    off = {"clearcoatRoughnessFactor": 0.25, "clearcoatTexture": {"index": 0}, "clearcoatNormalTexture": {"index": 0}}
    assert lacquered(off).read(tmp_path).materials == lacquered({}).read(tmp_path).materials


def test_normals_of_a_coat_by_other_coordinates_are_ignored(tmp_path: Path) -> None:
    """The tangents are those of the other map."""
    normals = {"clearcoatNormalTexture": {"index": 0, "texCoord": 1}}
    gltf = lacquered(LACQUER | normals, normalTexture={"index": 0})
    note = r"ignored: clearcoatNormalTexture of materials\[0\], which has not the coordinates of its normalTexture$"
    with pytest.warns(UserWarning, match=note):
        model = gltf.read(tmp_path)
    assert model.materials["material 0"].coat == 0.75


def test_sheen(tmp_path: Path) -> None:
    """Both textures are one image, which each has where its transform says."""
    moved = {"extensions": {"KHR_texture_transform": {"scale": [2, 3], "offset": [0.5, 0]}}}
    maps = {"sheenColorTexture": {"index": 0}, "sheenRoughnessTexture": {"index": 0, **moved}}
    (made,) = layered({"KHR_materials_sheen": VELVET | maps}).read(tmp_path).materials.values()
    assert (made.sheen_color, made.sheen_roughness) == ((0.75, 0.5, 0), 0.5)
    color, roughness = made.sheen_color_texture, made.sheen_roughness_texture
    assert color is not None
    assert roughness is not None
    assert color.image is roughness.image
    assert color.image.color_space == "srgb"
    assert (roughness.channel, roughness.scale, roughness.offset) == ("a", (2, 3), (0.5, 0))


def test_iridescence(tmp_path: Path) -> None:
    """Thickness by green, from glTF's own minimum; without an iridescenceFactor there is no film."""
    maps = {"iridescenceTexture": {"index": 0}, "iridescenceThicknessTexture": {"index": 0}}
    (made,) = layered({"KHR_materials_iridescence": SOAP | maps}).read(tmp_path).materials.values()
    assert (made.iridescence, made.iridescence_ior) == (0.75, 1.5)
    assert (made.iridescence_thickness_minimum, made.iridescence_thickness) == (100, 300)
    weight, thickness = made.iridescence_texture, made.iridescence_thickness_texture
    assert weight is not None
    assert thickness is not None
    assert weight.image is thickness.image
    assert weight.image.color_space == "linear"
    assert (weight.channel, thickness.channel) == ("r", "g")
    off = {"iridescenceTexture": {"index": 0}}
    assert layered({"KHR_materials_iridescence": off}).read(tmp_path).materials == layered({}).read(tmp_path).materials


def test_sheen_of_a_black_factor_is_none(tmp_path: Path) -> None:
    off = {"sheenRoughnessFactor": 0.5, "sheenColorTexture": {"index": 0}}
    assert layered({"KHR_materials_sheen": off}).read(tmp_path).materials == layered({}).read(tmp_path).materials


@pytest.mark.parametrize(
    ("extensions", "metallic", "where", "coats"),
    [
        ({"KHR_materials_unlit": {}}, 0, ", which is unlit", [0]),
        (TRANSMITS, 0, " where it transmits", [0]),
        (TRANSMITS, 0.5, " where it transmits", [0.75, 0]),
    ],
)
def test_where_layers_are_ignored(
    tmp_path: Path, extensions: dict[str, Any], metallic: float, where: str, coats: list[float]
) -> None:
    layers = {"KHR_materials_clearcoat": LACQUER, "KHR_materials_sheen": VELVET, "KHR_materials_iridescence": SOAP}
    gltf = layered(layers, pbrMetallicRoughness={"metallicFactor": metallic}, extensions=extensions)
    notes = ", ".join(rf"{name} of materials\[0\]{where}" for name in layers)
    with pytest.warns(UserWarning, match=f"ignored: {notes}$"):
        materials = gltf.read(tmp_path).materials
    assert [material.coat for material in materials.values()] == coats
    assert [material.sheen_color[0] for material in materials.values()] == coats
    assert [material.iridescence for material in materials.values()] == coats


def test_a_metal_that_would_transmit_keeps_its_coat(tmp_path: Path) -> None:
    (made,) = lacquered(LACQUER, extensions=TRANSMITS).read(tmp_path).materials.values()
    assert made.coat == 0.75


LEAF: dict[str, Any] = {"diffuseTransmissionFactor": 0.75, "diffuseTransmissionColorFactor": [0.5, 1, 0]}
NO_METAL: dict[str, Any] = {"metallicFactor": 0}


def leaf(values: dict[str, Any], others: dict[str, Any] | None = None, **item: Any) -> Gltf:
    """A triangle that transmits diffusely, with other extensions."""
    layers = {"KHR_materials_diffuse_transmission": values} | (others or {})
    return layered(layers, **{"pbrMetallicRoughness": NO_METAL} | item)


def test_diffuse_transmission(tmp_path: Path) -> None:
    """Both textures are one image; light passes, so that the back of one that emits is no surface of its own."""
    maps = {"diffuseTransmissionColorTexture": {"index": 0}, "diffuseTransmissionTexture": {"index": 0}}
    model = leaf(LEAF | maps, doubleSided=True, emissiveFactor=[1, 1, 1]).read(tmp_path)
    (made,) = model.materials.values()
    assert (made.diffuse_transmission, made.diffuse_transmission_color) == (0.75, (0.5, 1, 0))
    color, factor = made.diffuse_transmission_color_texture, made.diffuse_transmission_texture
    assert color is not None
    assert factor is not None
    assert color.image is factor.image
    assert (factor.channel, color.image.color_space) == ("a", "srgb")
    assert made.double_sided
    assert len(model.mesh.parts) == 1


def test_half_of_what_transmits_diffusely_may_be_glass(tmp_path: Path) -> None:
    glass = {"KHR_materials_transmission": {"transmissionFactor": 0.5}}
    rest, pane = leaf(LEAF, glass).read(tmp_path).materials.values()
    assert (rest.diffuse_transmission, rest.blend_weight, pane.model) == (0.75, 0.5, "rough-thin-dielectric")


@pytest.mark.parametrize(
    ("values", "item"), [(LEAF | {"diffuseTransmissionFactor": 0}, {}), (LEAF, {"pbrMetallicRoughness": {}})]
)
def test_what_transmits_nothing_keeps_its_coat(tmp_path: Path, values: dict[str, Any], item: dict[str, Any]) -> None:
    """A factor of 0, or a metal."""
    (made,) = leaf(values, {"KHR_materials_clearcoat": LACQUER}, **item).read(tmp_path).materials.values()
    assert (made.diffuse_transmission, made.coat) == (0, 0.75)


@pytest.mark.parametrize(
    ("others", "notes", "factor"),
    [
        ({"KHR_materials_unlit": {}}, ["KHR_materials_diffuse_transmission of materials[0], which is unlit"], 0),
        (
            {
                "KHR_materials_clearcoat": LACQUER,
                "KHR_materials_sheen": VELVET,
                "KHR_materials_iridescence": {"iridescenceFactor": 1},
                "KHR_materials_volume": {"thicknessFactor": 1},
            },
            [
                "KHR_materials_volume of materials[0] where it transmits diffusely",
                "KHR_materials_clearcoat of materials[0], which transmits diffusely",
                "KHR_materials_sheen of materials[0], which transmits diffusely",
                "KHR_materials_iridescence of materials[0], which transmits diffusely",
            ],
            0.75,
        ),
    ],
)
def test_what_is_ignored_beside_diffuse_transmission(
    tmp_path: Path, others: dict[str, Any], notes: list[str], factor: float
) -> None:
    with pytest.warns(UserWarning, match=f"ignored: {re.escape(', '.join(notes))}$"):
        (made,) = leaf(LEAF, others).read(tmp_path).materials.values()
    assert (made.diffuse_transmission, made.coat, made.sheen_color) == (factor, 0, (0, 0, 0))


def test_emission_above_one_is_read(tmp_path: Path) -> None:
    gltf = Gltf(materials=[{"emissiveFactor": [7, 0, 2.5]}])
    gltf.triangle(material=0)
    assert gltf.read(tmp_path).materials["material 0"].emission == (7, 0, 2.5)


@pytest.mark.parametrize(("mode", "cutoff", "opacity"), [("MASK", 1, 1), ("MASK", 1.01, 0), ("BLEND", 2, 1)])
def test_an_alpha_cutoff_above_one_hides(tmp_path: Path, mode: str, cutoff: float, opacity: float) -> None:
    gltf = Gltf(materials=[{"alphaMode": mode, "alphaCutoff": cutoff}])
    gltf.triangle(material=0)
    material = gltf.read(tmp_path).materials["material 0"]
    assert (material.opacity, material.alpha_cutoff) == (opacity, 1)


@pytest.mark.parametrize("dispersion", [1e-38, 5e-324])
def test_next_to_no_dispersion(tmp_path: Path, dispersion: float) -> None:
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1},
        "KHR_materials_dispersion": {"dispersion": dispersion},
    }
    gltf = Gltf(materials=[{"pbrMetallicRoughness": NO_METAL, "extensions": extensions}])
    gltf.triangle(material=0)
    assert gltf.read(tmp_path).materials["material 0"].dispersion == pytest.approx(0, abs=1e-37)


@pytest.mark.parametrize("angle", [-20, -0.5, 20, 1e38])
def test_whole_turns_of_anisotropy_are_left_out(tmp_path: Path, angle: float) -> None:
    item = {"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": angle}}}
    gltf = Gltf(materials=[item])
    gltf.triangle(material=0)
    degrees = gltf.read(tmp_path).materials["material 0"].anisotropy_rotation_degrees
    assert abs(degrees) < 360
    turns = (angle - np.radians(degrees)) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-12)


HALF = np.sqrt(0.5)


def with_lights(lights: list[dict[str, Any]], nodes: list[dict[str, Any]]) -> Gltf:
    """A triangle, and ``lights``, each at the node of its number."""
    links = [{"extensions": {"KHR_lights_punctual": {"light": index}}} for index in range(len(lights))]
    gltf = Gltf(
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": lights}},
        nodes=[{"mesh": 0}, *(node | link for node, link in zip(nodes, links, strict=True))],
    )
    gltf.content["scenes"] = [{"nodes": list(range(len(nodes) + 1))}]
    gltf.triangle()
    return gltf


def test_cameras(tmp_path: Path) -> None:
    gltf = Gltf(
        cameras=[
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 1, "znear": 0}},
            {"type": "perspective", "perspective": {"yfov": np.pi / 4, "znear": 0.1}},
        ],
        nodes=[
            {"mesh": 0},
            {"camera": 0},
            {"camera": 1, "translation": [7, 0, 0], "rotation": [0, HALF, 0, HALF], "scale": [3, 3, 3]},
        ],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: orthographic cameras$"):
        model = gltf.read(tmp_path)
    [camera] = model.cameras
    assert camera.fov_degrees == pytest.approx(45)
    np.testing.assert_allclose(camera.position, [7, 0, 0])
    np.testing.assert_allclose(camera.target, [0.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(camera.up, [0, 3, 0], atol=1e-12)


@pytest.mark.parametrize("scale", [[1, 1, 1], [3, 3, 3], [1e-30, 2e-30, 3e-30], [1e30, 1, 5]])
def test_lights(tmp_path: Path, scale: list[float]) -> None:
    """The intensity of a spot light is on its axis; scale changes neither that nor the cone."""
    spot = {"innerConeAngle": np.pi / 12, "outerConeAngle": np.pi / 3}
    model = with_lights(
        [
            {"type": "point", "intensity": 3, "color": [1, 0.5, 0]},
            {"type": "directional", "intensity": 2, "color": [0.5, 1, 2]},
            {"type": "spot", "intensity": 5, "color": [1, 0, 0.5], "spot": spot},
            {"type": "spot"},
        ],
        [
            {"translation": [1, 2, 3], "scale": scale},
            {"translation": [9, 9, 9], "rotation": [-HALF, 0, 0, HALF], "scale": scale},
            {"translation": [4, 5, 6], "rotation": [0, HALF, 0, HALF], "scale": scale},
            {"scale": scale},
        ],
    ).read(tmp_path)
    [point], [sun], [turned, default] = model.lights, model.directional_lights, model.spot_lights
    assert (point.position, point.radius) == ((1, 2, 3), 0)
    np.testing.assert_allclose(point.intensity, [3, 1.5, 0])
    np.testing.assert_allclose(sun.direction, [0, -1, 0], atol=1e-12)
    assert sun.irradiance == (1, 2, 4)
    assert (turned.position, turned.intensity) == ((4, 5, 6), (5, 0, 2.5))
    np.testing.assert_allclose(turned.direction, [-1, 0, 0], atol=1e-12)
    assert (turned.inner_degrees, turned.outer_degrees) == pytest.approx((15, 60))
    assert (default.position, default.direction, default.intensity) == ((0, 0, 0), (0, 0, -1), (1, 1, 1))
    assert (default.inner_degrees, default.outer_degrees) == pytest.approx((0, 45))


def test_lights_below_scaled_nodes(tmp_path: Path) -> None:
    gltf = with_lights([{"type": "spot"}], [{"translation": [1, 0, 0]}])
    gltf.content["nodes"].append({"children": [1], "rotation": [0, HALF, 0, HALF], "scale": [2, 2, 2]})
    gltf.content["scenes"] = [{"nodes": [0, 2]}]
    [spot] = gltf.read(tmp_path).spot_lights
    np.testing.assert_allclose(spot.position, [0, 0, -2], atol=1e-12)
    np.testing.assert_allclose(spot.direction, [-1, 0, 0], atol=1e-12)
    assert spot.intensity == (1, 1, 1)


@pytest.mark.parametrize(
    ("cone", "degrees"),
    [
        ({"innerConeAngle": 0.5, "outerConeAngle": 0.5}, (28.619, 28.648)),
        ({"innerConeAngle": 1.0, "outerConeAngle": 0.5}, (28.619, 28.648)),
        ({"outerConeAngle": 1.5707964}, (0, 90)),
        ({"outerConeAngle": 1e-5}, (0, 0.001)),
    ],
)
def test_cones_at_their_limits(tmp_path: Path, cone: dict[str, float], degrees: tuple[float, float]) -> None:
    """Exporters write a hard edge as two equal angles, and π/2 rounded up; of others, none is too narrow."""
    [spot] = with_lights([{"type": "spot", "spot": cone}], [{}]).read(tmp_path).spot_lights
    assert (spot.inner_degrees, spot.outer_degrees) == pytest.approx(degrees, rel=1e-4)


def test_what_of_lights_is_ignored(tmp_path: Path) -> None:
    gltf = with_lights(
        [{"type": "point", "range": 10}, {"type": "spot", "range": 10}, {"type": "directional"}],
        [{}, {}, {"scale": [1, 1, 0]}],
    )
    with pytest.warns(UserWarning, match="ignored") as caught:
        model = gltf.read(tmp_path)
    [warning] = caught
    assert str(warning.message).endswith(
        "ignored: the range of lights, the light of nodes[3] (its scale of 0 leaves it no direction)"
    )
    assert (len(model.lights), len(model.spot_lights), len(model.directional_lights)) == (1, 1, 0)


@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_a_model_with_a_light_gets_no_others(tmp_path: Path, kind: str) -> None:
    scene = load(with_lights([{"type": kind}], [{}]).write(tmp_path / "x.gltf"))
    assert [len(scene.lights), len(scene.spot_lights), len(scene.directional_lights)] == [
        int(kind == other) for other in ("point", "spot", "directional")
    ]
    assert not any(scene.ambient.radiance)
    save(scene, tmp_path / "x.toml")
    assert load(tmp_path / "x.toml") == scene


@pytest.mark.parametrize(
    ("aspect", "size"),
    [(None, (640, 480)), (1, (480, 480)), (16 / 9, (640, 360)), (0.5, (240, 480)), (1e30, (640, 1)), (1e-30, (1, 480))],
)
def test_the_picture_has_the_shape_that_the_first_camera_gives_it(
    tmp_path: Path, aspect: float | None, size: tuple[int, int]
) -> None:
    perspectives = [{"yfov": 1.0, "znear": 0.1}, {"yfov": 1.0, "znear": 0.1, "aspectRatio": 3}]
    if aspect is not None:
        perspectives[0]["aspectRatio"] = aspect
    gltf = Gltf(
        cameras=[{"type": "perspective", "perspective": item} for item in perspectives],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}, {"camera": 1, "translation": [0, 0, 5]}],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: cameras after the first$"):
        scene = load(gltf.write(tmp_path / "x.glb"))
    assert scene.camera.position == (0, 0, 3)
    assert (scene.render.width, scene.render.height) == size


def test_what_is_not_shown_is_listed(tmp_path: Path) -> None:
    gltf = Gltf(
        extensionsUsed=["KHR_materials_unlit", "KHR_materials_variants", "KHR_xmp_json_ld"],
        animations=[{}],
        nodes=[{"mesh": 0}],
        scenes=[{"nodes": [0]}, {"nodes": []}],
        images=[{"uri": "none.png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    weights = gltf.array([[1, 0, 0, 0]] * 3)
    gltf.triangle(material=0, targets=[{"COLOR_1": weights}], attributes={"COLOR_1": weights, "_ID": weights})
    gltf.content["meshes"][0]["weights"] = [1]
    gltf.content["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 1})
    with pytest.warns(UserWarning, match="ignored") as caught:
        model = gltf.read(tmp_path)
    assert len(caught) == 1
    assert str(caught[0].message).endswith(
        "x.gltf: ignored: KHR_materials_variants, KHR_xmp_json_ld, animations (none is chosen), scenes but one, "
        "COLOR_1, _ID, COLOR_1 of morph targets, "
        "images[0]: none.png: no such file, points and lines"
    )
    assert model.materials["material 0"].albedo_texture is None
