# SPDX-License-Identifier: MIT
"""Keeps a picture on the screen: small and at once while something moves, then ever finer."""

import time

from fragtracer.errors import ShaderError
from fragtracer.gpu.context import is_software
from fragtracer.gpu.film import Film
from fragtracer.scene import Camera, Scene
from fragtracer.viewer.governor import Governor
from fragtracer.viewer.live import LiveRenderer

_SETTLED = 0.15  # seconds without a change until the picture is made in full size
_BAKE_AFTER = 0.6  # and until it is worth compiling the scene into the program
_FADE = 0.3  # seconds over which the finer picture takes over
_FADE_SPP = 8  # samples per pixel that it should have by then


class Refiner:
    """Decides what ``renderer`` does in each frame; ``size`` is that of the picture on the screen."""

    def __init__(self, renderer: LiveRenderer, governor: Governor) -> None:
        self.renderer = renderer
        self.governor = governor
        self.size = renderer.size
        self.held: Film | None = None  # the picture of before, shown until the new one is finer
        self.held_weight = 0.0
        self._bakes = is_software(renderer.context)
        self._changed_at = time.perf_counter()
        self._frame_at = self._changed_at
        self._moving = False

    @property
    def is_moving(self) -> bool:
        """Whether the picture is, for the moment, made to be quick rather than fine."""
        return self._moving

    def change(self, scene: Scene) -> None:
        """Show another scene."""
        self._begin_change()
        self.renderer.change(scene)

    def look(self, camera: Camera) -> None:
        """Show the scene from another camera."""
        self._begin_change()
        self.renderer.look(camera)

    def gather(self, view: str) -> None:
        """Show normals, depth or albedo, or light again."""
        self._begin_change()
        self.renderer.gather(view)

    def resize(self, size: tuple[int, int]) -> None:
        """Fill a picture of another size, in pixels."""
        if size != self.size:
            self.size = size
            self._begin_change()

    def reload_shaders(self) -> None:
        """Go on with the shader files as they are now."""
        self.renderer.reload_shaders()
        self._bakes = is_software(self.renderer.context)
        self._begin_change()

    def frame(self, limit: int | None = None) -> float:
        """Trace for about as long as a frame may take, up to ``limit`` samples per pixel; returns the seconds."""
        now = time.perf_counter()
        self.fade(limit)
        if self._moving and now - self._changed_at > _SETTLED:
            self._settle()
        if self._moving:
            return self._preview()
        if self._bakes and not self.renderer.is_baked and now - self._changed_at > _BAKE_AFTER:
            self._bake()
        return self._refine(limit)

    def _bake(self) -> None:
        """The shader files may be broken for now: then the program that works stays in use."""
        try:
            self.renderer.bake()
        except ShaderError:
            self._bakes = False

    def _begin_change(self) -> None:
        self._changed_at = time.perf_counter()
        if not self._moving:
            self._moving = True
        self._drop_held()
        self._resize(self.governor.size(self.size, self.renderer.samples_per_second))

    def _settle(self) -> None:
        self._moving = False
        if self.renderer.size != self.size:
            self._drop_held()
            self.held, self.held_weight = self.renderer.resize(self.size), 1.0

    def _preview(self) -> float:
        renderer = self.renderer
        rays = self.governor.rays(renderer.size, renderer.samples_per_second, renderer.settings.rays)
        return renderer.refine(self.governor.budget, rays, whole=True)

    def _refine(self, limit: int | None) -> float:
        renderer = self.renderer
        left = renderer.settings.rays if limit is None else limit - renderer.spp
        if left <= 0:
            return 0.0
        rays = max(1, min(renderer.settings.rays, renderer.spp, left))
        return renderer.refine(self.governor.budget, rays)

    def fade(self, limit: int | None = None) -> None:
        """Let the finer picture take over a little more, of which there will be ``limit`` samples per pixel."""
        now = time.perf_counter()
        seconds, self._frame_at = now - self._frame_at, now
        if self.held is None or self.renderer.spp == 0:
            return
        enough = _FADE_SPP if limit is None else min(limit, _FADE_SPP)
        aim = max(0.0, 1.0 - self.renderer.spp / enough) if enough else 0.0
        self.held_weight = max(aim, self.held_weight - min(seconds, 0.1) / _FADE)
        if self.held_weight <= 0:
            self._drop_held()

    def _resize(self, size: tuple[int, int]) -> None:
        if size != self.renderer.size:
            self.renderer.resize(size).release()

    def _drop_held(self) -> None:
        if self.held is not None:
            self.held.release()
        self.held = None

    def close(self) -> None:
        self._drop_held()
        self.renderer.close()
