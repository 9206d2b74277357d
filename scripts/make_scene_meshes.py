# SPDX-License-Identifier: MIT
"""Makes the meshes of the bundled scenes, ``scenes/meshes/*.glb``, from formulas; the same files at every run.

usage: python scripts/make_scene_meshes.py

Each mesh is made of patches (patches.py). The files are binary glTF 2.0, in metres, y up, standing on y = 0.
"""

import json
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from patches import Array, Mesh, joined, lathe, patch, tube

FOLDER = Path(__file__).parents[1] / "scenes" / "meshes"


def knot() -> Mesh:
    """The trefoil as a tube around the axis of a torus."""

    def center(t: Array) -> Array:
        a = 2 * np.pi * t
        r = 0.62 + 0.27 * np.cos(3 * a)
        return np.stack([r * np.cos(2 * a), 0.27 * np.sin(3 * a), r * np.sin(2 * a)], -1)

    def surface(u: Array, v: Array) -> Array:
        ahead = center(v + 1e-4) - center(v - 1e-4)
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        out = center(v) * (1, 0, 1)
        out -= ahead * (out * ahead).sum(-1, keepdims=True)
        out /= np.linalg.norm(out, axis=-1, keepdims=True)
        angle = (2 * np.pi * u)[..., None]
        return center(v) + 0.15 * (np.cos(angle) * out + np.sin(angle) * np.cross(ahead, out)) + (0, 0.42, 0)

    return patch(surface, 24, 200)


def ring() -> Mesh:
    """A band of 0.5 m radius, 0.24 m high and 2.4 cm thick, with rounded edges."""
    turn = np.linspace(-np.pi / 2, 3 * np.pi / 2, 41)
    across, up = (np.sign(wave) * np.abs(wave) ** 0.4 for wave in (np.cos(turn), np.sin(turn)))
    return lathe(np.stack([0.5 + 0.012 * across, 0.12 + 0.12 * up], -1), 128, 40)


def height_field() -> Mesh:
    """Hills on a square of 4 m: octaves of smooth waves in many directions."""
    rng = np.random.default_rng(7)
    waves = [(0.55 * 0.62**i, 1.1 * 1.55**i, *rng.uniform(0, 2 * np.pi, 2)) for i in range(9) for _ in range(3)]

    def surface(u: Array, v: Array) -> Array:
        x, z = 4 * u - 2, 2 - 4 * v
        height = sum(
            a * np.sin(k * (np.cos(d) * x + np.sin(d) * z) + p + 0.4 * np.sin(k * (x - z))) for a, k, d, p in waves
        )
        return np.stack([x, 0.5 + 0.28 * height, z], -1)

    return patch(surface, 84, 84)


def teapot() -> Mesh:
    body = [(0, 0.004), (0.036, 0.003), (0.043, 0.0), (0.0465, 0.003), (0.046, 0.009), (0.06, 0.02), (0.081, 0.047)]
    body += [
        (0.086, 0.07),
        (0.08, 0.096),
        (0.064, 0.118),
        (0.05, 0.129),
        (0.0475, 0.133),
        (0.046, 0.1345),
        (0.042, 0.131),
    ]
    lid = [(0.0465, 0.1325), (0.0475, 0.1345), (0.045, 0.137), (0.034, 0.1445), (0.018, 0.150), (0.009, 0.153)]
    lid += [(0.0062, 0.158), (0.0095, 0.164), (0.0125, 0.1705), (0.0095, 0.177), (0, 0.1795)]
    spout = [(0.06, 0.052), (0.088, 0.058), (0.108, 0.079), (0.121, 0.108), (0.138, 0.132)]
    handle = [(-0.06, 0.113), (-0.092, 0.129), (-0.128, 0.118), (-0.139, 0.088), (-0.121, 0.055), (-0.074, 0.04)]
    return joined(
        lathe(body, 64, 48),
        lathe(lid, 48, 32),
        tube(spout, [0.026, 0.021, 0.0155, 0.0125, 0.0115], 24, 40, hollow=True),
        tube(handle, [0.010, 0.0078, 0.0068, 0.0066, 0.0068, 0.0085], 14, 40),
    )


def bowl() -> Mesh:
    profile = [(0, 0.008), (0.03, 0.007), (0.043, 0.003), (0.047, 0.0), (0.05, 0.003), (0.05, 0.012), (0.078, 0.028)]
    profile += [(0.112, 0.056), (0.134, 0.088), (0.1375, 0.0955), (0.135, 0.097), (0.13, 0.09), (0.107, 0.06)]
    return lathe([*profile, (0.073, 0.034), (0.04, 0.021), (0, 0.018)], 72, 56)


def goblet() -> Mesh:
    profile = [(0, 0.002), (0.025, 0.001), (0.034, 0.0), (0.036, 0.002), (0.032, 0.005), (0.014, 0.01), (0.0075, 0.02)]
    profile += [(0.0065, 0.035), (0.0115, 0.044), (0.0115, 0.049), (0.0065, 0.058), (0.0085, 0.068), (0.024, 0.077)]
    profile += [(0.0345, 0.093), (0.0385, 0.115), (0.0385, 0.139), (0.0378, 0.1405), (0.037, 0.139), (0.0365, 0.115)]
    return lathe([*profile, (0.0325, 0.095), (0.022, 0.082), (0, 0.078)], 56, 80)


def vase() -> Mesh:
    profile = [(0, 0.004), (0.035, 0.003), (0.041, 0.0), (0.044, 0.003), (0.058, 0.04), (0.071, 0.09), (0.07, 0.13)]
    profile += [(0.052, 0.175), (0.031, 0.205), (0.025, 0.228), (0.03, 0.25), (0.0365, 0.2575), (0.0365, 0.259)]
    return lathe([*profile, (0.034, 0.2585), (0.027, 0.249), (0.0215, 0.228), (0.026, 0.205), (0.045, 0.175)], 60, 60)


def apple() -> Mesh:
    profile = [(0, 0.009), (0.006, 0.0065), (0.0135, 0.0015), (0.019, 0.001), (0.0285, 0.008), (0.038, 0.0255)]
    profile += [(0.0415, 0.043), (0.0395, 0.058), (0.031, 0.0685), (0.0205, 0.070), (0.0105, 0.064), (0.004, 0.0575)]

    def grown(u: Array, v: Array) -> Array:
        lobes = 1 + 0.022 * (1 - v) ** 2 * np.cos(10 * np.pi * u) + 0.03 * np.sin(2 * np.pi * u + 1)
        tall = 1 + 0.03 * np.sin(2 * np.pi * u) * v**2
        return np.stack([lobes, tall, np.zeros_like(u)], -1)

    return lathe([*profile, (0, 0.0555)], 52, 44, grown)


def pear() -> Mesh:
    profile = [(0, 0.006), (0.005, 0.0045), (0.011, 0.0005), (0.02, 0.003), (0.031, 0.014), (0.0365, 0.030)]
    profile += [(0.034, 0.047), (0.0262, 0.062), (0.0192, 0.076), (0.0155, 0.089), (0.0125, 0.097), (0.0075, 0.101)]

    def grown(u: Array, v: Array) -> Array:
        wide = 1 + 0.02 * np.sin(2 * np.pi * u) + 0.012 * np.sin(6 * np.pi * u + 7 * v)
        return np.stack([wide, np.ones_like(u), 0.012 * v**2], -1)

    return lathe([*profile, (0.003, 0.1005), (0, 0.099)], 48, 44, grown)


def lemon() -> Mesh:
    """It lies along the y axis: turn it."""
    profile = [(0, 0), (0.0035, 0.0005), (0.0062, 0.004), (0.0105, 0.009), (0.0205, 0.018), (0.0263, 0.031)]
    profile += [(0.0268, 0.042), (0.0235, 0.055), (0.0155, 0.0665), (0.0085, 0.0725), (0.0055, 0.077), (0.003, 0.0795)]

    def grown(u: Array, v: Array) -> Array:
        wide = 1 + 0.02 * np.sin(4 * np.pi * u) + 0.012 * np.sin(6 * np.pi * u + 9 * v)
        return np.stack([wide, np.ones_like(u), 0 * u], -1)

    return lathe([*profile, (0, 0.08)], 40, 40, grown)


def orange() -> Mesh:
    a = np.linspace(0, np.pi, 17)
    radius, height = 0.037 * np.sin(a), 0.036 - 0.035 * np.cos(a)
    height[-3:] -= np.array([0.0002, 0.0012, 0.003])

    def grown(u: Array, v: Array) -> Array:
        return np.stack([1 + 0.012 * np.sin(2 * np.pi * u + 4 * v), np.ones_like(u), 0 * u], -1)

    return lathe(np.stack([radius, height], -1), 56, 40, grown)


def stem() -> Mesh:
    """Of an apple or a pear, its foot in the origin."""
    return tube([(0, 0), (0.0005, 0.008), (0.002, 0.016), (0.005, 0.023)], [0.0018, 0.0011, 0.0012, 0.0021], 10, 12)


def cloth() -> Mesh:
    """A sheet of 0.8 by 0.6 m with folds, thicker than nothing above y = 0."""
    rng = np.random.default_rng(11)
    folds = [(rng.uniform(-0.5, 0.5), rng.uniform(0.9, 1.6), rng.uniform(0, 6), rng.uniform(0.3, 1)) for _ in range(7)]

    def surface(u: Array, v: Array) -> Array:
        x, z = 0.8 * (u - 0.5), 0.6 * (0.5 - v)
        height = np.zeros_like(x)
        for turn, pace, phase, strength in folds:
            along = np.cos(turn) * x + np.sin(turn) * z
            across = np.cos(turn) * z - np.sin(turn) * x
            ridge = np.sin(18 * pace * along + phase + 1.2 * np.sin(9 * across + phase))
            height += strength * np.exp(3 * (ridge - 1)) * (0.4 + 0.6 * np.sin(7 * across + 2 * phase) ** 2)
        edge = np.clip(np.minimum(np.minimum(u, 1 - u), np.minimum(v, 1 - v)) / 0.02, 0, 1)
        return np.stack([x + 0.006 * np.sin(21 * z), 0.0015 * edge + 0.011 * height, z + 0.005 * np.sin(17 * x)], -1)

    return patch(surface, 96, 72)


def lantern() -> Mesh:
    """A paper lantern of 16 bulging panels, open at both ends."""

    def surface(u: Array, v: Array) -> Array:
        a = 0.18 * np.pi + 0.64 * np.pi * (v - 0.0)
        bulge = 1 + 0.035 * np.abs(np.sin(16 * np.pi * u)) ** 1.2
        radius = 0.3 * np.sin(a) * bulge * (1 + 0.012 * np.cos(24 * np.pi * v))
        return np.stack([radius * np.sin(2 * np.pi * u), 0.34 - 0.36 * np.cos(a), radius * np.cos(2 * np.pi * u)], -1)

    return patch(surface, 96, 32)


def leaf() -> Mesh:
    """A bent square of side 1 from its foot in the origin along +x; the outline of a leaf is left to the texture."""

    def surface(u: Array, v: Array) -> Array:
        across = 0.5 - u
        lift = 0.25 * np.sin(0.75 * np.pi * v) + 0.3 * np.abs(across) * (1 - 0.4 * v) + 0.012 * np.sin(19 * v + 5 * u)
        return np.stack([v, lift, -across], -1)

    return patch(surface, 16, 24)


def sheet() -> Mesh:
    """A flat square of side 1 that stands on y = 0 and faces +z."""
    return patch(lambda u, v: np.stack([u - 0.5, v, 0 * u], -1), 1, 1)


def write_glb(path: Path, mesh: Mesh) -> None:
    """A mesh as binary glTF 2.0."""
    positions, normals, uvs, triangles = mesh
    points = positions.astype("<f4")
    arrays: list[tuple[NDArray[np.generic], str, int]] = [
        (points, "VEC3", 34962),
        (normals.astype("<f4"), "VEC3", 34962),
        (uvs.astype("<f4"), "VEC2", 34962),
        (triangles.astype("<u2" if len(points) < 2**16 else "<u4").ravel(), "SCALAR", 34963),
    ]
    views, accessors, data = [], [], b""
    for array, kind, target in arrays:
        chunk = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(chunk), "target": target})
        component = {"f4": 5126, "u2": 5123, "u4": 5125}[array.dtype.str[1:]]
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind})
        data += chunk + b"\0" * (-len(chunk) % 4)
    accessors[0] |= {"min": points.min(0).tolist(), "max": points.max(0).tolist()}
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}
    document = {
        "asset": {"version": "2.0", "generator": "fragtracer scripts/make_scene_meshes.py"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": path.stem}],
        "meshes": [{"name": path.stem, "primitives": [{"attributes": attributes, "indices": 3}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    header = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data))
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(header + chunks)


MAKERS: Sequence[Callable[[], Mesh]] = (
    *(
        knot,
        ring,
        height_field,
        teapot,
        bowl,
        goblet,
        vase,
        apple,
        pear,
        lemon,
        orange,
        stem,
        cloth,
        lantern,
        leaf,
        sheet,
    ),
)


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for make in MAKERS:
        mesh = make()
        path = FOLDER / f"{make.__name__.replace('_', '-')}.glb"
        write_glb(path, mesh)
        print(f"{path.name}: {len(mesh[3])} triangles, {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
