# SPDX-License-Identifier: MIT
"""Photons, which shaders/light_tracing.frag sends to pixels."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.context import nearest_texture, skips_branches
from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import Level, specialise
from fragtracer.gpu.splats import Drawn
from fragtracer.gpu.textures import UNITS, SceneTextures, folded_textures
from fragtracer.gpu.tracer import upload_random_texture
from fragtracer.light_tracing.sums import Splats
from fragtracer.packing import PackedScene
from fragtracer.packing.targets import Targets
from fragtracer.resources import folder

Floats = NDArray[np.float64]

# Photons of a pass. All draws have the same size, for llvmpipe compiles a program anew for textures of another.
_SIZE = (512, 128)
PHOTONS = _SIZE[0] * _SIZE[1]
_TARGETS_UNIT = UNITS["u_film_mean"]  # there is no film here
_PILOT = (2**30, 2**30 + 1)  # the numbers of the passes that say to which targets photons go


class LightTracer:
    """Sends photons to the targets of a scene; release it."""

    def __init__(self, ctx: Any) -> None:
        self._ctx = ctx
        self._key: object = None
        self._program: FullscreenProgram | None = None
        self._textures = SceneTextures(ctx)
        self._table: Any = None
        self._aiming: Iterator[None] | None = None
        self._weights = np.empty(0)  # of the targets
        self._random = upload_random_texture(ctx)
        self._drawn: Drawn = (nearest_texture(ctx, _SIZE), nearest_texture(ctx, _SIZE))

    def load(
        self,
        packed: PackedScene,
        targets: Targets,
        size: tuple[int, int],
        level: Level,
        root: Path | None = None,
        kept: Sequence[str] = (),
        keeps_aim: bool = False,
    ) -> None:
        """Take over ``packed``, for a picture of ``size``, and its ``targets``, at least one; compiles only if the
        program is another one. What is ``kept`` is not compiled in (:func:`.specialise`).

        More photons go to targets from which more light is seen, so that the variance is least; :meth:`aim` finds out
        from which. As many as before go to each if it ``keeps_aim``, as for another moment of a picture.

        Raises :class:`ShaderError` if the program does not compile; the last one stays in use.
        """
        specialisation = specialise(packed, level, kept, skips_branches(self._ctx))
        key = root, dict(packed.features), specialisation.key
        if self._program is None or key != self._key:
            program = FullscreenProgram(
                self._ctx,
                root or folder("shaders"),
                "light_tracing.frag",
                text_pass=specialisation.apply,
                optional=packed.features,
            )
            if self._program is not None:
                self._program.release()
            self._program, self._key = program, key
        self._size = size
        self._textures.load(packed.tables)
        uniforms: dict[str, Any] = {**UNITS, **packed.all_uniforms, "u_targets": _TARGETS_UNIT, "u_seed": 0}
        uniforms |= {"u_target_count": len(targets), "u_photon_width": _SIZE[0]}
        self._program.set({name: value for name, value in uniforms.items() if name in self._program.declared})
        self._seed = packed.uniforms["u_seed"]
        if keeps_aim and self.is_aimed and len(targets) == len(self._weights):
            self._aim_by(targets, self._weights)
            self.seed(self._seed)
        else:
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
            found = Splats.read(self._draw(number), self._size[1])
            seen += np.bincount(found.target, np.square(found.radiance.mean(axis=0, dtype=np.float64)), len(targets))
            yield
        self._aim_by(targets, targets.weights(seen))
        self._program.set({"u_seed": self._seed})

    def _aim_by(self, targets: Targets, weights: Floats) -> None:
        if self._table is not None:
            self._table.release()
        self._weights = weights
        table = {"u_targets": (targets.texels(weights),)}
        self._table = folded_textures(self._ctx, table, table)["u_targets"]

    def trace(self, number: int) -> Drawn:
        """Pass ``number``, of :data:`PHOTONS` photons, after those of :meth:`aim`; until the next one."""
        while not self.is_aimed:
            self.aim()
        return self._draw(number)

    def _draw(self, number: int) -> Drawn:
        assert self._program is not None
        with drawing_to(self._ctx, self._drawn):
            self._program.use("u_random_texture", self._random, UNITS["u_random_texture"])
            self._textures.use(self._program)
            self._program.use("u_targets", self._table, _TARGETS_UNIT)
            self._program.set({"u_photon_pass": number})
            self._program.draw()
        return self._drawn

    @property
    def gpu_bytes(self) -> int:
        """Size of what is held on the GPU, without the program."""
        points = self._random.width * self._random.height * self._random.depth
        table = self._table.width * self._table.height if self._table else 0
        return 16 * int(points + 2 * PHOTONS + table) + self._textures.gpu_bytes

    def release(self) -> None:
        for texture in (*self._drawn, self._random, *([self._table] if self._table else ())):
            texture.release()
        self._textures.release()
        if self._program is not None:
            self._program.release()
