# SPDX-License-Identifier: MIT
"""Sensor, film and integrator of a Mitsuba scene: the camera and the settings."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.io.mitsuba.nodes import Node
from fragtracer.io.model import triple
from fragtracer.scene import Camera, RenderSettings

_CAMERAS = ("perspective", "thinlens")
_MOST_BOUNCES = 10_000
_ENDLESS = 1_000  # bounces of a path that only roulette ends
_NO_ROULETTE = 2**31 - 1
_FILTERS = {"box": 0.5, "tent": 1.0, "gaussian": 0.5}  # widths, as ours are
_WITHIN = ("aov", "moment", "multi")  # integrators that hold another one


def camera_of(node: Node, settings: RenderSettings, low: NDArray[np.float64], high: NDArray[np.float64]) -> Camera:
    """The camera of a sensor that looks at a scene whose bounding box is from ``low`` to ``high`` (3,)."""
    if node.plugin not in _CAMERAS:
        raise node.error(f"this camera is not known; use {' or '.join(_CAMERAS)}")
    placed = node.matrix()
    if not np.linalg.det(placed[:3, :3]) > 0:
        raise node.error("to_world mirrors or flattens the picture; a camera must not")
    position, up, ahead = placed[:3, 3], placed[:3, 1], placed[:3, 2] / np.linalg.norm(placed[:3, 2])
    size = float(np.linalg.norm(high - low)) or 1.0
    distance = max(float(((low + high) / 2 - position) @ ahead), 0.05 * size)
    lens: dict[str, Any] = {}
    if node.plugin == "thinlens":
        lens = {"aperture_radius": node.number("aperture_radius", 0.1)}
        lens["focus_distance"] = node.number("focus_distance", 1.0)
    with node.checked():
        return Camera(
            position=triple(position),
            target=triple(position + distance * ahead),
            up=triple(up),
            fov_degrees=_vertical_fov(node, settings.width, settings.height),
            **lens,
        )


def _vertical_fov(node: Node, width: int, height: int) -> float:
    """Degrees."""
    diagonal = math.hypot(width, height)
    if node.has("focal_length") or not node.has("fov"):
        text = node.text("focal_length", "50mm")
        found = re.fullmatch(r"\s*([\d.]+)\s*(mm)?\s*", text)
        if found is None or not float(found[1]) > 0:
            raise node.error(f"focal_length {text!r} is no length; 50mm is one")
        half, extent = math.hypot(36, 24) / (2 * float(found[1])), diagonal
    else:
        half = math.tan(math.radians(node.number("fov", 0.0)) / 2)
        axis = node.text("fov_axis", "x")
        sizes = {"x": width, "y": height, "diagonal": diagonal}
        sizes |= {"smaller": min(width, height), "larger": max(width, height)}
        if axis not in sizes:
            raise node.error(f"fov_axis {axis!r} is not known; choose from {', '.join(sizes)}")
        extent = sizes[axis]
    return math.degrees(2 * math.atan(half * height / extent))


def settings_of(sensor: Node, integrator: Node | None, notes: list[str]) -> RenderSettings:
    """The settings of a scene."""
    found: dict[str, Any] = {"width": 768, "height": 576, "pixel_filter": "gaussian"}  # Mitsuba's defaults
    film = sensor.child("film")
    if film is not None:
        found |= {"width": film.whole("width", 768), "height": film.whole("height", 576)}
        found |= _filter(film, notes)
    sampler = sensor.child("sampler")
    if sampler is not None:
        found["spp"] = sampler.whole("sample_count", 4)
    found |= {"bounces": _ENDLESS} if integrator is None else _integrator(integrator, notes)
    with sensor.checked():
        return replace(RenderSettings(), **found)


def _filter(film: Node, notes: list[str]) -> dict[str, Any]:
    node = film.child("rfilter")
    if node is None:
        return {}
    if node.plugin not in _FILTERS:
        notes.append(f"{node.line}: {node.title}, a gaussian in its place")
        return {}
    width = _FILTERS[node.plugin]
    name = "stddev" if node.plugin == "gaussian" else "radius"
    if abs(node.number(name, width) - width) > 1e-6:
        notes.append(f"{node.line}: {name} of {node.title}, which is {width:g}")
    return {"pixel_filter": node.plugin}


def _integrator(node: Node, notes: list[str]) -> dict[str, Any]:
    node = inner_integrator(node)
    if node.plugin == "direct":
        return {"bounces": 1}
    if node.plugin not in ("path", "volpath", "volpathmis"):
        notes.append(f"{node.line}: {node.title}, paths in its place")
    depth = node.whole("max_depth", -1)
    found: dict[str, Any] = {"bounces": _ENDLESS if depth < 0 else min(max(depth - 1, 0), _MOST_BOUNCES)}
    roulette = min(max(node.whole("rr_depth", 5), 1), _NO_ROULETTE)
    found |= {"russian_roulette_depth": roulette, "russian_roulette": roulette < _MOST_BOUNCES}
    return found


def inner_integrator(node: Node) -> Node:
    """The integrator that traces, in one of several layers."""
    while node.plugin in _WITHIN and (inner := node.child("integrator")) is not None:
        node = inner
    return node
