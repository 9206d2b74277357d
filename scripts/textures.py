# SPDX-License-Identifier: MIT
"""Makes the bundled textures of scenes/textures/, all of which but the leaf repeat without a seam.

usage: python scripts/textures.py

Files of colours are sRGB; heights become normal maps whose green points up the image, as in glTF.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

OUTPUT = Path(__file__).parents[1] / "scenes" / "textures"
Floats = NDArray[np.float64]


def grid(size: int) -> tuple[Floats, Floats]:
    """Coordinates (u, v) of the middles of size x size texels, v downwards."""
    middle = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(middle, middle)
    return u, v


def noise(u: Floats, v: Floats, cells: tuple[int, int], seed: int, octaves: int = 1) -> Floats:
    """Smooth noise in [0, 1] that repeats with u and v, of ``cells`` (along u, along v) and finer ones."""
    total, weight = np.zeros_like(u), 0.0
    for octave in range(octaves):
        columns, rows = cells[0] << octave, cells[1] << octave
        values = np.random.default_rng([seed, octave]).random((rows, columns))
        x, y = u % 1 * columns, v % 1 * rows
        left, upper = np.floor(x).astype(int), np.floor(y).astype(int)
        s, t = smooth(x - left), smooth(y - upper)
        corner = [[values[(upper + i) % rows, (left + j) % columns] for j in (0, 1)] for i in (0, 1)]
        above, below = (row[0] * (1 - s) + row[1] * s for row in corner)
        total += 0.5**octave * (above * (1 - t) + below * t)
        weight += 0.5**octave
    return total / weight


def smooth(x: Floats) -> Floats:
    """From 0 to 1 over [0, 1], level at both ends."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def blend(a: tuple[float, ...], b: tuple[float, ...], t: Floats) -> Floats:
    """Colours between ``a`` and ``b``."""
    return np.asarray(a) * (1 - t[..., None]) + np.asarray(b) * t[..., None]


def normals(height: Floats, strength: float) -> Floats:
    """The normal map of a height field that repeats, in [0, 1]; ``strength`` is the height of 1 in widths."""
    size = len(height)
    slope_u = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) * size / 2
    slope_up = (np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)) * size / 2
    normal = np.stack([-strength * slope_u, -strength * slope_up, np.ones_like(height)], axis=-1)
    return 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def checker() -> dict[str, Floats]:
    """Two greys on 8 x 8 squares."""
    u, v = grid(64)
    odd = (np.floor(8 * u) + np.floor(8 * v)) % 2
    return {"checker": blend((0.36,) * 3, (0.82,) * 3, odd)}


def wood() -> dict[str, Floats]:
    """Four boards along u, of other pieces of grain, with a groove between them."""
    u, v = grid(512)
    board = np.floor(4 * v)
    shift = np.array([0.13, 0.71, 0.37, 0.59])[board.astype(int)]
    bend = 0.05 * noise(u + shift, v, (3, 8), 1, 2)
    grain = noise(u + shift, v + bend, (2, 48), 2, 2)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (10 * (v + bend) + 1.5 * grain))
    across = 4 * v % 1
    groove = smooth(np.minimum(across, 1 - across) / 0.04)
    tone = 0.55 * rings + 0.45 * grain
    color = blend((0.36, 0.20, 0.09), (0.66, 0.44, 0.25), tone) * (0.85 + 0.3 * shift[..., None])
    color *= (0.35 + 0.65 * groove)[..., None]
    return {
        "wood_albedo": color,
        "wood_normal": normals(0.85 * groove + 0.15 * rings, 0.006),
        "wood_roughness": 0.42 + 0.25 * (1 - tone) + 0.2 * (1 - groove),
    }


def tiles() -> dict[str, Floats]:
    """Glazed tiles, 4 x 4, each of a tone of its own, in matt joints."""
    u, v = grid(512)
    column, row = np.floor(4 * u).astype(int), np.floor(4 * v).astype(int)
    tone = np.random.default_rng(3).random((4, 4))[row, column]
    edge = np.minimum.reduce([4 * u % 1, 1 - 4 * u % 1, 4 * v % 1, 1 - 4 * v % 1])
    glazed = smooth((edge - 0.03) / 0.03)
    cloud = noise(u, v, (8, 8), 4, 3)
    color = blend((0.10, 0.30, 0.36), (0.32, 0.56, 0.58), 0.6 * tone + 0.4 * cloud)
    return {
        "tiles_albedo": color * glazed[..., None] + np.multiply(0.62, [1, 0.97, 0.92]) * (1 - glazed[..., None]),
        "tiles_normal": normals(smooth((edge - 0.025) / 0.075), 0.012),
        "tiles_roughness": 0.85 - glazed * (0.7 - 0.12 * cloud),
    }


def hammered() -> dict[str, Floats]:
    """Dents in sheet metal, and how rough they are worn: a normal map and a roughness map without colour."""
    u, v = grid(256)
    rng = np.random.default_rng(5)
    depth = np.zeros_like(u)
    for x, y, radius in zip(*rng.random((2, 140)), rng.uniform(0.05, 0.09, 140), strict=True):
        du, dv = np.abs(u - x), np.abs(v - y)
        away = np.hypot(np.minimum(du, 1 - du), np.minimum(dv, 1 - dv)) / radius
        depth = np.maximum(depth, np.clip(1 - away**2, 0, 1))
    return {
        "hammered_normal": normals(-depth, 0.012),
        "hammered_roughness": 0.22 + 0.25 * noise(u, v, (4, 4), 6, 4) * (1 - 0.5 * depth),
    }


def grille() -> dict[str, Floats]:
    """A sheet with round holes: alpha is 0 in them, and soft over two texels at their edges."""
    u, v = grid(256)
    away = np.hypot(4 * u % 1 - 0.5, 4 * v % 1 - 0.5)
    alpha = np.clip(0.5 + (away - 0.36) * 256 / 4 / 2, 0, 1)
    metal = blend((0.50, 0.49, 0.47), (0.62, 0.60, 0.57), noise(u, v, (4, 64), 7))
    return {"grille": np.concatenate([metal, alpha[..., None]], axis=-1)}


def leaf() -> dict[str, Floats]:
    """One leaf with its veins, upright, to be cut out by its alpha."""
    u, v = grid(256)
    along = 1 - v  # from the stalk upwards
    half = 0.34 * np.sin(np.pi * np.clip((along - 0.12) / 0.84, 0, 1)) ** 0.8 * (1.1 - 0.45 * along)
    side = np.abs(u - 0.5)
    inside = np.clip((half - side) * 128, 0, 1) * (along > 0.12)
    stalk = np.clip(0.5 + (0.012 - side) * 128, 0, 1) * (along <= 0.14)
    veins = np.abs((along - 0.9 * side) * 9 % 1 - 0.5)
    vein = np.maximum(smooth(1 - veins / 0.09), smooth(1 - side / 0.012))
    green = blend((0.13, 0.36, 0.10), (0.30, 0.52, 0.14), noise(u, v, (6, 6), 8, 3))
    color = green * (1 - 0.45 * vein[..., None]) + np.multiply(0.45 * vein[..., None], (0.62, 0.72, 0.36))
    return {"leaf": np.concatenate([color, np.maximum(inside, stalk)[..., None]], axis=-1)}


def glow() -> dict[str, Floats]:
    """Lamps in rows of three colours on black, for what emits."""
    u, v = grid(128)
    color = np.array([(1.0, 0.78, 0.45), (0.45, 0.75, 1.0), (1.0, 0.45, 0.55)])[np.floor(3 * v).astype(int) % 3]
    away = np.hypot(6 * u % 1 - 0.5, (3 * v % 1 - 0.5))
    return {"glow": color * smooth((0.42 - away) / 0.12)[..., None]}


def fruit() -> dict[str, Floats]:
    """Skins of an apple and a pear, from the stalk down, and the pores of an orange."""
    u, v = grid(256)
    fade = 1 - smooth(v / 0.05) * smooth((1 - v) / 0.05)  # to one colour at the poles
    streaks = noise(u, v, (56, 3), 9, 2)
    blush = smooth((0.8 * noise(u, v, (2, 2), 10, 2) + 0.5 * streaks + 0.5 * smooth((v - 0.05) / 0.3) - 0.62) / 0.45)
    apple = blend((0.80, 0.62, 0.22), (0.62, 0.07, 0.08), blush) * (0.8 + 0.3 * streaks[..., None])
    apple = blend_maps(apple, (0.45, 0.36, 0.14), fade)
    apple = blend_maps(apple, (0.86, 0.66, 0.42), 0.5 * specks(u, v, 260, 0.0045, 11))
    pear = blend((0.58, 0.60, 0.17), (0.80, 0.70, 0.25), noise(u, v, (4, 3), 12, 3))
    pear = blend_maps(pear, (0.72, 0.34, 0.16), 0.55 * smooth((noise(u, v, (2, 2), 13, 3) - 0.52) / 0.25))
    pear = blend_maps(pear, (0.42, 0.30, 0.12), np.maximum(0.6 * specks(u, v, 700, 0.0035, 14), 0.8 * fade))
    pores = specks(u, v, 900, 0.016, 15)
    return {"apple": apple, "pear": pear, "peel_normal": normals(-pores, 0.0035)}


def linen() -> dict[str, Floats]:
    """A plain weave of 16 x 16 threads, of uneven width."""
    u, v = grid(256)
    warp, weft = (
        16 * (u + 0.012 * (noise(u, v, (4, 16), 16) - 0.5)),
        16 * (v + 0.012 * (noise(u, v, (16, 4), 17) - 0.5)),
    )
    over = np.cos(np.pi * warp) * np.cos(np.pi * weft) > 0
    thread = np.where(over, np.abs(np.sin(np.pi * (warp + 0.5))), np.abs(np.sin(np.pi * (weft + 0.5))))
    return {"linen_normal": normals(np.sqrt(np.clip(thread, 0, 1)), 0.012)}


def specks(u: Floats, v: Floats, count: int, radius: float, seed: int) -> Floats:
    """Round spots from 0 at the rim to 1, scattered so that they repeat."""
    rng = np.random.default_rng(seed)
    found = np.zeros_like(u)
    for x, y, size in zip(*rng.random((2, count)), radius * rng.uniform(0.6, 1.4, count), strict=True):
        du, dv = np.abs(u - x), np.abs(v - y)
        away = np.hypot(np.minimum(du, 1 - du), np.minimum(dv, 1 - dv)) / size
        found = np.maximum(found, smooth(1 - away))
    return found


def blend_maps(colors: Floats, other: tuple[float, ...], t: Floats) -> Floats:
    """``colors`` (h, w, 3), and where ``t`` is 1 the colour ``other``."""
    return colors * (1 - t[..., None]) + np.asarray(other) * t[..., None]


MAKERS: tuple[Callable[[], dict[str, Floats]], ...] = (checker, wood, tiles, hammered, grille, leaf, glow, fruit, linen)


def textures() -> dict[str, NDArray[np.uint8]]:
    """The bytes of every texture by its name."""
    found: dict[str, NDArray[np.uint8]] = {}
    for make in MAKERS:
        found |= {name: np.rint(255 * np.clip(values, 0, 1)).astype(np.uint8) for name, values in make().items()}
    return found


def main() -> None:
    OUTPUT.mkdir(exist_ok=True)
    for name, pixels in textures().items():
        Image.fromarray(pixels).save(OUTPUT / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
