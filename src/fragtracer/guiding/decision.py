# SPDX-License-Identifier: MIT
"""Whether a scene is guided, and why."""

from dataclasses import dataclass
from typing import Any

from fragtracer.guiding.guide import Guide, learn
from fragtracer.packing import PackedScene
from fragtracer.scene import RenderSettings, Scene

_LEAST_BOUNCES = 2  # light that reaches a surface over another takes so many


@dataclass(frozen=True, eq=False)
class Decision:
    """What guides, if anything, and why it does or does not."""

    guide: Guide | None
    reason: str

    def applied(self, packed: PackedScene) -> PackedScene:
        """``packed`` for the program of this decision."""
        return packed if self.guide is None else self.guide.applied(packed)


def decide(ctx: Any, scene: Scene, settings: RenderSettings) -> Decision:
    """Whether and how ``scene`` is guided with ``settings``, by photons traced on ``ctx`` if need be."""
    if settings.guiding == "off":
        return Decision(None, "off: as asked for")
    if settings.integrator != "path":
        return Decision(None, f"off: the integrator is {settings.integrator}")
    if settings.bounces < _LEAST_BOUNCES:
        return Decision(None, "off: paths of one bounce meet no light that others reflect")
    if settings.guiding == "auto":
        return Decision(None, "off: only guided when asked for")
    guide = learn(ctx, scene)
    if guide is None:
        return Decision(None, "off: no surface reflects light narrowly onto another")
    return Decision(guide, "on: as asked for")
