# SPDX-License-Identifier: MIT
"""An environment for the shader: its map, and the tree that texels are chosen by (light/environment.glsl)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.display.tone import REC_709
from fragtracer.packing.lights import LightKind, LightSource
from fragtracer.scene import Environment, RenderSettings
from fragtracer.scene.environment import Source

Array = NDArray[Any]

_EVEN = 0.05  # the relative variance of luminance below which BSDF sampling finds an environment well by itself
_HALF_TOP = 2.0**15  # what the largest value of a map is brought to, or half of it: half floats end at 65504


@dataclass(frozen=True, eq=False)
class EnvironmentTables:
    """The data of one map, the same object for the same map.

    ``texels`` (n, 4) are radiance / ``unit`` and weight, row by row from the top: half floats where these
    hold the radiance exactly, as they do that of .hdr and half-float .exr files, else float32. ``tree``, float32
    (n, 4), are the weights of the four nodes or texels under each node, level by level from the root.
    """

    texels: Array
    tree: NDArray[np.float32]
    size: tuple[int, int]  # width and height
    levels: int
    unit: float
    density: float
    irradiance: float  # radiance integrated over all directions, the channels added
    sampled: float  # the share of its light that light samples are for; 0 where there are to be none

    @property
    def bytes(self) -> int:
        return int(self.texels.nbytes + self.tree.nbytes)


def compensates(settings: RenderSettings) -> bool:
    """Whether light samples of an environment are weighed against BSDF samples."""
    return settings.estimator != "nee"


@lru_cache(maxsize=2)
def environment_tables(source: Source, is_compensated: bool) -> EnvironmentTables:
    """The tables of what an environment shows; ``is_compensated`` where light samples are weighed against BSDF samples.

    Texels then have weights by what their luminance is above the mean over all directions, for BSDF sampling finds the
    rest (Karlik et al. 2019, *MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling*).
    """
    pixels = source.pixels
    height, width, _ = pixels.shape
    unit = 2.0 ** np.ceil(np.log2(max(float(pixels.max()), 2.0**-100))) / _HALF_TOP
    sines = np.sin(np.pi * (np.arange(height) + 0.5) / height)
    rows = pixels.sum(axis=1, dtype=np.float64)
    mean = float(sines @ rows @ REC_709 / (sines.sum() * width))
    share, variance = _unevenness(mean, pixels, sines) if is_compensated and mean > 0 else (1.0, np.inf)
    sampled = share if variance >= _EVEN else 0.0
    base = mean / unit if 0 < sampled < 1 else 0.0
    exact = all(np.array_equal(row.astype(np.float16), row) for row in map(_scaled_by(unit), pixels))
    texels = np.empty((height, width, 4), np.float16 if exact else np.float32)
    for texel, row, sine in zip(texels, map(_scaled_by(unit), pixels), sines, strict=True):
        texel[:, :3] = row
        weights = _above(base, texel[:, :3].astype(np.float32)) * np.float32(sine)
        # No weight is rounded to 0 where there is light to be found.
        texel[:, 3] = np.where(weights > 0, np.maximum(weights, np.finfo(texels.dtype).tiny), 0)
    # The sums are of the weights as the shader reads them: what is interpolated is what is sampled.
    levels, total = _sums(texels[..., 3].astype(np.float64))
    solid_angle = 2 * np.pi**2 / (width * height)
    return EnvironmentTables(
        texels.reshape(-1, 4),
        np.concatenate([level.reshape(-1, 4) for level in levels]),
        (width, height),
        len(levels),
        unit,
        1 / (total * solid_angle) if total > 0 else 0.0,
        float(sines @ rows.sum(axis=1)) * solid_angle,
        sampled,
    )


def _above(base: float, row: NDArray[np.float32]) -> NDArray[np.float32]:
    """What the luminance of each texel of ``row`` (width, 3) is above ``base``."""
    above: NDArray[np.float32] = np.maximum(row @ REC_709.astype(np.float32) - np.float32(base), 0)
    return above


def _unevenness(mean: float, pixels: NDArray[np.float32], sines: NDArray[np.float64]) -> tuple[float, float]:
    """Of the luminance over all directions: the share that is above its ``mean``, and its relative variance."""
    above, squares = 0.0, 0.0
    for row, sine in zip(pixels, sines, strict=True):
        relative = (row @ REC_709) / mean - 1
        above += sine * float(np.maximum(relative, 0).sum())
        squares += sine * float(np.square(relative).sum())
    total = float(sines.sum()) * pixels.shape[1]
    return above / total, squares / total


def _scaled_by(unit: float) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
    return lambda row: row * np.float32(1 / unit)


def _sums(weights: NDArray[np.float64]) -> tuple[list[NDArray[np.float32]], float]:
    """The levels of the tree, the root first, each (rows, columns, 4), and the sum of all weights."""
    levels: list[NDArray[np.float32]] = []
    total = max(float(weights.sum()), np.finfo(np.float64).tiny)
    while not levels or weights.size > 1:
        height, width = weights.shape
        even = np.pad(weights, ((0, height % 2), (0, width % 2))) if height % 2 or width % 2 else weights
        quarters = [even[row::2, column::2] for row, column in ((0, 0), (0, 1), (1, 0), (1, 1))]
        four = np.empty((*quarters[0].shape, 4), np.float32)
        for i, quarter in enumerate(quarters):
            np.divide(quarter, total, out=four[..., i], casting="same_kind")
        levels.insert(0, four)
        weights = (quarters[0] + quarters[1]) + (quarters[2] + quarters[3])
    return levels, float(weights.sum())


@dataclass(frozen=True)
class PackedEnvironment:
    """What an environment gives to a packed scene; nothing where there is none, or a black one.

    ``movable`` are the uniforms that change as it is turned; ``hidden`` says that camera rays see a colour instead.
    """

    tables: EnvironmentTables | None = None
    lights: Sequence[LightSource] = ()
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    movable: Mapping[str, Any] = field(default_factory=dict)
    hidden: bool = False


def pack_environment(environment: Environment | None, extent: float, is_compensated: bool) -> PackedEnvironment:
    """Pack the environment of a scene that extends ``extent`` metres from its middle."""
    if environment is None:
        return PackedEnvironment()
    uniforms: dict[str, Any] = {} if environment.visible else {"u_background_radiance": environment.background}
    cross_section = np.pi * extent**2
    tables = environment_tables(environment.source, is_compensated) if max(environment.scale) > 0 else None
    if tables is not None and tables.irradiance == 0:
        tables = None
    power = cross_section * tables.irradiance * max(environment.scale) if tables else 0.0
    sampled = tables.sampled if tables else 0.0
    lights: list[LightSource] = []
    if (sun := environment.sun) is not None:
        # With it, light samples that the sky does not need go to the sun.
        of_sun = cross_section * 2 * np.pi * sun.one_minus_cos * sum(sun.radiance) + (1 - sampled) * power
        power *= sampled
        record = {"direction": sun.direction, "one_minus_cos": sun.one_minus_cos, "radiance": sun.radiance}
        lights.append(LightSource(LightKind.SUN, of_sun, record))
    if sampled > 0:
        lights.append(LightSource(LightKind.ENVIRONMENT, power, {}))
    if tables is None:
        return PackedEnvironment(None, lights, uniforms, hidden=not environment.visible)
    uniforms |= {
        "u_environment_size": tables.size,
        "u_environment_levels": tables.levels,
        "u_environment_density": tables.density,
    }
    angle = np.radians(environment.rotation_degrees)
    movable = {
        "u_environment_scale": tuple(tables.unit * scale for scale in environment.scale),
        "u_environment_rotation": (float(np.cos(angle)), float(np.sin(angle))),
    }
    return PackedEnvironment(tables, lights, uniforms, movable, not environment.visible)
