# SPDX-License-Identifier: MIT
"""material/: what textures make of a material is what scene/material.py makes of the same values."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from fragtracer.packing.materials import mean_emission
from fragtracer.packing.records import BsdfModel
from fragtracer.scene import Image, Material, Texture
from fragtracer.scene.reflectance import METAL_F0

from . import Floats
from .texture_oracle import lookup
from .texture_probe import material_probe, packed_materials

RNG = np.random.default_rng(3)


def constant(*values: float, channel: str = "r") -> Texture:
    return Texture(Image(np.array(values, np.float32).reshape(1, 1, -1), "linear"), channel=channel)


BODY = """
    Material m = material_at(surface);
    diffuse = m.diffuse; alpha = m.alpha; f0 = m.f0; f90 = m.f90; emission = m.emission;"""
OUTPUTS = {"diffuse": 3, "alpha": 1, "f0": 3, "f90": 3, "emission": 3}


def run(
    ctx: moderngl.Context,
    materials: Sequence[Material],
    index: Floats,
    uv: Floats | None = None,
    colors: Floats | None = None,
) -> dict[str, Floats]:
    """The material ``index`` at coordinates of both sets (n, 4), where vertices have ``colors`` (n, 3)."""
    inputs = {"index": index, "uv": np.zeros((len(index), 4)) if uv is None else uv}
    if colors is not None:
        inputs["color"] = np.column_stack([colors, np.ones(len(index))])
    return material_probe(ctx, packed_materials(materials, colors is not None), BODY, inputs, OUTPUTS)


def triple(low: float = 0.0, high: float = 1.0) -> tuple[float, float, float]:
    r, g, b = RNG.uniform(low, high, 3).tolist()
    return (r, g, b)


def random_material() -> tuple[Material, Material, tuple[float, float, float]]:
    """A material with textures, one without that has their product at once, and the colour of the vertex."""
    plain = Material(
        albedo=triple(0, RNG.choice([1.0, 0.02])),
        roughness=float(RNG.random()),
        metallic=float(RNG.choice([0.0, 1.0, RNG.random()])),
        specular=float(RNG.random()),
        emission=triple(0, 5),
        **[{"ior": 1.8}, {"f0": triple(0, 0.1)}, {"ior": 1.05}, {}][RNG.integers(4)],
    )
    by = triple(0, 1.5)
    color = triple()
    roughness, metallic, emission = float(RNG.uniform(0, 1.5)), float(RNG.random()), triple(0, 2)
    textured = replace(
        plain,
        albedo_texture=constant(*by),
        roughness_texture=constant(0.1, roughness, 0.3, channel="g"),
        metallic_texture=constant(0.1, 0.2, metallic, channel="b"),
        emission_texture=constant(*emission),
    )
    product = replace(
        plain,
        albedo=tuple(np.minimum(1, np.prod([plain.albedo, by, color], axis=0)).tolist()),
        roughness=min(1.0, plain.roughness * roughness),
        metallic=plain.metallic * metallic,
        emission=tuple(np.multiply(plain.emission, emission).tolist()),
    )
    return textured, product, color


def expect(found: Mapping[str, Floats], materials: Sequence[Material]) -> None:
    names = {"diffuse": "diffuse_albedo", "alpha": "alpha", "f0": "specular_f0", "f90": "specular_f90"}
    for name, attribute in {**names, "emission": "emission"}.items():
        expected = [getattr(m, attribute) for m in materials]
        np.testing.assert_allclose(found[name], expected, rtol=3e-6, atol=1e-7, err_msg=name)


def test_textures_multiply_the_constant_values(ctx: moderngl.Context) -> None:
    textured, products, colors = zip(*(random_material() for _ in range(40)), strict=True)
    expect(run(ctx, textured, np.arange(len(textured)), colors=np.array(colors)), products)


@pytest.mark.parametrize("colored", [True, False])
def test_without_textures_nothing_changes(ctx: moderngl.Context, colored: bool) -> None:
    """Where the values are those of the maps, and where a scene has none."""
    materials = [random_material()[1] for _ in range(20)] + [Material(metal=name) for name in METAL_F0]
    index = np.arange(len(materials))
    expect(run(ctx, materials, index, colors=np.ones((len(index), 3)) if colored else None), materials)


def test_each_map_at_its_own_coordinates(ctx: moderngl.Context) -> None:
    """All maps vary, with their own transforms and sets."""
    images = [Image(RNG.integers(0, 256, (4, 5, 3), np.uint8), space) for space in ("srgb", "linear", "srgb")]
    material = Material(
        albedo=0.8,
        albedo_texture=Texture(images[0], scale=(2.0, 2.0)),
        roughness=0.9,
        roughness_texture=Texture(images[1], channel="g", coordinates=1),
        metallic=0.7,
        metallic_texture=Texture(images[1], channel="b", wrap_u="clamp"),
        emission=2.0,
        emission_texture=Texture(images[2], offset=(0.2, 0.1), coordinates=1),
    )
    uv = RNG.uniform(-1, 2, (100, 4)).astype(np.float32)
    found = run(ctx, [material], np.zeros(100), uv)
    sets = (uv[:, :2].astype(np.float64), uv[:, 2:].astype(np.float64))
    values = {
        name: lookup(texture, sets[texture.coordinates])
        for name in ("albedo", "roughness", "metallic", "emission")
        if (texture := getattr(material, f"{name}_texture"))
    }
    expected = [
        Material(
            albedo=tuple(0.8 * values["albedo"][i, :3]),
            roughness=0.9 * values["roughness"][i, 1],
            metallic=0.7 * values["metallic"][i, 2],
            emission=tuple(2.0 * values["emission"][i, :3]),
        )
        for i in range(100)
    ]
    for name, attribute in (("diffuse", "diffuse_albedo"), ("f0", "specular_f0"), ("emission", "emission")):
        np.testing.assert_allclose(found[name], [getattr(m, attribute) for m in expected], atol=3e-5)


@pytest.mark.parametrize(
    ("materials", "models"),
    [
        ([Material(specular=0.0)], {BsdfModel.DIFFUSE}),
        ([Material(specular=0.0), Material()], {BsdfModel.COOK_TORRANCE}),
        ([Material(model="rough-plastic", roughness=0.0)], {BsdfModel.PLASTIC}),
        ([Material(model="rough-plastic", roughness=0.3)], {BsdfModel.ROUGH_PLASTIC}),
        (
            [Material(specular=0.0), Material(model="conductor", metal="gold"), Material(model="thin-dielectric")],
            {BsdfModel.DIFFUSE, BsdfModel.CONDUCTOR, BsdfModel.THIN_DIELECTRIC},
        ),
    ],
    ids=["matte", "matte and plastic", "smooth coat", "rough coat", "three"],
)
def test_models_that_no_material_has_are_absent(materials: Sequence[Material], models: set[BsdfModel]) -> None:
    absent = packed_materials(materials).flags["u_absent_models"]
    assert {model for model in BsdfModel if not absent >> model & 1} == models


@pytest.mark.parametrize("both", [True, False])
def test_one_lookup_for_two_channels(ctx: moderngl.Context, both: bool) -> None:
    """Roughness and metallic in one image; with another material that has them apart, in two lookups."""
    image = Image(RNG.integers(0, 256, (4, 5, 3), np.uint8), "linear")
    rough, metal = Texture(image, channel="g"), Texture(image, channel="b")
    apart = Material(metallic=1.0, metallic_texture=metal)
    one = Material(roughness=0.8, metallic=0.9, roughness_texture=rough, metallic_texture=metal)
    materials = [one, Material()] if both else [one, apart]
    # TEXTURE_METALLIC: some metallic is looked up by itself.
    assert bool(packed_materials(materials).flags["u_texture_uses"] & 4) != both
    uv = RNG.uniform(-1, 2, (50, 4)).astype(np.float32)
    found = run(ctx, materials, np.zeros(50), uv)
    values = lookup(rough, uv[:, :2].astype(np.float64))
    np.testing.assert_allclose(found["alpha"], (0.8 * values[:, 1]) ** 2, atol=1e-5)
    np.testing.assert_allclose(found["diffuse"][:, 0], 0.5 * (1 - 0.9 * values[:, 2]), atol=1e-5)


def test_unlit_shows_its_albedo(ctx: moderngl.Context) -> None:
    material = Material(albedo=(0.5, 0.6, 0.7), emission=3.0, unlit=True, albedo_texture=constant(0.5, 0.5, 1.0))
    assert not material.is_emissive
    found = run(ctx, [material], np.zeros(1), colors=np.array([(1, 1, 0.5)]))
    np.testing.assert_allclose(found["emission"], [(0.25, 0.3, 0.35)], rtol=1e-6)
    assert not found["diffuse"].any()
    assert not found["f0"].any()
    assert not found["f90"].any()


def test_sheen_at_a_point(ctx: moderngl.Context) -> None:
    """Its textures multiply it, its roughness is bounded, and other materials have none."""
    sheen = Material(sheen_color=(0.8, 0.4, 0.2), sheen_roughness=0.9)
    maps = {
        "sheen_color_texture": constant(0.5, 0.25, 1, 0.3),
        "sheen_roughness_texture": constant(1, 1, 1, 0.5, channel="a"),
    }
    materials = [sheen, replace(sheen, **maps), replace(sheen, **maps, sheen_roughness=0.1), Material(coat=0.5)]
    body = "Bsdf b = material_bsdf(material_at(surface), true); material_set_sheen(b, surface);"
    body += "value = vec4(b.sheen_color, b.sheen_roughness);"
    inputs = {"index": np.arange(4), "uv": np.zeros((4, 4))}
    found = material_probe(ctx, packed_materials(materials), body, inputs, {"value": 4})["value"]
    expected = [(0.8, 0.4, 0.2, 0.9), (0.4, 0.1, 0.2, 0.45), (0.4, 0.1, 0.2, 0.1), (0, 0, 0, 0.1)]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_film_at_a_point(ctx: moderngl.Context) -> None:
    """A texture multiplies its weight, another one says how thick it is between two values; others have none."""
    film = Material(iridescence=0.8, iridescence_ior=1.5, iridescence_thickness=300, iridescence_thickness_minimum=200)
    weight, thickness = constant(0.5, 1, 1, 1), constant(1, 0.25, 1, 1, channel="g")
    maps = {"iridescence_texture": weight, "iridescence_thickness_texture": thickness}
    materials = [film, replace(film, **maps), Material(coat=0.5)]
    body = "Bsdf b = material_bsdf(material_at(surface), true); material_set_iridescence(b, surface);"
    body += "value = vec3(b.iridescence, b.iridescence_ior, b.iridescence_thickness);"
    inputs = {"index": np.arange(3), "uv": np.zeros((3, 4))}
    found = material_probe(ctx, packed_materials(materials), body, inputs, {"value": 3})["value"]
    np.testing.assert_allclose(found, [(0.8, 1.5, 300), (0.4, 1.5, 225), (0, 1.3, 400)], rtol=1e-6)


def test_diffuse_transmission_at_a_point(ctx: moderngl.Context) -> None:
    """Its textures multiply it, a metal has no base that could transmit, and the base reflects the rest."""
    leaf = Material(albedo=0.5, diffuse_transmission=0.8, diffuse_transmission_color=(1.0, 0.5, 0.25))
    factor = {"diffuse_transmission_texture": constant(1, 1, 1, 0.5, channel="a")}
    color = {"diffuse_transmission_color_texture": constant(0.5, 0.5, 1)}
    metal = {"metallic": 0.5, "metallic_texture": constant(0, 0, 0.5, channel="b")}
    materials = [
        replace(leaf, **maps) for maps in ({}, factor, color, metal, {"metallic": 0.75}, factor | color | metal)
    ]
    body = """Material material = material_at(surface); Bsdf b = material_bsdf(material, true);
        material_set_translucency(b, surface, translucency_load(material.record));
        value = vec4(b.transmitted, b.diffuse.x);"""
    inputs = {"index": np.arange(len(materials)), "uv": np.zeros((len(materials), 4))}
    found = material_probe(ctx, packed_materials(materials), body, inputs, {"value": 4})["value"]
    expected = [
        *[(0.8, 0.4, 0.2, 0.1), (0.4, 0.2, 0.1, 0.3), (0.4, 0.2, 0.2, 0.1), (0.6, 0.3, 0.15, 0.075)],
        *[(0.2, 0.1, 0.05, 0.025), (0.15, 0.075, 0.075, 0.225)],
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("scale", [1.0, 0.5, -2.0, 0.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_mapped_normal(ctx: moderngl.Context, scale: float, sign: float) -> None:
    """Of a surface, and of a coat that has a map of its own."""
    count = 200
    local = RNG.normal(size=(count, 3))
    local[:, 2] = np.abs(local[:, 2])
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    image = Image(((local + 1) / 2).astype(np.float32)[None], "linear")
    normal = RNG.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = RNG.normal(size=(count, 3))
    uv = np.stack([(np.arange(count) + 0.5) / count, np.full(count, 0.5)] * 2, axis=1)
    tangents = np.column_stack([tangent, np.full(count, sign)])
    texture = Texture(image, filter="nearest")
    found = material_probe(
        ctx,
        packed_materials(
            [
                Material(normal_texture=texture, normal_scale=scale),
                Material(coat=1.0, coat_normal_texture=texture, coat_normal_scale=scale),
            ]
        ),
        "Material material = material_at(surface); value = surface.mapped_normal;"
        "if (index == 1) value = material_coat_normal(surface, clear_coat_load(material.record));",
        {
            "index": np.repeat([0, 1], count),
            "normal": np.tile(normal, (2, 1)),
            "uv": np.tile(uv, (2, 1)),
            "tangent": np.tile(tangents, (2, 1)),
        },
        {"value": 3},
    )["value"]
    along = tangent - normal * (normal * tangent).sum(axis=1, keepdims=True)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    x, y, z = (local * (scale, scale, 1))[:, :, None].transpose(1, 0, 2)
    expected = x * along + y * sign * np.cross(normal, along) + z * normal
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(found, np.tile(expected, (2, 1)), atol=1e-5)


def test_without_a_tangent_or_a_map_the_normal_stays(ctx: moderngl.Context) -> None:
    mapped = Material(normal_texture=constant(1.0, 0.5, 0.5))
    found = material_probe(
        ctx,
        packed_materials([mapped, Material()]),
        "material_at(surface); value = surface.mapped_normal;",
        {"index": [0, 0, 0, 1], "tangent": [(1, 0, 0, 1), (0, 0, 0, 0), (0, 0, 1, 1), (1, 0, 0, 1)]},
        {"value": 3},
    )["value"]
    np.testing.assert_allclose(found, [(1, 0, 0), (0, 0, 1), (0, 0, 1), (0, 0, 1)], atol=1e-6)


def test_opacity(ctx: moderngl.Context) -> None:
    half = Texture(Image(np.array([[[255, 255, 255, 128]]], np.uint8)))
    materials = [
        Material(opacity=0.5),
        Material(opacity=0.5, alpha_mode="blend"),
        Material(opacity=0.5, alpha_mode="blend", albedo_texture=half),
        Material(opacity=0.9, alpha_mode="mask", albedo_texture=half, alpha_cutoff=0.5),
        Material(alpha_mode="mask", albedo_texture=half, alpha_cutoff=0.5),
        Material(opacity=0.5, alpha_mode="mask", alpha_cutoff=0.5),
        Material(alpha_mode="mask", alpha_cutoff=1.0),
        Material(alpha_mode="mask", alpha_cutoff=1.0),
    ]
    alpha = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1 - 2**-21, 1 - 1e-5])  # 2^-21 is lost by interpolation
    colors = np.column_stack([np.ones((8, 3)), alpha])
    packed = packed_materials(materials, colored=True)
    inputs = {"index": np.arange(8), "color": colors}
    found = material_probe(ctx, packed, "value = material_opacity(surface);", inputs, {"value": 1})["value"]
    np.testing.assert_allclose(found, [1, 0.25, 0.25 * 128 / 255, 0, 1, 1, 1, 0], rtol=1e-6)


@pytest.mark.parametrize("strength", [1.0, 0.4, 0.0])
def test_occlusion(ctx: moderngl.Context, strength: float) -> None:
    """Its one channel, as far as the strength lets it; of a material without a map, nothing."""
    open_share = constant(0.1, 0.3, 0.9, channel="g")
    materials = [Material(occlusion_texture=open_share, occlusion_strength=strength), Material()]
    body = "value = material_occlusion(surface);"
    found = material_probe(ctx, packed_materials(materials), body, {"index": [0, 1]}, {"value": 1})["value"]
    np.testing.assert_allclose(found, [1 - strength * 0.7, 1], rtol=1e-6)


def test_mean_emission() -> None:
    image = Image(np.array([[[0, 0, 0], [255, 255, 188]]], np.uint8))
    material = Material(emission=(2.0, 4.0, 6.0), emission_texture=Texture(image))
    np.testing.assert_allclose(mean_emission(material), (1, 2, 3 * 0.5029), rtol=1e-3)
    assert mean_emission(Material(emission=3.0)) == (3.0, 3.0, 3.0)
