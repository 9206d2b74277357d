# SPDX-License-Identifier: MIT
"""Colours and textures of a Mitsuba scene."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.io.mitsuba.nodes import Node
from fragtracer.io.textures import read_texture
from fragtracer.scene import Image, Texture
from fragtracer.scene.fields import Triple
from fragtracer.scene.texture import ColorSpace, linear_pixels

Floats = NDArray[np.float64]
Lengths = tuple[float, float]

_FINER, _MOST_BUMPS = 4, 2**22  # times, along each axis, that a normal map is finer than its heights; texels, at most
VERTEX_COLORS = "vertex_color"
_LUMINANCE = np.array((0.212671, 0.715160, 0.072169))  # Mitsuba's
# Older versions have filters and ways to wrap that Mitsuba has no longer.
_FILTERS = {"bilinear": "linear", "trilinear": "linear", "ewa": "linear", "nearest": "nearest"}
_WRAPS = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "zero": "clamp", "one": "clamp"}


@dataclass(frozen=True)
class Value:
    """A parameter: a colour, or what a ``texture`` is multiplied by. ``attribute`` names the attribute of a mesh that
    it is multiplied by."""

    color: Triple
    texture: Texture | None = None
    attribute: str = ""

    @property
    def number(self) -> float:
        return float(np.dot(self.color, _LUMINANCE)) if len(set(self.color)) > 1 else self.color[0]


@dataclass
class Textures:
    """Those of one file, each read once; ``notes`` are what is not as in Mitsuba."""

    mi: Any
    notes: list[str]
    _made: dict[tuple[Node, bool], Texture] = field(default_factory=dict)
    _images: dict[tuple[Path, ColorSpace], Image] = field(default_factory=dict)

    def reflectance(self, node: Node, name: str, default: float) -> Value:
        """A colour from 0 to 1, or a texture of such."""
        value = self._value(node, name, default, node.props.get_texture)
        r, g, b = (min(max(channel, 0.0), 1.0) for channel in value.color)
        return replace(value, color=(r, g, b))

    def unbounded(self, node: Node, name: str, default: float) -> Triple:
        """A colour of any size, as an index of refraction."""
        value = self._value(node, name, default, node.props.get_unbounded_texture)
        if value.texture is not None:
            self.notes.append(f"{node.line}: the texture of {name}, {default:g} in its place")
            return (default, default, default)
        return value.color

    def radiance(self, node: Node, name: str) -> Value:
        """That of an emitter, which a texture may say; 1, as Mitsuba has it, where it is left out."""
        other = node.named.get(name)
        if other is not None and other.plugin not in ("bitmap", "checkerboard"):
            node.asked.add(name)
            emitter = self.mi.load_dict({"type": "constant", "radiance": other.as_dict()})
            r, g, b = np.array(emitter.eval(self.mi.SurfaceInteraction3f()), np.float64).tolist()
            return Value((r, g, b))
        value = self._value(node, name, 1.0, node.props.get_emissive_texture)
        if value.attribute:
            self.notes.append(f"{node.line}: colours of vertices for {name}, 1 in their place")
        return replace(value, attribute="")

    def number(self, node: Node, name: str, default: float) -> Value:
        """A number, or a texture whose red channel is one."""
        other = node.named.get(name)
        if other is None:
            grey = node.number(name, default)
            return Value((grey, grey, grey))
        node.asked.add(name)
        if other.plugin == "mesh_attribute":
            self.notes.append(f"{other.line}: {other.title} as a number")
            return Value((default, default, default))
        return Value((1.0, 1.0, 1.0), self.texture(other, grey=True))

    def texture(self, node: Node, grey: bool = False) -> Texture:
        """A bitmap or a checkerboard; ``grey``, its luminance."""
        key = node, grey
        if key not in self._made:
            match node.plugin:
                case "bitmap":
                    found = self._bitmap(node)
                case "checkerboard":
                    dark, light = (self.reflectance(node, f"color{i}", (0.4, 0.2)[i]).color for i in (0, 1))
                    board = np.array([[dark, light], [light, dark]], np.float32)
                    found = Texture(Image(board, "linear"), filter="nearest")
                case _:
                    raise node.error("this texture is not known; use a bitmap")
            found = replace(found, **self._mapping(node))
            if grey:
                found = mapped(found, lambda pixels: pixels[..., :3] @ _LUMINANCE)
            self._made[key] = found
        return self._made[key]

    def bump(self, node: Node, scale: float, lengths: Lengths) -> Texture:
        """Heights as a normal map, where u and v of texture coordinates grow by 1 along these ``lengths``."""
        texture = self.texture(node, grey=True)
        coarse = scale * linear_pixels(texture.image)[..., 0]
        edge: Any = "wrap" if texture.wrap_u == "repeat" else "edge"
        # Mitsuba's slopes jump between texels, where heights are interpolated: finer ones are nearer to that.
        times = max(1, min(_FINER, int(np.sqrt(_MOST_BUMPS / coarse.size))))
        heights = _finer(_finer(coarse, times, edge).T, times, edge).T
        rows, columns = heights.shape
        wide = np.pad(heights, 1, edge)
        steps = columns * (wide[1:-1, 2:] - wide[1:-1, :-2]) / 2, rows * (wide[2:, 1:-1] - wide[:-2, 1:-1]) / 2
        along_u, along_v = np.tensordot(node.matrix("to_uv")[:2, :2].T, np.stack(steps), 1)
        # The bitangent of a normal map points up in the image, against v.
        normals = np.stack([-along_u / lengths[0], along_v / lengths[1], np.ones_like(heights)], axis=-1)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return replace(texture, image=Image((0.5 + 0.5 * normals).astype(np.float32), "linear"))

    def _value(self, node: Node, name: str, default: float, convert: Callable[[str], Any]) -> Value:
        node.asked.add(name)
        other = node.named.get(name)
        if other is None:
            if not node.has(name):
                return Value((default, default, default))
            if node.props.type(name) == self.mi.Properties.Type.Color:
                r, g, b = (float(channel) for channel in node.props[name])
                return Value((r, g, b))
            plugin = convert(name)
            r, g, b = np.broadcast_to(np.array(self.mi.traverse(plugin)["value"], np.float64), 3).tolist()
            return Value((r, g, b))
        if other.plugin == "mesh_attribute":
            attribute = other.text("name", "")
            if attribute == VERTEX_COLORS:
                scale = other.number("scale", 1.0)
                return Value((scale, scale, scale), attribute=attribute)
            self.notes.append(f"{other.line}: {other.title}, {default:g} in its place")
            return Value((default, default, default))
        return Value((1.0, 1.0, 1.0), self.texture(other))

    def _bitmap(self, node: Node) -> Texture:
        space: ColorSpace = "linear" if node.flag("raw", False) else "srgb"
        path = node.file()
        if (path, space) not in self._images:
            self._images[path, space] = self._image(node, path, space)
        wrap = node.text("wrap_mode", "repeat")
        filter_type = node.text("filter_type", "bilinear")
        if wrap not in _WRAPS or filter_type not in _FILTERS:
            raise node.error(f"wrap_mode {wrap!r} or filter_type {filter_type!r} is not known")
        way: Any = _WRAPS[wrap]
        kind: Any = _FILTERS[filter_type]
        return Texture(self._images[path, space], way, way, kind)

    def _image(self, node: Node, path: Path, space: ColorSpace) -> Image:
        try:
            return read_texture(path, space)
        except FragtracerError as error:
            try:
                bitmap = self.mi.Bitmap(str(path))
            except RuntimeError:
                raise node.error(str(error)) from None
            pixel = self.mi.Bitmap.PixelFormat.RGB
            return Image(np.array(bitmap.convert(pixel, self.mi.Struct.Type.Float32, False)), "linear", str(path))

    def _mapping(self, node: Node) -> dict[str, Any]:
        """How texture coordinates are transformed."""
        matrix = node.matrix("to_uv")
        (a, b), (c, d) = matrix[:2, :2]
        x = float(np.hypot(a, c))
        y = (a * d - b * c) / x if x > 0 else 0.0
        if x == 0 or y == 0:
            raise node.error("to_uv takes all texture coordinates to a line or a point")
        if abs(a * b + c * d) > 1e-5 * abs(x * y):
            self.notes.append(f"{node.line}: the shear of to_uv")
        u, v = matrix[:2, 3].tolist()
        return {"scale": (x, float(y)), "rotation": float(np.arctan2(-c, a)), "offset": (u, v)}


def _finer(heights: Floats, times: int, edge: Any) -> Floats:
    """So many ``times`` more rows, interpolated linearly between those of ``heights``."""
    wide = np.pad(heights, ((1, 1), (0, 0)), edge)
    place = (np.arange(times * len(heights)) + 0.5) / times + 0.5
    row = place.astype(np.int64)
    share = (place - row)[:, None]
    found: Floats = (1 - share) * wide[row] + share * wide[row + 1]
    return found


def mapped(texture: Texture, change: Callable[[Floats], Floats]) -> Texture:
    """``texture`` with other pixels, (h, w) or (h, w, channels), made of the linear ones (h, w, 4)."""
    pixels = change(linear_pixels(texture.image))
    return replace(texture, image=Image(pixels.astype(np.float32), "linear"))
