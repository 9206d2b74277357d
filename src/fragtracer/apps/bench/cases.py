# SPDX-License-Identifier: MIT
"""The scenes that benchmarks run on."""

from dataclasses import replace
from typing import Any

from fragtracer.io.toml import load
from fragtracer.scene import Material, RenderSettings, Scene

LAMBERT = "-lambert"  # behind a scene's name: the same scene, all its materials matte


def case(name: str) -> Scene:
    """The scene of that name or path; with :data:`LAMBERT` behind it, in Lambert materials."""
    if not name.endswith(LAMBERT):
        return load(name)
    scene = load(name.removesuffix(LAMBERT))
    return replace(scene, name=name, materials={k: _lambert(m) for k, m in scene.materials.items()})


def _lambert(material: Material) -> Material:
    return Material(albedo=material.base_color, specular=0.0, emission=material.emission)


def with_settings(scene: Scene, size: tuple[int, int], **settings: Any) -> Scene:
    """``scene`` at that size with those :class:`RenderSettings`, the rest of them their defaults."""
    return replace(scene, render=RenderSettings(width=size[0], height=size[1], **settings))
