# SPDX-License-Identifier: MIT
"""Whether a scene is guided, and why."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.cache import cached
from fragtracer.gpu.context import is_software
from fragtracer.gpu.film import Film
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import Tracer, TracerProgram
from fragtracer.guiding.guide import VERSION, Guide, learn
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.digest import program_digest
from fragtracer.packing.targets import may_be_narrow, too_many
from fragtracer.scene import RenderSettings, Scene
from fragtracer.scene.content import content_digest

# Samples of a picture; to trace them takes about as long as to learn. A GPU (an H200) traces more meanwhile, 2^22 to
# 2^28 a second; the second number is for scenes of meshes.
_LEAST_SAMPLES, _LEAST_SAMPLES_OF_GPUS = 2**24, (2**29, 2**27)
_LEAST_BOUNCES = 2  # light that reaches a surface over another takes so many
_RAY_COST = 1.5  # of a guided ray over another (docs/sampling.md)
_MARGIN = 1.15  # by which the gain must exceed the cost: it is less for the rarest paths, which are not met
_SIDE = 96  # of the measurement, the longer one
# Of it in all, as long as guiding seems to pay, and not to pay so clearly that no more are needed; the last only where
# the picture has so many times as many samples.
_SAMPLES, _LAST_PAYS = (64, 256, 1024), 16
_CLEAR = 1.5  # times the gain that is wanted are expected


@dataclass(frozen=True, eq=False)
class Decision:
    """What guides, if anything, why it does or does not, by how much it lowers the relative variance, and what a sample
    costs then, 1 being what it costs without; as far as that was measured."""

    guide: Guide | None
    reason: str
    gain: float = 1.0
    cost: float = 1.0

    @property
    def worth(self) -> float:
        """By how much it raises the efficiency."""
        return self.gain / self.cost

    def applied(self, packed: PackedScene) -> PackedScene:
        """``packed`` for the program of this decision."""
        return packed if self.guide is None else self.guide.applied(packed)


def decide(
    ctx: Any,
    scene: Scene,
    settings: RenderSettings,
    defines: Mapping[str, int | str] | None = None,
    least: float = _MARGIN,
    samples: int = _LEAST_SAMPLES,
    pictures: int = 1,
) -> Decision:
    """Whether and how ``scene`` is guided with ``settings``, by photons traced on ``ctx`` if need be; ``defines`` are
    those of the program that is guided, and ``least`` is what it must be worth in a picture of so many ``samples``. It
    is learned once for so many ``pictures``."""
    least = max(least, _MARGIN)
    if settings.guiding == "off":
        return Decision(None, "off: as asked for")
    if settings.integrator != "path":
        return Decision(None, f"off: the integrator is {settings.integrator}")
    if settings.bounces < _LEAST_BOUNCES:
        return Decision(None, "off: paths of one bounce meet no light that others reflect")
    nothing = Decision(None, "off: no surface reflects light narrowly onto another")
    if not any(may_be_narrow(material) for material in scene.materials.values()):
        return nothing
    if reason := too_many(scene):
        return Decision(None, f"off: {reason}")
    if settings.guiding == "auto" and not has_enough_samples(ctx, scene, settings, pictures):
        return Decision(None, f"off: to trace the {settings.spp} samples per pixel takes less time than to learn")
    guide = learn(ctx, scene)
    if guide is None:
        return nothing
    if settings.guiding == "on":
        return Decision(guide, "on: as asked for")
    gain, cost = measure(ctx, scene, settings, guide, defines or {}, least, samples)
    if gain < least * cost:
        return Decision(None, f"off: the variance would fall by {gain:.2f}, the time of a sample rise by {cost:.2f}")
    reason = f"on: the variance falls by {gain:.2f}, the time of a sample rises by {cost:.2f}"
    return Decision(guide, reason, gain, cost)


def has_enough_samples(ctx: Any, scene: Scene, settings: RenderSettings, pictures: int = 1) -> bool:
    """Whether to trace the samples of so many ``pictures`` takes longer than to learn where their light comes from."""
    least = _LEAST_SAMPLES if is_software(ctx) else _LEAST_SAMPLES_OF_GPUS[bool(scene.meshes)]
    return settings.spp * settings.width * settings.height * pictures >= least


def measured_size(settings: RenderSettings) -> tuple[int, int]:
    """Of the small picture in whose place that with ``settings`` is measured."""
    longer = max(settings.width, settings.height)
    return max(1, round(_SIDE * settings.width / longer)), max(1, round(_SIDE * settings.height / longer))


def decides(settings: RenderSettings) -> RenderSettings:
    """``settings`` without what makes no difference to the decision."""
    return replace(settings, seed=0, rays=1)


def same_light(one: Scene, other: Scene) -> bool:
    """Whether the two differ at most in the camera, the settings and the names, so that one decision serves both."""
    names = {field.name for field in fields(Scene)} - {"camera", "render", "name", "description"}
    return one is other or all(getattr(one, name) == getattr(other, name) for name in names)


def measure(
    ctx: Any,
    scene: Scene,
    settings: RenderSettings,
    guide: Guide,
    defines: Mapping[str, int | str],
    least: float = _MARGIN,
    samples: int = _LEAST_SAMPLES,
) -> tuple[float, float]:
    """By how much ``guide`` lowers the relative variance of ``scene`` in a picture of so many ``samples``, mean over
    the pixels, and what a sample costs then, 1 being what it costs without; roughly, where the ratio of the two is
    clearly below or above ``least``.

    Both variances come from a small picture of guided paths: they find the rare and bright ones, which without guiding
    no small number of samples shows. What guiding does not find, they do not find either: where the gain falls with the
    number of samples, it is taken to fall on in the same way. The cost is told by the length of the paths, since times
    are not the same twice.
    """
    size = measured_size(settings)
    plain = pack(scene, settings, *size)
    packed, unguided = guide.applied(plain), guide.without_lobes().applied(plain)
    pixels = size[0] * size[1]
    is_long = settings.spp * settings.width * settings.height >= _LAST_PAYS * _SAMPLES[-1] * pixels
    counts = _SAMPLES if is_long else _SAMPLES[:-1]
    how = f"{VERSION} {sorted(defines.items())} {least:.2f} {samples} {counts}"
    found = cached(
        "guiding-measurement",
        content_digest(program_digest(packed), how),
        lambda: _measured(ctx, packed, unguided, size, defines, least, samples, counts),
        "measuring what path guiding is worth",
    )
    return float(found["gain"]), _RAY_COST * float(found["rays"])


def _measured(
    ctx: Any,
    packed: PackedScene,
    unguided: PackedScene,
    size: tuple[int, int],
    defines: Mapping[str, int | str],
    least: float,
    samples: int,
    counts: Sequence[int],
) -> dict[str, NDArray[np.float64]]:
    """The gain, and the mean number of rays of a guided path over that of another."""
    program = TracerProgram(defines={**defines, "GUIDING": "GUIDING_MEASURED"}, level=Level.SCENE)
    with ExitStack() as held:
        films = [Film(ctx, *size), Film(ctx, *size)]
        for film in films:
            held.callback(film.release)
        tracer = Tracer(ctx, unguided, program)
        held.callback(tracer.release)
        plain = _sampled(tracer, films[0], counts[0])
        tracer.load(packed, program)
        guided = _sampled(tracer, films[1], counts[0])
        rays = guided.rays / plain.rays
        wanted = least * _RAY_COST * rays
        # What is not guided has the share that stratification leaves of its few samples, without the rarest.
        stratified = plain.left / max(guided.left, 1e-30)
        gain = found = guided.gain * stratified
        for before, count in pairwise(counts):
            if gain < wanted or (before > counts[0] and gain > _CLEAR * wanted):
                break
            earlier, found = found, _sampled(tracer, films[1], count - before).gain * stratified
            steps = np.log(samples / (size[0] * size[1] * count)) / np.log(count / before)
            gain = found * min(1.0, found / earlier) ** max(0.0, float(steps))
    return {"gain": np.asarray(gain), "rays": np.asarray(rays)}


@dataclass(frozen=True)
class _Sampled:
    """Of paths: the ``gain`` in the variance of a sample by guiding, the share of it that is ``left`` where samples are
    stratified, and the mean number of ``rays``."""

    gain: float
    left: float
    rays: float


def _sampled(tracer: Tracer, film: Film, samples: int) -> _Sampled:
    """All paths of ``film`` after so many more samples."""
    for _ in tracer.bands(film, samples):
        pass
    pixels = film.read()
    found, moment, rays = (pixels.mean[..., i].astype(np.float64) for i in range(3))
    squared = np.square(found) + 1e-2 * np.square(found.mean())
    if not squared.max() > 0:
        return _Sampled(1.0, 1.0, float(rays.mean()))
    variance = max(float((pixels.variance[..., 0] / squared).mean()), 1e-30)
    unguided = float((np.maximum(moment - np.square(found), 0) / squared).mean())
    left = np.square(pixels.centred_half_difference()[..., 0]) * pixels.mean[..., 3]
    return _Sampled(unguided / variance, float((left / squared).mean()) / variance, float(rays.mean()))
