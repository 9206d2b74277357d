# SPDX-License-Identifier: MIT
"""A scene by its content: two with the same digests are the same picture, wherever their files lie."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from fragtracer.scene import Scene
from fragtracer.scene.content import content_digest

_NAMES = ("name", "description", "file", "pose")  # of scenes and meshes, which say nothing of the picture


def scene_digests(scene: Scene) -> dict[str, str]:
    """A digest of each field of ``scene``, textures and meshes included; of all but the settings and the names."""
    names = [field.name for field in fields(Scene) if field.name not in (*_NAMES, "render")]
    return {name: content_digest(repr(_plain(getattr(scene, name)))) for name in names}


def _plain(value: Any) -> Any:
    """``value`` as tuples, strings and numbers, and the digests of large arrays."""
    if hasattr(value, "digest"):
        return value.digest
    if is_dataclass(value):
        kept = [field.name for field in fields(value) if field.name not in _NAMES]
        return type(value).__name__, [(name, _plain(getattr(value, name))) for name in kept]
    if isinstance(value, Mapping):
        return [(name, _plain(item)) for name, item in value.items()]
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
