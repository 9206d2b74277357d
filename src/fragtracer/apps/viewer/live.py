# SPDX-License-Identifier: MIT
"""The renderer of a window: it can pause within a pass, and follows the camera without compiling."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from fragtracer.gpu.film import Film
from fragtracer.packing import PackedScene, pack
from fragtracer.packing.camera import camera_uniforms
from fragtracer.renderer import Renderer
from fragtracer.scene import Camera, RenderSettings, Scene
from fragtracer.shader_composer import CONSTANTS

_AWAY = 4.0  # times the distance of the first camera; one further out takes the origin of coordinates along


@dataclass(frozen=True)
class Plan:
    """A packed scene that is not rendered yet; see :meth:`LiveRenderer.plan`."""

    scene: Scene
    settings: RenderSettings
    defines: dict[str, int]
    home: Camera  # with which the origin was chosen
    baked: bool
    packed: PackedScene


class LiveRenderer(Renderer):
    """A :class:`Renderer` on the window's ``context`` that works in slices of time.

    ``size`` is (width, height) in pixels; the size in the scene is ignored.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], context: Any) -> None:
        self._home = scene.camera
        self._light_samples = scene.render.light_samples
        self._pass: Iterator[float] | None = None
        self._pass_rays = 0
        self._slices = 0.0  # seconds that the pass has taken so far
        self._speeds: dict[bool, float] = {}  # in samples per second, baked and not
        self.pass_seconds = 0.0  # that the last whole pass took
        super().__init__(scene, size, context, baked=False, defines=_defines(""))
        self._origin = self._packed().origin

    @property
    def size(self) -> tuple[int, int]:
        return self._film.size

    @property
    def film(self) -> Film:
        """The film that accumulates the samples."""
        return self._film

    @property
    def is_baked(self) -> bool:
        """Whether the scene, but not the camera, is compiled into the program."""
        return self._baked

    @property
    def samples_per_second(self) -> float:
        """The speed of the last draw, of this program or else the previous one; 0 before the first measurement."""
        measured = self._tracer.pixel_samples_per_second
        if measured:
            self._speeds[self._baked] = measured
        return self._speeds.get(self._baked) or self._speeds.get(False, 0.0)

    @property
    def max_rays(self) -> int:
        """Paths for each pixel in one pass, at most."""
        return self._tracer.max_rays

    @property
    def light_samples(self) -> int:
        """Shadow rays at each vertex, at most those of the settings."""
        return min(self._light_samples, self.settings.light_samples)

    def plan(self, scene: Scene, view: str = "", baked: bool = False) -> Plan:
        """Pack ``scene`` to go on with it, ``baked`` into the program or not.

        ``view`` is "normals", "depth" or "albedo" to render these in place of radiance.
        """
        width, height = self.size
        settings = replace(scene.render, width=width, height=height)
        home = scene.camera if self._is_away(scene.camera) else self._home
        defines = _defines(view)
        return Plan(scene, settings, defines, home, baked, _packed(scene, settings, home, baked, defines))

    def knows(self, plan: Plan) -> bool:
        """Whether :meth:`adopt` need not compile."""
        return self._tracer.knows(plan.packed)

    def has_maps(self, plan: Plan) -> bool:
        """Whether :meth:`adopt` need not make the maps of an environment."""
        return self._tracer.has_maps(plan.packed)

    def adopt(self, plan: Plan, recompile: bool = False) -> None:
        """Render ``plan`` from now on; the samples stay until :meth:`restart`.

        ``recompile`` takes the shader files as they are now.

        Raises
        ------
        ShaderError
            If its program does not compile. Nothing has changed then.
        """
        if not (plan.baked or self.knows(plan)):
            self._speeds.clear()
        self._tracer.load(plan.packed, recompile)
        width, height = self.size  # may have changed meanwhile
        self.scene, self.settings = plan.scene, replace(plan.settings, width=width, height=height)
        self._defines, self._home, self._baked = plan.defines, plan.home, plan.baked
        self._origin = plan.packed.origin
        self._pass = None
        self._set_uniforms()

    def warm_up(self) -> None:
        """Make the driver do now the work that it defers to the first draw."""
        self._tracer.warm_up(self._film)

    def follows(self, camera: Camera) -> bool:
        """Whether :meth:`look` suffices for ``camera``, without another plan."""
        opened = (self.scene.camera.aperture_radius > 0) != (camera.aperture_radius > 0)
        return not (opened or self._is_away(camera))

    def look(self, camera: Camera) -> None:
        """Restart from another camera, which it :meth:`follows`."""
        self.scene = replace(self.scene, camera=camera)
        self._set_uniforms()
        self.restart()

    def resize(self, size: tuple[int, int], light_samples: int) -> Film:
        """Restart at another size, with at most ``light_samples``; returns the previous film, which the
        caller releases."""
        film = Film(self.context, *size)
        before, self._film = self._film, film
        self.settings = replace(self.settings, width=size[0], height=size[1])
        self._light_samples = light_samples
        self._set_uniforms()
        self.restart()
        return before

    def restart(self) -> None:
        """Forget all samples."""
        self._pass = None
        self.reset()

    def refine(self, seconds: float, rays: int, whole: bool = False) -> float:
        """Draw until ``seconds`` are over or a pass of ``rays`` paths per pixel is complete, or, if
        ``whole``, until it is complete in any case. Returns the seconds that the draws took, by the
        GPU's clock where it has one."""
        start, drawn = time.perf_counter(), self.draw_seconds
        if self._pass is None:
            rays = min(rays, self._tracer.max_rays)
            self._pass, self._pass_rays = self._tracer.bands(self._film, rays, seconds / 2), rays
            self._slices = 0.0
        while next(self._pass, None) is not None:
            if not whole and time.perf_counter() - start >= seconds:
                self._slices += self.draw_seconds - drawn
                return self.draw_seconds - drawn
        spent = self.draw_seconds - drawn
        self._pass, self.pass_seconds = None, self._slices + spent
        self.spp += self._pass_rays
        return spent

    def beside(self, film: Film, seed: int, rays: int, seconds: float) -> Iterator[None]:
        """Draw a pass of ``rays`` paths per pixel, at most :attr:`max_rays`, on another ``film`` of
        this size and with another ``seed``; each step takes about ``seconds``."""
        bands = self._tracer.bands(film, rays, seconds)
        while True:
            self._tracer.set({"u_seed": seed})
            share = next(bands, None)
            self._tracer.set({"u_seed": self.settings.seed})
            if share is None:
                return
            yield

    def _is_away(self, camera: Camera) -> bool:
        """Whether ``camera`` is so far from the origin of coordinates that float32 would lose detail."""
        here, home = (max(map(abs, c.position)) for c in (camera, self._home))
        return here > _AWAY * max(home, 1e-6) or here < home / _AWAY / _AWAY

    def _packed(self) -> PackedScene:
        return _packed(self.scene, self.settings, self._home, self._baked, self._defines)

    def _set_uniforms(self) -> None:
        """Set the uniforms that change while the program stays."""
        camera = camera_uniforms(self.scene.camera, self._origin, *self.size)
        varied = {"u_light_samples": self.light_samples} if self.settings.light_samples > 1 else {}
        self._tracer.set(camera | varied)


def _defines(view: str) -> dict[str, int]:
    return {"AUXILIARY": CONSTANTS[f"AUXILIARY_{(view or 'none').upper()}"]}


def _packed(scene: Scene, settings: RenderSettings, home: Camera, baked: bool, defines: dict[str, int]) -> PackedScene:
    packed = pack(scene, settings, settings.width, settings.height, baked, home)
    constants, uniforms = dict(packed.constants), dict(packed.uniforms)
    if settings.light_samples > 1 and "u_light_samples" in constants:  # fewer while something moves
        uniforms["u_light_samples"] = constants.pop("u_light_samples")
    return replace(packed, defines={**packed.defines, **defines}, constants=constants, uniforms=uniforms)
