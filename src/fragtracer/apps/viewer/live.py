# SPDX-License-Identifier: MIT
"""The renderer of a window: it can pause within a pass, and follows the camera without compiling."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

from fragtracer import guiding, light_tracing
from fragtracer.apps.viewer.lit_film import LitFilm, ShownFilm
from fragtracer.decisions import Decided
from fragtracer.errors import FragtracerError
from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.film import Film
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.tracer import TracerProgram
from fragtracer.light_tracing import Decisions, LightTracing
from fragtracer.packing import PackedScene, view_uniforms
from fragtracer.packing.lights import LightKind
from fragtracer.packing.space import Space
from fragtracer.renderer import PROGRAMS, Renderer
from fragtracer.scene import Camera, RenderSettings, Scene

_LEAST = Level.KINDS  # which kinds of things there are costs much, and hardly ever changes
# Features that a program may have although the scene has nothing of the kind: what was removed needs no other program.
_SPARE = (
    *(kind.feature for kind in LightKind if kind not in (LightKind.SUN, LightKind.ENVIRONMENT)),
    *("HAS_MESHES", "HAS_INSTANCES", "HAS_DELTA"),
)


@dataclass(frozen=True)
class Plan:
    """A packed scene that is not rendered yet, and the program to render it with; see :meth:`LiveRenderer.plan`."""

    scene: Scene
    settings: RenderSettings
    packed: PackedScene
    program: TracerProgram
    light: light_tracing.Decision  # whether some of it is traced from the lights

    @property
    def is_specialised(self) -> bool:
        """Whether the scene, but not the camera, is compiled into the program."""
        return self.program.level is Level.SCENE

    def specialised(self) -> "Plan":
        """The same with a program that is."""
        return replace(self, program=replace(self.program, level=Level.SCENE))


class LiveRenderer(Renderer):
    """A :class:`Renderer` on the window's ``context`` that works in slices of time.

    ``size`` is (width, height) in pixels; the size in the scene is ignored.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], context: Any) -> None:
        self._space: Space | None = None
        self._light_samples = scene.render.light_samples
        self._pass: Iterator[float] | None = None
        self._slices = 0.0  # seconds that the pass has taken so far
        self._speeds: dict[tuple[bool, bool], float] = {}  # in samples per second, by kinds of programs
        self.pass_seconds = 0.0  # that the last whole pass took
        self.begun = 0  # pictures so far, each of which forgets the samples of the one before
        self._is_specialised = False
        self._is_guided = False
        self._learned: Decided | None = None
        self._traceable: tuple[Scene, bool] | None = None  # the last answer of may_trace_light()
        self._lights: LightTracing | None = None  # kept while the picture is of paths alone
        self._lit: LitFilm | None = None
        self._traces_paths = scene.render.integrator == "path"
        super().__init__(scene, size, context, specialised=False)

    @property
    def size(self) -> tuple[int, int]:
        return self._film.size

    @property
    def film(self) -> ShownFilm:
        """The picture so far."""
        return self._film if self._light is None or self._lit is None else self._lit

    @property
    def is_specialised(self) -> bool:
        """Whether the scene, but not the camera, is compiled into the program."""
        return self._is_specialised

    @property
    def is_guided(self) -> bool:
        """Whether the program in use guides paths."""
        return self._is_guided

    @property
    def traces_light(self) -> bool:
        """Whether some of the light of the picture is traced from the lights."""
        return self._light is not None

    @property
    def samples_per_second(self) -> float:
        """The speed of the last draw, of this program or else the previous one; 0 before the first measurement."""
        measured, kind = self._tracer.pixel_samples_per_second, (self._is_specialised, self.traces_light)
        if measured:
            self._speeds[kind] = measured
        return self._speeds.get(kind) or self._speeds.get((False, False), 0.0)

    @property
    def max_rays(self) -> int:
        """Paths for each pixel in one pass, at most."""
        return self._tracer.max_rays

    @property
    def gpu_bytes(self) -> int:
        return super().gpu_bytes + (self._lit.gpu_bytes if self._lit else 0)

    @property
    def light_samples(self) -> int:
        """Shadow rays at each vertex, at most those of the settings."""
        return min(self._light_samples, self.settings.light_samples)

    def plan(self, scene: Scene, view: str = "", rests: bool = False) -> Plan:
        """Pack ``scene`` to go on with it, by a program that is not specialised.

        ``view`` is "normals", "depth" or "albedo" to render these in place of radiance. Light is traced from the lights
        in a picture that ``rests`` alone: photons for each frame of a camera that moves would take too long.
        """
        width, height = self.size
        settings = replace(scene.render, width=width, height=height)
        packed = self._pack(scene, settings, _LEAST)
        traced, guided = self._decisions_for(scene, rests)
        if view:
            traced = light_tracing.Decision(False, "off: the view is no light")
        else:
            packed = guided.applied(packed)
        return Plan(scene, settings, packed, self._program_of(settings, view, traced), traced)

    def learn(self, decided: Decided) -> None:
        """Plan as ``decided`` from now on, wherever there is the same light as in its scene."""
        self._learned, self._traceable = decided, None

    def may_trace_light(self, scene: Scene) -> bool:
        """Whether some light of ``scene`` is traced from the lights in a picture that rests."""
        if self._traceable is None or self._traceable[0] is not scene:
            self._traceable = scene, self._decisions_for(scene, True)[0].is_on
        return self._traceable[1]

    def quickest(self, plan: Plan) -> Plan:
        """``plan`` with the fastest program that is compiled already, or as it is if none can render it."""
        plans = plan.specialised(), plan, self._with_spare_features(plan)
        return next((p for p in plans if self.knows(p)), plan)

    def knows(self, plan: Plan) -> bool:
        """Whether :meth:`adopt` need not compile."""
        return self._tracer.knows(plan.packed, plan.program)

    def has_maps(self, plan: Plan) -> bool:
        """Whether :meth:`adopt` need not make the maps of an environment."""
        return self._tracer.has_maps(plan.packed)

    def adopt(self, plan: Plan, recompile: bool = False) -> None:
        """Render ``plan`` from now on; the samples stay until :meth:`restart`.

        ``recompile`` takes the shader files as they are now. If this raises, the picture goes on as before.

        Raises
        ------
        ShaderError
            If its program does not compile.
        DeviceError
            If the GPU cannot hold it.
        """
        if not (plan.is_specialised or self.knows(plan)):
            self._speeds.clear()
        if plan.light.is_on:
            self._load_photons(plan)  # first: paths without the photons would be another picture
        self._take_over(plan.packed, plan.program, recompile)
        if recompile:
            self._forget_light()
        width, height = self.size  # may have changed meanwhile
        self.scene, self.settings = plan.scene, replace(plan.settings, width=width, height=height)
        self._space, self._is_specialised = plan.packed.space, plan.is_specialised
        self._is_guided = "u_guiding" in plan.packed.tables
        self._show_photons(plan.light.is_on)
        if not plan.is_specialised:
            self._features = plan.packed.features
        self._pass = None
        self._traces_paths = plan.program.name == PROGRAMS["path"]
        self._set_uniforms()

    def warm_up(self) -> None:
        """Make the driver do now the work that it defers to the first draw."""
        self._film.warm_up(self._tracer)

    def follows(self, camera: Camera) -> bool:
        """Whether :meth:`look` suffices for ``camera``, without another plan."""
        return self._space is not None and self._space.serves(camera)

    def look(self, camera: Camera) -> None:
        """Restart from another camera, which it :meth:`follows`."""
        self.scene = replace(self.scene, camera=camera)
        self._set_uniforms()
        self.restart()

    def resize(self, size: tuple[int, int], light_samples: int) -> Accumulation:
        """Restart at another size, with at most ``light_samples``, where no light is traced from the lights; returns
        the previous samples, which the caller releases."""
        assert self._light is None
        film = Accumulation(self.context, *size, self._film.adaptive)
        before, self._film = self._film, film
        self.settings = replace(self.settings, width=size[0], height=size[1])
        self._light_samples = light_samples
        self._set_uniforms()
        self.restart()
        return before

    def restart(self) -> None:
        """Forget all samples."""
        self._pass = None
        self.begun += 1
        self.reset()

    def refine(self, seconds: float, rays: int, most: int | None = None, whole: bool = False) -> float:
        """Draw until ``seconds`` are over or a pass is complete, or, if ``whole``, until it is complete in any case.
        A pass has ``rays`` paths per pixel, or as many as its stage has planned, but no more than ``most``.

        The photons for it come first. Returns the seconds that all of it took, draws by the GPU's clock
        where it has one.
        """
        start = time.perf_counter()
        if self._light is not None:
            while self._light.lacks_photons(self.spp + rays):
                self._light.step()
                if not whole and time.perf_counter() - start >= seconds:
                    return time.perf_counter() - start
        of_photons, drawn = time.perf_counter() - start, self.draw_seconds
        if self._pass is None:
            self._pass = self._film.bands(self._tracer, rays, most, seconds / 2)
            self._slices = 0.0
        try:
            while next(self._pass, None) is not None:
                if not whole and time.perf_counter() - start >= seconds:
                    self._slices += self.draw_seconds - drawn
                    return of_photons + self.draw_seconds - drawn
        except FragtracerError:  # the next one begins anew
            self._pass = None
            raise
        spent = self.draw_seconds - drawn
        self._pass, self.pass_seconds = None, self._slices + spent
        return of_photons + spent

    def beside(self, film: Film, seed: int, rays: int, seconds: float) -> Iterator[None]:
        """Draw a pass of ``rays`` paths per pixel, at most :attr:`max_rays`, on another ``film`` of
        this size and with another ``seed``; each step takes about ``seconds``. No light may be traced from the lights:
        the film would lack it."""
        assert self._light is None
        bands = self._tracer.bands(film, rays, seconds)
        while True:
            self._tracer.set({"u_seed": seed})
            share = next(bands, None)
            self._tracer.set({"u_seed": self.settings.seed})
            if share is None:
                return
            yield

    def close(self) -> None:
        self._forget_light()
        super().close()

    @property
    def _adaptive_sampling(self) -> tuple[Literal["auto", "on", "off"], str]:
        if not self._traces_paths:
            return "off", f"off: the integrator is {self.settings.integrator}"
        return self.settings.adaptive, ""  # however few samples are asked for: a window goes on

    def _packed(self) -> PackedScene:
        packed = self._pack(self.scene, self.settings, _LEAST)
        self._space, self._features = packed.space, packed.features
        self._loaded = packed, self._program()
        return packed

    @property
    def _gradient_domain(self) -> tuple[Literal["auto", "on", "off"], str]:
        return "off", "off: a window shows single pixels"

    def _decisions(self) -> Decisions:
        return self._decisions_for(self.scene, self.traces_light)

    def _decisions_for(self, scene: Scene, rests: bool) -> Decisions:
        learned = self._learned and self._learned.for_picture(scene, scene.render)
        reason = "off: nothing is learned yet"
        traced, guided = learned or (light_tracing.Decision(False, reason), guiding.Decision(None, reason))
        if traced.is_on and not rests:
            reason = "off: light is traced from the lights once the picture rests"
            return light_tracing.Decision(False, reason), guiding.Decision(None, reason)
        return traced, guided

    def _program(self) -> TracerProgram:
        return self._program_of(self.settings, "", self._decisions()[0])

    def _program_of(self, settings: RenderSettings, view: str, light: light_tracing.Decision) -> TracerProgram:
        """The program for a view, not specialised. Fewer light samples than those of the settings are drawn while
        something moves, and a mesh that moves is no reason to compile."""
        kept = ("bvh_root", "u_light_samples") if settings.light_samples > 1 else ("bvh_root",)
        if view:
            return TracerProgram("auxiliary.frag", {"AUXILIARY": f"AUXILIARY_{view.upper()}"}, _LEAST, kept)
        return TracerProgram(PROGRAMS[settings.integrator], light.defines, _LEAST, kept)

    def _take_over(self, packed: PackedScene, program: TracerProgram, recompile: bool) -> None:
        """Have the tracer take over another scene; if it cannot, what it had."""
        try:
            self._tracer.load(packed, program, recompile)
        except FragtracerError:  # some tables may be gone already
            self._tracer.load(*self._loaded)
            self._set_uniforms()
            raise
        self._loaded = packed, program

    def _load_photons(self, plan: Plan) -> None:
        if self._lights is None:
            self._lights = LightTracing(self.context)
        if self._lit is None:
            self._lit = LitFilm(self.context)
        self._lights.load(plan.packed, plan.scene, self.size, plan.light.photons, plan.program.level)

    def _show_photons(self, is_on: bool) -> None:
        """Add the light of photons to that of the paths, or no longer."""
        self._light = self._lights if is_on else None
        if self._lit is None:
            return
        if self._light is not None:
            self._lit.begin(self._film, self._light)
        else:
            self._lit.end()

    def _forget_light(self) -> None:
        """Release all that light tracing needs."""
        for part in (self._lit, self._lights):
            if part is not None:
                part.release()
        self._light = self._lit = self._lights = None

    def _with_spare_features(self, plan: Plan) -> Plan:
        """``plan`` with the features that the last program has besides."""
        features = dict(plan.packed.features)
        features |= {name: 1 for name in _SPARE if self._features[name]}
        return replace(plan, packed=replace(plan.packed, features=features))

    def _set_uniforms(self) -> None:
        """Set the uniforms that change while the program stays."""
        assert self._space is not None
        camera = view_uniforms(self.scene, self._space.origin, *self.size)
        varied = {"u_light_samples": self.light_samples} if self.settings.light_samples > 1 else {}
        self._tracer.set(camera | varied)
