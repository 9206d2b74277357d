# SPDX-License-Identifier: MIT
"""fragtracer and Mitsuba with the same methods: add samples, look at the clock, take the image."""

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.bench.variants import Edit, edited_shaders
from fragtracer.reference.render import ReferenceRenderer
from fragtracer.renderer import Renderer
from fragtracer.scene import Scene

Image = NDArray[np.float64]
_MOST_PATHS = 2**25  # in flight at once, some 6 GB
_WARM_UPS = 2  # of Mitsuba, which compiles another kernel for the second rendering of some scenes


@dataclass(frozen=True)
class Sampling:
    """A sampler of Mitsuba, and how many samples per pixel it takes in one pass."""

    sampler: str = "independent"
    spp: int = 16

    def fits(self, scene: Scene) -> bool:
        """Whether the paths of a pass of ``scene`` are few enough for the memory."""
        return self.spp * scene.render.width * scene.render.height <= _MOST_PATHS

    def __str__(self) -> str:
        return f"{self.sampler}, {self.spp} spp a pass"


class Contender(Protocol):
    """A renderer with a clock of its own, which runs only while it samples."""

    name: str
    seconds: float
    spp: int

    @property
    def step(self) -> int:
        """Samples per pixel that it takes at once."""

    def sample(self, spp: int) -> None: ...
    def image(self) -> Image: ...


class Ours:
    """fragtracer on ``scene``, compiled and warm; a ``with`` block.

    ``edits`` are made in its shaders; ``options`` are those of :class:`Renderer`. It is told that it has so many
    ``longest`` seconds, if given, as by ``render --time``.
    """

    name = "fragtracer"

    def __init__(
        self, scene: Scene, seed: int = 0, edits: Sequence[Edit] = (), longest: float | None = None, **options: Any
    ) -> None:
        start = time.perf_counter()
        with ExitStack() as stack:
            shaders = stack.enter_context(edited_shaders(edits))
            self._renderer = stack.enter_context(Renderer(scene, shaders=shaders, seed=seed, **options))
            self._stack = stack.pop_all()
        self._renderer.sample(1)
        self._renderer.image()
        self.first_picture = time.perf_counter() - start  # seconds from the scene to one sample of each pixel
        self._longest = longest
        self.seconds, self.spp = 0.0, 0
        self.restart()

    @property
    def step(self) -> int:
        return self._renderer.pass_spp

    def restart(self) -> None:
        """Forget the samples, and set the clock to 0."""
        self._renderer.sample(self.step)
        self._renderer.reset()
        self.seconds, self.spp = 0.0, 0

    def sample(self, spp: int) -> None:
        start = time.perf_counter()
        if self._longest is not None:
            self._renderer.expect(self._longest - self.seconds)
        self._renderer.sample(spp)
        self.seconds += time.perf_counter() - start
        self.spp += spp

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU."""
        return self._renderer.gpu_bytes

    def image(self) -> Image:
        return self._renderer.image().astype(np.float64)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()


class Mitsuba:
    """Mitsuba on ``scene``, compiled and warm; a ``with`` block."""

    name = "Mitsuba"

    def __init__(
        self, scene: Scene, seed: int = 0, variant: str | None = None, sampling: Sampling = Sampling()
    ) -> None:
        self._stack = ExitStack()
        renderer = ReferenceRenderer(scene, variant=variant, sampler=sampling.sampler, exact=False)
        self.step = renderer.passes_of = sampling.spp
        self._renderer = self._stack.enter_context(renderer)
        self.variant = self._renderer.variant
        self._seeds = np.random.default_rng(seed)
        for _ in range(_WARM_UPS):
            self.restart()

    def restart(self) -> None:
        """Forget the samples, and set the clock to 0."""
        self._renderer.sample(self.step, self._seed())
        self._sum: Image | float = 0.0
        self.seconds, self.spp = 0.0, 0

    def _seed(self) -> int:
        return int(self._seeds.integers(2**32))

    def sample(self, spp: int) -> None:
        start = time.perf_counter()
        image = self._renderer.sample(spp, self._seed())
        self.seconds += time.perf_counter() - start
        self._sum = self._sum + spp * image
        self.spp += spp

    def image(self) -> Image:
        return np.asarray(self._sum) / self.spp

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()


def race(contenders: Sequence[Contender], seconds: float) -> None:
    """Let all sample until the clock of each shows ``seconds``, in turns of one step of the one that is behind."""
    while behind := [c for c in contenders if c.seconds < seconds]:
        last = min(behind, key=lambda c: c.seconds)
        last.sample(last.step)
