# SPDX-License-Identifier: MIT
"""The renderer while someone watches: it stops within a pass, and follows the camera without compiling."""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from fragtracer.gpu.film import Film
from fragtracer.packing import PackedScene, camera_uniforms, pack
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, Scene
from fragtracer.shader_composer import CONSTANTS

_AWAY = 4.0  # distances from the middle of the scene; a camera further out moves the origin with it


class LiveRenderer(Renderer):
    """A :class:`Renderer` on the window's ``context`` that works in slices of time.

    ``size`` is (width, height) in pixels; the size in the scene is passed over.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], context: Any) -> None:
        self._home = scene.camera
        self._pass: Iterator[int] | None = None
        self._pass_rays = 0
        self._slices = 0.0  # seconds that the pass has taken so far
        self.pass_seconds = 0.0  # that the last whole pass took
        super().__init__(scene, size, context, baked=False)
        self._origin = self._packed().origin

    @property
    def size(self) -> tuple[int, int]:
        return self._film.size

    @property
    def film(self) -> Film:
        """What the samples are gathered in."""
        return self._film

    @property
    def is_baked(self) -> bool:
        """Whether the scene, but not the camera, is compiled into the program."""
        return self._baked

    @property
    def samples_per_second(self) -> float:
        """The speed of the last draw; 0 when the program is new."""
        return self._tracer.pixel_samples_per_second

    def change(self, scene: Scene) -> None:
        """Go on with another scene, and its settings, from no samples.

        Raises
        ------
        ShaderError
            If it needs a program that does not compile. The old one stays in use.
        """
        self._adopt(scene)
        self._load(baked=False)
        self.restart()

    def look(self, camera: Camera) -> None:
        """Go on from another camera, from no samples."""
        before, self.scene = self.scene.camera, replace(self.scene, camera=camera)
        if (before.aperture_radius > 0) != (camera.aperture_radius > 0) or self._is_away(camera):
            self._home = camera
            self._load(baked=False)
        else:
            self._set_camera()
        self.restart()

    def gather(self, view: str) -> None:
        """Gather normals, depth or albedo instead of light, by that name, or light again, from no samples."""
        name = f"AUXILIARY_{view.upper()}"
        self._defines = {"AUXILIARY": CONSTANTS.get(name, CONSTANTS["AUXILIARY_NONE"])}
        self._load(baked=False)
        self.restart()

    def bake(self) -> None:
        """Compile the scene into the program: faster on a software renderer. Samples stay."""
        if not self._baked:
            self._load(baked=True)

    def reload_shaders(self) -> None:
        """Compile from the shader files as they are now, and forget all samples; errors as for :meth:`change`."""
        self._load(baked=False, recompile=True)
        self.restart()

    def resize(self, size: tuple[int, int]) -> Film:
        """Go on in another size, from no samples; returns the film of before, which the caller releases."""
        film = Film(self.context, *size)
        before, self._film = self._film, film
        self.settings = replace(self.settings, width=size[0], height=size[1])
        self._set_camera()
        self.restart()
        return before

    def restart(self) -> None:
        """Forget all samples."""
        self._pass = None
        self.reset()

    def refine(self, seconds: float, rays: int, whole: bool = False) -> float:
        """Draw until ``seconds`` are over or a pass of ``rays`` paths per pixel is complete, or, if
        ``whole``, until it is complete in any case. Returns the seconds it took."""
        start = time.perf_counter()
        if self._pass is None:
            rays = min(rays, self._tracer.max_rays)
            self._pass, self._pass_rays = self._tracer.bands(self._film, rays, seconds / 2), rays
            self._slices = 0.0
        while next(self._pass, None) is not None:
            if not whole and time.perf_counter() - start >= seconds:
                self._slices += time.perf_counter() - start
                return time.perf_counter() - start
        spent = time.perf_counter() - start
        self._pass, self.pass_seconds = None, self._slices + spent
        self.spp += self._pass_rays
        return spent

    def _adopt(self, scene: Scene) -> None:
        width, height = self.size
        self.scene, self.settings = scene, replace(scene.render, width=width, height=height)
        if self._is_away(scene.camera):
            self._home = scene.camera

    def _is_away(self, camera: Camera) -> bool:
        """Whether the numbers of ``camera`` are so large against the scene's that float32 would show."""
        here, home = (max(map(abs, c.position)) for c in (camera, self._home))
        return here > _AWAY * max(home, 1e-6) or here < home / _AWAY / _AWAY

    def _load(self, baked: bool, recompile: bool = False) -> None:
        before, self._baked = self._baked, baked
        try:
            packed = self._packed()
            self._tracer.load(packed, recompile)
            self._origin = packed.origin
        except Exception:
            self._baked = before
            raise
        self._pass = None

    def _packed(self) -> PackedScene:
        width, height = self.settings.width, self.settings.height
        packed = pack(self.scene, self.settings, width, height, self._baked, self._home)
        return replace(packed, defines={**packed.defines, **self._defines})

    def _set_camera(self) -> None:
        self._tracer.set(camera_uniforms(self.scene.camera, self._origin, *self.size))
