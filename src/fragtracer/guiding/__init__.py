# SPDX-License-Identifier: MIT
"""Path guiding: where light arrives from few directions, learned from photons before a picture begins."""

from fragtracer.guiding.decision import Decision, decide, decides, has_enough_samples, measured_size, same_light
from fragtracer.guiding.guide import Guide, learn

__all__ = ["Decision", "Guide", "decide", "decides", "has_enough_samples", "learn", "measured_size", "same_light"]
