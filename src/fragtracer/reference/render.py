# SPDX-License-Identifier: MIT
"""Renders a fragtracer scene with Mitsuba's path tracer."""

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError
from fragtracer.interruption import deferred
from fragtracer.io.mitsuba import instantiated, reason
from fragtracer.reference.plugins import BESIDE
from fragtracer.reference.shapes import Tree
from fragtracer.reference.translate import NEVER, loadable, sensor_tree, to_mitsuba
from fragtracer.reference.variant import mitsuba_variant
from fragtracer.scene import Scene

MAX_PATHS = 2**21  # in flight at once; bounds the memory
# Mitsuba compiles another kernel for less than 4 samples, for numbers that are no power of two, and for the second
# rendering of some scenes.
_WARM_UPS, _WARM_UP_SPP = 2, (4, 5)


class ReferenceRenderer:
    """Mitsuba with ``scene`` loaded, in a ``with`` block.

    ``size`` is (width, height) in pixels, the scene's own if left out; for ``variant`` see
    :func:`fragtracer.reference.variant.choose_variant`, and for what the block may raise
    :func:`fragtracer.reference.variant.mitsuba_variant`. ``sampler`` is Mitsuba's name of one,
    and ``exact`` as for :func:`fragtracer.reference.translate.to_mitsuba`. With ``file``, the Mitsuba scene that
    ``scene`` was read from, the world is that of the file; the camera, the film and the depth are those of ``scene``.
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int] | None = None,
        variant: str | None = None,
        sampler: str = "independent",
        exact: bool = True,
        file: Path | None = None,
    ) -> None:
        width, height = size or (scene.render.width, scene.render.height)
        self.scene = replace(scene, render=replace(scene.render, width=width, height=height))
        self.passes_of = max(1, MAX_PATHS // (width * height))  # samples per pixel in one pass, at most
        self._variant = variant
        self._sampler = sampler
        self._exact = exact
        self._file = file

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self.variant = stack.enter_context(mitsuba_variant(self._variant))
            import mitsuba as mi

            folder = stack.enter_context(tempfile.TemporaryDirectory())
            sampler = {"type": self._sampler, "sample_count": self.passes_of}
            if self._file is not None:
                self._tree = loadable(sensor_tree(self.scene)) | {"sampler": sampler}
                self._world, self._sensor, self._integrator = _of_file(self._file, self._tree, self.scene)
            else:
                tree = to_mitsuba(self.scene, Path(folder), exact=self._exact)
                tree["sensor"]["sampler"] = sampler
                self._tree = tree["sensor"]
                with deferred():
                    self._world = mi.load_dict(tree, parallel=False)
                self._sensor, self._integrator = self._world.sensors()[0], self._world.integrator()
            self._stack = stack.pop_all()
        return self

    def sample(self, spp: int, seed: int, progress: Callable[[int], None] | None = None) -> NDArray[np.float64]:
        """The mean of ``spp`` samples per pixel, (height, width, 3) linear radiance, row 0 at the top.

        Samples of different seeds are independent. ``progress`` hears the number of samples per
        pixel of each pass when it is done.
        """
        return self._sample(self._sensor, spp, seed, progress)

    def batches(
        self, count: int, spp: int, seed: int, progress: Callable[[int], None] | None = None
    ) -> NDArray[np.float64]:
        """So many independent estimates as of :meth:`sample`, (count, height, width, 3).

        Those of which ``MAX_PATHS`` allows several in flight are rendered side by side, which takes less time.
        """
        sensor, beside = self._beside(count, spp)
        width, height = self.scene.render.width, self.scene.render.height

        def report(samples: int) -> None:
            if progress:
                progress(beside * samples)

        seeds = np.random.SeedSequence(seed).generate_state(count // beside).tolist()
        films = np.stack([self._sample(sensor, spp, one, report, beside) for one in seeds])
        return films.reshape(-1, height, beside, width, 3).swapaxes(1, 2).reshape(count, height, width, 3)

    def warm_up(self, count: int, spp: int) -> None:
        """Compile what :meth:`batches` needs."""
        sensor, beside = self._beside(count, spp)
        alike = {min(samples, _WARM_UP_SPP[samples & (samples - 1) > 0]) for samples in _split(spp, self.passes_of)}
        for seed in range(_WARM_UPS):
            for samples in alike:
                self._sample(sensor, samples, seed, None, beside)

    def _beside(self, count: int, spp: int) -> tuple[Any, int]:
        """A sensor for batches of ``spp`` samples, and how many of the ``count`` batches its film has."""
        import mitsuba as mi

        sensor, settings = self._sensor, self.scene.render
        is_possible = settings.pixel_filter == "box" and not self.variant.startswith("scalar")
        most = MAX_PATHS // (settings.width * settings.height * spp) if is_possible else 1
        beside = max(n for n in range(1, count + 1) if count % n == 0 and n <= max(1, most))
        if beside == 1:
            return sensor, 1
        film = self._tree["film"] | {"width": beside * settings.width}
        tree = {"type": BESIDE, "count": beside, "sensor": sensor, "film": film, "sampler": self._tree["sampler"]}
        if (medium := sensor.get_medium()) is not None:
            tree["medium"] = medium
        return mi.load_dict(tree), beside

    def _sample(
        self, sensor: Any, spp: int, seed: int, progress: Callable[[int], None] | None, pictures: int = 1
    ) -> NDArray[np.float64]:
        """The film of ``sensor``, which has so many ``pictures``."""
        import mitsuba as mi

        total = np.zeros((self.scene.render.height, pictures * self.scene.render.width, 3))
        passes = _split(spp, self.passes_of)
        seeds = np.random.SeedSequence(seed).generate_state(len(passes)).tolist()
        for samples, pass_seed in zip(passes, seeds, strict=True):
            with deferred():  # it calls Python for the plugins
                film = np.array(mi.render(self._world, None, sensor, self._integrator, pass_seed, spp=samples))
            total += film * (samples / spp)
            if progress:
                progress(samples)
        return total

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del self._world, self._sensor, self._integrator
        self._stack.close()


def render_reference(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seed: int = 0,
    batches: int = 1,
    variant: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.float32]:
    """Mitsuba's picture of a scene, as independent estimates of the same radiance.

    Parameters
    ----------
    scene
        Any scene.
    size
        Width and height in pixels; left out, the scene's own.
    spp
        Samples per pixel of all batches together, a multiple of ``batches``; left out, the scene's
        own, rounded up to one.
    seed
        Another seed gives other random numbers; every batch has its own.
    batches
        How many estimates, each of ``spp / batches`` samples per pixel.
    variant
        Mitsuba variant, see :func:`fragtracer.reference.variant.choose_variant`.
    progress
        Called after each pass with the samples per pixel done and ``spp``.

    Returns
    -------
    ndarray
        Float32, shape (batches, height, width, 3): linear radiance, row 0 at the top.

    Raises
    ------
    ValueError
        If ``spp`` is not a positive multiple of ``batches``.
    FragtracerError
        If Mitsuba, or the variant asked for, is missing.
    """
    spp = spp or -(-scene.render.spp // batches) * batches
    if batches < 1 or spp < 1 or spp % batches:
        raise ValueError(f"spp = {spp} must be a positive multiple of batches = {batches}")
    done = 0

    def report(samples: int) -> None:
        nonlocal done
        done += samples
        if progress:
            progress(done, spp)

    with ReferenceRenderer(scene, size, variant) as renderer:
        return renderer.batches(batches, spp // batches, seed, report).astype(np.float32)


def _of_file(file: Path, sensor: Tree, scene: Scene) -> tuple[Any, Any, Any]:
    """The world of a Mitsuba scene, with another ``sensor``, and an integrator of the depth of ``scene``.

    Raises
    ------
    FragtracerError
        If Mitsuba refuses the file.
    """
    import mitsuba as mi

    settings = scene.render
    rr_depth = settings.russian_roulette_depth if settings.russian_roulette else NEVER
    hides = scene.environment is not None and not scene.environment.visible
    integrator = {"type": "volpath", "max_depth": settings.bounces + 1, "rr_depth": rr_depth, "hide_emitters": hides}
    with deferred():
        try:
            world = instantiated(mi, file)
        except RuntimeError as error:
            raise FragtracerError(f"{file}: Mitsuba refuses this scene: {reason(error)}") from None
        inside = world.sensors()[0].get_medium() if world.sensors() else None
        camera = mi.load_dict(sensor if inside is None else {**sensor, "medium": inside})
        return world, camera, mi.load_dict(integrator)


def _split(samples: int, most: int) -> list[int]:
    """``samples`` in as few nearly equal parts as do not exceed ``most``."""
    return [len(part) for part in np.array_split(np.empty(samples), -(-samples // most))]
