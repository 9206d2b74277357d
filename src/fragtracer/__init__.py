# SPDX-License-Identifier: MIT
"""A path tracer in one GLSL fragment shader, proved against Mitsuba."""

from importlib import import_module
from importlib.metadata import version
from typing import Any

__version__ = version("fragtracer")

# What the package offers and where it lives: imported when first used, so that a command pays only
# for what it needs.
_PUBLIC = {
    "Camera": "scene",
    "Material": "scene",
    "Sphere": "scene",
    "Plane": "scene",
    "Rectangle": "scene",
    "Disk": "scene",
    "Triangle": "scene",
    "Geometry": "scene",
    "Part": "scene",
    "Placement": "scene",
    "Mesh": "scene",
    "Image": "scene",
    "Texture": "scene",
    "Light": "scene",
    "SpotLight": "scene",
    "DirectionalLight": "scene",
    "Ambient": "scene",
    "Environment": "scene",
    "Panorama": "scene",
    "Gradient": "scene",
    "Sky": "scene",
    "RenderSettings": "scene",
    "Scene": "scene",
    "load": "io.toml",
    "save": "io.toml",
    "load_mesh": "io",
    "read_panorama": "io.toml.environments",
    "Renderer": "renderer",
    "render": "renderer",
    "view": "apps.viewer",
    "read_image": "io.images",
    "write_image": "io.images",
    "FragtracerError": "errors",
}
__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'fragtracer' has no attribute {name!r}")
    return getattr(import_module(f"fragtracer.{_PUBLIC[name]}"), name)
