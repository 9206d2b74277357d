# SPDX-License-Identifier: MIT
"""Progressive refinement: a small picture at once while something moves, then full resolution and more samples."""

import time
from dataclasses import replace

from fragtracer.apps.viewer.compiler import BackgroundCompiler
from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution
from fragtracer.apps.viewer.guider import Guider
from fragtracer.apps.viewer.live import LiveRenderer, Plan
from fragtracer.apps.viewer.preparer import Preparer
from fragtracer.errors import DeviceError, FragtracerError, SceneError, ShaderError
from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.specialise import specialise
from fragtracer.guiding import decides
from fragtracer.packing.targets import targets_of
from fragtracer.scene import Camera, Scene

_SETTLED = 0.15  # seconds without a change until the picture is made in full size
_SPECIALISE_AFTER = 0.3  # seconds without an edit until the scene is compiled into the program
_LEARN_AFTER = 1.0  # seconds without an edit until it is learned where light comes from
_FADE = 0.3  # seconds to fade to the finer picture
_FADE_SPP = 8  # samples per pixel at which that fade ends
_FADE_SHARE = 4  # of the samples of a finer picture, at which a fade from it ends
_SLOW = 0.25  # seconds; a driver that takes longer to load a compiled program has no shader cache that processes share
_REST = 3.0  # seconds without a change until such a driver compiles a faster program


class Refiner:
    """Decides what ``renderer`` does in each frame; ``size`` is that of the picture on the screen, in pixels.

    Another process first compiles the program and makes the maps of the split sum. Until they are ready, the previous
    picture stays. Where a ``guider`` learns, the picture goes on without guiding, and with
    the samples that it has when that is done. Where light is traced from the lights, it begins anew each time that it
    rests: what its paths leave to photons is not in the samples of before.
    """

    def __init__(self, renderer: LiveRenderer, resolution: DynamicResolution, guider: Guider | None = None) -> None:
        self.renderer = renderer
        self.resolution = resolution
        self.size = renderer.size
        self.held: Accumulation | None = None  # the previous picture, faded out as the new one refines
        self.held_weight = 0.0
        self._fade_spp = _FADE_SPP  # samples per pixel at which it is gone
        self.problem = ""  # why the requested scene is not shown
        self.tracing_problem = ""  # why the picture gets no more samples
        self._is_refused = False  # whether it cannot be packed, or the GPU cannot hold it
        self._scene, self._view = renderer.scene, ""  # as requested
        self._preparer = Preparer(renderer.scene)
        self._is_behind = False  # while the tables of the requested environment are being made
        self._waiting: tuple[Plan, int] | None = None  # and the number of its request to the compiler
        self._next: Plan | None = None  # the newest plan, to be requested when the waiting one is compiled
        self._specialising: tuple[Plan, int] | None = None  # like the waiting one
        self._shaders: int | None = None  # number of the request to compile the changed shader files
        self._specialises = True  # as far as shader files are whole
        self._loads_slowly = False  # what the other process has compiled
        self._compiler = BackgroundCompiler()
        self._guider = guider
        self._guides = False  # what was learned waits for its program
        self._lighting: int | None = None  # number of the request to compile the programs of light tracing
        self._traces = True  # from the lights, as far as their programs compile
        self._compares = False
        self._changed_at = self._edited_at = self._frame_at = time.perf_counter()
        self._moving = False

    @property
    def is_moving(self) -> bool:
        """Whether the picture is a preview: at reduced resolution, or of what was there before."""
        return self._moving or self.is_preparing

    @property
    def is_preparing(self) -> bool:
        """Whether the requested scene still waits for its program, maps or tables."""
        return self._waiting is not None or self._is_behind

    @property
    def _is_shown(self) -> bool:
        """Whether the picture is of the requested scene."""
        return not (self.is_preparing or self.problem)

    @property
    def is_deciding(self) -> bool:
        """Whether the picture may still get another way to find its light, by what is being learned or compiled."""
        if self._view or not self._is_shown:
            return False
        learns = self._guider is not None and not self._guider.has_answered(self._scene, decides(self._scene.render))
        return learns or (self._guides and self._wants_to_specialise) or self._wants_light

    @property
    def _wants_light(self) -> bool:
        """Whether light is to be traced from the lights, and is not yet."""
        renderer = self.renderer
        if renderer.traces_light or not self._is_shown or self._view or self._compares or not self._traces:
            return False
        return renderer.may_trace_light(self._scene) and renderer.follows(self._scene.camera)

    @property
    def _wants_to_specialise(self) -> bool:
        is_new = (self._guides or not self.renderer.is_specialised) and not self.renderer.traces_light
        return self._specialises and is_new and self._is_shown

    @property
    def camera(self) -> Camera:
        """The requested camera; the picture follows when its program is compiled."""
        return self._scene.camera

    def change(self, scene: Scene) -> None:
        """Show another scene."""
        self._scene = scene
        self._edit()

    def show_view(self, view: str) -> None:
        """Render normals, depth or albedo, by that name, or radiance ("")."""
        self._view = view
        self._edit()

    def look(self, camera: Camera) -> None:
        """Show the scene from another camera."""
        self._scene = replace(self._scene, camera=camera)
        waits = self._waiting is not None and not self.renderer.knows(self._waiting[0])
        if not (waits or self._is_refused) and self.renderer.follows(camera):
            self._begin_change()
            self.renderer.look(camera)
        else:
            self._edit()

    def resize(self, size: tuple[int, int]) -> None:
        """Fill a picture of another size, in pixels."""
        if size != self.size:
            self.size = size
            self._begin_change()

    def compare(self, is_on: bool) -> None:
        """Say whether the picture is compared with another: then it is of paths alone, as all pictures for that are."""
        self._compares = is_on
        if is_on and self.renderer.traces_light:
            self._begin_change()

    def prepare_shaders(self) -> None:
        """Compile the changed shader files in the background, for :meth:`reload_shaders` to take from the cache."""
        self._shaders = self._ask(self._shown_plan())

    def take_shaders(self) -> bool:
        """Whether they are compiled, so that :meth:`reload_shaders` is quick; True once."""
        if self._shaders is None or not self._compiler.is_done(self._shaders):
            return False
        self._shaders = None
        return True

    def reload_shaders(self) -> None:
        """Compile the shader files again, and render with them; a scene that is not shown yet is requested again.

        Raises
        ------
        ShaderError
            If they do not compile. The last program stays in use.
        """
        is_shown = self._is_shown
        self.renderer.adopt(self._shown_plan(), recompile=True)
        self.renderer.restart()
        self.problem = ""
        self._waiting = self._next = self._specialising = self._lighting = None
        self._specialises = self._traces = True
        self._begin_change()
        if not is_shown:
            self._edit()

    def _shown_plan(self) -> Plan:
        return self.renderer.plan(self.renderer.scene, self._view)

    def frame(self, limit: int | None = None) -> float:
        """Trace for the time budget of a frame, up to ``limit`` samples per pixel; returns the seconds."""
        now = time.perf_counter()
        self.fade(limit)
        self._take_prepared()
        self._take_compiled(now)
        self._guide(now)
        if self._moving and now - self._changed_at > _SETTLED:
            self._settle()
        elif not self._moving and self._may_load(now):
            self._trace_light()
        try:
            seconds = self._preview() if self._moving else self._refine(limit)
        except (ShaderError, DeviceError) as error:  # a later stage may need another program, and more memory
            self.tracing_problem = str(error)
            return 0.0
        self.tracing_problem = ""
        return seconds

    def _edit(self) -> None:
        """Render the requested scene: now, or when the background process has compiled its program."""
        self._edited_at = time.perf_counter()
        self._specialising = self._lighting = None
        self._is_behind = not self._preparer.begin(self._scene)
        if not self._is_behind:
            self._go_on(self._scene)

    def _go_on(self, scene: Scene) -> None:
        try:
            plan = self.renderer.quickest(self.renderer.plan(scene, self._view))
        except SceneError as error:
            self._waiting = self._next = None
            self._fail(error)
            return
        if self._loads_slowly or (self.renderer.knows(plan) and self.renderer.has_maps(plan)):
            self._waiting = self._next = None
            self._adopt(plan)
        elif self._waiting is None:
            self._waiting = plan, self._ask(plan)
        elif _source(self._waiting[0]) == _source(plan):
            self._waiting, self._next = (plan, self._waiting[1]), None
        else:
            self._next = plan

    def _ask(self, plan: Plan) -> int:
        targets = targets_of(plan.packed, plan.scene) if plan.light.is_on else None
        return self._compiler.ask(plan.packed, plan.program, (self.size, self.renderer.size), targets)

    def _take_prepared(self) -> None:
        """Render with an environment whose tables are ready, even if a newer one was requested meanwhile."""
        prepared = self._preparer.take()
        if prepared is None or not self._is_behind:
            return
        self._is_behind = not self._preparer.begin(self._scene)
        if self._is_behind:
            render = replace(self._scene.render, estimator=prepared.render.estimator)
            self._go_on(replace(self._scene, environment=prepared.environment, render=render))
        else:
            self._go_on(self._scene)

    def _take_compiled(self, now: float) -> None:
        """Use what the background process has compiled."""
        if self._waiting is not None:
            plan, number = self._waiting
            if self._compiler.is_done(number):
                later, self._waiting, self._next = self._next, None, None
                self._adopt(replace(plan, scene=replace(plan.scene, camera=self._scene.camera)))
                if later is not None:
                    self._go_on(replace(later.scene, camera=self._scene.camera))
        elif self._specialising is not None:
            self._specialise_when_ready(now, *self._specialising)
        elif self._wants_to_specialise and now - self._edited_at > _SPECIALISE_AFTER:
            plan = self.renderer.plan(self._scene, self._view).specialised()
            self._specialising = plan, self._ask(plan)

    def _guide(self, now: float) -> None:
        """Have the shown scene learned when it rests, and guide by what was learned."""
        if self._guider is None or self._view or not self._is_shown:
            return
        if (decided := self._guider.take()) is not None:
            self.renderer.learn(decided)
            if "u_guiding" in self.renderer.plan(self._scene).packed.tables:
                self._guides, self._specialising = True, None
        elif now - self._edited_at > _LEARN_AFTER:
            self._guider.ask(self._scene, decides(self._scene.render))

    def _trace_light(self) -> None:
        """Trace light of a picture that rests from the lights, where that pays and the programs for it are compiled."""
        renderer = self.renderer
        if not self._wants_light:
            return
        if self._lighting is None:
            plan = self._lit_plan()
            self._lighting = 0 if renderer.knows(plan) else self._ask(plan)
        if self._lighting and not self._compiler.is_done(self._lighting):
            return
        if self.held is None:
            self._hold(renderer.resize(renderer.size, renderer.light_samples))
        self.held_weight, self._specialising = 1.0, None
        renderer.restart()
        try:
            renderer.adopt(self._lit_plan())
        except (ShaderError, DeviceError):  # a shader file may be broken for now; the last program stays in use
            self._traces = False

    def _lit_plan(self) -> Plan:
        return self.renderer.plan(self._scene, rests=True).specialised()

    def _may_load(self, now: float) -> bool:
        """Whether a frame may take as long as the driver needs for a program that another process has compiled."""
        return not self._loads_slowly or now - self._changed_at > _REST

    def _specialise_when_ready(self, now: float, plan: Plan, number: int) -> None:
        """Keeps the samples. The camera is not part of the program, so it may have moved meanwhile."""
        if not (self._compiler.is_done(number) and self._may_load(now)):
            return
        self._specialising, self._guides = None, False
        if not self.renderer.follows(self._scene.camera):
            return
        start = time.perf_counter()
        try:
            self.renderer.adopt(replace(plan, scene=self._scene))
            self.renderer.warm_up()
        except (ShaderError, DeviceError):  # a shader file may be broken for now; the last program stays in use
            self._specialises = False
        self._loads_slowly = time.perf_counter() - start > _SLOW

    def _adopt(self, plan: Plan) -> None:
        try:
            self.renderer.adopt(plan)
        except (ShaderError, DeviceError) as error:
            self._fail(error)
            return
        self.problem, self._is_refused = "", False
        self.renderer.restart()
        self._begin_change()

    def _fail(self, error: FragtracerError) -> None:
        """Keep the picture of before, from whichever camera if only a shader file is broken for now."""
        self.problem, self._is_refused = str(error), not isinstance(error, ShaderError)

    def _begin_change(self) -> None:
        self._changed_at = time.perf_counter()
        self._moving = True
        self._drop_held()
        renderer = self.renderer
        if renderer.traces_light:
            renderer.adopt(renderer.quickest(renderer.plan(renderer.scene)))
            renderer.restart()
        now, most = renderer.light_samples, renderer.settings.light_samples
        size, light_samples = self.resolution.choose(self.size, renderer.samples_per_second, now, most)
        if (size, light_samples) != (renderer.size, renderer.light_samples):
            renderer.resize(size, light_samples).release()

    def _settle(self) -> None:
        self._moving = False
        most = self.renderer.settings.light_samples
        if (self.renderer.size, self.renderer.light_samples) != (self.size, most):
            self._hold(self.renderer.resize(self.size, most))
        if not self._loads_slowly:
            self._trace_light()

    def _preview(self) -> float:
        renderer = self.renderer
        rays = self.resolution.rays(renderer.size, renderer.samples_per_second, renderer.settings.rays)
        return renderer.refine(self.resolution.budget, rays, whole=True)

    def _refine(self, limit: int | None) -> float:
        renderer = self.renderer
        left = None if limit is None else limit - renderer.spp
        if left is not None and left <= 0:
            return 0.0
        rays = max(1, min(renderer.settings.rays, renderer.spp))
        return renderer.refine(self.resolution.rest_budget, rays, left)

    def fade(self, limit: int | None = None) -> None:
        """Lower the weight of the held picture; the new one will have ``limit`` samples per pixel."""
        now = time.perf_counter()
        seconds, self._frame_at = now - self._frame_at, now
        if self.held is None or self.renderer.spp == 0:
            return
        enough = self._fade_spp if limit is None else min(limit, self._fade_spp)
        aim = max(0.0, 1.0 - self.renderer.spp / enough) if enough else 0.0
        self.held_weight = max(aim, self.held_weight - min(seconds, 0.1) / _FADE)
        if self.held_weight <= 0:
            self._drop_held()

    @property
    def is_fading(self) -> bool:
        """Whether each frame shows less of the held picture."""
        return self.held is not None and self.renderer.spp > 0 and self._fade_spp == _FADE_SPP

    def _hold(self, film: Accumulation) -> None:
        """Fade from ``film``, the slower the more samples it has."""
        self._drop_held()
        is_finer = film.size == self.renderer.size
        self.held, self.held_weight = film, 1.0
        self._fade_spp = max(_FADE_SPP, film.spp // _FADE_SHARE if is_finer else 0)

    def _drop_held(self) -> None:
        if self.held is not None:
            self.held.release()
        self.held = None

    def close(self) -> None:
        self._compiler.close()
        if self._guider is not None:
            self._guider.close()
        self._drop_held()
        self.renderer.close()


def _source(plan: Plan) -> tuple[object, ...]:
    """What the program of ``plan``, and its maps, depend on."""
    packed, program = plan.packed, plan.program
    compiled_in = specialise(packed, program.level, program.kept).key
    return program, dict(packed.features), compiled_in, packed.environment if packed.needs_maps else None
