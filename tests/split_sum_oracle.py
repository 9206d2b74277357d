# SPDX-License-Identifier: MIT
"""The maps of shaders/split_sum/ again in float64, and the integrals that they stand for."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.scene.environment import direction_of, lookup

Floats = NDArray[np.float64]


def picture(height: int, sharpness: float = 0.0) -> NDArray[np.float32]:
    """A positive environment without symmetry; with a soft sun of that many lobes' exponent, if any."""
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height), indexing="ij")
    d = direction_of(u, v)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    colors = np.stack([1 + 0.5 * y + 0.3 * x * z, 1 - 0.6 * x + 0.2 * y * y, 1.2 + 0.7 * z - 0.3 * x * y], axis=-1)
    if sharpness:
        colors += 20 * np.exp(sharpness * (d @ np.array([0.48, 0.6, -0.64]) - 1))[..., None]
    return colors.astype(np.float32)


def sphere(rows: int) -> tuple[Floats, Floats]:
    """Directions (n, 3) all over the sphere, and the solid angle of each (n,)."""
    v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(2 * rows) + 0.5) / (2 * rows), indexing="ij")
    edges = np.cos(np.pi * np.arange(rows + 1) / rows)
    angle = np.repeat((edges[:-1] - edges[1:]) * np.pi / rows, 2 * rows)
    return direction_of(u, v).reshape(-1, 3), angle


class Integrals:
    """Of an environment over the sphere."""

    def __init__(self, pixels: ArrayLike, rows: int = 360) -> None:
        self._directions, self._angle = sphere(rows)
        self._radiance = lookup(pixels, self._directions)

    def irradiance(self, normal: Floats) -> Floats:
        """Over pi."""
        weight = np.maximum(self._directions @ normal, 0) * self._angle
        return np.asarray(weight @ self._radiance / np.pi)

    def lobe_mean(self, normal: Floats, alpha: float) -> Floats:
        """The mean radiance over the lobe seen along the normal, weighted by the cosine."""
        cosine = self._directions @ normal
        weight = np.maximum(cosine, 0) * self._angle * d_ggx(alpha, (1 + cosine) / 2)
        return np.asarray(weight @ self._radiance / weight.sum())


def d_ggx(alpha: float, cosine2: ArrayLike) -> Floats:
    return np.asarray(alpha**2 / np.pi / (np.asarray(cosine2) * (alpha**2 - 1) + 1) ** 2)


def brdf(cosine: float, roughness: float, g1: object, steps: int = 1500) -> tuple[float, float]:
    """Factors of F0 and F90: half vectors by D cos, evenly in the two coordinates of its inverse distribution; half a
    turn, of which the other is the mirror image."""
    alpha = roughness**2
    u = ((np.arange(steps) + 0.5) / steps)[:, None]
    phi = np.pi * ((np.arange(180) + 0.5) / 180)[None, :]
    h_z = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    h_x = np.sqrt(1 - h_z**2) * np.cos(phi)
    v_h = h_x * np.sqrt(1 - cosine**2) + h_z * cosine
    l_z = 2 * v_h * h_z - cosine
    lit = (l_z > 0) & (v_h > 0)
    g = g1(alpha, cosine) * g1(alpha, np.where(lit, l_z, 1))  # type: ignore[operator]
    value = np.where(lit, g * v_h / (h_z * cosine), 0)
    grazing = (1 - np.clip(v_h, 0, 1)) ** 5
    return float((value * (1 - grazing)).mean()), float((value * grazing).mean())


def g1_smith(alpha: float, cosine: ArrayLike) -> Floats:
    c = np.asarray(cosine)
    return np.asarray(2 * c / (c + np.sqrt(alpha**2 + (1 - alpha**2) * c**2)))


def g1_environment(alpha: float, cosine: ArrayLike) -> Floats:
    """k = roughness^2 / 2."""
    c, k = np.asarray(cosine), alpha / 2
    return np.asarray(c / (c * (1 - k) + k))


def cube_directions(size: int) -> Floats:
    """(size + 2, 6 (size + 2), 3): as cube_direction of texture/cube.glsl."""
    st = (2 * np.arange(-1, size + 1) + 1) / size - 1
    s, t = np.meshgrid(st, st)
    beyond = np.stack([np.maximum(np.abs(s) - 1, 0), np.maximum(np.abs(t) - 1, 0)])
    depth = np.where(beyond.min(axis=0) > 0, 1, 1 - beyond.sum(axis=0))
    s, t = np.clip(s, -1, 1), np.clip(t, -1, 1)
    faces = [(depth, t, s), (-depth, t, -s), (s, depth, t), (s, -depth, -t), (-s, t, depth), (s, t, -depth)]
    points = np.concatenate([np.stack(face, axis=-1) for face in faces], axis=1)
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def cube_place(direction: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Face and st of directions (n, 3)."""
    axis = np.abs(direction).argmax(axis=-1)
    x, y, z = direction.T
    depth = np.take_along_axis(direction, axis[:, None], axis=-1)[:, 0]
    side = np.sign(depth)
    s = np.choose(axis, [side * z, x, -side * x])
    t = np.choose(axis, [y, side * z, y])
    return 2 * axis + (side < 0), np.stack([s, t], axis=-1) / np.abs(depth)[:, None]


def cube_lookup(levels: list[Floats], direction: Floats, level: Floats) -> Floats:
    """Between the texels of the levels of a cube map, and between levels."""
    level = np.clip(level, 0, len(levels) - 1)
    lower = np.minimum(level.astype(int), len(levels) - 2)
    face, st = cube_place(direction)
    result = np.zeros((len(direction), 3))
    for number, of_level in enumerate(levels):
        weight = np.maximum(
            0, np.where(lower == number, 1 - (level - lower), np.where(lower + 1 == number, level - lower, 0))
        )
        used = weight > 0
        if used.any():
            result[used] += weight[used, None] * _bilinear(of_level, face[used], st[used])
    return result


def _bilinear(level: Floats, face: NDArray[np.int64], st: Floats) -> Floats:
    size = level.shape[0] - 2
    place = (0.5 * st + 0.5) * size + 0.5
    corner = np.floor(place).astype(int)
    corner = np.clip(corner, 0, size)
    fx, fy = (place - corner).T[:, :, None]
    x, y = corner[:, 0] + face * (size + 2), corner[:, 1]
    lower = level[y, x] * (1 - fx) + level[y, x + 1] * fx
    upper = level[y + 1, x] * (1 - fx) + level[y + 1, x + 1] * fx
    return np.asarray(lower * (1 - fy) + upper * fy)


def pyramid(pixels: ArrayLike, size: int, taps: int) -> list[Floats]:
    """The levels of the environment as a cube map."""
    middles = cube_directions(size)
    face, st = cube_place(middles.reshape(-1, 3))
    total, weights = np.zeros((len(face), 3)), np.zeros(len(face))
    for i in range(taps):
        for j in range(taps):
            moved = st + ((np.array([i, j]) + 0.5) / taps - 0.5) * 2 / size
            weight = (1 + (moved**2).sum(axis=-1)) ** -1.5
            total += weight[:, None] * lookup(pixels, _point(face, moved))
            weights += weight
    levels = [(total / weights[:, None]).reshape(middles.shape)]
    while size > 1:
        levels.append(_halved(levels[-1], size))
        size //= 2
    return levels


def _point(face: NDArray[np.int64], st: Floats) -> Floats:
    s, t = st.T
    side = np.where(face % 2 == 0, 1.0, -1.0)
    faces = [(side, t, side * s), (s, side, side * t), (-side * s, t, side)]
    return np.stack([np.choose(face // 2, [f[k] for f in faces]) for k in range(3)], axis=-1)


def _halved(level: Floats, size: int) -> Floats:
    half = size // 2
    st = (2 * np.arange(size) + 1) / size - 1
    weight = (1 + st[:, None] ** 2 + st**2) ** -1.5
    insides = []
    for face in range(6):
        inside = level[1:-1, face * (size + 2) + 1 : (face + 1) * (size + 2) - 1]
        parts = (inside * weight[..., None]).reshape(half, 2, half, 2, 3).sum(axis=(1, 3))
        insides.append(parts / weight.reshape(half, 2, half, 2).sum(axis=(1, 3))[..., None])
    face, st = cube_place(cube_directions(half).reshape(-1, 3))
    texel = np.clip(((0.5 * st + 0.5) * half + 1e-9).astype(int), 0, half - 1)
    return np.stack(insides)[face, texel[:, 1], texel[:, 0]].reshape(half + 2, 6 * (half + 2), 3)


def prefiltered(levels: list[Floats], normal: Floats, alpha: float, samples: int) -> Floats:
    """One texel by the formula of split_sum/prefilter.frag."""
    index = np.arange(samples)
    inverse = np.array([int(f"{i:032b}"[::-1], 2) >> 8 for i in index]) / 2**24
    turns, z = index / samples, 1 - 2 * inverse  # the spherical caps of ggx_sample_vndf, at normal incidence
    r = np.sqrt(1 - z * z)
    h = np.stack([alpha * r * np.cos(2 * np.pi * turns), alpha * r * np.sin(2 * np.pi * turns), z + 1], axis=-1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    local = 2 * h[:, 2:] * h - np.array([0, 0, 1])
    lit = local[:, 2] > 0
    pdf = d_ggx(alpha, h[:, 2] ** 2) / 4
    size = levels[0].shape[0] - 2
    level = 0.5 * np.log2(1 / (samples * pdf) / (4 * np.pi / (6 * size**2)))
    s = 1.0 if normal[2] >= 0 else -1.0
    a = -1 / (s + normal[2])
    b = normal[0] * normal[1] * a
    frame = np.array(
        [[1 + s * normal[0] ** 2 * a, s * b, -s * normal[0]], [b, s + normal[1] ** 2 * a, -normal[1]], normal]
    )
    radiance = cube_lookup(levels, (local @ frame)[lit], level[lit])
    weight = local[lit, 2]
    return np.asarray(weight @ radiance / weight.sum())
