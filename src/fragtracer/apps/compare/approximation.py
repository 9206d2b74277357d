# SPDX-License-Identifier: MIT
"""The split-sum approximation against the path-traced truth of the same scene, its errors one at a time.

Between the truth and the approximation lie estimators that differ from their neighbours by one error each. The
differences of neighbours add up to the whole difference, pixel by pixel: nothing is left over. They come in a fixed
order, and what an error is worth depends on those that were made before it.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.machine import describe_machine
from fragtracer.apps.compare.measures import relative
from fragtracer.apps.compare.rendering import Progress, part_of
from fragtracer.renderer import Renderer
from fragtracer.scene import LIGHTS, Scene
from fragtracer.scene.material import DEFAULT_MODEL

Floats = NDArray[np.float64]

SPP = 1024
BOUNCES = 8  # of the truth, at least
ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)  # degrees, of view to normal


@dataclass(frozen=True)
class Stage:
    """An estimator, and the error that it makes and the one before it does not."""

    name: str
    error: str
    explanation: str
    settings: Mapping[str, Any]
    defines: Mapping[str, str] = field(default_factory=dict)


def stages(scene: Scene) -> list[Stage]:
    """The estimators for ``scene`` from the truth to the approximation; those are left out that change nothing."""
    path = {"integrator": "path", "geometry": "smith", "bounces": max(BOUNCES, scene.render.bounces)}
    both, once = "facets reflect light any number of times", "facets reflect light once and absorb the rest"
    found = [
        Stage("truth", "", both, {**path, "multiple_scattering": True}),
        Stage("single scattering", "lost multiple scattering", once, path),
        Stage("direct light", "missing interreflection", "surfaces are dark to each other", {**path, "bounces": 1}),
    ]
    lit = any(getattr(scene, kind) for kind in LIGHTS) or any(m.is_emissive for m in scene.materials.values())
    if lit or (scene.environment is not None and scene.environment.sun is not None):
        found.append(_step("OCCLUDED", "lights as points", "lights are points without shadows, with the k of lamps"))
    found += [
        _step("UNOCCLUDED", "missing occlusion", "the environment is seen through everything in its way"),
        _step("MASKING", "another masking", "Schlick's masking with k = roughness²/2 instead of Smith's"),
        _step("DIFFUSE", "diffuse factor", "1 - F at the normal, instead of what passes the interface twice"),
        _step("FACTORS", "factorisation", "the mean light over the lobe times the mean BRDF"),
        _step("NORMAL_VIEW", "n = v = r", "the lobe of a view along the normal, around the mirrored direction"),
        _step("FRESNEL", "doubled Fresnel", "F at the normal in the place of F0, though the bias holds it already"),
        _step("LOOKUPS", "lookups", "maps of 5 roughness levels, 128² to 8², and 512²; 1024 samples"),
    ]
    if any(m.occlusion_texture for m in scene.materials.values()):
        found.append(_step("OCCLUSION_MAP", "occlusion map", "an artist's guess at the occlusion darkens the result"))
    return found


def _step(name: str, error: str, explanation: str) -> Stage:
    smith = name in ("OCCLUDED", "UNOCCLUDED")
    masking = "GEOMETRY_SMITH" if smith else "GEOMETRY_KARIS_ENVIRONMENT"
    defines = {"SPLIT_SUM_STEP": f"SPLIT_SUM_{name}", "GEOMETRY_TERM": masking}
    title = error if name == "OCCLUSION_MAP" else f"with {error}"
    return Stage(title, error, explanation, {"integrator": "split-sum"}, defines)


@dataclass(frozen=True)
class Term:
    """What one error does to the surfaces in the picture, relative to their mean radiance in truth.

    ``bias`` is the mean of the change, ``bias_error`` its standard error, from what two independent halves of the
    samples differ by in each pixel; ``rms`` the root mean square over pixels with the noise taken out, by multiplying
    the halves; None where the noise hides it.
    """

    error: str
    explanation: str
    bias: float
    bias_error: float
    rms: float | None


@dataclass(frozen=True)
class Approximation:
    """All that was measured. ``pictures`` (stages, height, width, 3) are the means of all samples."""

    scene: Scene
    stages: tuple[Stage, ...]
    halves: Floats  # (stages, 2, height, width, 3)
    surfaces: NDArray[np.bool_]  # (height, width): where a surface fills the pixel
    depth: Floats  # (height, width) metres, of its middle
    spp: int
    device: str
    machine: dict[str, str] = field(default_factory=describe_machine)

    @property
    def pictures(self) -> Floats:
        return np.asarray(self.halves.mean(axis=1))

    @property
    def truth(self) -> Floats:
        return np.asarray(self.pictures[0])

    @property
    def split_sum(self) -> Floats:
        return np.asarray(self.pictures[-1])

    @property
    def size(self) -> tuple[int, int]:
        height, width = self.surfaces.shape
        return width, height

    def terms(self) -> list[Term]:
        """One for each stage but the first, and last their sum: the whole difference."""
        pairs = [(i - 1, i, stage.error, stage.explanation) for i, stage in enumerate(self.stages) if i]
        pairs.append((0, len(self.stages) - 1, "all together", "the split-sum approximation against the truth"))
        return [Term(error, text, *self._measure(before, after)) for before, after, error, text in pairs]

    @property
    def others(self) -> list[str]:
        """The names of materials that are not what the steps are about, isotropic metallic-roughness without sheen,
        films and diffuse transmission, perhaps coated; and "fog" where there is some."""
        found = [
            name
            for name, m in self.scene.materials.items()
            if m.model != DEFAULT_MODEL or m.anisotropy > 0 or m.has_sheen or m.has_iridescence or m.is_translucent
        ]
        return found + (["fog"] if self.scene.fog else [])

    def _measure(self, before: int, after: int) -> tuple[float, float, float | None]:
        if not self.surfaces.any():
            return 0.0, 0.0, 0.0
        level = max(float(self.truth[self.surfaces].mean()), 1e-30)
        first, second = (self.halves[after] - self.halves[before])[:, self.surfaces] / level
        bias = float((first + second).mean() / 2)
        noise = (first - second).mean(axis=1) / 2
        error = float(np.linalg.norm(noise) / len(noise))
        square = float((first * second).mean())
        return bias, error, math.sqrt(square) if square >= 0 else None

    def relative(self, stage: int = -1, against: int = 0) -> Floats:
        """(stage - another) / truth of each pixel's mean of the colours, (height, width)."""
        change = (self.pictures[stage] - self.pictures[against]).mean(axis=2)
        return relative(change, self.truth.mean(axis=2))


def measure_approximation(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int = SPP,
    seed: int = 0,
    progress: Progress | None = None,
    context: Any = None,
) -> Approximation:
    """Render ``scene`` by all stages, ``spp`` samples per pixel each, and measure what lies between.

    ``progress`` hears of each stage the samples per pixel that are done.
    """
    each = max(1, spp // 2)
    # In the gradient domain the errors of neighbours would not be independent.
    settings: dict[str, Any] = {"multiple_scattering": False, "background": "environment", "gradient_domain": "off"}
    scene = replace(scene, render=replace(scene.render, **settings))
    found = stages(scene)
    halves = []
    for stage in found:
        with Renderer(scene, size, context, defines=stage.defines, rays=min(each, 64), **stage.settings) as renderer:
            device = renderer.context_info["GL renderer"]
            pictures = []
            for number, half_seed in enumerate(np.random.SeedSequence(seed).generate_state(2)):
                renderer.reset(seed=int(half_seed))
                renderer.sample(each, part_of(progress, stage.name, number * each, 2 * each))
                pictures.append(renderer.image())
        halves.append(pictures)
    surfaces, depth = _surfaces(scene, size, context)
    return Approximation(scene, tuple(found), np.asarray(halves, np.float64), surfaces, depth, 2 * each, device)


def _surfaces(scene: Scene, size: tuple[int, int] | None, context: Any) -> tuple[NDArray[np.bool_], Floats]:
    """Where all of 64 rays through a pixel meet something, and its mean distance."""
    defines = {"AUXILIARY": "AUXILIARY_DEPTH"}
    with Renderer(scene, size, context, defines=defines, program="auxiliary.frag") as renderer:
        renderer.sample(64)
        depth = renderer.image()[..., 0].astype(np.float64)
        # A ray that meets nothing has depth 0, which shows as scatter beyond that of a surface.
        spread = renderer.standard_deviation()[..., 0]
    return (depth > 0) & (spread < 0.1 * depth), depth


def by_roughness_and_angle(
    found: Approximation, stage: int = -1, against: int = 0
) -> Iterator[tuple[float, float, list[float]]]:
    """On the spheres of the scene: the mean relative difference of two stages by the angle of view.

    Yields (metallic, roughness, [for each bin between two :data:`ANGLES`]), NaN where no pixel falls in.
    """
    radiance = found.pictures.mean(axis=3)
    index, angle = sphere_angles(found)
    spheres = found.scene.spheres
    kinds = sorted({_kind(found.scene, i) for i in range(len(spheres))})
    for kind in kinds:
        of_kind = np.isin(index, [i for i in range(len(spheres)) if _kind(found.scene, i) == kind])
        row = []
        for low, high in pairwise(ANGLES):
            here = of_kind & (angle >= low) & (angle < high)
            change = (radiance[stage] - radiance[against])[here].sum()
            truth = radiance[0][here].sum()
            row.append(float(change / truth) if truth > 0 else math.nan)
        yield kind[0], kind[1], row


def _kind(scene: Scene, sphere: int) -> tuple[float, float]:
    material = scene.materials[scene.spheres[sphere].material]
    return material.metalness, material.roughness


def sphere_angles(found: Approximation) -> tuple[NDArray[np.int64], Floats]:
    """For each pixel the number of the sphere that its middle shows, -1 for none, and the angle between view
    and normal in degrees, both (height, width)."""
    width, height = found.size
    camera = found.scene.camera
    eye = np.asarray(camera.position, np.float64)
    forward = np.subtract(camera.target, eye)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = np.tan(np.radians(camera.fov_degrees) / 2)
    x = (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
    y = (1 - 2 * (np.arange(height) + 0.5) / height) * half
    ray = forward + x[None, :, None] * right + y[:, None, None] * up
    ray /= np.linalg.norm(ray, axis=2, keepdims=True)
    index, cosine = np.full((height, width), -1), np.ones((height, width))
    nearest = np.full((height, width), np.inf)
    for number, sphere in enumerate(found.scene.spheres):
        to_center = np.subtract(sphere.center, eye)
        along = ray @ to_center
        square = sphere.radius**2 - (to_center @ to_center - along**2)
        distance = along - np.sqrt(np.maximum(square, 0))
        hit = (square > 0) & (distance > 0) & (distance < nearest)
        nearest[hit], index[hit] = distance[hit], number
        cosine[hit] = np.sqrt(square[hit]) / sphere.radius
    # Something else may stand in front.
    seen = found.surfaces & (np.abs(nearest - found.depth) < 0.02 * found.depth)
    return np.where(seen, index, -1), np.degrees(np.arccos(np.clip(cosine, 0, 1)))
