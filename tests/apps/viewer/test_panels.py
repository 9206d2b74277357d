# SPDX-License-Identifier: MIT
"""Materials and lights in the panels."""

import numpy as np
import pytest

from fragtracer.apps.viewer.panels import lights, materials, media
from fragtracer.scene import Camera, DirectionalLight, Fog, Light, Material, Medium, SpotLight
from fragtracer.scene.material import DEFAULT_MODEL, MODELS
from fragtracer.scene.reflectance import DIELECTRIC_F0, METAL_F0


@pytest.mark.parametrize("preset", [*DIELECTRIC_F0, *METAL_F0])
def test_presets_have_the_reflectance_of_the_table(preset: str) -> None:
    before = Material(albedo=(0.2, 0.3, 0.4), roughness=0.3)
    made = materials.with_preset(before, preset)
    expected = METAL_F0.get(preset) or (DIELECTRIC_F0[preset],) * 3
    assert made.specular_f0 == pytest.approx(expected)
    assert made.roughness == 0.3
    if preset not in ("glass", "ruby"):  # the table has their values under another name first
        assert materials.preset_of(made) == preset
    assert materials.with_preset(made, "custom").metal is None


@pytest.mark.parametrize("before", MODELS)
@pytest.mark.parametrize("after", MODELS)
def test_every_model_becomes_every_other(before: str, after: str) -> None:
    """With a control for each of its keys, and what both have kept."""
    made = materials.with_model(Material(roughness=0.3, coat=0.5, emission=2.0, unlit=True), before)
    made = materials.with_model(made, after)
    assert made.model == after
    assert made.emission == (2.0, 2.0, 2.0)
    if all("roughness" in MODELS[model] for model in (before, after)):
        assert made.roughness == 0.3
    assert made.coat == (0.5 if before == after == DEFAULT_MODEL else 0.0)
    assert after == DEFAULT_MODEL or set(MODELS[after]) <= {*materials._CONTROLS, "interior"}


def test_light_in_other_unit_is_the_same_light() -> None:
    light = Light((0.0, 1.0, 0.0), 0.2, power=(10.0, 20.0, 30.0))
    there = lights.in_unit(light, "radiance")
    assert there.power is None
    assert there.surface_radiance == pytest.approx(light.surface_radiance)
    assert lights.in_unit(there, "power").power == pytest.approx(light.power)


@pytest.mark.parametrize("kind", list(lights.NEW))
def test_new_light_gives_the_same_irradiance_whatever_its_kind(kind: str) -> None:
    camera = Camera((0.0, 2.0, 4.0), (1.0, 0.5, 0.0))
    light = lights.new_light(kind, camera)
    if isinstance(light, DirectionalLight):
        irradiance = light.irradiance
    else:
        intensity = light.intensity
        height = np.linalg.norm(np.subtract(light.position, camera.target))
        irradiance = tuple(i / height**2 for i in intensity)
        assert light.position[1] > camera.target[1]
    assert irradiance == pytest.approx((20 / np.pi,) * 3)


def test_only_what_is_edited_of_a_light_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    rows: dict[str, object] = {}

    def row(text: str, value: object, *_: object, **__: object) -> object:
        return rows.get(text, value)

    for name in ("point", "color", "number", "quantity", "length", "vector", "slider", "choice"):
        monkeypatch.setattr(lights.widgets, name, row)
    spot = SpotLight((0.0, 1.0, 0.0), (0.3, -1.0, 0.1), (0.8, 0.4, 0.2), 10.0, 30.0)
    sun = DirectionalLight((0.3, -1.0, 0.1), (0.8, 0.4, 0.2))
    lamp = Light((0.0, 1.0, 0.0), 0.2, power=(0.7, 0.3, 0.1))
    for light in (spot, sun, lamp):
        assert lights.edit(light, 1.0) is light
    rows = {"Position": (1.0, 2.0, 3.0), "Direction": (0.0, 0.0, -1.0), "Intensity": 8.0, "Outer angle": 20.0}
    assert lights.edit(spot, 1.0) == SpotLight((1.0, 2.0, 3.0), (0.0, 0.0, -1.0), (8.0, 4.0, 2.0), 10.0, 20.0)
    rows = {"Colour": (1.0, 1.0, 0.5)}
    assert lights.edit(sun, 1.0) == DirectionalLight(sun.direction, (0.8, 0.8, 0.4))
    rows = {"Direction": (0.0, 0.0, 0.0)}
    assert lights.edit(sun, 1.0) is sun, "no direction"


def test_only_what_is_edited_of_media_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever coefficients they are given by; and a material has one or the colour of what is left, not both."""
    rows: dict[str, object] = {}

    def row(text: str, value: object, *_: object, **__: object) -> object:
        return rows.get(text, value)

    for name in ("whole", "color", "number", "length", "slider", "choice"):
        monkeypatch.setattr(media.widgets, name, row)
    given = [
        Medium(),
        Medium(extinction=2.0, albedo=0.5),
        Medium(mean_free_path=3.0),
        Medium(scattering=1.0, absorption=2.0),
    ]
    for medium in given:
        assert media.edit(medium) is medium
    rows = {"g": 0.5, "Extinction": (1.0, 2.0, 3.0), "Mean free path": (0.0, 1.0, 2.0), "Absorption": (0.0, 0.0, 1.0)}
    assert media.edit(given[0]) == Medium(extinction=(1.0, 2.0, 3.0), g=0.5)
    assert media.edit(given[2]) == Medium(mean_free_path=(1e-5, 1.0, 2.0), g=0.5)
    assert media.edit(given[3]) == Medium(scattering=1.0, absorption=(0.0, 0.0, 1.0), g=0.5)
    assert media.fog(None, ["a"]) is None
    rows = {"Fog": "a", "Interior": "a"}
    assert media.fog(None, ["a"]) == Fog("a")
    tinted = Material(model="dielectric", ior=1.5, attenuation_color=(0.9, 0.5, 0.1))
    assert materials.edit(tinted, known=["a"]) == Material(model="dielectric", ior=1.5, interior="a")
    rows = {"Interior": media.NONE}
    assert materials.edit(Material(model="null", interior="a"), known=["a"]) == Material(model="null")
    assert media.new_name(["medium-1", "medium-3"]) == "medium-2"


@pytest.mark.parametrize("before", [Material(), Material(blend="a", blend_weight=0.2)])
def test_a_material_is_blended_with_another(monkeypatch: pytest.MonkeyPatch, before: Material) -> None:
    rows: dict[str, object] = {}

    def row(text: str, value: object, *_: object, **__: object) -> object:
        return rows.get(text, value)

    for name in ("color", "slider", "choice"):
        monkeypatch.setattr(materials.widgets, name, row)
    assert materials.edit(before) is materials.edit(before, others=["a", "b"]) is before
    rows = {"Blend with": "b", "Weight of it": 0.7}
    assert materials.edit(before, others=["a", "b"]) == Material(blend="b", blend_weight=0.7)
    rows = {"Blend with": "none"}
    assert materials.edit(before, others=["a", "b"]) == Material()


def test_diffuse_transmission_is_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no coat is, and then there can be none."""
    rows: dict[str, object] = {}

    def row(text: str, value: object, *_: object, **__: object) -> object:
        return rows.get(text, value)

    for name in ("color", "slider", "choice"):
        monkeypatch.setattr(materials.widgets, name, row)
    rows = {"Diffuse transm.": 0.75, "of a colour": (0.25, 0.5, 1.0), "Coat": 0.5}
    leaf, lacquer = Material(diffuse_transmission=0.5), Material(coat=0.5)
    edited = Material(diffuse_transmission=0.75, diffuse_transmission_color=(0.25, 0.5, 1.0))
    assert materials.edit(leaf) == edited
    assert materials.edit(lacquer) is lacquer
    rows = {"Diffuse transm.": 0.75}
    assert materials.edit(Material()) == Material(diffuse_transmission=0.75)


@pytest.mark.parametrize(
    ("material", "refused"),
    [
        (Material(blend="a"), {"Unlit"}),
        (Material(unlit=True), {"Blend with", "Diffuse transm."}),
        (Material(diffuse_transmission=0.5), {"Unlit", "Coat", "Sheen", "Iridescence", "Diffuse factor"}),
        (Material(), set()),
    ],
)
def test_what_a_material_refuses_is_not_offered(
    monkeypatch: pytest.MonkeyPatch, material: Material, refused: set[str]
) -> None:
    shown: set[str] = set()

    def row(text: str, value: object, *_: object, **__: object) -> object:
        shown.add(text)
        return value

    for name in ("color", "slider", "choice", "check"):
        monkeypatch.setattr(materials.widgets, name, row)
    assert materials.edit(material, of_mesh=True, others=["a"]) is material
    rows = {"Unlit", "Blend with", "Diffuse transm.", "Coat", "Sheen", "Iridescence", "Diffuse factor"}
    assert rows - shown == refused


def test_layers_are_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the default model alone, their roughnesses and an index where there is one."""
    rows: dict[str, object] = {}
    shown: list[str] = []

    def row(text: str, value: object, *_: object, **__: object) -> object:
        shown.append(text)
        return rows.get(text, value)

    for name in ("color", "slider", "choice"):
        monkeypatch.setattr(materials.widgets, name, row)
    bare, gold = Material(), Material(metal="gold", coat=0.5, coat_roughness=0.1)
    assert materials.edit(bare) is bare
    assert [text for text in shown if "Coat" in text] == ["Coat"]
    assert materials.edit(gold) is gold
    rows = {"Coat": 0.75, "Coat roughness": 0.25, "Coat index": 1.7}
    assert materials.edit(bare) == Material(coat=0.75)
    assert materials.edit(gold) == Material(metal="gold", coat=0.75, coat_roughness=0.25, coat_ior=1.7)
    clay, velvet = Material(model="eon"), Material(sheen_color=0.5, sheen_roughness=0.3)
    assert materials.edit(clay) is clay
    rows = {"Sheen": (0.25, 0.5, 0.75), "Sheen roughness": 0.6}
    assert materials.edit(bare) == Material(sheen_color=(0.25, 0.5, 0.75))
    assert materials.edit(velvet) == Material(sheen_color=(0.25, 0.5, 0.75), sheen_roughness=0.6)
    rows = {"Iridescence": 0.5, "Film index": 1.5, "Film thickness": 250.0}
    assert materials.edit(bare) == Material(iridescence=0.5)
    soap = Material(iridescence=0.5, iridescence_ior=1.5, iridescence_thickness=250.0)
    assert materials.edit(Material(iridescence=1.0)) == soap
