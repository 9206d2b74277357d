# SPDX-License-Identifier: MIT
"""Photons of a scene, traced by shaders/photons.frag."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.context import is_software
from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import Level, specialise
from fragtracer.gpu.textures import UNITS, SceneTextures
from fragtracer.packing import PackedScene
from fragtracer.resources import folder

Floats = NDArray[np.float64]

# Of a draw, in fragments: operating systems reset a GPU that is silent for about 2 s. All draws have the same size, for
# llvmpipe compiles a program anew for textures of another.
_SIZE = (512, 64)
_TARGETS_UNIT = UNITS["u_film_mean"]  # there is no film here
_DEFINES = {"SAMPLER": "SAMPLER_HASH", "ESTIMATOR": "ESTIMATOR_NEE"}


@dataclass(frozen=True)
class Photons:
    """What was received: places (n, 3) in metres about the origin of the packing, the vertex before (n, 3), flux (n,),
    and in ``group`` (n,) the target that the photon met first, twice, plus 1 if it met more. ``indirect`` (n,) are
    samples of the receiver's irradiance by one more reflection."""

    receiver: Floats
    source: Floats
    flux: Floats
    group: NDArray[np.int64]
    indirect: Floats

    def __len__(self) -> int:
        return len(self.flux)


class PhotonTracer:
    """Traces photons in ``packed``; release it."""

    def __init__(self, ctx: Any, packed: PackedScene) -> None:
        self._ctx = ctx
        specialisation = specialise(packed, Level.KINDS if is_software(ctx) else Level.NOTHING)
        self._program = FullscreenProgram(
            ctx,
            folder("shaders"),
            "photons.frag",
            _DEFINES,
            text_pass=specialisation.apply,
            optional={name: value for name, value in packed.features.items() if name not in _DEFINES},
        )
        self._textures = SceneTextures(ctx)
        self._textures.load(packed.tables)
        self._chords, *self._found = (ctx.texture(_SIZE, 4, dtype="f4") for _ in range(3))
        uniforms: dict[str, Any] = {**UNITS, **packed.all_uniforms, "u_photon_targets": _TARGETS_UNIT}
        self._program.set({name: value for name, value in uniforms.items() if name in self._program.declared})

    def trace(self, targets: Floats, counts: NDArray[np.int64], seed: int) -> Photons:
        """``counts`` (n,) photons to each of the ``targets`` (n, 4), centre and radius of their bounding spheres;
        where the radius is below 0, chords begin inside of them."""
        index = np.repeat(np.arange(len(targets)), counts)
        found = np.empty((2, len(index), 4), np.float64)
        each = _SIZE[0] * _SIZE[1]
        for first in range(0, len(index), each):
            part = index[first : first + each]
            found[:, first : first + each] = self._draw(targets[part], seed + first)
        receiver, source = found
        area = 4 * np.pi * np.square(targets[:, 3]) / np.maximum(counts, 1)
        there = np.flatnonzero((receiver[:, 3] != 0) & np.isfinite(found).all(axis=(0, 2)))
        return Photons(
            receiver[there, :3],
            source[there, :3],
            np.abs(receiver[there, 3]) * area[index[there]],
            2 * index[there] + (receiver[there, 3] < 0),
            source[there, 3],
        )

    def _draw(self, targets: Floats, seed: int) -> NDArray[np.float32]:
        """The two texels (2, n, 4) of a photon for each of ``targets`` (n, 4), as many as fit into a draw."""
        texels = np.zeros((_SIZE[0] * _SIZE[1], 4), np.float32)
        texels[: len(targets)] = targets
        self._chords.write(texels.tobytes())
        with drawing_to(self._ctx, self._found):
            self._textures.use(self._program)
            self._chords.use(_TARGETS_UNIT)
            self._program.set({"u_seed": seed})
            self._program.draw()
        found = [np.frombuffer(t.read(), np.float32).reshape(-1, 4)[: len(targets)] for t in self._found]
        return np.stack(found)

    def release(self) -> None:
        for texture in (self._chords, *self._found):
            texture.release()
        self._textures.release()
        self._program.release()
