# SPDX-License-Identifier: MIT
"""Textures in scene files: read with what is said about them, written as they were, mistakes named."""

from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from fragtracer.errors import SceneError
from fragtracer.io.images import write_image
from fragtracer.io.toml import load, save
from fragtracer.scene import Sphere, Texture
from fragtracer.scene.material import TEXTURED

SPHERE = '[[sphere]]\ncenter = [0, 1, 2]\nradius = 1\nmaterial = "red"\n'
MESH = '[[mesh]]\nfile = "mesh.obj"\nmaterial = "red"\n'
PIXELS = np.random.default_rng(1).integers(0, 256, (3, 5, 4)).astype(np.uint8)


def write(folder: Path, lines: str, shape: str = MESH) -> Path:
    (folder / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    (folder / "maps").mkdir(exist_ok=True)
    PIL.Image.fromarray(PIXELS).save(folder / "maps" / "wood.png")
    PIL.Image.fromarray(PIXELS[..., 0]).save(folder / "maps" / "grey.png")
    PIL.Image.fromarray(PIXELS[..., 0].astype(np.uint16) * 257).save(folder / "maps" / "deep.png")
    write_image(folder / "maps" / "sky.exr", PIXELS[..., :3] / np.float32(7))
    (folder / "maps" / "broken.png").write_bytes((folder / "maps" / "wood.png").read_bytes()[:50])
    (folder / "maps" / "text.png").write_text("no picture")
    (folder / "scene.toml").write_text(f"{shape}[material.red]\n{lines}")
    return folder / "scene.toml"


def test_pixels_and_color_spaces(tmp_path: Path) -> None:
    text = 'albedo_texture = "maps/wood.png"\nroughness_texture = "maps/grey.png"\nemission_texture = "maps/sky.exr"\n'
    material = load(write(tmp_path, text + 'metallic_texture = "maps/deep.png"')).materials["red"]
    np.testing.assert_array_equal(material.albedo_texture.image.pixels, PIXELS)
    assert material.albedo_texture.image.color_space == "srgb"
    np.testing.assert_array_equal(material.roughness_texture.image.pixels, PIXELS[..., :1])
    assert material.roughness_texture.image.color_space == "linear"
    assert material.emission_texture.image.pixels.dtype == np.float32
    assert material.emission_texture.image.color_space == "linear"
    np.testing.assert_allclose(material.metallic_texture.image.pixels[..., 0], PIXELS[..., 0] / 255, rtol=1e-6)


def test_what_is_a_colour_is_in_srgb(tmp_path: Path) -> None:
    """Of 8 bits, unless the file says otherwise."""
    colors = {"albedo", "emission", "sheen_color", "diffuse_transmission_color"}
    keys = [name for name in TEXTURED if name not in ("transmittance", "blend_weight")]
    scene = load(write(tmp_path, "".join(f'{key}_texture = "maps/wood.png"\n' for key in keys)))
    material = scene.materials["red"]
    assert {key for key in keys if getattr(material, f"{key}_texture").image.color_space == "srgb"} == colors


def test_every_key_survives_the_trip(tmp_path: Path) -> None:
    table = (
        '{ file = "maps/wood.png", color_space = "linear", wrap_u = "clamp", wrap_v = "mirror", filter = "nearest", '
        'offset = [0.5, 1], rotation = 1, scale = [2, 3.5], coordinates = 1, channel = "b" }'
    )
    rest = 'normal_scale = -2\nalpha_mode = "mask"\nalpha_cutoff = 0.25\nopacity = 0.5\ndouble_sided = false\n'
    rest += 'coat_texture = "maps/grey.png"\ncoat_roughness_texture = { file = "maps/wood.png", channel = "g" }\n'
    rest += 'coat_normal_texture = "maps/grey.png"\ncoat_normal_scale = 2.0\n'
    rest += (
        'sheen_color_texture = "maps/wood.png"\nsheen_roughness_texture = { file = "maps/wood.png", channel = "a" }\n'
        'iridescence_texture = "maps/grey.png"\niridescence_thickness_texture = "maps/grey.png"\n'
        "iridescence_thickness_minimum = 50.0\n"
    )
    rest += 'diffuse_transmission_texture = { file = "maps/wood.png", channel = "a" }\n'
    rest += 'diffuse_transmission_color_texture = "maps/wood.png"\n'
    scene = load(write(tmp_path, f'albedo_texture = {table}\nnormal_texture = "maps/wood.png"\nunlit = true\n{rest}'))
    texture = scene.materials["red"].albedo_texture
    assert isinstance(texture, Texture)
    assert (texture.wrap_u, texture.wrap_v, texture.filter, texture.channel) == ("clamp", "mirror", "nearest", "b")
    assert (texture.offset, texture.rotation, texture.scale) == ((0.5, 1), 1, (2, 3.5))
    (tmp_path / "other").mkdir()
    save(scene, tmp_path / "other" / "scene.toml")
    assert load(tmp_path / "other" / "scene.toml") == scene
    assert '"../maps/wood.png"' in (tmp_path / "other" / "scene.toml").read_text()


def test_textures_that_nothing_shows(tmp_path: Path) -> None:
    """A material of meshes and other shapes is silent: it has its textures on the meshes."""
    text = 'albedo_texture = "maps/wood.png"\nroughness_texture = "maps/grey.png"\n'
    load(write(tmp_path, text, MESH + SPHERE))
    message = r"scene\.toml: material\.red: ignored: albedo_texture, roughness_texture; only meshes have texture coor"
    with pytest.warns(UserWarning, match=message):
        load(write(tmp_path, text, SPHERE))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("3", 'must be the name of an image file or a table { file = "…" }, got 3'),
        ("{ wrap_u = 3 }", ".file: is missing; name an image file"),
        ("{ file = 3 }", ".file: must be a text in quotes, got 3"),
        ('"none.png"', "none.png: cannot read this texture: No such file"),
        ('"maps/text.png"', "text.png: cannot read this texture: it is none of"),
        ('"maps/broken.png"', "broken.png: cannot read this texture: image file is trunc"),
        ('"scene.toml"', "scene.toml: cannot read this texture: it is none of"),
        ('{ file = "maps/wood.png", wrap = 3 }', ".wrap: there is no such key; did you mean wrap_u? choose from"),
        ('{ file = "maps/wood.png", image = 3 }', ".image: there is no such key"),
        ('{ file = "maps/wood.png", wrap_u = 3 }', '.wrap_u: must be one of "repeat", "mirror", "clamp", got 3'),
        ('{ file = "maps/wood.png", scale = 3 }', ".scale: must be two numbers [u, v], got 3"),
        ('{ file = "maps/wood.png", scale = [3, "a"] }', '.scale[1]: must be a number, got "a"'),
        ('{ file = "maps/wood.png", color_space = "aces" }', '.color_space: must be one of "srgb", "linear", got "ac'),
    ],
)
def test_mistakes_are_named(tmp_path: Path, value: str, message: str) -> None:
    with pytest.raises(SceneError) as raised:
        load(write(tmp_path, f"albedo_texture = {value}"))
    [line] = str(raised.value).splitlines()
    assert "scene.toml: material.red.albedo_texture" in line
    assert message in line


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            'model = "plastic"\ncoat_normal_texture = "maps/wood.png"',
            "coat_normal_texture means nothing to model = 'plastic'; leave it out",
        ),
        (
            'coat = 1\nnormal_texture = "maps/wood.png"\n'
            'coat_normal_texture = { file = "maps/wood.png", coordinates = 1 }',
            "normal_texture and coat_normal_texture must have the same coordinates, which the tangents follow",
        ),
    ],
    ids=["of a plastic", "by other coordinates"],
)
def test_normal_maps_that_cannot_be(tmp_path: Path, keys: str, message: str) -> None:
    with pytest.raises(SceneError, match=f"material.red: {message}"):
        load(write(tmp_path, keys))


@pytest.mark.parametrize("value", [10**400, -(10**400), 1e39, float("nan"), True])
def test_numbers_that_the_shader_cannot_hold_are_refused_from_python(value: float) -> None:
    with pytest.raises(ValueError, match="validation error"):
        Sphere((0, value, 0), 1, "red")
    with pytest.raises(ValueError, match="validation error"):
        Sphere((0, 0, 0), value, "red")


def test_numbers_of_numpy_are_numbers() -> None:
    assert Sphere(np.arange(3, dtype=np.float32), np.float32(2), "red") == Sphere((0, 1, 2), 2.0, "red")
