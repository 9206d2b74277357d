# SPDX-License-Identifier: MIT
"""What a program needs in order to guide, and how it is learned."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.cache import cached
from fragtracer.guiding.lobes import LOBES, Lobes, fit
from fragtracer.guiding.photons import Photons, PhotonTracer, joined
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.digest import program_digest
from fragtracer.packing.space import space_of
from fragtracer.packing.targets import Targets, targets_of
from fragtracer.scene import Camera, RenderSettings, Scene

Floats = NDArray[np.float64]

VERSION = 20  # of what is done with photons, for the files kept on disk
_DRAWS = 16  # of photons
_PILOT = 4  # of them, which find out which targets pass light on
_PILOT_WEIGHT = 1 / 8  # of what these bring: by area they are up to five times as noisy (docs/sampling.md)
_MOST_LISTED = 8  # shapes that every photon is tested against
_MOST_WIDTH = 1024  # texels of an environment: lobes are no finer


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


def learn(ctx: Any, scene: Scene) -> Guide | None:
    """What photons of ``scene`` teach, or None where too few are received; from the disk if it was learned before.

    It depends on the scene alone, and not on the camera and the settings.
    """
    space = space_of(scene)
    if not np.isfinite(space.low).all():  # nothing but planes
        return None
    # Seen from its middle, so that the coordinates do not depend on the camera.
    x, y, z = ((space.low + space.high) / 2).tolist()
    camera = Camera((x, y, z), (x, y, z - max(1.0, float((space.high - space.low).max()))))
    settings = RenderSettings(estimator="nee")  # of light samples alone, as the program is
    environment = scene.environment
    if environment is not None and environment.image is not None:
        environment = replace(environment, image=environment.image.reduced(_MOST_WIDTH))
    packed = pack(replace(scene, camera=camera, environment=environment), settings, 64, 64, _MOST_LISTED)
    if not packed.uniforms["u_light_count"]:
        return None

    def make() -> dict[str, NDArray[Any]]:
        targets = targets_of(packed, scene, reach=float(np.linalg.norm(space.high - space.low)) / 2)
        found = _photons(ctx, packed, targets) if len(targets) else None
        lobes = None if found is None else fit(found)
        return {} if lobes is None else {name: np.asarray(value) for name, value in vars(lobes).items()}

    arrays = cached("guiding", f"{VERSION}-{program_digest(packed)}", make, "tracing photons for path guiding")
    if not arrays:
        return None
    return Guide(Lobes(**arrays | {"edge": float(arrays["edge"])}), packed.origin)  # type: ignore[arg-type]


def _photons(ctx: Any, packed: PackedScene, targets: Targets) -> Photons | None:
    """Photons to ``targets``, more to those that pass on more light; None where nothing is received."""
    tracer = PhotonTracer(ctx, packed)
    try:
        pilot = tracer.trace(targets, targets.weights(), range(_PILOT))
        if not len(pilot):
            return None
        squares = np.bincount(pilot.target, np.square(pilot.flux), len(targets)).astype(np.float64)
        rest = tracer.trace(targets, targets.weights(squares), range(_PILOT, _DRAWS))
    finally:
        tracer.release()
    # Weights that followed from the pilot would bias what it brings.
    return joined((pilot, _PILOT_WEIGHT), (rest, 1 - _PILOT_WEIGHT))


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
