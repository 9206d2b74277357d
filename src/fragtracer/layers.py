# SPDX-License-Identifier: MIT
"""The layers of :data:`fragtracer.aov.AOVS` from what is drawn: parts of the light, and what paths meet first."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.aov import AOVS, DENOISING, RANKS, matte
from fragtracer.gpu.film import Film
from fragtracer.gpu.layers import LayerTextures
from fragtracer.gpu.tracer import Tracer, TracerProgram
from fragtracer.packing import PackedScene, matte_names
from fragtracer.packing.camera import pixel_matrix
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Camera, Scene

Floats = NDArray[np.float32]

# What the targets of film/parts.glsl hold.
PARTS = ("emission", "direct_diffuse", "direct_specular", "indirect_diffuse", "indirect_specular")
_SUMS = {
    "direct": PARTS[1:3],
    "indirect": PARTS[3:],
    "diffuse": PARTS[1::2],
    "specular": PARTS[2::2],
    **{name: (name,) for name in PARTS},
}
_TARGETS = 3  # of layers.frag besides those of the film
_DENOISING_SAMPLES = 64  # at least, of what a denoiser is told


def light(name: str, parts: LayerTextures) -> Floats:
    """The layer ``name``, a part of the light, from the targets of film/parts.glsl."""
    targets = [PARTS.index(part) for part in _SUMS[name]]
    total: Floats = parts.read()[targets, ..., :3].sum(axis=0, dtype=np.float32)
    return total


@dataclass(frozen=True)
class Picture:
    """Of which layers are drawn: a scene, packed, in ``size`` pixels, with ``spp`` samples of each so far, which
    ``program`` has taken. ``is_plain`` if these go the ways of layers.frag as long as surfaces are smooth. ``moment``
    packs what a sample, by its number, has seen, and says the number of the first that sees something else."""

    scene: Scene
    packed: PackedScene
    program: TracerProgram
    size: tuple[int, int]
    spp: int
    is_plain: bool
    moment: Callable[[int], tuple[PackedScene, int]]


class FirstSurface:
    """Draws layers.frag with a ``tracer``, and keeps what was drawn last of each of its kinds."""

    def __init__(self, ctx: Any, tracer: Tracer) -> None:
        self._ctx, self._tracer = ctx, tracer
        self._drawn_last: dict[str, tuple[tuple[Camera, int], list[tuple[Pixels, Floats]]]] = {}

    def forget(self) -> None:
        """Draw all anew, since the scene or a setting has changed."""
        self._drawn_last.clear()

    def layer(self, name: str, picture: Picture, previous: Camera | None) -> Floats:
        """A layer as :meth:`fragtracer.Renderer.aov` returns it."""
        if AOVS[name].matte:
            return self._matte(name, picture)
        if name in DENOISING:
            return self._denoising(name, picture)
        return self._geometry(name, picture, previous or picture.scene.camera)

    def _matte(self, name: str, picture: Picture) -> Floats:
        pixels, layers = self._drawn(f"LAYERS_{name.upper()}S", picture, picture.scene.camera)[0]
        ranks = layers.transpose(1, 2, 0, 3).reshape(*layers.shape[1:3], RANKS, 2)
        return matte(ranks, pixels.mean[..., 3], matte_names(picture.scene)[name == "material"])

    def _geometry(self, name: str, picture: Picture, previous: Camera) -> Floats:
        pixels, (normal, place, motion) = self._drawn("LAYERS_GEOMETRY", picture, previous)[0]
        is_met = normal[..., 3:] > 0
        if name == "albedo":
            return np.ascontiguousarray(pixels.mean[..., :3])
        if name == "depth":
            return np.where(is_met[..., 0], place[..., 3], np.float32(np.inf))
        if name == "position":
            return np.where(is_met, place[..., :3] + picture.packed.origin, 0).astype(np.float32)
        if name == "motion":
            return np.ascontiguousarray(motion[..., :2])
        if name == "normal_camera":
            axes: NDArray[np.float64] = np.reshape(picture.packed.movable["u_inverse_view"], (4, 4))[:3, :3]
            return np.asarray(normal[..., :3] @ axes.T, np.float32)
        return np.ascontiguousarray(normal[..., :3])

    def _denoising(self, name: str, picture: Picture) -> Floats:
        most = max(picture.spp, _DENOISING_SAMPLES)
        (_, few), (pixels, (normal, emission, _)) = self._drawn("LAYERS_DENOISING", picture, picture.scene.camera, most)
        if name == "denoising_albedo":
            return np.clip(pixels.mean[..., :3], 0, 1)
        if name == "denoising_normal":
            return np.ascontiguousarray(normal[..., :3])
        found = (emission if name == "denoising_clean_emission" else few[1])[..., :3]
        return np.ascontiguousarray(found if picture.is_plain else np.zeros_like(found))

    def _drawn(self, kind: str, picture: Picture, previous: Camera, most: int = 0) -> list[tuple[Pixels, Floats]]:
        """What layers.frag draws with the samples that the picture has, and then with ``most``, if there is such a
        number: its film and its layers (3, height, width, 4)."""
        known, found = self._drawn_last.get(kind, (None, None))
        if found is None or known != (previous, picture.spp):
            packed = picture.packed
            cameras = {"u_to_pixel": picture.scene.camera, "u_to_previous_pixel": previous}
            matrices = {name: pixel_matrix(camera, packed.origin, *picture.size) for name, camera in cameras.items()}
            film = Film(self._ctx, *picture.size, LayerTextures(self._ctx, picture.size, _TARGETS))
            try:
                program = replace(picture.program, name="layers.frag", defines={"LAYERS": kind})
                assert film.layers is not None
                found = []
                for samples in (picture.spp, most) if most else (picture.spp,):
                    while film.samples < samples:
                        seen, end = picture.moment(film.samples)
                        self._tracer.load(seen, program)
                        self._tracer.set({name: tuple(matrix.T.ravel()) for name, matrix in matrices.items()})
                        for _ in self._tracer.bands(film, min(samples, end) - film.samples):
                            pass
                    found.append((film.read(), film.layers.read()))
                self._drawn_last[kind] = (previous, picture.spp), found
            finally:
                film.release()
                self._tracer.load(packed, picture.program)
        return found
