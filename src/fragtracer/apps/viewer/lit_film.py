# SPDX-License-Identifier: MIT
"""What the window shows of a film: the samples of its paths, with the light of photons where there are some."""

import time
from typing import Any, Protocol

import numpy as np

from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.context import nearest_texture
from fragtracer.gpu.film import read_pixels
from fragtracer.gpu.outputs import Outputs
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.light_tracing import PHOTONS, LightTracing
from fragtracer.resources import folder
from fragtracer.sampling.pixels import Pixels

_UPLOADS = 0.1  # of the time, at most, are uploads of the light of photons
_BAND = 64  # rows of an upload that stay in the cache
_UNITS = {
    name: unit
    for unit, name in enumerate(
        (
            *("u_film_mean", "u_film_variance", "u_film_half_difference"),
            *("u_light_even", "u_light_odd", "u_light_squares"),
        )
    )
}


class ShownFilm(Protocol):
    """A picture in progress as far as it is shown."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""

    @property
    def is_uneven(self) -> bool:
        """Whether pixels have different numbers of samples."""

    @property
    def textures(self) -> tuple[Any, ...]:
        """Those of a film, in the order of :class:`Pixels`; row 0 at the bottom."""

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """``rows`` rows from ``bottom`` (0 is the lowest) upwards."""


class LitFilm:
    """A film with light of photons added; release it, which leaves both as they are."""

    def __init__(self, ctx: Any) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, folder("shaders"), "film/with_light.frag")
        self._program.set(_UNITS)
        self._film: Accumulation | None = None

    def begin(self, film: Accumulation, light: LightTracing) -> None:
        """Show ``film`` with the light of ``light``, until :meth:`end`."""
        self.end()
        self._film, self._light = film, light
        self._passes, self._uploads_at = -1, 0.0  # passes of photons in the textures, and when there may be more
        self._shown: object = None  # the version of the film that the sums are of
        self._uploaded = () if light.textures else tuple(nearest_texture(self._ctx, film.size, 3) for _ in range(3))
        self._sums = [nearest_texture(self._ctx, film.size) for _ in range(3)]
        self._outputs = Outputs(self._ctx, self._sums)

    def end(self) -> None:
        """Forget them."""
        if self._film is None:
            return
        self._film = None
        self._outputs.release()
        for texture in (*self._uploaded, *self._sums):
            texture.release()

    @property
    def size(self) -> tuple[int, int]:
        return self._of_paths.size

    @property
    def is_uneven(self) -> bool:
        return self._of_paths.is_uneven

    @property
    def textures(self) -> tuple[Any, ...]:
        self._take_photons()
        if self._of_paths.version != self._shown:
            self._add(0, self.size[1])
            self._shown = self._of_paths.version
        return tuple(self._sums)

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        self._take_photons()
        self._add(bottom, rows)
        return read_pixels(self._outputs, bottom, rows)

    @property
    def _of_paths(self) -> Accumulation:
        assert self._film is not None
        return self._film

    def _add(self, bottom: int, rows: int) -> None:
        """Add the light of the photons to some rows of the film."""
        before = self._ctx.detect_framebuffer()
        for unit, texture in enumerate((*self._of_paths.textures, *(self._light.textures or self._uploaded))):
            texture.use(unit)
        self._outputs.use()
        self._outputs.restrict(bottom, rows)
        self._program.set({"u_light_passes": self._passes, "u_light_photons": float(PHOTONS)})
        self._program.draw()
        before.use()

    def _take_photons(self) -> None:
        """Take over the light of the photons; where that is an upload, unless there was one a moment ago."""
        passes, now = self._light.passes, time.perf_counter()
        if passes == self._passes or now < self._uploads_at:
            return
        self._passes, self._shown = passes, None
        if not self._uploaded:
            return
        width, height = self.size
        for bottom in range(0, height, _BAND):
            rows = min(_BAND, height - bottom)
            for texture, image in zip(self._uploaded, self._light.sums(height - bottom - rows, rows), strict=True):
                texture.write(np.ascontiguousarray(image[::-1], np.float32), (0, bottom, width, rows))
        self._uploads_at = now + (time.perf_counter() - now) / _UPLOADS

    @property
    def gpu_bytes(self) -> int:
        """Size of its textures."""
        if self._film is None:
            return 0
        return 3 * (16 + (12 if self._uploaded else 0)) * self.size[0] * self.size[1]

    def release(self) -> None:
        self.end()
        self._program.release()
