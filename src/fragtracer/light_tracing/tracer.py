# SPDX-License-Identifier: MIT
"""The light that shaders/light_tracing.frag sends to pixels, summed up."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import skips_branches
from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import Level, specialise
from fragtracer.gpu.textures import UNITS, SceneTextures, folded_textures
from fragtracer.gpu.tracer import upload_random_texture
from fragtracer.packing import PackedScene
from fragtracer.packing.targets import Targets
from fragtracer.resources import folder

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Photons of a pass. All draws have the same size, for llvmpipe compiles a program anew for textures of another.
_SIZE = (512, 128)
PHOTONS = _SIZE[0] * _SIZE[1]
_TARGETS_UNIT = UNITS["u_film_mean"]  # there is no film here
_PILOT = (2**30, 2**30 + 1)  # the numbers of the passes that say to which targets photons go
_NOT_FINITE, _CUT = -2, -3  # in the place of the pixel


@dataclass(frozen=True)
class Splats:
    """Photons that are seen: the ``pixel`` (n,) of each, row by row from the top, and its ``radiance`` (3, n) there.
    ``photon`` (n,) are their numbers in the pass; ``non_finite`` more are left out, being NaN or infinite."""

    pixel: Ints
    radiance: NDArray[np.float32]
    photon: Ints
    non_finite: int


@dataclass(eq=False)
class Sums:
    """Of the radiance of photons, of each pixel, row by row from the top: ``halves`` (2, 3, pixels) of passes with even
    and odd numbers, and ``squares`` (3, pixels); the number of ``passes``, and that of photons left out since they were
    ``non_finite``."""

    halves: Floats
    squares: Floats
    passes: int = 0
    non_finite: int = 0

    @staticmethod
    def none(size: tuple[int, int]) -> "Sums":
        """Of a picture of ``size``, (width, height)."""
        pixels = size[0] * size[1]
        return Sums(np.zeros((2, 3, pixels)), np.zeros((3, pixels)))

    def add(self, splats: Splats) -> None:
        """Add the splats of the next pass."""
        radiance = splats.radiance.astype(np.float64)
        for sums, values in ((self.halves[self.passes % 2], radiance), (self.squares, radiance**2)):
            for channel in range(3):
                np.add.at(sums[channel], splats.pixel, values[channel])
        self.passes += 1
        self.non_finite += splats.non_finite


class LightTracer:
    """Sends photons to the targets of a scene; release it."""

    def __init__(self, ctx: Any) -> None:
        self._ctx = ctx
        self._key: object = None
        self._program: FullscreenProgram | None = None
        self._textures = SceneTextures(ctx)
        self._table: Any = None
        self._aiming: Iterator[None] | None = None
        self._random = upload_random_texture(ctx)
        self._found = [ctx.texture(_SIZE, 4, dtype="f4") for _ in range(2)]

    def load(
        self, packed: PackedScene, targets: Targets, size: tuple[int, int], level: Level, root: Path | None = None
    ) -> None:
        """Take over ``packed``, for a picture of ``size``, and its ``targets``, at least one; compiles only if the
        program is another one.

        More photons go to targets from which more light is seen, so that the variance is least; :meth:`aim` finds out
        from which.

        Raises :class:`ShaderError` if the program does not compile.
        """
        self._size = size
        specialisation = specialise(packed, level, skips_branches=skips_branches(self._ctx))
        key = root, dict(packed.features), specialisation.key
        if self._program is None or key != self._key:
            if self._program is not None:
                self._program.release()
            self._program = FullscreenProgram(
                self._ctx,
                root or folder("shaders"),
                "light_tracing.frag",
                text_pass=specialisation.apply,
                optional=packed.features,
            )
            self._key = key
        self._textures.load(packed.tables)
        uniforms: dict[str, Any] = {**UNITS, **packed.all_uniforms, "u_targets": _TARGETS_UNIT, "u_seed": 0}
        uniforms |= {"u_target_count": len(targets), "u_photon_width": _SIZE[0]}
        self._program.set({name: value for name, value in uniforms.items() if name in self._program.declared})
        self._seed = packed.uniforms["u_seed"]
        self._aiming = self._pilot(targets)

    def seed(self, seed: int) -> None:
        """Trace other photons."""
        assert self._program is not None
        self._seed = seed
        if self.is_aimed:
            self._program.set({"u_seed": seed})

    @property
    def is_aimed(self) -> bool:
        """Whether it is known how many photons go to which targets."""
        return self._aiming is None

    def aim(self) -> None:
        """Take a step towards knowing how many photons go to which targets: a pass at most."""
        if self._aiming is not None and next(self._aiming, self) is self:
            self._aiming = None

    def _pilot(self, targets: Targets) -> Iterator[None]:
        assert self._program is not None
        self._aim_by(targets, targets.weights())
        seen = np.zeros(len(targets))
        for number in _PILOT:
            found = self._trace(number)
            aimed = _texels(self._found[1])[found.photon, 0].astype(np.int64)
            seen += np.bincount(aimed, np.square(found.radiance.mean(axis=0, dtype=np.float64)), len(targets))
            yield
        self._aim_by(targets, targets.weights(seen))
        self._program.set({"u_seed": self._seed})

    def _aim_by(self, targets: Targets, weights: Floats) -> None:
        if self._table is not None:
            self._table.release()
        table = {"u_targets": (targets.texels(weights),)}
        self._table = folded_textures(self._ctx, table, table)["u_targets"]

    def trace(self, number: int) -> Splats:
        """Pass ``number``, of :data:`PHOTONS` photons, after those of :meth:`aim`.

        Raises :class:`DeviceError` if the driver ended their ways before their time.
        """
        while not self.is_aimed:
            self.aim()
        return self._trace(number)

    def _trace(self, number: int) -> Splats:
        assert self._program is not None
        with drawing_to(self._ctx, self._found):
            self._program.use("u_random_texture", self._random, UNITS["u_random_texture"])
            self._textures.use(self._program)
            self._program.use("u_targets", self._table, _TARGETS_UNIT)
            self._program.set({"u_photon_pass": number})
            self._program.draw()
        splat = _texels(self._found[0])
        place = splat[:, 3]
        if (place == _CUT).any():
            raise DeviceError("the driver ended the ways of photons early; render with fewer bounces")
        there = np.flatnonzero(place >= 0)
        width, height = self._size
        row, column = np.divmod(place[there].astype(np.int64), width)
        radiance = np.ascontiguousarray(splat[there, :3].T)
        return Splats((height - 1 - row) * width + column, radiance, there, int((place == _NOT_FINITE).sum()))

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU, without the program."""
        points = self._random.width * self._random.height * self._random.depth
        table = self._table.width * self._table.height if self._table else 0
        return 16 * int(points + 2 * PHOTONS + table) + self._textures.gpu_bytes

    def release(self) -> None:
        for texture in (*self._found, self._random, *([self._table] if self._table else ())):
            texture.release()
        self._textures.release()
        if self._program is not None:
            self._program.release()


def _texels(texture: Any) -> NDArray[np.float32]:
    """(n, 4), row by row."""
    return np.frombuffer(texture.read(), np.float32).reshape(-1, 4)
