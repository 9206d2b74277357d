# SPDX-License-Identifier: MIT
"""Whether a scene is guided, and why."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.cache import cached
from fragtracer.gpu.film import Film
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import Tracer, TracerProgram
from fragtracer.guiding.guide import VERSION, Guide, learn, packed_digest
from fragtracer.packing import PackedScene, pack
from fragtracer.scene import Material, RenderSettings, Scene

_LEAST_SAMPLES = 2**24  # of a picture; to trace them takes about as long as to learn
_LEAST_BOUNCES = 2  # light that reaches a surface over another takes so many
_WIDEST = 0.5  # GGX width of a lobe that may be narrow somewhere
_COST = 1.7  # of a guided sample over another (docs/sampling.md)
_WIDTH, _SAMPLES, _MORE_SAMPLES = 96, 64, 256  # of the measurement


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
    nothing = Decision(None, "off: no surface reflects light narrowly onto another")
    if not any(_may_be_narrow(material) for material in scene.materials.values()):
        return nothing
    if settings.guiding == "auto" and settings.spp * settings.width * settings.height < _LEAST_SAMPLES:
        return Decision(None, f"off: to trace the {settings.spp} samples per pixel takes less time than to learn")
    guide = learn(ctx, scene)
    if guide is None:
        return nothing
    if settings.guiding == "on":
        return Decision(guide, "on: as asked for")
    gain = measure(ctx, scene, settings, guide)
    if gain < _COST:
        return Decision(None, f"off: the variance would fall by {gain:.2f}, less than the time would rise")
    return Decision(guide, f"on: the variance falls by {gain:.2f}")


def decides(settings: RenderSettings) -> RenderSettings:
    """``settings`` without what makes no difference to the decision."""
    return replace(settings, seed=0, rays=1)


def same_light(one: Scene, other: Scene) -> bool:
    """Whether the two differ at most in the camera, the settings and the names, so that one decision serves both."""
    names = {field.name for field in fields(Scene)} - {"camera", "render", "name", "description"}
    return one is other or all(getattr(one, name) == getattr(other, name) for name in names)


def _may_be_narrow(material: Material) -> bool:
    """Whether some part of a surface may scatter light narrowly (FOCUS in shaders/photons.frag)."""
    is_rough = material.alpha > _WIDEST and material.roughness_texture is None
    return not material.unlit and max(*material.specular_f0, *material.specular_f90) > 0 and not is_rough


def measure(ctx: Any, scene: Scene, settings: RenderSettings, guide: Guide) -> float:
    """By how much ``guide`` lowers the relative variance of ``scene``, mean over the pixels.

    Both variances come from a small picture of guided paths: they find the rare and bright ones, which without guiding
    no small number of samples shows. What guiding does not find, they do not find either: where the gain falls with the
    number of samples, it is taken to fall on in the same way until the number that the smallest picture has for which
    this is asked.
    """
    size = (_WIDTH, max(1, round(_WIDTH * settings.height / settings.width)))
    packed = guide.applied(pack(scene, settings, *size))
    found = cached("guiding-gain", f"{VERSION}-{packed_digest(packed)}", lambda: {"gain": _measured(ctx, packed, size)})
    return float(found["gain"])


def _measured(ctx: Any, packed: PackedScene, size: tuple[int, int]) -> NDArray[np.float64]:
    program = TracerProgram(defines={"GUIDING": "GUIDING_MEASURED"}, level=Level.KINDS)
    film = Film(ctx, *size)
    tracer = Tracer(ctx, packed, program)
    try:
        gain = _gain(tracer, film, _SAMPLES)
        if gain >= _COST:
            before, gain = gain, _gain(tracer, film, _MORE_SAMPLES - _SAMPLES)
            steps = np.log(_LEAST_SAMPLES / (size[0] * size[1] * _MORE_SAMPLES)) / np.log(_MORE_SAMPLES / _SAMPLES)
            gain *= min(1.0, gain / before) ** max(0.0, float(steps))
    finally:
        tracer.release()
        film.release()
    return np.asarray(gain)


def _gain(tracer: Tracer, film: Film, samples: int) -> float:
    """The ratio of the variances after so many more samples."""
    for _ in tracer.bands(film, samples):
        pass
    mean = film.read().mean.astype(np.float64)
    found, guided, unguided = (mean[..., i] for i in range(3))
    squared = np.square(found) + 1e-2 * np.square(found.mean())
    if not squared.max() > 0:
        return 1.0
    variances = [np.maximum(moment - np.square(found), 0) / squared for moment in (guided, unguided)]
    return float(variances[1].mean() / max(variances[0].mean(), 1e-30))
