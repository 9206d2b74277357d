# SPDX-License-Identifier: MIT
"""Domains of samplers, each as a map from the unit square in which its cells are equal rectangles.

The maps are written anew in float64, not taken from shaders/core/warp.glsl, and crowd cells where a
density is high: a lobe of width 1e-3 gets as many of them as a wide one.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from . import Floats


class Domain(Protocol):
    """A piece of a plane, a sphere or a triangle with coordinates (s, t) in the unit square."""

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Points (n, k), and the measure of the domain over that of the square there."""

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        """Coordinates of points; s outside [0, 1) for those that do not lie in the domain."""


@dataclass(frozen=True)
class Box:
    """The square of half width ``half`` around the origin, or the unit square if that is None."""

    half: float | None = None

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        points = np.stack([s, t], -1)
        if self.half is None:
            return points, np.ones(len(s))
        return self.half * (2 * points - 1), np.full(len(s), 4 * self.half**2)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        square = points if self.half is None else (points / self.half + 1) / 2
        s, t = square.T
        return np.where((t >= 0) & (t <= 1), s, -1), t


class Disk:
    """The unit disk: s is the square of the radius."""

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        return np.sqrt(s)[:, None] * _circle(t), np.full(len(s), np.pi)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        return (points**2).sum(1), _turns(points)


@dataclass(frozen=True)
class GaussianPlane:
    """The plane, in cells of equal mass under a normal distribution of deviation ``sigma``."""

    sigma: float

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        radius = self.sigma * np.sqrt(-2 * np.log1p(-s))
        return radius[:, None] * _circle(t), 2 * np.pi * self.sigma**2 / (1 - s)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        return -np.expm1(-(points**2).sum(1) / (2 * self.sigma**2)), _turns(points)


class Triangle:
    """Weights of the second and third vertex of a triangle."""

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        r = np.sqrt(s)
        return np.stack([r * (1 - t), r * t], -1), np.full(len(s), 0.5)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        r = points.sum(1)
        inside = (points >= 0).all(1)
        return np.where(inside, r**2, -1), points[:, 1] / np.where(r > 0, r, 1)


@dataclass(frozen=True)
class Cone:
    """Unit vectors around ``axis`` with 1 - cos below ``height``: 1 for a hemisphere, 2 for the sphere.

    ``slack`` widens the rim by a fraction of the height, for float32 vectors in a narrow cone.
    """

    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    height: float = 1.0
    slack: float = 0.0

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        fall = s * self.height
        radius = np.sqrt(fall * (2 - fall))
        local = np.concatenate([radius[:, None] * _circle(t), 1 - fall[:, None]], 1)
        return local @ self._frame(), np.full(len(s), 2 * np.pi * self.height)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        local = points @ self._frame().T
        sin2 = (local[:, :2] ** 2).sum(1)
        # 1 - cos loses its digits in a narrow cone; sin^2 / (1 + cos) does not.
        s = np.where(local[:, 2] > 0, sin2 / (1 + local[:, 2]), 1 - local[:, 2]) / self.height
        return np.where((s >= 1) & (s <= 1 + self.slack), np.nextafter(1, 0), s), _turns(local)

    def _frame(self) -> Floats:
        """Rows: two vectors across the axis, and the axis."""
        z = np.asarray(self.axis) / np.linalg.norm(self.axis)
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        return np.stack([x, np.cross(z, x), z])


class Grazing:
    """Directions above the surface, in rings that are the closer the lower they are: s = 1 - sqrt(z)."""

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        z = (1 - s) ** 2
        return np.concatenate([np.sqrt(1 - z**2)[:, None] * _circle(t), z[:, None]], 1), 4 * np.pi * (1 - s)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        z = points[:, 2]
        return np.where(z > 0, 1 - np.sqrt(np.maximum(z, 0)), -1), _turns(points)


@dataclass(frozen=True)
class VisibleNormals:
    """Half vectors wh above the surface with wo . wh > 0, in rings around the normal that widen from a
    fraction of ``alpha`` to the whole hemisphere: s = asinh(2 theta / alpha) / asinh(2 theta_max / alpha)."""

    alpha: float
    wo: tuple[float, float, float]

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        scale = self._scale(np.cos(2 * np.pi * t))
        theta = self.alpha / 2 * np.sinh(s * scale)
        x, y = (np.sin(theta)[:, None] * _circle(t)).T
        wh = np.stack([self._to_wo[0] * x - self._to_wo[1] * y, self._to_wo[1] * x + self._to_wo[0] * y, np.cos(theta)])
        return wh.T, 2 * np.pi * np.sin(theta) * self.alpha / 2 * np.cosh(s * scale) * scale

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        """Of directions, of any length."""
        x = self._to_wo[0] * points[:, 0] + self._to_wo[1] * points[:, 1]
        y = self._to_wo[0] * points[:, 1] - self._to_wo[1] * points[:, 0]
        radius = np.sqrt(x**2 + y**2)
        theta = np.arctan2(radius, points[:, 2])
        return _arcsinh(2 * theta / self.alpha) / self._scale(x / np.maximum(radius, 1e-300)), _turned(y, x)

    @property
    def _to_wo(self) -> tuple[float, float]:
        """The horizontal direction that azimuths begin at."""
        x, y, _ = self.wo
        length = float(np.hypot(x, y))
        return (x / length, y / length) if length else (1.0, 0.0)

    def _scale(self, cosine: Floats) -> Floats:
        return _arcsinh(2 * self._largest_theta(cosine) / self.alpha)

    def _largest_theta(self, cosine: Floats) -> Floats:
        """Where wo . wh becomes 0, or wh horizontal, at azimuths of that cosine."""
        return np.minimum(np.pi / 2, self._perpendicular(cosine))

    def _perpendicular(self, cosine: Floats) -> Floats:
        return np.arctan2(self.wo[2], -np.hypot(self.wo[0], self.wo[1]) * cosine)


class Reflections(VisibleNormals):
    """Directions wi above the surface, in the cells of their half vectors with ``wo``."""

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        wh, measure = super().place(s, t)
        cosine = wh @ np.array(self.wo)
        return 2 * cosine[:, None] * wh - self.wo, 4 * cosine * measure

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        return super().locate(points + self.wo)

    def _largest_theta(self, cosine: Floats) -> Floats:
        """Where wi becomes horizontal: tan(2 theta) = -cos_o / (sin_o cos phi)."""
        return self._perpendicular(cosine) / 2


@dataclass(frozen=True)
class Refractions:
    """Directions wi below the surface of a dielectric, in the cells of the facets that refract light there from ``wo``:
    in rings around the normal that widen from a fraction of ``alpha``, or around ``wo`` where the normal reflects all.
    """

    alpha: float
    eta: float
    wo: tuple[float, float, float]

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        width, scale = self._width, np.arcsinh(2 * self._largest_theta(t) / self._width)
        theta = width / 2 * np.sinh(s * scale)
        wh = self._facet(theta, t)
        wi = self._refracted(wh)
        cosine = np.abs((wi * wh).sum(1))
        measure = 2 * np.pi * np.sin(theta) * width / 2 * np.cosh(s * scale) * scale
        return wi, measure * (wh @ np.array(self.wo) - self.eta * cosine) ** 2 / (
            self.eta**2 * np.maximum(cosine, 1e-12)
        )

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        wh = np.asarray(self.wo) + self.eta * points  # of any length
        x, y, z = (wh * np.where(wh[:, 2:] < 0, -1, 1) @ self._frame.T).T
        t, theta = _turned(y, x), np.arctan2(np.sqrt(x**2 + y**2), z)
        return _arcsinh(2 * theta / self._width) / _arcsinh(2 * self._largest_theta(t) / self._width), t

    @cached_property
    def _is_critical(self) -> bool:
        return self.wo[0] ** 2 + self.wo[1] ** 2 >= self.eta**2

    @property
    def _width(self) -> float:
        return 1.0 if self._is_critical else self.alpha

    @cached_property
    def _frame(self) -> Floats:
        """Rows: two vectors across the axis, and the axis."""
        return Cone(self.wo if self._is_critical else (0.0, 0.0, 1.0))._frame()

    def _facet(self, theta: Floats, t: Floats) -> Floats:
        facets: Floats = np.concatenate([np.sin(theta)[:, None] * _circle(t), np.cos(theta)[:, None]], 1) @ self._frame
        return facets

    def _refracted(self, wh: Floats) -> Floats:
        cosine = wh @ np.array(self.wo)
        beyond = np.sqrt(np.maximum(1 - (1 - cosine**2) / self.eta**2, 0))
        return (cosine / self.eta - beyond)[:, None] * wh - np.array(self.wo) / self.eta

    def passes(self, theta: Floats, t: Floats) -> NDArray[np.bool_]:
        """Whether the facets at an angle from the axis refract light from ``wo`` to below the surface."""
        wh = self._facet(theta, t)
        cosine = wh @ np.array(self.wo)
        return (wh[:, 2] > 0) & (cosine > 0) & (1 - cosine**2 < self.eta**2) & (self._refracted(wh)[:, 2] < 0)

    def _largest_theta(self, t: Floats) -> Floats:
        return np.interp(t, *_rim(self.eta, self.wo))


@cache
def _rim(eta: float, wo: tuple[float, float, float]) -> tuple[Floats, Floats]:
    """Turns, and the angle at which there all is reflected, a facet looks away or wi becomes horizontal, by bisection:
    the same whatever the width."""
    t = np.linspace(0, 1, 4097)
    low, high = np.zeros(len(t)), np.full(len(t), np.pi)
    for _ in range(50):
        theta = (low + high) / 2
        passes = Refractions(1.0, eta, wo).passes(theta, t)
        low, high = np.where(passes, theta, low), np.where(passes, high, theta)
    return t, low


@dataclass(frozen=True)
class Sides:
    """Directions on both sides of a dielectric, in the cells of its facets: those above where s < 1/2. A smooth one has
    those of a rough one, and a pane, which has no ``eta``, below the mirror images of those above."""

    alpha: float
    eta: float | None
    wo: tuple[float, float, float]

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        above = s < 0.5
        (up, up_measure), (down, down_measure) = (
            self._above.place(np.minimum(2 * s, 1), t),
            self._below.place(np.maximum(2 * s - 1, 0), t),
        )
        return np.where(above[:, None], up, down), 2 * np.where(above, up_measure, down_measure)

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        above = points[:, 2] > 0
        s, t = np.empty((2, len(points)))
        for number, (side, its) in enumerate(((self._above, above), (self._below, ~above))):
            of_side, t[its] = side.locate(points[its])
            s[its] = np.where((of_side >= 0) & (of_side < 1), (number + of_side) / 2, -1.0)
        return s, t

    @property
    def _above(self) -> Domain:
        return Reflections(self.alpha or 1.0, self.wo)

    @cached_property
    def _below(self) -> Domain:
        return Mirrored(self._above) if self.eta is None else Refractions(self.alpha or 1.0, self.eta, self.wo)


@dataclass(frozen=True)
class Mirrored:
    """The mirror image of a domain in the surface."""

    domain: Domain

    def place(self, s: Floats, t: Floats) -> tuple[Floats, Floats]:
        points, measure = self.domain.place(s, t)
        return points * (1, 1, -1), measure

    def locate(self, points: Floats) -> tuple[Floats, Floats]:
        return self.domain.locate(points * (1, 1, -1))


def _circle(turns: Floats) -> Floats:
    return np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)], -1)


def _turns(points: Floats) -> Floats:
    """Azimuth in [0, 1]."""
    return _turned(points[:, 1], points[:, 0])


def _turned(y: Floats, x: Floats) -> Floats:
    """Azimuth in [0, 1]."""
    turns = np.arctan2(y, x) / (2 * np.pi)
    return np.where(turns < 0, turns + 1, turns)


def _arcsinh(x: Floats) -> Floats:
    """Of positive numbers, with the absolute error of a cell's place; NumPy's takes twice as long."""
    return np.log(x + np.sqrt(x**2 + 1))
