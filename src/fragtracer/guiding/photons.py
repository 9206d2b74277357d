# SPDX-License-Identifier: MIT
"""Photons of a scene, traced by shaders/photons.frag."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import Level, specialise
from fragtracer.gpu.textures import UNITS, SceneTextures, folded_textures
from fragtracer.packing import PackedScene
from fragtracer.packing.targets import Targets
from fragtracer.resources import folder

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Of a draw, in fragments: operating systems reset a GPU that is silent for about 2 s. All draws have the same size, for
# llvmpipe compiles a program anew for textures of another.
_SIZE = (512, 64)
_TARGETS_UNIT = UNITS["u_film_mean"]  # there is no film here
_DEFINES = {"SAMPLER": "SAMPLER_HASH", "ESTIMATOR": "ESTIMATOR_NEE"}


@dataclass(frozen=True)
class Photons:
    """What was received: places (n, 3) in metres about the origin of the packing, the vertex before (n, 3), flux (n,)
    in W, the ``target`` (n,) that the photon met first, and in ``group`` (n,) twice the group of that, plus 1 if it met
    more. ``indirect`` (n,) are samples of the receiver's irradiance by one more reflection."""

    receiver: Floats
    source: Floats
    flux: Floats
    target: Ints
    group: Ints
    indirect: Floats

    def __len__(self) -> int:
        return len(self.flux)


def joined(*parts: tuple[Photons, float]) -> Photons:
    """The photons of several estimates of the same light, each with the weight that it has in their mean."""
    weighed = [replace(photons, flux=weight * photons.flux) for photons, weight in parts]
    names = [field.name for field in fields(Photons)]
    return Photons(**{name: np.concatenate([getattr(photons, name) for photons in weighed]) for name in names})


class PhotonTracer:
    """Traces photons in ``packed``; release it."""

    def __init__(self, ctx: Any, packed: PackedScene) -> None:
        self._ctx = ctx
        specialisation = specialise(packed, Level.SCENE)
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
        self._found = [ctx.texture(_SIZE, 4, dtype="f4") for _ in range(3)]
        uniforms: dict[str, Any] = {**UNITS, **packed.all_uniforms, "u_targets": _TARGETS_UNIT}
        self._program.set({name: value for name, value in uniforms.items() if name in self._program.declared})

    def trace(self, targets: Targets, weights: Floats, draws: range) -> Photons:
        """Photons to ``targets`` in proportion to their ``weights`` (n,): those of the draws with these numbers, 2^15
        each."""
        words = {"u_targets": (targets.texels(weights),)}
        table = folded_textures(self._ctx, words, words)["u_targets"]
        self._program.set({"u_target_count": len(targets), "u_target_reach": targets.reach})
        try:
            found = [self._draw(table, number) for number in draws]
        finally:
            table.release()
        receiver, source, aimed = np.concatenate(found, axis=1, dtype=np.float64)
        target = aimed[:, 0].astype(np.int64)
        flux = np.abs(receiver[:, 3]) / (len(draws) * _SIZE[0] * _SIZE[1])
        group = 2 * targets.group[target] + (receiver[:, 3] < 0)
        return Photons(receiver[:, :3], source[:, :3], flux, target, group, source[:, 3])

    def _draw(self, table: Any, number: int) -> NDArray[np.float32]:
        """The three texels (3, n, 4) of each photon that was received."""
        with drawing_to(self._ctx, self._found):
            self._textures.use(self._program)
            self._program.use("u_targets", table, _TARGETS_UNIT)
            self._program.set({"u_seed": number})
            self._program.draw()
        found = np.stack([np.frombuffer(texture.read(), np.float32).reshape(-1, 4) for texture in self._found])
        return found[:, (found[0, :, 3] != 0) & np.isfinite(found).all(axis=(0, 2))]

    def release(self) -> None:
        for texture in self._found:
            texture.release()
        self._textures.release()
        self._program.release()
