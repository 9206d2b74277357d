# SPDX-License-Identifier: MIT
"""From radiance to what a screen shows: tone curves and the sRGB transfer function (shaders/display.frag)."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

FloatImage = npt.NDArray[np.float32]


def linear(x: FloatImage) -> FloatImage:
    """Keep ``x``; the clip to [0, 1] that every curve ends in is all that happens."""
    return x


def reinhard(x: FloatImage) -> FloatImage:
    """x / (1 + x) for each channel, which never clips and fades bright colours.

    Reinhard et al. 2002, "Photographic tone reproduction for digital images", equation 3, there for luminance.
    """
    return x / (1 + x)


def aces(x: FloatImage) -> FloatImage:
    """A film-like S curve for each channel: Narkowicz 2015, "ACES filmic tone mapping curve"."""
    x = np.minimum(x, np.float32(1e6))
    curve = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return curve.astype(np.float32)


TONE_CURVES: dict[str, Callable[[FloatImage], FloatImage]] = {"linear": linear, "reinhard": reinhard, "aces": aces}


def srgb_encode(x: FloatImage) -> FloatImage:
    """Linear [0, 1] to sRGB [0, 1] (IEC 61966-2-1)."""
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-6) ** (1 / 2.4) - 0.055).astype(np.float32)


def srgb_decode(x: FloatImage) -> FloatImage:
    """sRGB [0, 1] to linear [0, 1] (IEC 61966-2-1)."""
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def to_display(image: FloatImage, exposure: float = 0.0, tonemap: str = "linear") -> FloatImage:
    """Exposure, then the tone curve, then the clip to [0, 1] and the sRGB transfer function.

    Parameters
    ----------
    image
        Linear radiance, (h, w, 3) float32, finite.
    exposure
        In stops: the radiance is multiplied by ``2**exposure``.
    tonemap
        A key of :data:`TONE_CURVES`.

    Returns
    -------
    numpy.ndarray
        sRGB values in [0, 1], (h, w, 3) float32.
    """
    with np.errstate(over="ignore"):
        exposed = np.maximum(image, 0) * np.float32(2.0**exposure)
    curve = TONE_CURVES[tonemap](np.minimum(exposed, np.finfo(np.float32).max))
    return srgb_encode(np.clip(curve, 0, 1))
