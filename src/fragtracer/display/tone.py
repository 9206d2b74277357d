# SPDX-License-Identifier: MIT
"""Tone curves and the sRGB transfer function (shaders/display/tone.glsl)."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

FloatImage = npt.NDArray[np.float32]

BRIGHTEST = 1e30  # that bloom and metering reckon with
REC_709 = np.array([0.2126, 0.7152, 0.0722])  # luminance of red, green and blue (core/math.glsl)


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


_AGX_INSET = np.array(
    [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ],
    np.float32,
)
_AGX_OUTSET = np.array(
    [
        [1.19687900512017, -0.0980208811401368, -0.0990297440797205],
        [-0.0528968517574562, 1.15190312990417, -0.0989611768448433],
        [-0.0529716355144438, -0.0980434501171241, 1.15107367264116],
    ],
    np.float32,
)
_AGX_CURVE = (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232)


def agx(x: FloatImage) -> FloatImage:
    """A curve over 16.5 stops between two matrices, in which bright colours fade as on film.

    Sobotka's AgX in the fit of Wrensch 2023, "Minimal AgX implementation"; the power of 2.2 at its end makes
    the result linear again.
    """
    inset = np.maximum(np.minimum(x, np.float32(1e6)) @ _AGX_INSET.T, np.float32(1e-10))
    stops = np.clip(np.log2(inset), np.float32(-12.47393), np.float32(4.026069))
    curve = np.polyval(np.array(_AGX_CURVE, np.float32), (stops + np.float32(12.47393)) / np.float32(16.5))
    outset: FloatImage = np.maximum(curve @ _AGX_OUTSET.T, 0) ** np.float32(2.2)
    return outset


TONE_CURVES: dict[str, Callable[[FloatImage], FloatImage]] = {
    "linear": linear,
    "reinhard": reinhard,
    "aces": aces,
    "agx": agx,
}


def srgb_encode(x: FloatImage) -> FloatImage:
    """Linear [0, 1] to sRGB [0, 1] (IEC 61966-2-1)."""
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-6) ** (1 / 2.4) - 0.055).astype(np.float32)


def srgb_decode(x: FloatImage) -> FloatImage:
    """sRGB [0, 1] to linear [0, 1] (IEC 61966-2-1)."""
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)
