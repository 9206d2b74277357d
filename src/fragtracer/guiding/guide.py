# SPDX-License-Identifier: MIT
"""What a program needs in order to guide, and how it is learned."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.cache import cached
from fragtracer.guiding.lobes import LOBES, Lobes, fit
from fragtracer.guiding.photons import Photons, PhotonTracer
from fragtracer.guiding.targets import targets_of
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.digest import program_digest
from fragtracer.scene import Camera, RenderSettings, Scene

Floats = NDArray[np.float64]

VERSION = 7  # of what is done with photons, for the files kept on disk
_PILOT = 2**15  # photons that find out which targets pass light on
_PHOTONS = 2**20
_MOST_LISTED = 8  # shapes that every photon is tested against


@dataclass(frozen=True, eq=False)
class Guide:
    """Lobes in metres about ``origin`` (3,) of the world."""

    lobes: Lobes
    origin: Floats

    def without_lobes(self) -> "Guide":
        """A guide whose lobes have no probability: the same program draws the paths of an unguided one."""
        return replace(self, lobes=replace(self.lobes, ratios=np.zeros_like(self.lobes.ratios)))

    def applied(self, packed: PackedScene) -> PackedScene:
        """``packed`` for a program that guides."""
        lobes, move = self.lobes, self.origin - packed.origin
        uniforms = {
            "u_guiding_size": tuple(lobes.size.tolist()),
            "u_guiding_low": tuple((lobes.low + move).tolist()),
            "u_guiding_scale": 1 / lobes.edge,
        }
        return replace(
            packed,
            tables={**packed.tables, "u_guiding": (_texels(lobes, move),)},
            features={**packed.features, "GUIDING": "GUIDING_ON"},
            uniforms={**packed.uniforms, **uniforms},
        )


def learn(ctx: Any, scene: Scene, photons: int = _PHOTONS) -> Guide | None:
    """What photons of ``scene`` teach, or None where too few are received; from the disk if it was learned before.

    It depends on the scene alone, and not on the camera and the settings.
    """
    targets = targets_of(scene)
    if not len(targets):
        return None
    packed = _packed(scene, targets)
    if not packed.uniforms["u_light_count"]:
        return None

    def make() -> dict[str, NDArray[Any]]:
        found = _photons(ctx, packed, targets - np.append(packed.origin, 0), photons)
        lobes = None if found is None else fit(found)
        return {} if lobes is None else {name: np.asarray(value) for name, value in vars(lobes).items()}

    arrays = cached("guiding", f"{VERSION}-{program_digest(packed)}-{photons}", make)
    if not arrays:
        return None
    return Guide(Lobes(**arrays | {"edge": float(arrays["edge"])}), packed.origin)  # type: ignore[arg-type]


def _photons(ctx: Any, packed: PackedScene, targets: Floats, count: int) -> Photons | None:
    """``count`` photons to ``targets``, more to those that pass on more light; None where nothing is received."""
    tracer = PhotonTracer(ctx, packed)
    try:
        pilot = tracer.trace(targets, np.full(len(targets), -(-_PILOT // len(targets))), 1)
        power = np.bincount(pilot.group // 2, pilot.flux, len(targets))
        if not power.sum() > 0:
            return None
        share = np.sqrt(power / power.sum())
        share = 0.9 * share / share.sum() + 0.1 / len(targets)
        found = tracer.trace(targets, np.ceil(count * share).astype(np.int64), 2)
    finally:
        tracer.release()
    return found if len(found) else None


def _packed(scene: Scene, targets: Floats) -> PackedScene:
    """``scene`` seen from its middle, so that the coordinates do not depend on the camera."""
    low, high = (
        (targets[:, :3] - np.abs(targets[:, 3:])).min(axis=0),
        (targets[:, :3] + np.abs(targets[:, 3:])).max(axis=0),
    )
    x, y, z = ((low + high) / 2).tolist()
    camera = Camera((x, y, z), (x, y, z - float((high - low).max())))
    return pack(replace(scene, camera=camera), RenderSettings(), 64, 64, _MOST_LISTED)


def _texels(lobes: Lobes, move: Floats) -> NDArray[np.uint32]:
    """The table (n, 4) that guiding/lobes.glsl reads."""
    count = len(lobes.first)
    coarse = np.zeros((-(-count // LOBES) * LOBES, 4), np.uint32)  # the lobes of a cell stand in one row of the texture
    coarse[:count, 0] = len(coarse) + LOBES * lobes.first
    coarse[:count, 1] = lobes.edges
    fine = np.zeros((lobes.ratios.size, 4), np.uint32)
    fine[:, :3] = (lobes.points + move).reshape(-1, 3).astype(np.float32).view(np.uint32)
    fine[:, 3] = _bits(lobes.ratios) << 16 | _bits(lobes.widths)
    return np.concatenate([coarse, fine])


def _bits(values: Floats) -> NDArray[np.uint32]:
    """The upper halves of float32."""
    bits: NDArray[np.uint32] = values.reshape(-1).astype(np.float32).view(np.uint32) >> np.uint32(16)
    return bits
