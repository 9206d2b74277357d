# SPDX-License-Identifier: MIT
"""Bloom: the glare of bright parts, as numbers; shaders/display/bloom.frag computes the same.

After the three-stage blur of the PBR document this project grew out of, which has it from the Unreal Engine:
the bright parts are blurred at 1/16 of the resolution with 11 taps, added at 1/8 and blurred with 9, added at
1/4 and blurred with 5. This is the whole definition:

1. The image is exposed, finite and not negative. Its bright parts are x max(0, 1 - T / Y), with Y the luminance
   of x (Rec. 709) and T the threshold: colours stay, and what is just above T adds next to nothing. Values
   above 1e30 count as that.
2. Width and height are made multiples of 16 by mirroring at the right and at the top edge, the edge pixels
   repeated first (numpy's ``symmetric``); images smaller than that are mirrored more than once.
3. Means of 4 x 4 pixels are level 1/4; means of 2 x 2 texels of it level 1/8, and of that level 1/16.
4. A blur is a Gaussian over n taps, horizontally, then vertically, with sigma = (n + 1) / 6 texels and weights
   that sum to 1: the first tap left out lies at three sigma. Borders are mirrored as above.
5. A level is enlarged by linear interpolation between the centres of its texels, clamped at the borders.
   B16 = blur11(L16), B8 = blur9(L8 + 2x B16), B4 = blur5(L4 + 2x B8), and the bloom is 4x B4 / 3, cropped.

Every step keeps the mean, so that an image + s bloom is brighter by s times the mean of its bright parts: exactly
(but for rounding) where both sides are multiples of 16, elsewhere but for what lies near the mirrored edges. The
width of the glare is fixed in pixels (half of a point's is within 16, 90 % within 57, nothing beyond 150): in a
picture of twice the size it looks half as wide.
"""

import numpy as np

from fragtracer.display.tone import BRIGHTEST, REC_709, FloatImage

BLOCK = 16  # pixels of a texel of the coarsest level
TAPS = (11, 9, 5)  # at 1/16, 1/8 and 1/4


def weights(taps: int) -> list[float]:
    """Of the middle tap and those to one side of it; with both sides they sum to 1."""
    radius = taps // 2
    sigma = (radius + 1) / 3
    one_side = [float(np.exp(-0.5 * (i / sigma) ** 2)) for i in range(radius + 1)]
    return [w / (2 * sum(one_side) - 1) for w in one_side]


def bright_parts(image: FloatImage, threshold: float) -> FloatImage:
    """What of an exposed, finite (h, w, 3) image is above ``threshold``."""
    x = np.clip(image, 0, np.float32(BRIGHTEST))
    luminance = x @ REC_709.astype(np.float32)
    above = np.maximum(1 - np.float32(threshold) / np.maximum(luminance, np.float32(1e-30)), 0)
    bright: FloatImage = x * above[..., None].astype(np.float32)
    return bright


def bloom(image: FloatImage, threshold: float) -> FloatImage:
    """The glare of an exposed, finite image, (h, w, 3) float32, row 0 at the top; shape and type stay."""
    height, width, _ = image.shape
    result = _enlarged(quarter(image, threshold), 4)
    return np.ascontiguousarray(result[:height, :width][::-1], dtype=np.float32)


def quarter(image: FloatImage, threshold: float) -> FloatImage:
    """The glare at 1/4 of the resolution of the mirrored image, row 0 at the bottom."""
    height, width, _ = image.shape
    bright = bright_parts(image, threshold)[::-1]  # rows upwards, as the shader has them
    bright = np.pad(bright, ((0, -height % BLOCK), (0, -width % BLOCK), (0, 0)), "symmetric")
    fourth = _reduced(bright, 4)
    eighth = _reduced(fourth, 2)
    result = _blurred(_reduced(eighth, 2), TAPS[0])
    result = _blurred(eighth + _enlarged(result, 2), TAPS[1])
    return _blurred(fourth + _enlarged(result, 2), TAPS[2]) / np.float32(3)


def _reduced(image: FloatImage, factor: int) -> FloatImage:
    height, width, _ = image.shape
    blocks: FloatImage = image.reshape(height // factor, factor, width // factor, factor, 3).mean(axis=(1, 3))
    return blocks


def _blurred(image: FloatImage, taps: int) -> FloatImage:
    one_side = weights(taps)
    radius = taps // 2
    for axis in (1, 0):
        size = image.shape[axis]
        padded = np.pad(image, [(radius, radius) if i == axis else (0, 0) for i in range(3)], "symmetric")
        image = sum(np.float32(one_side[abs(i - radius)]) * padded.take(range(i, i + size), axis) for i in range(taps))  # type: ignore[assignment]
    return image


def _enlarged(image: FloatImage, factor: int) -> FloatImage:
    for axis in (1, 0):
        size = image.shape[axis]
        place = ((np.arange(size * factor) + 0.5) / factor - 0.5).astype(np.float32)
        low = np.floor(place).astype(int)
        shape = [-1 if i == axis else 1 for i in range(3)]
        t = (place - low).reshape(shape)
        a, b = (image.take(np.clip(i, 0, size - 1), axis) for i in (low, low + 1))
        image = a + t * (b - a)
    return image
