# SPDX-License-Identifier: MIT
"""The display chain: how linear radiance becomes a picture for a screen (shaders/display/display.frag)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fragtracer.display import bloom
from fragtracer.display.exposure import MOST_STOPS, automatic_exposure
from fragtracer.display.tone import TONE_CURVES, FloatImage, srgb_encode
from fragtracer.errors import OutputError


@dataclass(frozen=True)
class Look:
    """How radiance becomes a picture, in this order.

    1. **exposure**: radiance, negative values as 0, times 2**``exposure``; "auto" finds the stops
       (:mod:`fragtracer.display.exposure`).
    2. **bloom**: ``bloom`` times the glare of what is above ``bloom_threshold`` then, 1 being white, is added
       (:mod:`fragtracer.display.bloom`); ``bloom_alone`` shows nothing else.
    3. **tone curve** ``tonemap``, a key of :data:`TONE_CURVES`, and the clip to [0, 1].
    4. the **sRGB** transfer function, and the power 1 / ``gamma`` of the result; 1 leaves it.

    Pixels that are not finite count as black in all of this, do not count in the exposure, and end magenta.

    Raises
    ------
    OutputError
        If a value is not of this kind.
    """

    exposure: float | Literal["auto"] = 0.0
    tonemap: str = "linear"
    gamma: float = 1.0
    bloom: float = 0.0
    bloom_threshold: float = 1.0
    bloom_alone: bool = False

    def __post_init__(self) -> None:
        if self.tonemap not in TONE_CURVES:
            raise OutputError(f"there is no tone curve {self.tonemap!r}; choose from {', '.join(TONE_CURVES)}")
        if self.exposure != "auto" and not (not isinstance(self.exposure, str) and abs(self.exposure) <= MOST_STOPS):
            raise OutputError(
                f'exposure must be "auto" or lie between -{MOST_STOPS} and {MOST_STOPS} stops, got {self.exposure}'
            )
        if not 0 < self.gamma <= 10:
            raise OutputError(f"gamma must be above 0 and at most 10, got {self.gamma}")
        for name, value in (("bloom", self.bloom), ("bloom_threshold", self.bloom_threshold)):
            if not 0 <= value <= 1e6:
                raise OutputError(f"{name} must lie between 0 and a million, got {value}")
        if self.bloom_alone and not self.bloom:
            raise OutputError("bloom alone shows nothing without bloom: give its strength too")

    def stops(self, image: FloatImage) -> float:
        """The exposure of ``image``."""
        return automatic_exposure(image) if isinstance(self.exposure, str) else float(self.exposure)

    def show(self, image: FloatImage) -> FloatImage:
        """The picture of linear radiance, (h, w, 3) float32: sRGB values in [0, 1] of that shape."""
        bad = ~np.isfinite(image).all(axis=2, keepdims=True)
        with np.errstate(over="ignore"):
            exposed = np.maximum(np.where(bad, np.float32(0), image), 0) * np.float32(2.0 ** self.stops(image))
        exposed = np.minimum(exposed, np.float32(3e38))
        if self.bloom:
            glare = np.float32(self.bloom) * bloom.bloom(exposed, self.bloom_threshold)
            exposed = np.minimum(glare if self.bloom_alone else exposed + glare, np.float32(3e38))
        shown = srgb_encode(np.clip(TONE_CURVES[self.tonemap](exposed), 0, 1))
        if self.gamma != 1:
            shown = shown ** np.float32(1 / self.gamma)
        return np.where(bad, np.array([1, 0, 1], np.float32), shown)

    def metadata(self, image: FloatImage) -> dict[str, str]:
        """The values as text by name, for the file of the picture; of bloom where there is some."""
        entries = {"exposure": f"{self.stops(image):g}", "tonemap": self.tonemap}
        if self.exposure == "auto":
            entries["exposure_mode"] = "auto"
        if self.gamma != 1:
            entries["gamma"] = f"{self.gamma:g}"
        if self.bloom:
            entries |= {"bloom": f"{self.bloom:g}", "bloom_threshold": f"{self.bloom_threshold:g}"}
        if self.bloom_alone:
            entries["bloom_alone"] = "true"
        return entries
