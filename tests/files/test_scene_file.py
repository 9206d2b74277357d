# SPDX-License-Identifier: MIT
"""Scene files: every scene survives a trip, and the bundled ones are what they say."""

import dataclasses
import re
from pathlib import Path
from typing import get_args

import pytest
from scene_builders import RED, SPHERE

from fragtracer.errors import OutputError
from fragtracer.io.toml import bundled, dump, load, meshes, parse, save, tables, textures
from fragtracer.resources import folder
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Disk,
    Environment,
    Fog,
    Gradient,
    Light,
    Material,
    Medium,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sky,
    Sphere,
    SpotLight,
    Triangle,
)
from fragtracer.scene.reflectance import DIELECTRIC_F0, METAL_F0, METAL_INDEX

BUNDLED = sorted(path.stem for path in folder("scenes").glob("*.toml"))
TABLES = (Camera, RenderSettings, Ambient, Fog, Medium, Environment, Gradient, Sky)
LIGHTS = (Light, SpotLight, DirectionalLight)
MODEL = (*TABLES, Material, *LIGHTS, Sphere, Plane, Rectangle, Disk, Triangle)
FULL = Scene(
    camera=Camera((1, 2, 3), (0.1, 0.2, 0.3), (0, 0, 1), 33.3, 0.01, 2.5),
    materials={
        "plain": Material(),
        'odd "name" [\n,é': Material(albedo=(0.1, 1 / 3, 1e-20), roughness=0, metallic=0.25, ior=1.33, specular=0.5),
        "shining": Material(f0=(0.1, 0.2, 0.3), emission=(1e10, 2, 3)),
        "metal": Material(metal="copper", roughness=1),
        "lacquer": Material(coat=0.5, coat_roughness=0.25, coat_ior=1.7),
        "soap": Material(iridescence=0.5, iridescence_ior=1.33, iridescence_thickness=300.0),
        "velvet": Material(sheen_color=(0.5, 0.25, 0.1), sheen_roughness=0.75),
        "leaf": Material(diffuse_transmission=0.5, diffuse_transmission_color=(0.5, 0.75, 0.1)),
    },
    spheres=(Sphere((0, 0, 0), 1e-3, "plain"), Sphere((1e6, -0.0, 0), 1, "metal")),
    rectangles=(Rectangle((0, 0, 0), (0, 2, 0), (3, 0, 0), "shining"),),
    disks=(Disk((0, 1, 0), (0, 0, -2), 0.25, "metal"), Disk((0, 2, 0), (1e-3, 0, 0), 1e6, "shining")),
    triangles=(Triangle(((0, 0, 0), (1, 0, 0), (0, 1, 0)), 'odd "name" [\n,é'),),
    lights=(Light((0, 1, 0), power=(1, 2, 3)), Light((0, 1, 0), 0.5, radiance=(1, 0, 0))),
    spot_lights=(
        SpotLight((0, 3, 0), (0, -5, 1e-3), (4, 5, 6), 12.5, 90),
        SpotLight((1, 3, 0), (0, -1, 0), (0.1, 0, 0)),
    ),
    directional_lights=(DirectionalLight((1, -1, 0), (1 / 3, 2, 3)),),
    ambient=Ambient((0.1, 0.2, 0.3)),
    render=RenderSettings(
        *(100, 50, 7, 3, 2, 4, False, 9, "karis", False, "nee", "hash", "tent"),
        adaptive="off",
        seed=2**32 - 1,
        integrator="split-sum",
        background="prefiltered",
        background_roughness=0.5,
        guiding="on",
        light_tracing="off",
        gradient_domain="on",
    ),
    description="odd: [\n 1,\n ]\t\"'\\ é,\n]",
)


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_scenes_survive_the_trip(name: str) -> None:
    scene = load(name)
    assert scene.name == name
    assert scene.description == bundled()[name]
    assert parse(dump(scene), f"{name}.toml") == scene


def test_every_field_survives_the_trip() -> None:
    defaults = {Camera: FULL.camera, Ambient: FULL.ambient, RenderSettings: FULL.render}
    for cls, item in defaults.items():
        missed = {f.name for f in dataclasses.fields(cls) if getattr(item, f.name) == f.default}
        assert not missed - {"multiple_scattering"}  # which goes with the default geometry only
    assert parse(dump(FULL)) == FULL
    other = dataclasses.replace(FULL, render=RenderSettings(multiple_scattering=True))
    assert parse(dump(other)) == other


def test_what_has_its_default_is_left_out() -> None:
    scene = Scene(lights=(Light((0, 1, 0), power=(1, 2, 3)),), camera=Camera(fov_degrees=30))
    assert dump(scene) == (
        "[camera]\nfov_degrees = 30.0\n\n[[light]]\nposition = [0.0, 1.0, 0.0]\npower = [1.0, 2.0, 3.0]\n"
    )
    assert parse(dump(scene)) == scene


def test_spot_and_directional_lights_and_disks() -> None:
    made = parse(
        "[[spot_light]]\nposition = [0, 3, 0]\ndirection = [0, -2, 0]\nintensity = 4\nouter_degrees = 30\n"
        "[[directional_light]]\ndirection = [1, -1, 0]\nirradiance = [1, 2, 3]\n"
        f'[[disk]]\ncenter = [0, 1, 2]\nnormal = [0, 1, 0]\nradius = 2\nmaterial = "red"\n{RED}'
    )
    assert made.spot_lights == (SpotLight((0, 3, 0), (0, -2, 0), (4, 4, 4), 0, 30),)
    assert made.directional_lights == (DirectionalLight((1, -1, 0), (1, 2, 3)),)
    assert made.disks == (Disk((0, 1, 2), (0, 1, 0), 2, "red"),)


def test_f0_by_name() -> None:
    for name, f0 in DIELECTRIC_F0.items():
        assert parse(f'{SPHERE}{RED}f0 = "{name}"').materials["red"].specular_f0 == (f0,) * 3
    for name in METAL_F0:
        assert parse(f'{SPHERE}{RED}metal = "{name}"').materials["red"].specular_f0 == METAL_F0[name]


def test_save_and_load(tmp_path: Path) -> None:
    save(FULL, tmp_path / "my scene.toml")
    assert load(tmp_path / "my scene.toml") == dataclasses.replace(FULL, name="my scene")
    assert load(str(tmp_path / "my scene.toml")).name == "my scene"
    with pytest.raises(OutputError, match=r"cannot write .json; choose from .toml"):
        save(FULL, tmp_path / "scene.json")
    with pytest.raises(OutputError, match="there is no folder"):
        save(FULL, tmp_path / "none" / "scene.toml")


@pytest.mark.parametrize("encode", [lambda t: t.encode("utf-8-sig"), lambda t: t.replace("\n", "\r\n").encode()])
def test_files_of_windows_editors(tmp_path: Path, encode: object) -> None:
    (tmp_path / "x.toml").write_bytes(encode(SPHERE + RED))  # type: ignore[operator]
    assert load(tmp_path / "x.toml") == parse(SPHERE + RED, "x.toml")


def test_bundled_names_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mirror").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load("mirror").name == "mirror"
    assert load(Path("mirror")).name == "mirror"


def test_readme_lists_every_scene_and_key() -> None:
    readme = (folder("scenes") / "README.md").read_text("utf-8")
    keys = {field.name for item in MODEL for field in dataclasses.fields(item)}
    keys = keys - {"image", "gradient", "sky"} | {*textures.KEYS, *meshes.KEYS} - {"instance"}
    assert "[[mesh.instance]]" in readme
    assert not {name for name in {*BUNDLED, *keys} if f"`{name}`" not in readme}


def test_readme_has_defaults_and_names() -> None:
    readme = (folder("scenes") / "README.md").read_text("utf-8")
    _, _, text = readme.partition("**`[render]`.**")
    rows = [line for line in text.splitlines() if line.startswith("| `")]
    for field in dataclasses.fields(RenderSettings):
        if isinstance(field.default, str):
            [row] = [row for row in rows if f"`{field.name}`" in row.split("|")[1]]
            told = re.findall(r'`"([\w-]+)"`', row)
            assert (told, told[0]) == (list(get_args(field.type)), field.default)
        else:
            assert f"`{field.name} = {str(field.default).lower().removesuffix('.0')}`" in " ".join(text.split())
    for names in (METAL_F0, METAL_INDEX):
        assert f"| {', '.join(sorted(names))} |" in text
    assert all(name in text for name in DIELECTRIC_F0)


def test_every_field_has_words_for_what_it_takes() -> None:
    for item in MODEL:
        for field in dataclasses.fields(item):
            assert tables._expected(item, field.name)


def test_furnace_says_its_radiance() -> None:
    scene = load("furnace")
    [material] = scene.materials.values()
    assert material.emission[0] / (1 - material.albedo[0]) == pytest.approx(0.5)
    assert "= 0.5" in scene.description


def test_lights_of_different_size_have_the_same_power() -> None:
    scenes = [load(f"light-size-{size}") for size in ("0", "small", "large")]
    assert [scene.lights[0].radius for scene in scenes] == [0, 0.2, 0.8]
    rest = [
        dataclasses.replace(
            scene, name="", description="", lights=[dataclasses.replace(light, radius=0) for light in scene.lights]
        )
        for scene in scenes
    ]
    assert rest[0] == rest[1] == rest[2]
