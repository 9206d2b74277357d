# SPDX-License-Identifier: MIT
"""A path tracer in one GLSL fragment shader, proved against Mitsuba."""

import sys
from importlib import import_module
from importlib.metadata import version
from typing import Any

__version__ = version("fragtracer")

# Where what the package offers lives, besides all of fragtracer.scene: imported when first used, so that a command pays
# only for what it needs.
_PLACES = {
    "load": "io.toml",
    "save": "io.toml",
    "load_mesh": "io",
    "read_panorama": "io.toml.environments",
    "Renderer": "renderer",
    "render": "renderer",
    "Shutter": "shutter",
    "view": "apps.viewer",
    "export_html": "apps.web",
    "show": "apps.web",
    "widget": "apps.web",
    "read_image": "io.images",
    "write_image": "io.images",
    "denoise": "denoising",
    "FragtracerError": "errors",
}


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        found = getattr(import_module(f"fragtracer.{_PLACES[name]}"), name)
        _make_scenes_show_themselves()
        return found
    if not name.startswith("_") or name == "__all__":
        scene = import_module("fragtracer.scene")
        if name == "__all__":
            return sorted([*scene.__all__, *_PLACES])
        if name in scene.__all__:
            _make_scenes_show_themselves()
            return getattr(scene, name)
    raise AttributeError(f"module 'fragtracer' has no attribute {name!r}")


def _make_scenes_show_themselves() -> None:
    """In a notebook a scene is its live page; the scene model itself knows nothing of pages."""
    model = sys.modules.get("fragtracer.scene")
    if model is not None and not hasattr(model.Scene, "_repr_html_"):
        model.Scene._repr_html_ = lambda scene: __getattr__("show")(scene)._repr_html_()


def __dir__() -> list[str]:
    return [*globals(), *__getattr__("__all__")]
