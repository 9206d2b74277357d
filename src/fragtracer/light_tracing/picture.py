# SPDX-License-Identifier: MIT
"""The light of a picture that is traced from the lights, beside the film of its paths."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.specialise import Level
from fragtracer.guiding import same_light
from fragtracer.light_tracing.sums import Sums, sums_of
from fragtracer.light_tracing.tracer import PHOTONS, LightTracer
from fragtracer.packing import PackedScene
from fragtracer.packing.records import Words
from fragtracer.packing.targets import Targets, targets_of
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene

Floats = NDArray[np.float64]


class LightTracing:
    """Photons for a picture; release it.

    How many there are depends on the samples of a pixel alone, and not on how they are cut into passes.
    """

    def __init__(self, ctx: Any) -> None:
        self._ctx, self._size = ctx, (0, 0)
        self._tracer = LightTracer(ctx)
        self._sums: Sums | None = None
        self._known: tuple[Scene, tuple[Words, ...], Targets] | None = None  # with its shapes
        self._has_targets = False
        self._per_sample = 0.0
        self.passes = 0  # of photons

    def load(
        self,
        packed: PackedScene,
        scene: Scene,
        size: tuple[int, int],
        per_sample: float,
        level: Level,
        root: Path | None = None,
        kept: Sequence[str] = (),
        goes_on: bool = False,
    ) -> None:
        """Take over ``scene`` as it is ``packed``, for a picture of ``size`` with so many photons for a sample of a
        path; forgets all of them unless the picture ``goes_on``, with another moment. ``level`` and ``kept`` are those
        of :func:`fragtracer.gpu.specialise.specialise`.

        Raises :class:`ShaderError` if the program does not compile, and :class:`DeviceError` if the GPU has no memory
        for the photons.
        """
        if self._sums is None or size != self._size:
            self._release_sums()
            self._sums = sums_of(self._ctx, size)
        self._size, self._per_sample = size, per_sample
        targets = self._targets(packed, scene)
        self._has_targets = len(targets) > 0
        if self._has_targets:
            self._tracer.load(packed, targets, self._size, level, root, kept, goes_on)
        if not goes_on:
            self.clear()

    def _targets(self, packed: PackedScene, scene: Scene) -> Targets:
        """Those of the last scene, if at most its camera has moved."""
        shapes = tuple(packed.tables["u_shapes"])
        if self._known is not None:
            before, known, targets = self._known
            if same_light(scene, before) and len(shapes) == len(known) and all(map(np.array_equal, shapes, known)):
                return targets
        self._known = scene, shapes, targets_of(packed, scene)
        return self._known[2]

    def clear(self, seed: int | None = None) -> None:
        """Forget all photons; trace others from now on if there is another ``seed``."""
        self._held.clear()
        self.passes = 0
        if seed is not None and self._has_targets:
            self._tracer.seed(seed)

    def advance(self, spp: int) -> None:
        """Trace the photons of a picture with ``spp`` samples of each pixel.

        Raises :class:`DeviceError` if the driver ended their ways before their time.
        """
        while self.lacks_photons(spp):
            self.step()

    def lacks_photons(self, spp: int) -> bool:
        """Whether a picture with ``spp`` samples of each pixel is to have more photons."""
        width, height = self._size
        pairs = -(-spp * width * height * self._per_sample // (2 * PHOTONS))
        return self._has_targets and self.passes < 2 * pairs

    def warm_up(self) -> None:
        """Find out now where photons should go; a driver that compiles at the first draw does so."""
        while self._has_targets and not self._tracer.is_aimed:
            self._tracer.aim()

    def step(self) -> None:
        """Trace a pass of photons, or find out where they should go.

        Raises :class:`DeviceError` if the driver ended their ways before their time.
        """
        if self._tracer.is_aimed:
            self._held.add(self._tracer.trace(self.passes), self.passes % 2)
            self.passes += 1
        else:
            self._tracer.aim()

    def sums(self, top: int, rows: int) -> Floats:
        """In some rows, the sums of the radiance of photons, of passes with even numbers and with odd ones, and of its
        squares; (3, rows, width, 3), row 0 at the top."""
        return self._held.read(top, rows)

    @property
    def textures(self) -> tuple[Any, ...]:
        """These sums where they are textures, row 0 at the bottom; empty where they are not."""
        return self._held.textures

    @property
    def _held(self) -> Sums:
        assert self._sums is not None
        return self._sums

    def light(self, top: int, rows: int) -> tuple[Floats, Floats, Floats]:
        """In some rows, the light of the photons, half the difference of that of both halves of them, and the variance
        of the light, as of independent photons; each (rows, width, 3), row 0 at the top."""
        count = max(1, self.passes)
        even, odd, squares = self.sums(top, rows) / (count * PHOTONS)
        light = even + odd
        return light, even - odd - light * (count % 2) / count, squares / (count * PHOTONS)

    def added_to(self, pixels: Pixels) -> Pixels:
        """``pixels`` of the paths, with the light of the photons; the standard error is that of both."""
        if not self.passes:
            return pixels
        count = pixels.mean[..., 3:].astype(np.float64)
        light, difference, of_mean = self.light(0, self._size[1])
        mean, variance = pixels.mean.copy(), pixels.variance.copy()
        mean[..., :3] += light
        variance[..., :3] += of_mean * np.maximum(count - 1, 0)
        # As of samples in two streams, of which one may have one more (Pixels.centred_half_difference).
        half = pixels.half_difference + difference + light * (count % 2) / np.maximum(count, 1)
        return Pixels(mean, variance, half.astype(np.float32))

    def state(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """All that :meth:`restore` needs to go on with the same bits."""
        counts = {"light_passes": self.passes, "light_non_finite": self.non_finite}
        return {**counts, "photons_per_sample": self._per_sample}, {"light.sums": self.sums(0, self._size[1])}

    def restore(self, state: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what :meth:`state` has returned for a picture of this size; raises KeyError where it is not."""
        self._held.write(np.asarray(arrays["light.sums"]), state["light_non_finite"])
        self._per_sample, self.passes = state["photons_per_sample"], state["light_passes"]

    @property
    def non_finite(self) -> int:
        """How many photons were NaN or infinite; they are left out."""
        return self._held.non_finite

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU, without the program."""
        return self._held.gpu_bytes + (self._tracer.gpu_bytes if self._has_targets else 0)

    def release(self) -> None:
        self._tracer.release()
        self._release_sums()

    def _release_sums(self) -> None:
        if self._sums is not None:
            self._sums.release()
        self._sums = None
