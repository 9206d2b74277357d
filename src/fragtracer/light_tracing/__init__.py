# SPDX-License-Identifier: MIT
"""Light tracing: what surfaces throw narrowly onto others, caustics above all, is traced from the lights."""

from fragtracer.light_tracing.decision import Decision, Decisions, decide, decide_both, impossible, is_needed
from fragtracer.light_tracing.picture import LightTracing
from fragtracer.light_tracing.tracer import PHOTONS

__all__ = ["PHOTONS", "Decision", "Decisions", "LightTracing", "decide", "decide_both", "impossible", "is_needed"]
