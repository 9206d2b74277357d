# SPDX-License-Identifier: MIT
"""A scene as a page brings it along: a JSON header, and the arrays that it names (web/src/payload.ts)."""

import gzip
import json
import struct
import zlib
from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.web.controls import Control, controls
from fragtracer.display.look import Look
from fragtracer.errors import SceneError
from fragtracer.gpu.reachable import reachable
from fragtracer.gpu.specialise import MOST_LISTED, Level, Specialisation, specialise
from fragtracer.gpu.textures import WIDTH
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.random_texture import recipe
from fragtracer.resources import folder
from fragtracer.scene import RenderSettings, Scene
from fragtracer.shader_composer import compose

# What nearly all devices with WebGL 2 have; the standard promises 2048.
_MOST_ROWS = 4096
_KINDS = {"uint32": "uint", "float32": "float", "float16": "half", "uint8": "byte"}
_WHAT = {
    "u_scene": "materials, textures and lights",
    "u_shapes": "shapes and meshes",
    "u_vertices": "vertices of meshes",
    "u_environment": "the environment",
    "u_environment_tree": "the environment",
}


def packed_for_page(scene: Scene, settings: RenderSettings) -> PackedScene:
    """``scene`` as a browser can trace it.

    Raises
    ------
    SceneError
        If a browser cannot hold it, or the settings ask for more than paths.
    """
    packed = pack(scene, settings, settings.width, settings.height, MOST_LISTED["page"])
    if settings.integrator != "path" or packed.needs_maps:
        raise SceneError(
            "a page traces paths: it has no maps of the split-sum approximation; "
            'set integrator = "path" and background = "environment" under [render]'
        )
    for name, table in packed.tables.items():
        if table and table[0].ndim == 2 and sum(-(-len(part) // WIDTH) for part in table) > _MOST_ROWS:
            size = sum(part.nbytes for part in table) / 1e6
            most = _MOST_ROWS * WIDTH * table[0].itemsize * 4 / 1e6
            raise SceneError(
                f"{_WHAT.get(name, 'the scene')} take {size:,.0f} MB; a texture in a browser holds {most:,.0f} MB: "
                "use fewer triangles or smaller images"
            )
    return packed


def _packed_for_software(scene: Scene, settings: RenderSettings) -> PackedScene:
    """``scene`` as a browser traces it where a CPU renders."""
    size = settings.width, settings.height
    return pack(scene, settings, *size, MOST_LISTED["default"], most_outside_grid=MOST_LISTED["grid"])


def controls_by_name(scene: Scene, settings: RenderSettings, look: Look) -> dict[str, Control]:
    """All controls that the page of ``scene`` has somewhere: where a CPU renders there may be more than on a GPU."""
    packed = packed_for_page(scene, settings), _packed_for_software(scene, settings)
    return {control["id"]: control for stored in packed for control in controls(scene, settings, stored, look)}


def scene_payload(scene: Scene, settings: RenderSettings, look: Look) -> bytes:
    """All that the runner needs of ``scene``, compressed.

    Raises
    ------
    SceneError
        If a browser cannot hold it, or the settings ask for more than paths.
    """
    packed, listed = packed_for_page(scene, settings), _packed_for_software(scene, settings)
    shown, shown_there = (controls(scene, settings, stored, look) for stored in (packed, listed))
    composed, blob = _composed("pathtracer.frag", packed), _Blob()
    # For whatever the controls choose, and for shapes stored in either way.
    changing = {*_changing(shown), *_changing(shown_there)}
    kinds = {name: flag for name, flag in packed.flags.items() if listed.flags[name] == flag and name not in changing}
    general = reachable(Specialisation(kinds).apply(composed))
    header = {
        "file": _file_name(scene.name),
        "seed": settings.seed,
        "vertex": _composed("fullscreen.vert", None),
        "fragment": general,
        "pick": files("fragtracer.apps.web").joinpath("pick.glsl").read_text(encoding="utf-8"),
        "display": _composed("display/display.frag", None),
        **_stored(packed, shown, settings.seed, composed, general, blob),
        "random": recipe(),
        "camera": asdict(scene.camera),
        "origin": packed.origin.tolist(),
    }
    if len(listed.listed) != len(packed.listed):
        header["software"] = _stored(listed, shown_there, settings.seed, composed, general, blob)
    text = json.dumps(header, allow_nan=False).encode()
    return gzip.compress(struct.pack("<I", len(text)) + text + b"".join(blob.parts), 6, mtime=0)


def _stored(
    packed: PackedScene, shown: list[Control], seed: int, composed: str, general: str, blob: "_Blob"
) -> dict[str, object]:
    """What of the header depends on how shapes are stored; the ``general`` program does not."""
    special = reachable(specialise(packed, Level.SCENE, _changing(shown)).apply(composed))
    return {
        "constants": _changes(general, special),
        "path_rounds": packed.path_rounds,
        "uniforms": {name: _plain(value) for name, value in packed.all_uniforms.items()} | {"u_seed": seed},
        "tables": [blob.table(name, table) for name, table in packed.tables.items() if any(p.size for p in table)],
        "controls": shown,
    }


def _changing(shown: Sequence[Control]) -> tuple[str, ...]:
    """The uniforms that controls change."""
    return tuple(target["uniform"] for control in shown for target in control["targets"] if "uniform" in target)


def _composed(program: str, packed: PackedScene | None) -> str:
    return compose(program, {}, folder("shaders"), language="300 es", optional=packed.features if packed else None).text


def _changes(before: str, after: str) -> list[tuple[int, str]]:
    """The lines of two texts that differ, by their number from 0."""
    pairs = zip(before.splitlines(), after.splitlines(), strict=True)
    return [(i, new) for i, (old, new) in enumerate(pairs) if old != new]


def _plain(value: Any) -> Any:
    return np.asarray(value).tolist()


def _file_name(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name)[:80] or "scene"


class _Blob:
    """Arrays, one after the other, equal ones once."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self._size = 0
        self._known: dict[bytes, dict[str, int]] = {}

    def table(self, name: str, table: tuple[NDArray[Any], ...]) -> dict[str, Any]:
        """Add the parts of a table; what the header says of it."""
        is_folded = table[0].ndim == 2
        layers, height, width = (1, 0, 0) if is_folded else table[0].shape[:3]
        return {
            "name": name,
            "kind": _KINDS[table[0].dtype.name],
            "size": None if is_folded else (width, height, layers),
            "parts": [self._part(part) for part in table],
        }

    def _part(self, array: NDArray[Any]) -> dict[str, int]:
        stride = array.shape[-1] * array.itemsize
        plain = np.ascontiguousarray(array).view(np.uint8).reshape(-1, stride)
        apart = np.ascontiguousarray(plain.T)
        is_smaller = len(zlib.compress(apart.data, 1)) < len(zlib.compress(plain.data, 1))
        data = (apart if is_smaller else plain).tobytes()
        part = {"offset": self._size, "length": len(data), "stride": stride if is_smaller else 0}
        if known := self._known.get(data):
            return known | {"stride": part["stride"]}
        self._known[data] = part
        self.parts.append(data)
        self._size += len(data)
        return part
