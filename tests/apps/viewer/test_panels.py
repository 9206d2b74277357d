# SPDX-License-Identifier: MIT
"""Materials and lights in the panels."""

import pytest

from fragtracer.apps.viewer.panels import lights, materials
from fragtracer.scene import Light, Material
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


def test_light_in_other_unit_is_the_same_light() -> None:
    light = Light((0.0, 1.0, 0.0), 0.2, power=(10.0, 20.0, 30.0))
    there = lights.in_unit(light, "radiance")
    assert there.power is None
    assert there.surface_radiance == pytest.approx(light.surface_radiance)
    assert lights.in_unit(there, "power").power == pytest.approx(light.power)
