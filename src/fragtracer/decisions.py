# SPDX-License-Identifier: MIT
"""What settings that are left to "auto" become for a picture: light tracing, guiding and the gradient domain."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from fragtracer import guiding, light_tracing
from fragtracer.films import DECIDED
from fragtracer.light_tracing import Decisions, decide_both
from fragtracer.sampling.pilot import pilot_samples
from fragtracer.scene import RenderSettings, Scene

_LEAST_SAMPLES = 2**23  # of a picture for which a pilot of the gradient domain is asked: it takes 2^19 more at most
# Samples per pixel of a picture for which any pilot is asked, and with meshes; and its samples over those of a pilot
# that ends with its first tiles (docs/sampling.md).
_LEAST_SPP, _LEAST_SPP_OF_MESHES, _LEAST_PILOTS = 64, 128, 4


@dataclass(frozen=True)
class Decided:
    """What was decided about light tracing and guiding for a picture of ``scene`` with ``settings``."""

    scene: Scene
    settings: RenderSettings
    decisions: Decisions

    def for_picture(self, scene: Scene, settings: RenderSettings, animated: bool = False) -> Decisions | None:
        """What holds for another picture too, which may have another camera and, if ``animated``, be in another pose;
        None if more is another."""
        if guiding.decides(settings) != guiding.decides(self.settings):
            return None
        if not animated and not guiding.same_light(scene, self.scene):
            return None
        traced, guided = self.decisions
        # What has moved may have the camera inside of glass, where no photon is seen.
        if traced.is_on and (reason := light_tracing.impossible(scene, settings)):
            traced = light_tracing.Decision(False, f"off: {reason}")
        return traced, guided


class Decider:
    """Decides for the pictures of a renderer, anew only where something that matters has changed.

    Parameters
    ----------
    context
        The moderngl context to measure on.
    untraced
        Why the renderer cannot add light that is traced from the lights; empty if it can.
    moves
        Whether the camera moves from picture to picture: then the first decides for all.
    pictures
        How many there are.
    animated
        Whether they are of one scene in several poses: then the first decides for all, too.
    """

    def __init__(self, context: Any, untraced: str, moves: bool, pictures: int, animated: bool = False) -> None:
        self._context, self._untraced, self._moves, self._animated = context, untraced, moves, animated
        self.pictures = pictures
        self._decided: Decided | None = None

    def decide(self, scene: Scene, settings: RenderSettings) -> Decisions:
        """Whether light is traced from the lights of ``scene``, and whether paths are guided."""
        known = self._decided
        if known is not None and (self._moves or settings.light_tracing == "off" or scene.camera == known.scene.camera):
            decisions = known.for_picture(scene, settings, self._animated)
            if decisions is not None:
                return decisions
        decisions = self._measured(scene, settings)
        self._decided = Decided(scene, settings, decisions)
        return decisions

    def decide_as(self, film: Mapping[str, str], scene: Scene, settings: RenderSettings) -> str:
        """Decide about ``scene`` from now on as for a film with this origin (:func:`fragtracer.films.origin_of`), where
        that is left to "auto"; returns what is not done there and would be done in a new one, in words."""
        here = in_origin(self.decide(scene, settings))
        there = {name: film[name] for name in here if name in film}
        if there == {name: here[name] for name in there}:
            return ""
        chosen: dict[str, Any] = {
            DECIDED[name]: choice
            for name, choice in there.items()
            if choice in ("on", "off") and getattr(settings, DECIDED[name]) == "auto"
        }
        traced, guided = self._measured(scene, replace(settings, **chosen))
        traced = replace(traced, reason=f"{_said(traced.is_on)}: as in the film")
        guided = replace(guided, reason=f"{_said(guided.guide is not None)}: as in the film")
        self._decided = Decided(scene, settings, (traced, guided))
        left_out = (DECIDED[name].replace("_", " ") for name in there if here[name] == "on" and there[name] == "off")
        return " and ".join(left_out)

    def _measured(self, scene: Scene, settings: RenderSettings) -> Decisions:
        settings = guiding.decides(settings)
        if self._untraced:
            guided = guiding.decide(self._context, scene, settings, pictures=self.pictures)
            return light_tracing.Decision(False, f"off: {self._untraced}"), guided
        return decide_both(self._context, scene, settings, self.pictures)


def in_origin(decisions: Decisions) -> dict[str, str]:
    """How the origin of a film (:func:`fragtracer.films.origin_of`) has them."""
    traced, guided = decisions
    return {"guided": _said(guided.guide is not None), "light_traced": _said(traced.is_on)}


def noise_is_rare(decisions: Decisions) -> bool:
    """Whether what noise there is comes of rare, bright samples: of light that is neither traced nor guided to."""
    traced, guided = decisions
    return traced.is_on or guided.guide is not None


def adaptive_sampling(
    settings: RenderSettings, spp: int, has_meshes: bool, impossible: str = ""
) -> tuple[Literal["auto", "on", "off"], str]:
    """Whether a picture that is to have ``spp`` samples per pixel may be sampled adaptively, and why not, where that
    needs no pilot; ``impossible`` says why its renderer cannot do that, or nothing."""
    if settings.adaptive == "off":
        return "off", "off: as asked for"
    if impossible:
        return "off", f"off: {impossible}"
    if settings.adaptive == "auto" and spp < _least_spp(settings, has_meshes):
        return "off", _too_few(spp)
    return settings.adaptive, ""


def gradient_domain(
    settings: RenderSettings, spp: int, has_meshes: bool, decisions: Decisions, impossible: str
) -> tuple[Literal["auto", "on", "off"], str]:
    """Whether a picture that is to have ``spp`` samples per pixel may be made from differences, and why not, where that
    needs no pilot; ``impossible`` says why its renderer cannot do that, or nothing."""
    if settings.gradient_domain == "off":
        return "off", "off: as asked for"
    if impossible:
        return "off", f"off: {impossible}"
    if settings.gradient_domain == "auto":
        if settings.adaptive == "on":
            return "off", "off: adaptive sampling was asked for"
        if spp < _least_spp(settings, has_meshes) or spp * settings.width * settings.height < _LEAST_SAMPLES:
            return "off", _too_few(spp)
        if noise_is_rare(decisions):
            return "off", "off: light is traced from the lights, or guided: what is left of it is rare and bright"
    return settings.gradient_domain, ""


def _least_spp(settings: RenderSettings, has_meshes: bool) -> int:
    """Samples per pixel of a picture for which a pilot is asked."""
    pilot = int(pilot_samples(settings.width, settings.height)[0].sum())
    of_pilot = -(-_LEAST_PILOTS * pilot // (settings.width * settings.height))
    return max(of_pilot, _LEAST_SPP_OF_MESHES if has_meshes else _LEAST_SPP)


def _too_few(spp: int) -> str:
    return f"off: the {spp} samples per pixel are too few for a pilot to pay"


def _said(is_on: bool) -> str:
    return "on" if is_on else "off"
