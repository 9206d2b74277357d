# SPDX-License-Identifier: MIT
"""The viewer's loop: takes input, edits the session, traces within a time budget, and shows the picture."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from fragtracer.apps.viewer import actions
from fragtracer.apps.viewer.display import AUXILIARY
from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution
from fragtracer.apps.viewer.guider import Guider
from fragtracer.apps.viewer.interface import Interface
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.apps.viewer.panels.statistics import Figures
from fragtracer.apps.viewer.playback import Player
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.apps.viewer.screen import Screen
from fragtracer.apps.viewer.session import Session, file_name, fresh
from fragtracer.apps.viewer.statistics import LAG, FilmStatistics, FrameTimes
from fragtracer.apps.viewer.watch import Watch, scene_files, shader_files
from fragtracer.apps.viewer.wipe import Wipe
from fragtracer.display.tone import srgb_decode
from fragtracer.errors import DeviceError, FragtracerError, ShaderError
from fragtracer.gpu.context import is_software
from fragtracer.io.images import write_image
from fragtracer.resources import folder
from fragtracer.scene import Scene

_NAP = 0.1  # seconds to wait for events when there is nothing to do
_SHOWN_EVERY = 0.06  # seconds between frames while nothing moves and the picture refines
_FIRST = 16  # samples per pixel of the picture before those for the significance map are drawn
_AWAKE = 0.5  # seconds after the last input until the loop waits for events


class Viewer:
    """A window on ``scene``; use it in a ``with`` block and call :meth:`frame` until ``is_open`` ends.

    ``size`` is that of the window, ``path`` the scene's file, ``ini`` where the layout is kept, ``animation`` one that
    plays at once, as ``scene`` has been read with it.
    """

    def __init__(
        self,
        scene: Scene,
        path: Path | None = None,
        size: tuple[int, int] = (1280, 720),
        ini: Path | None = None,
        animation: str | None = None,
    ) -> None:
        self.session = Session.of(scene, path, animation)
        self.screen = Screen(size, ini)
        if not is_software(self.screen.context):  # GPUs' drivers may take seconds for the first program
            self.screen.announce(f"Compiling the shaders for {scene.name} …")
        renderer = LiveRenderer(self.session.shown, (65, 37), self.screen.context)
        self.refiner = Refiner(renderer, DynamicResolution(), Guider())
        self.film_statistics = FilmStatistics()
        self.times = FrameTimes()
        self.wipe = Wipe()
        self.interface = Interface(self.session, self.wipe)
        self._player = Player()
        self._shaders = Watch(lambda: shader_files(folder("shaders")), whole_folder=True)
        self._file = Watch(lambda: scene_files(self.session.document.scene, self.session.path))
        self._seen_version = self.session.version
        self._seen_view = ""
        self._gl_renderer = renderer.context_info["GL renderer"]
        self._shader_problem = ""
        self._presented: tuple[object, ...] = ()
        self._presented_at = 0.0
        self._still = 0  # frames that were shown since the last sample
        self._begun = 0  # pictures, when the film was looked at last
        self._awaited_image = ""  # its suffix: to be saved once the picture rests

    @property
    def is_open(self) -> bool:
        return not self.screen.window.should_close

    @property
    def renderer(self) -> LiveRenderer:
        return self.refiner.renderer

    @property
    def problem(self) -> str:
        """The message that the window shows, "" for none."""
        of_picture = self.refiner.problem, self.refiner.tracing_problem
        of_session = self.session.problem, self.session.file_problem
        problems = self._shader_problem, self.screen.problem, *of_picture, *of_session
        return next(filter(None, problems), "")

    @property
    def _is_whole(self) -> bool:
        """Whether there is a picture that is no preview, of a pass at least."""
        return not self.refiner.is_moving and self.renderer.spp > 0

    @property
    def _is_full(self) -> bool:
        """Whether it has as many samples as were asked for."""
        return self._is_whole and 0 < self.session.max_samples <= self.renderer.spp

    @property
    def _limit(self) -> str:
        """The limit that the picture has reached, "" for none."""
        session, error = self.session, self.film_statistics.relative_error
        if session.target_error > 0 and error is not None and error <= session.target_error:
            return f"error below {100 * session.target_error:.2g} %"
        return f"{session.max_samples:,} samples" if self._is_full else ""

    @property
    def is_done(self) -> bool:
        """Whether there is a picture, and a limit is reached or refining is paused. A limit ends nothing while it is
        being decided how light is found best."""
        if not self._is_whole:
            return False
        return self.session.paused or (self._limit != "" and not self.refiner.is_deciding)

    def frame(self) -> None:
        """One turn of the loop; sleeps for a while if nothing changes."""
        rests = self._is_asleep and not self.session.playback.moves
        idle = rests and (self.is_done or self._is_full) and not self._draws_for_comparison
        window = self.screen.window
        window.poll(_NAP if idle else 0.0)
        start = time.perf_counter()
        if window.was_touched:
            self.interface.used_at = start
        if window.is_minimised:
            time.sleep(0.05)
            return
        self._play()
        if self._shows_nothing_new(start):
            if self.is_done:
                self._watch()
            else:
                self._refine()
            return
        self._watch()
        with window.panels():
            area, action = self.interface.describe(self.figures, self.times, self.screen.display.compares, self.problem)
            if action:
                self.do(action)
        self._sync(area)
        self._compare()
        traced = self._refine()
        if self._is_whole and self.renderer.spp > 1:
            self.film_statistics.look(self.renderer.film)
        if self._awaited_image and self._is_whole:
            self.attempt(partial(self.save_image, self._awaited_image))
        self._set_title()
        self._presented = self._on_screen()
        self._presented_at = time.perf_counter()
        self.screen.show(self.refiner, self.session.display)
        seconds = time.perf_counter() - start
        self.refiner.resolution.note_overhead(seconds - traced)
        self.times.add(seconds, self.renderer.pass_seconds)

    def _play(self) -> None:
        """Show models as their animations have them now, where these have come so far."""
        try:
            if self._player.update(self.session.playback, self.session.document.scene):
                self.session.version += 1
        except FragtracerError as error:
            self.session.problem = str(error)

    def _shows_nothing_new(self, now: float) -> bool:
        """Whether a frame would show nothing new, or nothing but samples, and the last one was a moment ago."""
        refiner = self.refiner
        if refiner.is_moving or refiner.is_fading or self.screen.window.was_touched:
            return False
        if self._presented != self._on_screen():
            return False
        if self.is_done:
            return self._is_at_rest
        return now - self._presented_at < max(_SHOWN_EVERY, 2 * refiner.resolution.overhead)

    @property
    def _is_asleep(self) -> bool:
        """Whether there was no input lately."""
        return time.perf_counter() - self.interface.used_at > _AWAKE

    @property
    def _is_at_rest(self) -> bool:
        """Whether all that is shown with a picture that is done has come to rest."""
        adapts = self.session.display.auto_exposure and not self.screen.display.is_adapted
        changes = adapts or self.refiner.held is not None or self.wipe.is_on
        return self._is_asleep and self._still >= LAG and not changes

    def _on_screen(self) -> tuple[object, ...]:
        """What the next frame depends on, apart from samples and events."""
        session = self.session
        limits = session.max_samples, session.target_error, session.paused
        return session.version, session.camera, session.display, session.toast, self.problem, *limits

    def _compare(self) -> None:
        if problem := self.wipe.update(self.session.shown, self.refiner.size, self.screen.display):
            self.session.problem = problem
        self.refiner.compare(self.wipe.is_on)

    def _refine(self) -> float:
        """Trace unless the picture is done; returns the seconds spent."""
        if self._draws_for_comparison and (self.is_done or self.screen.frames % 2):
            return self._draw_for_comparison()
        if self.is_done:
            self._still += 1
            self.refiner.fade(limit=0)
            return 0.0
        self._still = 0
        seconds = self.refiner.frame(self.session.max_samples or None)
        if self.refiner.is_moving or self.renderer.begun != self._begun:
            self._begun = self.renderer.begun
            self.film_statistics.forget()
        return seconds

    @property
    def _draws_for_comparison(self) -> bool:
        """Whether the significance map needs more of our pictures, and nothing moves."""
        at_rest = not (self.refiner.is_moving or self.session.paused or self._auxiliary())
        return self.wipe.wants_pictures and at_rest and self.renderer.spp >= _FIRST

    def _draw_for_comparison(self) -> float:
        try:
            return self.wipe.draw_ours(self.renderer, self.refiner.resolution.rest_budget)
        except DeviceError as error:
            self.session.problem = str(error)
            return 0.0

    def _watch(self) -> None:
        for path in self.screen.window.take_dropped():
            self.attempt(partial(actions.take, self.session, Path(path)))
            self._file.accept()
        if changed := self._file.changed():
            self.attempt(lambda: self.session.follow(changed))
        if self._shaders.changed():
            self.refiner.prepare_shaders()
        if self.refiner.take_shaders():
            self._reload_shaders()

    def _reload_shaders(self) -> None:
        try:
            self.screen.display.reload_shaders()
            self.refiner.reload_shaders()
        except ShaderError as error:
            self._shader_problem = str(error)
            return
        if self._shader_problem:
            self.session.say("The shaders compile again")
        else:
            self.session.say("Shaders reloaded")
        self._shader_problem = ""
        self.film_statistics.forget()
        self.wipe.forget_ours()

    def attempt(self, action: Callable[[], object]) -> None:
        """Run ``action``; a failure becomes the problem that the window shows."""
        try:
            action()
            self.session.problem = ""
        except FragtracerError as error:
            self.session.problem = str(error)

    def do(self, action: str) -> None:
        """Carry out what a menu item or a key is called (:data:`fragtracer.apps.viewer.panels.menu.KEYS`)."""
        self.interface.used_at = time.perf_counter()
        match action:
            case "panels" | "help" | "layout":
                self.interface.show(action)
            case "dismiss":
                self.session.problem = ""
            case "close":
                self.screen.window.request_close()
            case "image png" | "image exr":
                self.attempt(partial(self.save_image, action.split()[1]))
            case "reference":
                self.wipe.step(self.session.shown, self.refiner.size)
            case "copy command":
                self.attempt(self._copy_command)
            case _:
                self.attempt(lambda: actions.carry_out(self.session, action))
                if action == "save":
                    self._file.accept()

    def _copy_command(self) -> None:
        command = actions.render_command(self.session, self.refiner.size, self.renderer.spp)
        imgui.set_clipboard_text(command)
        self.session.say(f"Copied: {command}")

    def save_image(self, suffix: str) -> None:
        """Write the picture, without panels, with the metadata of ``fragtracer render``, to a new file of the name of
        its scene; one that is a preview, once it rests. A .png file is the view that is shown, others are what is
        rendered for it."""
        if not self._is_whole:
            self._awaited_image = suffix
            self.session.say("The picture will be saved once it is no preview")
            return
        self._awaited_image = ""
        path = fresh(Path.cwd() / f"{file_name(self.session.document.scene.name)}.{suffix}")
        shown, what = self.session.display, self._auxiliary() or "radiance"
        image, look = self.renderer.image(), actions.look(shown)
        if suffix == "png":
            what = shown.view
            if what not in ("radiance", "bloom"):
                picture = self.screen.display.picture(self.renderer.film, shown, self.renderer.spp)
                image, look = srgb_decode(np.divide(picture, 255, dtype=np.float32)), {}
        write_image(path, image, self.renderer.metadata() | {"view": what}, **look)
        self.session.say(f"Saved {what} to {path}")

    def _sync(self, area: Area) -> None:
        """Tell the refiner what has changed since the last frame."""
        self.refiner.resize(self.screen.place(area))
        session = self.session
        if session.version != self._seen_version:
            self._seen_version = session.version
            self.refiner.change(session.shown)
        elif self._auxiliary() != self._seen_view:
            self._seen_view = self._auxiliary()
            self.refiner.show_view(self._seen_view)
        elif session.camera != self.refiner.camera:
            self.refiner.look(session.camera)

    def _auxiliary(self) -> str:
        """The view that the tracer renders in place of radiance, "" for none."""
        view = self.session.display.view
        return view if view in AUXILIARY else ""

    @property
    def figures(self) -> Figures:
        """The figures of the statistics panel and the status bar."""
        state = "moving" if self.refiner.is_moving else "paused" if self.session.paused else "refining"
        state = "preparing" if self.refiner.is_preparing else state
        return Figures(
            spp=self.renderer.spp,
            samples_per_second=self.renderer.samples_per_second,
            relative_error=self.film_statistics.relative_error,
            non_finite=self.film_statistics.non_finite,
            size=self.renderer.size,
            full_size=self.refiner.size,
            gl_renderer=self._gl_renderer,
            gpu_bytes=self.renderer.gpu_bytes,
            pass_seconds=self.renderer.pass_seconds,
            specialised=self.renderer.is_specialised,
            traces_light=self.renderer.traces_light,
            state=f"done: {self._limit}" if state == "refining" and self.is_done else state,
        )

    def _set_title(self) -> None:
        mark = "" if self.session.is_saved else " •"
        self.screen.set_title(f"{self.session.document.scene.name}{mark} – fragtracer")

    def grab(self) -> NDArray[np.uint8]:
        """What the window shows, (height, width, 3) sRGB bytes, row 0 at the top."""
        return self.screen.grab(self.refiner, self.session.display)

    def close(self) -> None:
        self._player.close()
        self.wipe.stop()
        self.refiner.close()
        self.screen.close()

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
