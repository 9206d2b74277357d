# SPDX-License-Identifier: MIT
"""Environment lights: radiance from infinitely far away, over the whole sphere of directions.

An equirectangular map is (h, w, 3) float32 radiance. v is 0 in the top row (+y) and 1 in the bottom row (-y); u is 0
at the left edge and 1 at the right. u = 0.5 is -z, the default view direction of a camera, u = 0.75 is +x, u = 0.25
is -x, and u = 0 and 1 are both +z. Texels are samples at their centres; lookups are bilinear, periodic in u and clamped
to the first and last row in v.
"""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.scene.content import Content, content_digest, read_only
from fragtracer.scene.fields import CONFIG, Fraction, NonNegative, Number, Strength, Triple
from fragtracer.scene.sky import sky_pixels, sun_irradiance

Floats = NDArray[np.float64]
_CONSTANT_SIZE = (32, 64)
_GRADIENT_ROWS = 256


class Panorama(Content):
    """An equirectangular map; two are equal if their content is.

    ``pixels`` is (h, w, 3) radiance in W/m²/sr, finite and not negative, stored as float32.
    ``file`` is the file it was read from, if any.

    Raises ``ValueError`` for an array of another kind.
    """

    def __init__(self, pixels: ArrayLike, file: str | None = None) -> None:
        array = read_only(pixels, np.float32)
        if array.ndim != 3 or array.shape[2] != 3 or array.size == 0:
            raise ValueError(f"the pixels of an environment are (height, width, 3) numbers, got {array.shape}")
        if not (np.isfinite(array).all() and array.min() >= 0):
            raise ValueError("the pixels of an environment must be finite and not negative")
        self.pixels: NDArray[np.float32] = array
        self.file = file
        self.digest = content_digest(self.pixels)

    def reduced(self, width: int) -> "Panorama":
        """Means of 2 x 2 texels, again and again until it is no wider than ``width``, or a side is odd."""
        pixels = self.pixels
        while pixels.shape[1] > width and pixels.shape[0] % 2 == pixels.shape[1] % 2 == 0:
            pixels = np.float32(0.5) * pixels[::2] + np.float32(0.5) * pixels[1::2]
            pixels = np.float32(0.5) * pixels[:, ::2] + np.float32(0.5) * pixels[:, 1::2]
        return self if pixels is self.pixels else Panorama(pixels)


@dataclass(frozen=True, config=CONFIG)
class Gradient:
    """Radiance (W/m²/sr) that is linear in the sine of the elevation: from ``horizon`` to ``zenith`` at +y, and to
    ``ground`` at -y."""

    zenith: Strength
    horizon: Strength
    ground: Strength

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The equirectangular map, (256, 1, 3)."""
        y = np.cos(np.pi * (np.arange(_GRADIENT_ROWS) + 0.5) / _GRADIENT_ROWS)[:, None, None]
        zenith, horizon, ground = (np.array(color) for color in (self.zenith, self.horizon, self.ground))
        pixels = np.where(y >= 0, horizon + (zenith - horizon) * y, horizon - (ground - horizon) * y)
        return np.asarray(pixels, np.float32)


@dataclass(frozen=True, config=CONFIG)
class Constant:
    """The same ``radiance`` (W/m²/sr) from all directions."""

    radiance: Strength

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The equirectangular map, (32, 64, 3): enough texels for nearly uniform sampling of directions."""
        return np.full((*_CONSTANT_SIZE, 3), self.radiance, np.float32)


@dataclass(frozen=True, config=CONFIG)
class Sky:
    """A clear sky with its sun and the ground; :mod:`fragtracer.scene.sky` names the model and the unit.

    ``turbidity`` is 1 for pure air, 2 for a very clear day, 10 for a hazy one. The sun is
    ``sun_elevation_degrees`` above the horizon, at the azimuth ``sun_azimuth_degrees`` from -z, clockwise seen from
    above: 90 is +x. A larger ``sun_radius_degrees`` makes shadows softer and the disc dimmer; the irradiance stays the
    same. With ``sun`` false there is the sky alone. ``ground_albedo`` is the albedo of the ground below the horizon.
    """

    turbidity: Annotated[float, Field(ge=1, le=10)] = 3.0
    sun_elevation_degrees: Annotated[float, Field(ge=-10, le=90)] = 45.0
    sun_azimuth_degrees: Number = 0.0
    sun_radius_degrees: Annotated[float, Field(ge=0.01, le=20)] = 0.2666
    sun: bool = True
    ground_albedo: Fraction = 0.2

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The equirectangular map, (256, 512, 3), without the sun's disc."""
        azimuth = float(np.radians(self.sun_azimuth_degrees % 360))
        elevation = float(np.radians(self.sun_elevation_degrees))
        return sky_pixels(self.turbidity, elevation, azimuth, self.ground_albedo)

    @property
    def disc(self) -> "Sun | None":
        """The sun in the space of the map; None if it is switched off or below the horizon."""
        elevation, azimuth = np.radians((self.sun_elevation_degrees, self.sun_azimuth_degrees))
        irradiance = sun_irradiance(self.turbidity, float(elevation))
        if not (self.sun and irradiance.max() > 0):
            return None
        half_angle = np.radians(self.sun_radius_degrees)
        x, y, z = direction_of(0.5 + azimuth / (2 * np.pi), 0.5 - elevation / np.pi).tolist()
        r, g, b = (irradiance / (np.pi * np.sin(half_angle) ** 2)).tolist()
        return Sun((x, y, z), float(2 * np.sin(half_angle / 2) ** 2), (r, g, b))


Source = Panorama | Constant | Gradient | Sky


@dataclass(frozen=True)
class Sun:
    """A disc of ``radiance`` (W/m²/sr) infinitely far away, towards the unit vector ``direction``, of a half
    angle whose 1 - cos is ``one_minus_cos``."""

    direction: Triple
    one_minus_cos: float
    radiance: Triple


@dataclass(frozen=True, config=CONFIG)
class Environment:
    """An environment light, given by exactly one of ``image``, ``radiance``, ``gradient`` and ``sky``.

    ``radiance`` (W/m²/sr) is constant, as that of :class:`Ambient`, to which an environment adds. The map is rotated
    by ``rotation_degrees`` about +y, counter-clockwise seen from above: 90 takes -z to -x. It is multiplied by
    ``strength`` and ``tint``. If it is not ``visible``, camera rays that leave the scene see ``background`` (W/m²/sr);
    illumination and reflections are unchanged.
    """

    image: Panorama | None = None
    radiance: Strength | None = None
    gradient: Gradient | None = None
    sky: Sky | None = None
    rotation_degrees: Number = 0.0
    strength: NonNegative = 1.0
    tint: Strength = (1.0, 1.0, 1.0)
    visible: bool = True
    background: Strength = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if sum(source is not None for source in (self.image, self.radiance, self.gradient, self.sky)) != 1:
            raise ValueError("give exactly one of image, radiance, gradient and sky")

    @property
    def source(self) -> Source:
        """The one that is given, before rotation, strength and tint."""
        if self.radiance is not None:
            return Constant(self.radiance)
        source = self.image or self.gradient or self.sky
        assert source is not None
        return source

    @property
    def sun(self) -> Sun | None:
        """The sun in world space, scaled by strength and tint; None if there is none."""
        disc = self.sky.disc if self.sky else None
        if disc is None or max(self.scale) == 0:
            return None
        x, y, z = (self.rotation @ disc.direction).tolist()
        r, g, b = (c * scale for c, scale in zip(disc.radiance, self.scale, strict=True))
        return Sun((x, y, z), disc.one_minus_cos, (r, g, b))

    @property
    def scale(self) -> Triple:
        """The factor of :attr:`pixels`, strength times tint."""
        r, g, b = (self.strength * tint for tint in self.tint)
        return (r, g, b)

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The equirectangular map, (h, w, 3) radiance before rotation and :attr:`scale`, without the sun."""
        return self.source.pixels

    @property
    def rotation(self) -> Floats:
        """(3, 3) matrix from the space of the map to world space."""
        angle = np.radians(self.rotation_degrees)
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def direction_of(u: ArrayLike, v: ArrayLike) -> Floats:
    """Unit directions (..., 3) of the coordinates u, v, in the space of the map."""
    phi = 2 * np.pi * (np.asarray(u, np.float64) - 0.5)
    theta = np.pi * np.asarray(v, np.float64)
    return np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=-1)


def place_of(direction: ArrayLike) -> Floats:
    """Coordinates (..., 2), u and v in [0, 1], of directions (..., 3) of any length in the space of the map."""
    x, y, z = np.moveaxis(np.asarray(direction, np.float64), -1, 0)
    u = 0.5 + np.arctan2(x, -z) / (2 * np.pi)
    return np.stack([u, np.arctan2(np.hypot(x, z), y) / np.pi], axis=-1)


def lookup(pixels: ArrayLike, direction: ArrayLike) -> Floats:
    """Radiance (..., 3) of a map in directions (..., 3), interpolated as above, in float64."""
    image = np.asarray(pixels, np.float64)
    height, width, _ = image.shape
    u, v = np.moveaxis(place_of(direction), -1, 0)
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    column, row = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), height - 1)
    fx, fy = (x - column)[..., None], (y - row)[..., None]
    below = np.minimum(row + 1, height - 1)
    left, right = column % width, (column + 1) % width
    upper = image[row, left] * (1 - fx) + image[row, right] * fx
    lower = image[below, left] * (1 - fx) + image[below, right] * fx
    result: Floats = upper * (1 - fy) + lower * fy
    return result
