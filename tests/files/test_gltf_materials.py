# SPDX-License-Identifier: MIT
"""Materials of glTF files: what they reflect, transmit and emit."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from fragtracer.io import qualified
from fragtracer.scene import Texture

from .data import PNG, TRIANGLE, Gltf


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
