# SPDX-License-Identifier: MIT
"""Whether some of the light of a scene is traced from the lights, and why."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer import guiding
from fragtracer.cache import cached
from fragtracer.gpu.context import is_software
from fragtracer.gpu.film import Film
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import Tracer, TracerProgram
from fragtracer.light_tracing.sums import ProcessSums
from fragtracer.light_tracing.tracer import PHOTONS, LightTracer
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.digest import program_digest
from fragtracer.packing.interiors import is_closed
from fragtracer.packing.materials import ALPHA_DELTA
from fragtracer.packing.mirrors import camera_is_in_mirror
from fragtracer.packing.targets import Targets, may_be_narrow, target_names, targets_of, too_many
from fragtracer.sampling.pixels import Pixels, bright
from fragtracer.scene import SHAPES, Geometry, Plane, RenderSettings, Scene, Sphere
from fragtracer.scene.content import content_digest, kept_by_digest
from fragtracer.scene.fields import Triple
from fragtracer.scene.interiors import Solid, fillings, has_media, solids, winding_number

Floats = NDArray[np.float64]

_VERSION = 9  # of the measurement
_MEASURED = 1 / 8  # photons for a sample, for which the variances are told
_PHOTONS = (1 / 8, 1 / 4)  # for a sample, of which there may be; twice as many where samples are placed adaptively
# Of a photon over a sample of a path, the second in scenes of meshes; of GPUs by those of an H200.
_PHOTON_COST, _PHOTON_COST_OF_GPUS = (5.0, 3.0), (8.0, 3.0)
# By how much adaptive sampling lowers the variance of paths, which place their samples by it, and not that of photons;
# the second in scenes of meshes. Such samples cost more than others.
_ADAPTIVE_GAIN = (3.0, 2.0)
_ADAPTIVE_COST = 2.0
_MARGIN = 1.05  # by which the gain must exceed that: few samples show too little of it
_SAMPLES = (64, 256)  # of it in all, the second where light tracing seems to pay
_PASSES = 4
_PAIR = 2 * PHOTONS  # of a picture, at least, after as many that aim them
_MOST_MISSED = 4.0  # standard errors that photons may bring less than what paths leave to them
_NOWHERE = 2**31 - 1  # a first shape that light is traced from, so that none is


@dataclass(frozen=True)
class Decision:
    """Whether there is light tracing, why, by how many photons for a sample of a path, and by how much it raises the
    efficiency, as far as that was measured."""

    is_on: bool
    reason: str
    photons: float = 0.0
    worth: float = 1.0

    @property
    def defines(self) -> dict[str, int | str]:
        """Of the program that traces the paths."""
        return {"FILM_LIGHT": "FILM_LIGHT_UNTRACED"} if self.is_on else {}


@dataclass(frozen=True)
class Measurement:
    """Of light tracing in a scene, with 1/8 photon for a sample that is not placed adaptively: by how much the relative
    variance falls at equal samples, mean over the pixels, 0 where photons do not find the light; and the ``share`` of
    photons in what is left of it. A photon costs ``photon_cost`` of a sample."""

    gain: float
    share: float
    photon_cost: float

    def promise(self, scene: Scene, settings: RenderSettings, guided: guiding.Decision) -> tuple[float, float, float]:
        """The number of photons for a sample that is best where paths are ``guided`` so; by how much the variance
        falls then, over that of paths that are not, and what a sample costs, with its photons, over one of those.

        The gain is rather less: few samples show less of the rare and bright paths that light tracing saves.
        """
        is_adaptive, has_meshes = settings.adaptive != "off", bool(scene.meshes)
        adaptive_gain = _ADAPTIVE_GAIN[has_meshes] if is_adaptive else 1.0
        photon = self.photon_cost / (_ADAPTIVE_COST if is_adaptive else 1.0)
        pair = _PAIR / (settings.spp * settings.width * settings.height)

        def of(photons: float) -> tuple[float, float, float]:
            sent = max(photons, pair)
            left = (1 - self.share) / guided.gain + self.share * adaptive_gain * _MEASURED / sent
            return photons, self.gain / left, 1.05 * guided.cost + photon * (sent + pair)

        return max((of(2 * n if is_adaptive else n) for n in _PHOTONS), key=lambda found: found[1] / found[2])


Decisions = tuple[Decision, guiding.Decision]  # about light tracing, and about guiding beside it
_NOT_GUIDED = guiding.Decision(None, "")


def decide(ctx: Any, scene: Scene, settings: RenderSettings) -> Decision:
    """Whether some light of ``scene`` is traced from the lights with ``settings``, measured on ``ctx`` if need be."""
    return _decide(ctx, scene, settings, 1)[0]


def _decide(ctx: Any, scene: Scene, settings: RenderSettings, pictures: int) -> tuple[Decision, Measurement | None]:
    """The decision, if paths are not guided, and the measurement where there is one."""
    if settings.light_tracing == "off":
        return Decision(False, "off: as asked for"), None
    if reason := impossible(scene, settings):
        return Decision(False, f"off: {reason}"), None
    if settings.light_tracing == "on":
        photons, *_ = Measurement(1.0, 0.0, _photon_cost(ctx, scene)).promise(scene, settings, _NOT_GUIDED)
        return Decision(True, "on: as asked for", photons), None
    if not guiding.has_enough_samples(ctx, scene, settings, pictures):
        reason = f"off: to trace the {settings.spp} samples per pixel takes less time than to measure"
        return Decision(False, reason), None
    found = measure(ctx, scene, settings)
    if not found.gain:
        return Decision(False, "off: photons find less of the light than paths do"), found
    photons, gain, cost = found.promise(scene, settings, _NOT_GUIDED)
    if gain < _MARGIN * cost:
        reason = f"off: the variance would fall by {gain:.2f}, the time of a sample rise by {cost:.2f}"
        return Decision(False, reason), found
    return _on(photons, gain, cost), found


def _on(photons: float, gain: float, cost: float) -> Decision:
    reason = f"on: the variance falls by {gain:.2f}, the time of a sample rises by {cost:.2f}"
    return Decision(True, reason, photons, gain / cost)


def decide_both(ctx: Any, scene: Scene, settings: RenderSettings, pictures: int = 1) -> Decisions:
    """Whether some light is traced from the lights, and whether paths are guided; where both may be chosen, which of
    light tracing and guiding alone promises more in the picture: what guiding does not find comes with its samples.
    Decided once for so many ``pictures``."""
    settings = guiding.decides(settings)
    traced, found = _decide(ctx, scene, settings, pictures)
    guided = guiding.decide(ctx, scene, settings, traced.defines, pictures=pictures)
    if traced.is_on and found is not None:
        planned = _on(*found.promise(scene, settings, guided))
        if settings.guiding == "auto":
            samples = settings.spp * settings.width * settings.height
            alone = guiding.decide(ctx, scene, settings, least=planned.worth, samples=samples)
            if alone.guide is not None and alone.worth > planned.worth:
                reason = (
                    f"guiding alone promises {alone.worth:.2f} times the efficiency, this {planned.worth:.2f} times"
                )
                return Decision(False, f"off: {reason}"), alone
        traced = planned
    return traced, guided


def impossible(scene: Scene, settings: RenderSettings) -> str:
    """Why no light can be traced; empty if some can."""
    if settings.integrator != "path":
        return f"the integrator is {settings.integrator}"
    if settings.bounces < 2:
        return "paths of one bounce meet no light that others reflect"
    if not any(may_be_narrow(material) for material in scene.materials.values()):
        return "no surface reflects light narrowly onto another"
    if has_media(scene):
        return "there is a medium"
    if _has_open_fronts(scene):
        return "light passes a surface that is met from its front alone"
    if any(material.exterior_ior is not None for material in scene.materials.values()):
        return "of an interface of dielectrics nobody knows what is on either side"
    if reason := too_many(scene):
        return reason
    if camera_is_in_mirror(scene):
        return "the camera is inside of a mirror"
    inside = list(solids(scene))
    if _has_open_solids(scene, inside):
        return "what bounds a dielectric is not closed, or has its front inside"
    if any(solid.contains(scene.camera.position) for solid in inside):
        return "the camera is inside of a dielectric"
    if any(light.may_be_in(solid) for light in (_lit(scene) if inside else ()) for solid in inside):
        return "a light is, or may be, inside of a dielectric"
    if (scene.environment or scene.directional_lights) and any(isinstance(solid.shape, Plane) for solid in inside):
        return "light from afar is inside of a dielectric"
    return ""


def is_needed(scene: Scene, settings: RenderSettings) -> bool:
    """Whether light tracing alone brings some of the light: paths do not meet lights without a size by way of a mirror
    or of smooth glass."""
    has_points = scene.spot_lights or scene.directional_lights or any(light.radius == 0 for light in scene.lights)
    shapes = (shape.material for kind in SHAPES for shape in getattr(scene, kind))
    parts = (mesh.material_of(part) for mesh in scene.meshes for part in mesh.parts)
    materials = (scene.materials[name] for used in {*shapes, *parts} for name in scene.blended(used))
    return (
        bool(has_points)
        and any(material.alpha < ALPHA_DELTA and may_be_narrow(material) for material in materials)
        and not impossible(scene, settings)
    )


def _has_open_fronts(scene: Scene) -> bool:
    """Whether a surface is met from its front alone that light may meet from behind: then what a ray meets depends on
    which way it goes. Spheres and closed meshes are met from their front either way, if neither the camera nor what
    light is traced from is behind it."""
    culled = {name for name, material in scene.materials.items() if not material.double_sided}
    if not culled:
        return False
    if any(scene.materials[other].is_translucent for name in culled for other in scene.blended(name)):
        return True  # it scatters from behind to the front, and not the other way
    flats = [shape for kind in SHAPES if kind not in ("spheres", "planes") for shape in getattr(scene, kind)]
    parts = [(mesh.material_of(part), matrix, part.geometry) for mesh in scene.meshes for matrix, part in mesh.placed()]
    if any(shape.material in culled for shape in (*scene.planes, *flats)):
        return True
    if any(name in culled and not is_closed(geometry) for name, _, geometry in parts):
        return True
    behinds = [(sphere.material, partial(_is_in_sphere, sphere)) for sphere in scene.spheres]
    behinds += [(name, partial(_is_behind_mesh, matrix, geometry)) for name, matrix, geometry in parts]
    narrow = target_names(scene)
    places = enumerate(_places(scene, parts, flats))
    targets = [(i, point) for i, (name, point) in places if not narrow.isdisjoint(scene.blended(name))]
    numbers = np.array([-1, *(i for i, _ in targets)])
    points = np.array([scene.camera.position, *(point for _, point in targets)], np.float64)
    return any(is_behind(points[numbers != i]).any() for i, (name, is_behind) in enumerate(behinds) if name in culled)


def _places(
    scene: Scene, parts: Iterable[tuple[str, Floats, Geometry]], flats: Iterable[Any]
) -> Iterator[tuple[str, Floats]]:
    """The material and a point of each sphere, of each of the placed ``parts`` of meshes, and of the ``flats``."""
    for sphere in scene.spheres:
        yield sphere.material, np.add(sphere.center, (0.0, sphere.radius, 0.0))
    for name, matrix, geometry in parts:
        yield name, matrix[:3, :3] @ _middle(geometry) + matrix[:3, 3]
    for shape in flats:
        yield shape.material, np.mean(shape.bounds, axis=0)


def _middle(geometry: Geometry) -> Floats:
    """The centroid of the first triangle."""
    middle: Floats = geometry.positions[geometry.triangles[0]].mean(axis=0)
    return middle


def _is_in_sphere(sphere: Sphere, points: Floats) -> NDArray[np.bool_]:
    is_inside: NDArray[np.bool_] = np.linalg.norm(points - sphere.center, axis=1) < sphere.radius
    return is_inside


def _is_behind_mesh(matrix: Floats, geometry: Geometry, points: Floats) -> NDArray[np.bool_]:
    """Which ``points`` (n, 3) are behind the fronts of a closed ``geometry`` that is placed by ``matrix`` (4, 4)."""
    local = (points - matrix[:3, 3]) @ np.linalg.pinv(matrix[:3, :3]).T  # some have no volume
    low, high = geometry.bounds
    is_inside = ((low <= local) & (local <= high)).all(axis=1)
    for i in np.flatnonzero(is_inside):
        is_inside[i] = _is_inside(geometry, tuple(local[i].tolist()))
    is_behind: NDArray[np.bool_] = is_inside == _looks_outwards(geometry)
    return is_behind


@kept_by_digest(4096)
def _is_inside(geometry: Geometry, point: Triple) -> bool:
    return abs(winding_number(geometry.positions[geometry.triangles] - point)) > 0.5


@kept_by_digest(64)
def _looks_outwards(geometry: Geometry) -> bool:
    """Whether the fronts of a closed mesh are outside: by the sign of its volume."""
    corners = geometry.positions[geometry.triangles] - geometry.bounds[0]
    return float(np.linalg.det(corners).sum()) > 0


def _has_open_solids(scene: Scene, found: Iterable[Solid]) -> bool:
    """Whether what bounds a dielectric is not closed, or has its front inside."""
    inside = fillings(scene)
    parts = [(mesh.material_of(part), part.geometry) for mesh in scene.meshes for part in mesh.parts]
    bounds = [geometry for name, geometry in parts if name in inside and len(geometry.triangles)]
    for solid in found:
        if solid.name.startswith("flat_"):
            corners = ((solid.triangles() - solid.low) / (solid.high - solid.low).max()).reshape(-1, 3)
            bounds.append(Geometry(np.round(corners, 6), np.arange(len(corners)).reshape(-1, 3)))
    is_open = not all(is_closed(geometry) and _looks_outwards(geometry) for geometry in bounds)
    return is_open or any(disk.material in inside for disk in scene.disks)


@dataclass(frozen=True)
class _Lit:
    """Where a light is: within ``margin`` metres of the box from ``low`` to ``high`` (3,), and within those of its
    ``parts``, corners (n, 3) of each, where there are several."""

    low: Floats
    high: Floats
    margin: float = 0.0
    parts: Callable[[], tuple[Floats, Floats]] | None = None

    def may_be_in(self, solid: Solid) -> bool:
        if not solid.may_hold(self.low, self.high, self.margin):
            return False
        return self.parts is None or bool(solid.may_meet(*self.parts()).any())


def _lit(scene: Scene) -> Iterator[_Lit]:
    """Where each light is that is somewhere."""
    glowing = {name for name, material in scene.materials.items() if material.is_emissive}
    balls = [(light.position, light.radius) for light in scene.lights]
    balls += [(light.position, 0.0) for light in scene.spot_lights]
    balls += [(sphere.center, sphere.radius) for sphere in scene.spheres if sphere.material in glowing]
    for center, radius in balls:
        yield _Lit(np.array(center), np.array(center), radius)
    for shape in (shape for kind in SHAPES if kind not in ("spheres", "planes") for shape in getattr(scene, kind)):
        if shape.material in glowing:
            low, high = map(np.array, shape.bounds)
            yield _Lit(low, high)
    for mesh in scene.meshes:
        for matrix, part in mesh.placed():
            if mesh.material_of(part) in glowing:
                corners = partial(_corners, matrix, part.geometry)
                low, high = corners()
                yield _Lit(low.min(axis=0), high.max(axis=0), parts=corners)


def _corners(matrix: Floats, geometry: Geometry) -> tuple[Floats, Floats]:
    """Of the box of each triangle that ``matrix`` (4, 4) has placed, (n, 3)."""
    triangles = (geometry.positions @ matrix[:3, :3].T + matrix[:3, 3])[geometry.triangles]
    return triangles.min(axis=1), triangles.max(axis=1)


def measure(ctx: Any, scene: Scene, settings: RenderSettings) -> Measurement:
    """What light tracing is worth in ``scene``, by the variances of a small picture."""
    size = guiding.measured_size(settings)
    packed = pack(scene, settings, *size)
    targets, photon_cost = targets_of(packed, scene), _photon_cost(ctx, scene)
    if not len(targets):
        return Measurement(1.0, 0.0, photon_cost)
    least = _MARGIN * (1.05 + photon_cost * _MEASURED)
    found = cached(
        "light-tracing",
        content_digest(program_digest(packed), f"{_VERSION} {size} {photon_cost:g}"),
        lambda: {"found": np.asarray(_measured(ctx, packed, targets, size, least))},
        "measuring what light tracing is worth",
    )
    gain, share = found["found"].tolist()
    return Measurement(gain, share, photon_cost)


def _photon_cost(ctx: Any, scene: Scene) -> float:
    """Of a photon over a sample of a path."""
    return (_PHOTON_COST if is_software(ctx) else _PHOTON_COST_OF_GPUS)[bool(scene.meshes)]


def _measured(
    ctx: Any, packed: PackedScene, targets: Targets, size: tuple[int, int], least: float
) -> tuple[float, float]:
    """The gain without adaptive sampling, roughly where it is below ``least``, and the share of photons in what is left
    of the variance; 0 where photons miss some of the light."""
    light = LightTracer(ctx)
    try:
        light.load(packed, targets, size, Level.SCENE)
        sums = ProcessSums(size)
        for number in range(_PASSES):
            sums.add(light.trace(number), 0)
    finally:
        light.release()
    radiance, _, squares = sums.read(0, size[1])
    if not squares.any():
        return 1.0, 0.0
    photons = PHOTONS * _PASSES
    traced = radiance / photons
    of_all = squares.mean(axis=2) / photons**2
    noise = of_all * photons / (size[0] * size[1])  # of one photon for each pixel
    program = TracerProgram(defines=Decision(True, "").defines, level=Level.SCENE, kept=("u_first_traced",))
    with ExitStack() as held:
        films = [Film(ctx, *size) for _ in range(2)]
        for film in films:
            held.callback(film.release)
        tracer = Tracer(ctx, packed, program)
        held.callback(tracer.release)
        gain, share = 1.0, 0.0
        for before, samples in pairwise((0, *_SAMPLES)):
            pixels = []
            for film, first in zip(films, (_NOWHERE, packed.uniforms["u_first_traced"]), strict=True):
                tracer.set({"u_first_traced": first})
                for _ in tracer.bands(film, samples - before):
                    pass
                pixels.append(film.read())
            full, rest = (np.square(p.standard_error().astype(np.float64)).mean(axis=2) * samples for p in pixels)
            brightness = bright((pixels[1].mean[..., :3] + traced).astype(np.float32))
            weight = 1 / np.maximum(brightness, 1e-30) ** 2
            of_photons = float((noise / _MEASURED * weight).mean())
            if _misses(pixels[0], pixels[1], traced, of_all, np.sqrt(weight)):
                return 0.0, 0.0
            left = max(float((rest * weight).mean()) + of_photons, 1e-30)
            gain, share = float((full * weight).mean()) / left, of_photons / left
            if gain < least:
                break
    return gain, share


def _misses(full: Pixels, rest: Pixels, traced: Floats, noise: Floats, weight: Floats) -> bool:
    """Whether photons have ``traced`` (height, width, 3) less light, with a variance of ``noise`` (height, width), than
    all paths have found and those that leave it to them have not, both by the same random numbers; pixels count by
    their ``weight``. Then too few photons come from where the light does to tell their variance."""
    missed = (full.mean[..., :3] - rest.mean[..., :3] - traced).mean(axis=2, dtype=np.float64)
    halves = full.centred_half_difference() - rest.centred_half_difference()
    variance = np.square(halves.mean(axis=2)) + noise
    return float((missed * weight).sum()) > _MOST_MISSED * float(np.sqrt((variance * weight**2).sum()))
