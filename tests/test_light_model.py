# SPDX-License-Identifier: MIT
"""Lights and disks of the scene model: their derived quantities against integrals, and what they refuse."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from fragtracer.scene import (
    Ambient,
    DirectionalLight,
    Disk,
    Environment,
    Gradient,
    Light,
    Material,
    Scene,
    Sphere,
    SpotLight,
)


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 45.0), (0.0, 90.0), (30.0, 31.0), (20.0, 60.0), (1e-3, 1.0)])
def test_power_of_a_spot_light_is_the_integral_of_its_intensity(inner: float, outer: float) -> None:
    low, high = math.cos(math.radians(outer)), math.cos(math.radians(inner))
    cosines = low + (1 - low) * (np.arange(1_000_000) + 0.5) / 1_000_000
    t = np.clip((cosines - low) / (high - low), 0, 1)
    expected = 2 * math.pi * (1 - low) * np.mean(t**2)
    light = SpotLight((0, 0, 0), (0, -3, 0), (1, 2, 0.5), inner, outer)
    np.testing.assert_allclose(light.power, np.multiply((1, 2, 0.5), expected), rtol=1e-5)


def test_a_point_light_of_the_same_intensity_has_the_power_of_all_directions() -> None:
    light = Light((0, 0, 0), power=(4 * math.pi, 8 * math.pi, 0))
    assert light.intensity == pytest.approx((1, 2, 0))


def test_area_of_a_disk() -> None:
    assert Disk((0, 1, 0), (0, 0, 9), 2, "red").area == pytest.approx(4 * math.pi)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpotLight((0, 0, 0), (0, 0, 0), 1), "direction must not have length zero"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, 50), "inner_degrees must be less than outer_degrees, 45"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, 30, 30), "inner_degrees must be less than outer_degrees, 30"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), intensity=-1), "intensity"),
        (lambda: SpotLight((0, 0, 0), (0, 0, 1), 1, outer_degrees=91), "outer_degrees"),
        (lambda: DirectionalLight((0, 0, 0), 1), "direction must not have length zero"),
        (lambda: DirectionalLight(direction=(0, 0, math.inf), irradiance=1), "direction"),
        (lambda: DirectionalLight((0, 0, 1), irradiance=(1, 2)), "irradiance"),
        (lambda: Disk((0, 0, 0), (0, 0, 0), 1, "red"), "normal must not have length zero"),
        (lambda: Disk((0, 0, 0), (0, 0, 1), radius=0, material="red"), "radius"),
        (
            lambda: Scene(disks=[Disk((0, 0, 0), (0, 0, 1), 1, "red")], materials={"rot": Material()}),
            r"disk\[0\].material: there is no material 'red'; the materials are: rot",
        ),
    ],
)
def test_mistakes_are_named(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValidationError, match=message):
        make()


def test_disks_can_emit() -> None:
    scene = Scene(disks=[Disk((0, 0, 0), (0, 0, 1), 1, "lamp")], materials={"lamp": Material(emission=5)})
    assert scene.disks[0].material == "lamp"


def test_where_there_is_light() -> None:
    ball, dark, glowing = Sphere((0, 0, 0), 1, "a"), {"a": Material()}, {"a": Material(emission=1.0)}
    without = Scene(materials=dark | {"unused": Material(emission=1.0)}, spheres=[ball])
    assert not without.has_light
    lit = (
        {"lights": [Light((0, 3, 0), power=1.0)]},
        {"directional_lights": [DirectionalLight((0, -1, 0), 1.0)]},
        {"ambient": Ambient(0.1)},
        {"environment": Environment(gradient=Gradient((1, 1, 1), (1, 1, 1), (1, 1, 1)))},
        {"materials": glowing},
        {"materials": {"a": Material(blend="b"), "b": Material(emission=1.0)}},
        {"materials": {"a": Material(unlit=True)}},
    )
    for changes in lit:
        assert replace(without, **changes).has_light
