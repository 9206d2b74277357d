# SPDX-License-Identifier: MIT
"""Materials of glTF files: coats, sheens, thin films and diffuse transmission."""

import re
from pathlib import Path
from typing import Any

import pytest

from .data import PNG, Gltf

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
