# SPDX-License-Identifier: MIT
"""Disks, spot and directional lights in Mitsuba against closed forms."""

import numpy as np
import pytest

from fragtracer.reference.render import render_reference
from fragtracer.scene import (
    Camera,
    DirectionalLight,
    Disk,
    Material,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    SpotLight,
)

ALBEDO = 0.5
MATERIALS = {
    "matt": Material(albedo=ALBEDO, specular=0.0),
    "one-sided": Material(albedo=ALBEDO, specular=0.0, double_sided=False),
    "glow": Material(albedo=0.0, specular=0.0, emission=(1.0, 2.0, 3.0)),
    "black": Material(albedo=0.0, specular=0.0),
}
FLOOR = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matt")
ABOVE = Camera((0.0, 4.0, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=60.0)
AHEAD = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), fov_degrees=40.0)
BEHIND = Camera((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), fov_degrees=40.0)
DISK = Disk((0.0, 0.0, 0.0), (0.0, 0.0, 3.0), 1.0, "glow")


def picture(scene, size=(32, 32), spp=64, bounces=1, **options):
    """One picture of the scene with the materials of this file, float32 (h, w, 3)."""
    scene = Scene(materials=MATERIALS, render=RenderSettings(bounces=bounces), **scene)
    return render_reference(scene, size, spp, **options)[0]


def floor_points(size, camera=ABOVE):
    """Where the middles of pixels of ``size``² show the floor, (h, w, 3), from straight above."""
    half = camera.position[1] * np.tan(np.radians(camera.fov_degrees) / 2)
    x = (2 * (np.arange(size) + 0.5) / size - 1) * half
    return np.stack([*np.meshgrid(x, x), np.zeros((size, size))], -1)[..., [0, 2, 1]]


def spot_irradiance(light, points):
    """Of the floor, for an intensity of 1: falloff cos θ / d² (KHR_lights_punctual)."""
    offset = points - light.position
    distance = np.linalg.norm(offset, axis=-1)
    axis = np.array(light.direction) / np.linalg.norm(light.direction)
    inner, outer = np.cos(np.radians([light.inner_degrees, light.outer_degrees]))
    t = np.clip((offset @ axis / distance - outer) / (inner - outer), 0, 1)
    return t**2 * -offset[..., 1] / distance**3


SPOTS = [
    SpotLight((0.0, 2.0, 0.0), (0.0, -3.0, 0.0), (100.0, 50.0, 0.0), 20.0, 40.0),
    SpotLight((0.0, 2.0, 0.0), (0.0, -1.0, 0.0), (100.0, 50.0, 0.0), 0.0, 90.0),
    SpotLight((-1.0, 1.5, 0.5), (1.0, -1.0, 0.3), (100.0, 50.0, 0.0), 25.0, 26.0),
    SpotLight((1.5, 3.0, -1.0), (-0.5, -2.0, 0.5), (100.0, 50.0, 0.0), 10.0, 35.0),
]


@pytest.mark.parametrize("light", SPOTS)
def test_irradiance_of_a_spot_light(mi, light):
    image = picture({"camera": ABOVE, "planes": [FLOOR], "spot_lights": [light]}, spp=4096)
    # The mean over each pixel, as the picture has it.
    fine = spot_irradiance(light, floor_points(32 * 16)).reshape(32, 16, 32, 16).mean((1, 3))
    expected = ALBEDO / np.pi * fine[..., None] * light.intensity
    np.testing.assert_allclose(image, expected, rtol=0, atol=0.02 * expected.max())
    assert image.mean((0, 1)) == pytest.approx(expected.mean((0, 1)), rel=1e-3)


def test_irradiance_of_a_spot_light_in_the_scalar_variant(mi):
    light = SPOTS[0]
    scene = {"camera": ABOVE, "planes": [FLOOR], "spot_lights": [light]}
    image = picture(scene, (16, 16), 16, variant="scalar_rgb")
    fine = spot_irradiance(light, floor_points(16 * 16)).reshape(16, 16, 16, 16).mean((1, 3))
    expected = ALBEDO / np.pi * fine[..., None] * light.intensity
    assert image.mean((0, 1)) == pytest.approx(expected.mean((0, 1)), rel=0.01)


def test_the_power_of_a_spot_light_leaves_it(mi):
    """Light that a sphere has reflected once falls evenly on all of it."""
    light = SpotLight((0.2, 0.1, 0.0), (0.3, -1.0, 0.2), 1.0, 30.0, 60.0)
    ball = [Sphere((0.0, 0.0, 0.0), 1.0, "matt")]
    camera = Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), fov_degrees=20.0)
    image = picture({"camera": camera, "spheres": ball, "spot_lights": [light]}, spp=1024, bounces=2)
    twice = image.mean((0, 1)) - picture({"camera": camera, "spheres": ball, "spot_lights": [light]}).mean((0, 1))
    assert twice == pytest.approx(ALBEDO**2 / np.pi * np.array(light.power) / (4 * np.pi), rel=0.01)


def test_a_spot_light_is_hidden_by_what_is_in_its_way(mi):
    disk = Disk((0.0, 1.0, 0.0), (0.0, 1.0, 0.0), 0.5, "black")
    camera = Camera((0.0, 0.5, 0.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=120.0)
    image = picture({"camera": camera, "planes": [FLOOR], "disks": [disk], "spot_lights": [SPOTS[0]]})
    half, points = 0.5 * np.tan(np.radians(60)), floor_points(32, camera)
    shadow = np.hypot(points[..., 0], points[..., 2])
    pixel = 2 * half / 32
    assert not image[shadow < 1 - pixel].any()
    assert image[(shadow > 1 + pixel) & (shadow < 1.1 + pixel)][:, 0].min() > 0.1


@pytest.mark.parametrize("direction", [(0.0, -2.0, 0.0), (3.0, -4.0, 0.0), (1.0, -0.2, 2.0)])
def test_irradiance_of_a_directional_light(mi, direction):
    light = DirectionalLight(direction, (3.0, 2.0, 0.0))
    image = picture({"camera": ABOVE, "planes": [FLOOR], "directional_lights": [light]}, spp=4)
    cosine = -direction[1] / np.linalg.norm(direction)
    expected = np.broadcast_to(ALBEDO / np.pi * cosine * np.array(light.irradiance), image.shape)
    np.testing.assert_allclose(image, expected, rtol=1e-5)


def test_the_shadow_of_a_directional_light_lies_along_it(mi):
    light = DirectionalLight((1.0, -1.0, 0.0), 1.0)
    disk = Disk((-5.0, 5.0, 0.0), (1.0, -1.0, 0.0), 1.0, "black")
    image = picture({"camera": ABOVE, "planes": [FLOOR], "disks": [disk], "directional_lights": [light]}, (64, 64), 16)
    pixel = (2 * 4 * np.tan(np.radians(30)) / 64) ** 2
    shadow = (image[..., 0] / image.max() < 0.5).sum() * pixel
    assert shadow == pytest.approx(np.pi * np.sqrt(2), rel=0.03)


def test_an_emissive_disk_emits_to_its_front_only(mi):
    front = picture({"camera": AHEAD, "disks": [DISK]}, spp=256, bounces=0)
    metre = 32 / (2 * 5 * np.tan(np.radians(20)))
    assert front.sum(axis=(0, 1)) == pytest.approx(np.pi * metre**2 * np.array([1, 2, 3]), rel=0.01)
    assert front[16, 16] == pytest.approx([1, 2, 3])
    assert not picture({"camera": BEHIND, "disks": [DISK]}, bounces=0).any()


@pytest.mark.parametrize("material", ["glow", "half"])
def test_irradiance_below_an_emissive_disk(mi, material):
    """On the axis pi L r² / (r² + h²), less where the disk is partly transparent."""
    half = Material(albedo=0.0, specular=0.0, emission=(1.0, 2.0, 3.0), alpha_mode="blend", opacity=0.5)
    lamp = Disk((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 0.7, material)
    camera = Camera((0.0, 0.5, 0.9), (0.0, 0.0, 0.0), fov_degrees=0.5)
    scene = Scene(camera, {**MATERIALS, "half": half}, planes=[FLOOR], disks=[lamp])
    image = render_reference(scene, (16, 16), 256)[0]
    share = 0.5 if material == "half" else 1.0
    expected = share * ALBEDO * 0.7**2 / (0.7**2 + 1) * np.array([1, 2, 3])
    assert image.mean((0, 1)) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 2.0), (0.0, 0.0, -1.0)])
def test_a_disk_reflects_on_both_sides(mi, normal):
    light = DirectionalLight((0.0, 0.0, -1.0), 2.0)
    disk = Disk((0.0, 0.0, 0.0), normal, 1.0, "matt")
    image = picture({"camera": AHEAD, "disks": [disk], "directional_lights": [light]}, spp=4)
    assert image[16, 16] == pytest.approx(np.full(3, 2 * ALBEDO / np.pi))


def test_back_faces_of_a_disk_are_culled_where_its_material_says_so(mi):
    wall = Rectangle((-5.0, -5.0, -1.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), "glow")
    disk = Disk((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 1.0, "one-sided")
    assert picture({"camera": AHEAD, "disks": [disk], "rectangles": [wall]})[16, 16] == pytest.approx([1, 2, 3])
