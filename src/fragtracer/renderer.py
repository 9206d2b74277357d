# SPDX-License-Identifier: MIT
"""From a scene to an image: progressive rendering with as many samples as asked for."""

import logging
import math
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from fragtracer.aov import AOVS, checked
from fragtracer.arguments import check_scene, checked_first_sample, checked_size, checked_spp
from fragtracer.decisions import Decider, adaptive_sampling, gradient_domain, in_origin, noise_is_rare
from fragtracer.errors import FilmError, FragtracerError
from fragtracer.films import DECIDED, MOST_SAMPLES, SavedFilm, origin_of
from fragtracer.gpu.accumulation import Accumulation
from fragtracer.gpu.context import borrowed, check_process, create_context, describe, max_size, release_with
from fragtracer.gpu.layers import LayerTextures
from fragtracer.gpu.specialise import MOST_LISTED, OF_POSES, Level
from fragtracer.gpu.tracer import Tracer, TracerProgram, most_outside_grid, picture_level
from fragtracer.interruption import deferred
from fragtracer.layers import PARTS, FirstSurface, Picture, light
from fragtracer.light_tracing import Decisions, LightTracing
from fragtracer.moments import Moments
from fragtracer.packing import PackedScene, matte_names, pack
from fragtracer.packing.space import Space
from fragtracer.sampling.allocation import FIRST_STAGE, StagePart, Window, least_gain
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Camera, RenderSettings, Scene
from fragtracer.shutter import Shutter

_log = logging.getLogger(__name__)

PROGRAMS = {"path": "pathtracer.frag", "split-sum": "split_sum.frag"}
_FIRST_LOOK = 16  # samples per pixel, at the error
_EXPECTED_RATE = 2**22  # samples a second, as of two cores on scenes of some shapes
_MOST_RAYS = 64  # of a pass that no window waits for: lanes that wait for the longest paths wait for less of the time


def pass_rays(rays: int, spp: int) -> int:
    """Samples per pixel of the pass after ``spp``, where no window waits for it: a multiple of the setting ``rays``."""
    return rays * max(1, min(spp // 4, _MOST_RAYS) // rays)


def expected_spp(settings: RenderSettings, spp: int | None, seconds: float) -> int:
    """The setting ``spp`` for a picture that is sampled for some ``seconds``, and ends at ``spp`` samples per pixel, if
    given: by it is judged what is worth learning before."""
    expected = _EXPECTED_RATE * seconds / (settings.width * settings.height)
    return max(1, round(min(expected, MOST_SAMPLES if spp is None else spp)))


@dataclass(frozen=True)
class Progress:
    """How far a render is: samples per pixel done, seconds since it began."""

    spp: float
    seconds: float
    relative_error: float | None  # mean relative standard error when last measured
    workers: int | None = None  # of a cluster


class Renderer:
    """Renders ``scene`` progressively on its own OpenGL context; use it in a ``with`` block.

    Threads may share it: they wait for each other's passes. Functions that a method is given may use it, too.

    What takes long before the first sample is told to the logger "fragtracer", at the level INFO. Whether that pays is
    judged by the setting ``spp``, whatever is sampled in the end, or by what :meth:`expect` is told.

    Parameters
    ----------
    scene
        What to render.
    size
        (width, height) in pixels; left out, the scene's own.
    context
        A moderngl context to render on instead of a new one without a window; the caller keeps it. It may have any
        state that moderngl sets. Each method makes it current, and leaves it so; what of its state is given back, says
        :func:`fragtracer.gpu.context.borrowed`. One of the renderer's own is current only in a method; after it,
        none may be.
    specialised
        Whether what the scene holds is compiled into the program (:mod:`fragtracer.gpu.specialise`).
    defines
        Values for some features of the program in place of those that the scene and settings give: for
        measurements and experiments.
    program
        A program below shaders/ in place of the one that the setting ``integrator`` asks for.
    shaders
        A folder of shader files in place of fragtracer's own.
    aovs
        Layers that :meth:`aov` will be asked for. Only those that are parts of the light need to be named; the light is
        then sampled evenly, without adaptive sampling.
    first_sample
        The number of the first sample of each pixel, an even one: renders of disjoint samples can be merged
        (:func:`fragtracer.films.merge`). Only where sampling is not adaptive.
    moves
        Whether :meth:`reset` will be given other cameras, which then do not compile. Coordinates, and whether paths are
        guided, are decided by the first.
    pictures
        How many pictures that then are: something is learned for all of them once.
    animated
        Whether :meth:`reset` will be given the same scene with its meshes in other poses, and with its lights in other
        places, which then do not compile. What is learned of the first serves all, without bias.
    settings
        Any field of :class:`RenderSettings` to change for this render, as ``bounces=2``.

    Raises
    ------
    DeviceError
        Without OpenGL 3.3, or if the GPU cannot hold an image of this size, or the scene. Of everything, in a process
        that was forked from one that has used OpenGL.
    FragtracerError
        If there is no such layer, or the integrator knows no parts of the light; if ``scene`` is none, ``size`` is not
        two whole numbers, or ``first_sample`` is not even. Of everything, after :meth:`close`.
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int] | None = None,
        context: Any = None,
        specialised: bool = True,
        defines: Mapping[str, int | str] | None = None,
        program: str | None = None,
        shaders: Path | None = None,
        aovs: Iterable[str] = (),
        first_sample: int = 0,
        moves: bool = False,
        pictures: int = 1,
        animated: bool = False,
        **settings: Any,
    ) -> None:
        check_scene(scene)
        self._has_parts = any(AOVS[name].is_light for name in checked(aovs))
        if size is not None:
            settings |= dict(zip(("width", "height"), checked_size(size), strict=True))
        self.settings: RenderSettings = replace(scene.render, **settings)
        self.scene = scene
        self._expected_spp = self.settings.spp
        self._seconds, self._resumed_at = 0.0, 0  # that the samples after so many per pixel have taken
        self._moments = Moments(scene, None, self.settings)
        self._owns_context, self._is_closed = context is None, False
        self._lock = threading.RLock()
        self._scope: AbstractContextManager[Any] | None = None  # in which the context is current
        self._is_loaded = True  # what scene and settings are, once all is made
        self.context = create_context() if context is None else context
        with ExitStack() as failing:
            if self._owns_context:
                failing.callback(self.context.release)
            with self._current(), ExitStack() as made:
                self._most_listed = MOST_LISTED["default"]
                self._level = picture_level(self.context, moves) if specialised else Level.NOTHING
                self._defines, self._name, self._shaders = dict(defines or {}), program, shaders
                self._moves, self._kept = moves, OF_POSES if animated else ()
                self._space: Space | None = None
                self.first_sample = first_sample = checked_first_sample(first_sample)
                self._decider = Decider(self.context, self._untraced, moves, pictures, animated)
                width, height = self.settings.width, self.settings.height
                window = Window(0, 0, width, height, first_sample) if first_sample else None
                self._check_window(window)
                size = width, height
                self._parts = LayerTextures(self.context, size, len(PARTS)) if self._has_parts else None
                self._film = Accumulation(self.context, *size, self._adaptive_sampling[0], self._parts, window)
                made.callback(self._film.release)
                self._light: LightTracing | None = None
                made.callback(self._release_light)
                _log.info("compiling")
                packed = self._packed()
                self._tracer = Tracer(self.context, packed, self._program())
                made.callback(self._tracer.release)
                self._film.warm_up(self._tracer)
                self._load_light(packed)
                self._choose_sampling()
                made.pop_all()
            failing.pop_all()
        if self._owns_context:
            release_with(self, self.context)
        self._last_error: float | None = None
        self._looked, self._next_look = 0, _FIRST_LOOK  # samples per pixel when the error was looked at, and will be
        self._first_surface = FirstSurface(self.context, self._tracer)

    def sample(self, spp: int = 1, on_band: Callable[[float], None] | None = None) -> None:
        """Add ``spp`` samples per pixel; ``on_band`` hears how many there are so far.

        Adaptive sampling spreads them unevenly, after the first 32, where that pays.

        Raises
        ------
        FragtracerError
            If there would be more than 2^24, in the mean over pixels, which float32 counts; if ``spp`` is no whole
            number, or negative.
        """
        target = self.spp + checked_spp(spp)
        if target > MOST_SAMPLES:
            raise FragtracerError(
                f"{target} samples per pixel are more than the {MOST_SAMPLES} that a film can count; it has {self.spp}"
            )
        while self.spp < target:
            self._draw_pass(target - self.spp, on_band)

    def _draw_pass(self, most: int, on_band: Callable[[float], None] | None) -> None:
        """Draw a pass of ``most`` samples per pixel at most."""
        start = time.perf_counter()
        with self._drawing():
            if self._moments.begin(self.spp):
                self._load(goes_on=True)
            most = min(most, self._moments.end(self.spp) - self.spp)
            if self._light is not None:
                self._light.advance(max(1, self.spp))  # no sample without photons, however the pass ends
            for share in self._film.bands(self._tracer, pass_rays(self.settings.rays, self.spp), most):
                if on_band is not None:
                    with self._suspended():
                        on_band(self.spp + self._film.pass_rays * share)
            if self._light is not None:
                self._light.advance(self.spp)
        self._seconds += time.perf_counter() - start

    def expect(self, seconds: float, spp: int = MOST_SAMPLES) -> None:
        """Say that this picture is sampled for so many ``seconds`` more, up to ``spp`` samples per pixel.

        By that it is judged, at the rate of the first 32 samples, whether a pilot pays, which comes after them;
        :meth:`render` says it of its own limits.
        """
        if self.spp == FIRST_STAGE > self._resumed_at and self._seconds:
            rate = (FIRST_STAGE - self._resumed_at) / self._seconds
            self._expected_spp = int(min(spp, FIRST_STAGE + rate * max(0.0, seconds)))
            with self._drawing():
                self._choose_sampling()

    def render(
        self,
        spp: int | None = None,
        seconds: float | None = None,
        until: float | None = None,
        progress: Callable[[Progress], None] | None = None,
        worst: float | None = None,
        keep: Callable[[bool], None] | None = None,
    ) -> NDArray[np.float32]:
        """Sample until the first of the given limits is reached and return :meth:`image`.

        Parameters
        ----------
        spp
            Samples per pixel in all, at most 2^24, which float32 counts; where no limit is given, the scene's own. A
            picture that is made from differences (docs/sampling.md, "The gradient domain") has one more where that is
            odd.
        seconds
            Wall-clock time; at least one pass is made, and the last one is finished.
        until
            Mean relative standard error, 0.01 for 1 %; looked at whenever a quarter more samples
            have been taken.
        progress
            Called after every draw, many times a second.
        worst
            Relative standard error that 99 % of the pixels are to have at most, 0.05 for 5 %. With ``until``, both
            must hold.
        keep
            Called after every pass from which :meth:`save` could go on with the same bits, with whether it is the last
            such one.

        Raises
        ------
        FragtracerError
            If ``spp`` is no whole number, or negative.
        KeyboardInterrupt
            On Ctrl-C; the passes that were finished stay in the image.
        """
        if spp is None and seconds is None and until is None and worst is None:
            spp = self.settings.spp
        spp = MOST_SAMPLES if spp is None else min(checked_spp(spp), MOST_SAMPLES)
        start = time.perf_counter()

        def report(done: float) -> None:
            assert progress is not None
            progress(Progress(done, time.perf_counter() - start, self._last_error))

        looks = until is not None or worst is not None
        is_good = looks and 0 < self.spp == self._looked and self._is_good(until, worst)
        while self.spp < spp and not is_good:
            if seconds is not None:
                self.expect(seconds - (time.perf_counter() - start), spp)
            self._draw_pass(spp - self.spp, report if progress is not None else None)
            if looks and self.spp >= self._next_look:
                is_good = self._is_good(until, worst)
                self._looked, self._next_look = self.spp, self.spp + max(_FIRST_LOOK, self.spp // 4)
            is_good |= seconds is not None and time.perf_counter() - start >= seconds
            if keep is not None and self.can_go_on:
                keep(is_good or not self._film.is_whole(spp - self.spp))
        return self.image()

    def _is_good(self, until: float | None, worst: float | None) -> bool:
        """Whether the errors that :meth:`render` has been given are reached."""
        pixels = self._read()
        before, self._last_error = self._last_error, pixels.relative_error()
        if math.inf == self._last_error != before:
            warnings.warn(
                "the error of the picture is not known, since its variance overflows a float32 or underflows it; until "
                "and worst do not end it",
                stacklevel=3,
            )
        is_good = until is None or self._last_error <= until
        return is_good and (worst is None or pixels.worst_error() <= worst)

    def save(self, path: str | Path) -> None:
        """Write what there is to a .npz file, from which :meth:`resume` goes on; one that is there is replaced once the
        new one is on the disk.

        Raises
        ------
        OutputError
            If it cannot be written.
        FilmError
            If no render could go on from it (:attr:`can_go_on`).
        DeviceError
            If what is on the GPU is not what was drawn there.
        """
        if not self.can_go_on:
            raise FilmError(f"{path}: adaptive sampling has ended within a pass; save the film before its last pass")
        with self._drawing():
            state, arrays = self._film.state()
            if self._light is not None:
                light_state, light_arrays = self._light.state()
                state, arrays = state | light_state, arrays | light_arrays
        ranges = ((self.first_sample, self.first_sample + self.spp),)
        state |= {"next_look": self._next_look, "looked": self._looked}
        state |= {"moment_spp": self._moments.samples} if self._moments.shutter is not None else {}
        SavedFilm(self.origin(), self.driver, ranges, self.metadata(), state, arrays).write(Path(path))

    def resume(self, path: str | Path) -> None:
        """Go on from what :meth:`save` has written, with the bits of a render that was not interrupted.

        What "auto" has decided for the film, which may have been meant to have fewer samples, stays as it is.

        Raises
        ------
        FilmError
            If the file is missing, damaged, or of another picture; the message says what differs.

        Warns
        -----
        UserWarning
            If another driver has rendered it: the bits may differ then. If a new render would be guided or traced from
            its lights, and the film is not.
        """
        film = SavedFilm.read(Path(path))
        if "cluster" in film.state:
            raise FilmError(f"{path}: this film was rendered on a cluster; go on with --cluster")
        here, decided = self.origin(), {name: film.origin[name] for name in DECIDED if name in film.origin}
        film.check(here | decided, path)
        if "merged" in film.state:
            raise FilmError(f"{path}: this film is merged of several; render more samples with --first-sample")
        ((first, _),) = film.ranges
        if first != self.first_sample:
            raise FilmError(f"{path}: its first sample is {first} there, {self.first_sample} here")
        with self._drawing():
            left_out = self._decider.decide_as(film.origin, self.scene, self.settings)
            if self.origin() != here:
                self._load()
                self._choose_sampling()
        film.check(self.origin(), path)
        if left_out:
            begun_anew = "a new render of so many samples would be less noisy"
            warnings.warn(f"{path}: goes on without {left_out}, as it was begun; {begun_anew}", stacklevel=2)
        if film.driver != self.driver:
            warnings.warn(
                f"{path}: was rendered by {film.driver}, and goes on with {self.driver}; bits may differ", stacklevel=2
            )
        with self._current():
            self._film.restore(film.state, film.arrays)
            if self._light is not None:
                self._light.restore(film.state, film.arrays)
        self._next_look, self._looked = film.state["next_look"], film.state.get("looked", 0)
        self._moments.forget()
        self._moments.samples = film.state.get("moment_spp", self._moments.samples)
        self._seconds, self._resumed_at = 0.0, self.spp
        if self.spp > FIRST_STAGE:  # how it goes on is decided
            self._expected_spp = MOST_SAMPLES
            self._choose_sampling()

    def block(self, window: Window, spp: int) -> Pixels:
        """``spp`` samples of each pixel of a part of the picture, beside the film of this renderer.

        Raises ValueError where sampling is adaptive, or the integrator is not "path".
        """
        self._check_window(window)
        with self._drawing():
            film = Accumulation(self.context, self.settings.width, self.settings.height, "off", window=window)
            try:
                while film.spp < spp:
                    for _ in film.bands(self._tracer, max(self.settings.rays, _MOST_RAYS), spp - film.spp):
                        pass
                return film.read()
            finally:
                film.release()

    def stage_part(self, part: StagePart) -> Pixels:
        """Its film with the samples that it asks for, beside the film of this renderer."""
        with self._drawing():
            return self._film.stage_part(self._tracer, part)

    def pilot(self) -> Pixels:
        """What says whether adaptive sampling pays, by :meth:`fragtracer.sampling.pilot.Pilot.of`; the picture must
        have a tile."""
        with self._drawing():
            return self._film.pilot(self._tracer)

    def _check_window(self, window: Window | None) -> None:
        if window is None:
            return
        if self._program().name != PROGRAMS["path"] or self.settings.adaptive != "off" or self._has_parts:
            raise ValueError('a part of the samples needs adaptive="off", integrator="path" and no parts of the light')
        if window.first_sample % 2:
            raise ValueError("the first sample must have an even number, since samples belong to two streams in turns")

    def origin(self, scene: Scene | None = None, **settings: Any) -> dict[str, str]:
        """What decides over the samples (:func:`fragtracer.films.origin_of`), or would after :meth:`reset`."""
        self._check_open()
        shown, chosen = scene or self.scene, replace(self.settings, **settings) if settings else self.settings
        more: dict[str, object] = {"program": self._program().name, "defines": self._defines}
        more |= {"light_parts": self._has_parts}
        if (shutter := self._moments.shutter) is not None and scene is None:
            more |= {"shutter": shutter.name}
        with self._current():
            decisions = self._decider.decide(shown, chosen)
        return origin_of(shown, chosen, self._shaders, **more, **in_origin(decisions))

    @property
    def driver(self) -> str:
        """What renders, with its version."""
        info = self.context_info
        return f"{info['GL renderer']}, OpenGL {info['GL version']}"

    def reset(self, scene: Scene | None = None, shutter: Shutter | None = None, **settings: Any) -> None:
        """Forget all samples; go on with ``scene``, if given, and with any settings that are.

        The size stays, and so do settings that are not given: those of ``scene`` itself are not taken over. Another
        ``seed`` never compiles, other values may.

        With a ``shutter`` the picture is the mean over its moments, sampled evenly; ``scene`` is that of one of them,
        by which all is decided and learned. The standard error does not know of how far the moments are apart.

        Raises
        ------
        FragtracerError
            If the scene cannot be rendered so. After any error, and Ctrl-C, the renderer begins anew with what it had.
        """
        if not {"width", "height"}.isdisjoint(settings):
            raise ValueError("a renderer keeps its size; make another one")
        if scene is not None:
            check_scene(scene)
        before = self.scene, self.settings, self._moments
        shown, chosen = scene or self.scene, replace(self.settings, **settings) if settings else self.settings
        with self._current():
            try:
                if scene is not None or settings or self._moments.shutter is not None or shutter is not None:
                    light_too = not self._is_loaded or scene is not None or settings.keys() != {"seed"}
                    light_too |= self._moments.shutter is not None
                    self.scene, self.settings, self._moments = shown, chosen, Moments(shown, shutter, chosen)
                    self._load(light_too)
            except BaseException:
                with deferred():
                    self.scene, self.settings, self._moments = before
                    self._release_light()
                raise
            finally:
                with deferred():
                    self._forget()
            self._choose_sampling()

    def _forget(self) -> None:
        """Be without samples."""
        if self._light is not None:
            self._light.clear(self.settings.seed)
        self._film.clear()
        self._expected_spp, self._seconds, self._resumed_at = self.settings.spp, 0.0, 0
        self._moments = Moments(self.scene, self._moments.shutter, self.settings)
        self._first_surface.forget()
        # The error does not know of moments that are still to come.
        self._last_error, self._looked, self._next_look = None, 0, max(_FIRST_LOOK, self._moments.all_seen)

    def image(self) -> NDArray[np.float32]:
        """Mean radiance, (height, width, 3) float32 linear Rec. 709, row 0 at the top."""
        return np.ascontiguousarray(self._read().mean[..., :3])

    def standard_error(self) -> NDArray[np.float32]:
        """Standard error of :meth:`image`, (height, width, 3); infinite where a pixel has fewer than two samples.

        It knows of stratification, by independent halves of the samples (:meth:`Pixels.standard_error`).
        """
        return self._read().standard_error()

    def standard_deviation(self) -> NDArray[np.float32]:
        """Standard deviation of the samples of each pixel, (height, width, 3), without adaptive sampling and the
        gradient domain."""
        return np.sqrt(self._read().variance[..., :3])

    def relative_error(self) -> float:
        """Mean standard error over mean radiance of the whole image; 0 for a black one, infinite before any sample."""
        pixels = self._read()
        return pixels.relative_error() if self.spp else math.inf

    def worst_error(self) -> float:
        """The relative standard error that 99 % of the pixels do not exceed (:meth:`Pixels.worst_error`); infinite
        before any sample."""
        pixels = self._read()
        return pixels.worst_error() if self.spp else math.inf

    def samples(self) -> NDArray[np.float32]:
        """How many finite samples each pixel has had, (height, width)."""
        return np.ascontiguousarray(self._read().mean[..., 3])

    def non_finite_samples(self) -> int:
        """How many samples, and photons of light tracing, were NaN or infinite; they are left out of the mean."""
        photons = 0 if self._light is None else self._light.non_finite
        return int(self._read().variance[..., 3].sum(dtype=np.float64)) + photons

    def aov(self, name: str, previous_camera: Camera | None = None) -> NDArray[np.float32]:
        """A layer of the picture, float32, row 0 at the top; :data:`fragtracer.aov.AOVS` says what each of them is.

        Colours, normals and positions are (height, width, 3), "motion" (height, width, 2), "depth" and "samples"
        (height, width). Of the mattes "object" and "material" it is (height, width, 6, 2): the ids of up to six names,
        and the share of the samples that met them, the largest first, 0 where there are no more.

        Light adds up: emission + direct + indirect is :meth:`image`, and so is emission + diffuse + specular. Layers of
        the surface that is met first are drawn now, with the first :attr:`spp` samples of each pixel. They are means
        over all samples, 0 where nothing is met; depth and position over those that have met something. Layers for a
        denoiser have at least 64 samples of each pixel, but for the light that the picture itself has seen.

        Parameters
        ----------
        name
            One of :data:`fragtracer.aov.AOVS`; a part of the light must have been named to ``aovs``.
        previous_camera
            Of the previous picture, for "motion"; left out, nothing moves.

        Raises
        ------
        FragtracerError
            If there is no such layer, or it was not asked for in time, or there are no samples.
        """
        (name,) = checked([name])
        if not self.spp:
            raise FragtracerError(f"there are no samples yet for the layer {name}")
        if name == "samples":
            return self.samples()
        if name == "standard_error":
            return self.standard_error()
        if name == "denoising_half_difference":
            return self._read().centred_half_difference().astype(np.float32)
        settings = self.settings
        with self._drawing():
            if AOVS[name].is_light:
                if self._parts is None:
                    raise FragtracerError(
                        f"the layer {name} must be asked for before: Renderer(scene, aovs=[{name!r}])"
                    )
                return light(name, self._parts)
            self._moments.forget()  # layers leave the tracer with the scene
            packed, program, size = self._packed(), self._program(), (settings.width, settings.height)

            def moment(sample: int) -> tuple[PackedScene, int]:
                seen = self._moments.at(sample)
                return packed if seen is self.scene else self._packed_as(seen), self._moments.end(sample)

            picture = Picture(self.scene, packed, program, size, self.spp, self._samples_are_plain, moment)
            return self._first_surface.layer(name, picture, previous_camera)

    def matte_names(self, name: str) -> list[str]:
        """The names whose ids the matte ``name`` has: meshes by theirs, other shapes by their place in the scene file,
        as "sphere[0]"; materials by their keys. Raises FragtracerError if there is no such matte."""
        if name not in AOVS or not AOVS[name].matte:
            mattes = " and ".join(one for one, aov in AOVS.items() if aov.matte)
            raise FragtracerError(f"there is no matte {name!r}; there are {mattes}")
        return matte_names(self.scene)[name == "material"]

    @property
    def _samples_are_plain(self) -> bool:
        """Whether those of the picture go the ways of layers.frag as long as surfaces are smooth."""
        traces_paths = self._program().name == PROGRAMS["path"]
        return traces_paths and not (
            self._film.is_uneven
            or self._film.shares_numbers
            or self.first_sample
            or "u_guiding" in self._packed().tables
        )

    @property
    def spp(self) -> int:
        """Samples per pixel so far; with adaptive sampling, in the mean over pixels."""
        self._check_open()
        return self._film.spp

    @property
    def pass_spp(self) -> int:
        """Samples per pixel of the next pass of :meth:`render` that nothing limits, where all pixels have as many."""
        return pass_rays(self.settings.rays, self.spp) * (2 if self._film.shares_numbers else 1)

    @property
    def can_go_on(self) -> bool:
        """Whether more samples give the picture of a render that was asked for them at once: not after adaptive
        sampling was told to stop within a pass."""
        self._check_open()
        return self._film.can_go_on

    @property
    def draw_seconds(self) -> float:
        """Time that all draws of passes have taken, by the GPU's clock where it has one."""
        self._check_open()
        return self._tracer.timer.seconds

    @property
    def gpu_clock(self) -> bool:
        """Whether :attr:`draw_seconds` is by the GPU's clock, else by the wall clock."""
        self._check_open()
        return self._tracer.timer.gpu_clock

    @property
    def gpu_bytes(self) -> int:
        """Size of the textures and buffers held on the GPU; drivers round up, and add the program."""
        self._check_open()
        return self._film.gpu_bytes + self._tracer.gpu_bytes + (self._light.gpu_bytes if self._light else 0)

    @property
    def context_info(self) -> dict[str, str]:
        """What renders, as :func:`fragtracer.gpu.context.describe` says it."""
        self._check_open()
        return describe(self.context)

    def metadata(self) -> dict[str, str]:
        """What made the image, as text by name, for its file."""
        from fragtracer import __version__

        settings = {name: str(value) for name, value in vars(self.settings).items() if not name.startswith("_")}
        counts = {
            "spp": str(self.spp),
            "first_sample": str(self.first_sample),
            "non_finite_samples": str(self.non_finite_samples()),
        }
        made_by = {"software": f"fragtracer {__version__}", "scene": self.scene.name}
        traced, guided = self._decisions()
        counts |= {"guiding_decision": guided.reason, "light_tracing_decision": traced.reason}
        counts |= {"adaptive_decision": self._adaptive_sampling[1] or self._film.decision}
        counts |= {"gradient_domain_decision": self._gradient_domain[1] or self._film.gradient_decision}
        counts |= self._moments.described(self.spp)
        return made_by | settings | counts | {"gl_renderer": describe(self.context)["GL renderer"]}

    def _repr_png_(self) -> bytes:
        """The picture so far, for a notebook, with the exposure that suits it."""
        from io import BytesIO

        from PIL import Image

        from fragtracer.display.look import Look

        data = BytesIO()
        Image.fromarray(np.uint8(np.rint(255 * Look("auto").show(self.image())))).save(data, "png")
        return data.getvalue()

    def _pack(self, scene: Scene, settings: RenderSettings, level: Level) -> PackedScene:
        outside_grid = most_outside_grid(self.context, level)
        return pack(scene, settings, settings.width, settings.height, self._most_listed, self._space, outside_grid)

    def _packed(self) -> PackedScene:
        return self._packed_as(self._moments.shown)

    def _packed_as(self, scene: Scene) -> PackedScene:
        """The scene as it is at a moment."""
        packed = self._pack(scene, self.settings, self._level)
        if self._moves:
            self._space = self._space or packed.space  # the first, so that a picture does not depend on others
        return self._decisions()[1].applied(packed) if self._name is None else packed

    def _load(self, light_too: bool = True, goes_on: bool = False) -> None:
        """Have the GPU hold the scene, as the settings ask for it; photons stay where the picture ``goes_on``."""
        self._is_loaded = False
        packed = self._packed()
        self._tracer.load(packed, self._program())
        if light_too:
            self._load_light(packed, goes_on)
        self._is_loaded = True

    def _load_light(self, packed: PackedScene, goes_on: bool = False) -> None:
        """Trace light of the scene from its lights, or no longer."""
        decision, _ = self._decisions()
        if not decision.is_on:
            self._release_light()
            return
        if self._light is None:
            self._light = LightTracing(self.context)
        size = self.settings.width, self.settings.height
        scene, photons = self._moments.shown, decision.photons
        self._light.load(packed, scene, size, photons, self._level, self._shaders, self._kept, goes_on)
        self._light.warm_up()

    def _release_light(self) -> None:
        if self._light is not None:
            self._light.release()
        self._light = None

    def _decisions(self) -> Decisions:
        """Whether some light is traced from the lights, and whether paths are guided."""
        return self._decider.decide(self.scene, self.settings)

    def _program(self) -> TracerProgram:
        name = self._name or PROGRAMS[self.settings.integrator]
        defines = self._defines
        if self._has_parts:
            if name != PROGRAMS["path"]:
                raise FragtracerError(
                    f"the integrator {self.settings.integrator} knows no parts of the light; use path"
                )
            defines = {**defines, "FILM_LIGHT": "FILM_LIGHT_PARTS"}
        defines = {**self._decisions()[0].defines, **defines}
        return TracerProgram(name, defines, self._level, self._kept, self._shaders)

    def _choose_sampling(self) -> None:
        """Where the samples of the next picture go, by scene and settings."""
        film = self._film
        film.least_gain = least_gain(self._has_meshes)
        film.adaptive, _ = self._adaptive_sampling
        film.gradient_domain, _ = self._gradient_domain
        film.is_rare = noise_is_rare(self._decisions())

    @property
    def _adaptive_sampling(self) -> tuple[Literal["auto", "on", "off"], str]:
        """Whether the picture may be sampled adaptively, and why not, where that needs no pilot."""
        impossible = ""
        if self._program().name != PROGRAMS["path"]:
            impossible = f"the integrator is {self.settings.integrator}"
        elif self._has_parts:
            impossible = "the parts of the light are sampled evenly"
        elif self._moments.shutter is not None:
            impossible = "moments are sampled evenly"
        return adaptive_sampling(self.settings, self._expected_spp, self._has_meshes, impossible)

    @property
    def _gradient_domain(self) -> tuple[Literal["auto", "on", "off"], str]:
        """Whether the picture may be made from differences, and why not, where that needs no pilot."""
        height, impossible = 2 * self.settings.height, ""
        if self._program().name != PROGRAMS["path"]:
            impossible = f"the integrator is {self.settings.integrator}"
        elif self._moments.shutter is not None:
            impossible = "moments are of single pixels"
        elif self._has_parts or self.first_sample:
            impossible = "layers of light and parts of the samples are of single pixels"
        elif height > max_size(self.context):
            impossible = f"the GPU holds no texture of twice the height, {height} pixels"
        return gradient_domain(self.settings, self._expected_spp, self._has_meshes, self._decisions(), impossible)

    @property
    def _has_meshes(self) -> bool:
        return bool(self.scene.meshes)

    @property
    def _untraced(self) -> str:
        """Why no light can be traced from the lights; empty if it can."""
        if self._has_parts or self.first_sample:
            return "layers of light and parts of the samples are of paths alone"
        return "this is another program" if self._name is not None or self._defines else ""

    def _read(self) -> Pixels:
        with self._current():
            pixels = self._film.read()
            return pixels if self._light is None else self._light.added_to(pixels)

    @contextmanager
    def _current(self) -> Iterator[None]:
        """Where the context is current, for one thread at a time. Such a block may be in another: several renderers may
        live at once."""
        with self._lock:
            is_outermost = self._scope is None
            if is_outermost:
                self._enter()
            try:
                yield
            finally:
                if is_outermost:
                    self._leave()

    @contextmanager
    def _drawing(self) -> Iterator[None]:
        """The same with the scene on the GPU, which a :meth:`reset` that has failed leaves to be loaded."""
        with self._current():
            if not self._is_loaded:
                self._load()
                self._choose_sampling()
            yield

    @contextmanager
    def _suspended(self) -> Iterator[None]:
        """In such a block, as if it were not there: for functions of the caller's."""
        self._leave()
        try:
            yield
        finally:
            self._enter()

    def _enter(self) -> None:
        self._check_open()
        check_process()
        scope = self.context if self._owns_context else borrowed(self.context)
        scope.__enter__()
        self._scope = scope

    def _leave(self) -> None:
        scope, self._scope = self._scope, None
        if scope is not None:
            scope.__exit__(None, None, None)

    def _check_open(self) -> None:
        if self._is_closed:
            raise FragtracerError("this renderer is closed; make another one")

    def close(self) -> None:
        """Release what is held on the GPU; nothing can be asked of the renderer any more, and to close it again does
        nothing."""
        with self._lock:
            if self._is_closed:
                return
            with self._current():
                self._tracer.release()
                self._film.release()
                self._release_light()
            self._is_closed = True
            if self._owns_context:
                self.context.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def warn_if_dark(scene: Scene) -> None:
    """Warn, by a UserWarning, if ``scene`` has no light."""
    if not scene.has_light:
        mend = "give it a [[light]], [ambient] or [environment], or a material an emission"
        warnings.warn(f"{scene.name}: this scene has no light, and is black: {mend}", stacklevel=3)


def render(
    scene: Scene, size: tuple[int, int] | None = None, spp: int | None = None, **settings: Any
) -> NDArray[np.float32]:
    """Render ``scene`` and return (height, width, 3) float32 linear radiance, row 0 at the top.

    ``size``, ``spp`` and ``settings`` take the place of the scene's own values; see :class:`Renderer`.

    Raises
    ------
    DeviceError, FragtracerError
        As :class:`Renderer`; and if a limit of :meth:`Renderer.render` is given.

    Warns
    -----
    UserWarning
        If the scene has no light.
    """
    if limits := [name for name in ("seconds", "until", "worst") if name in settings]:
        mend = f"with ft.Renderer(scene) as renderer: renderer.render({limits[0]}=...)"
        raise FragtracerError(f"{limits[0]} is a limit of Renderer.render: {mend}")
    if spp is not None:
        settings["spp"] = checked_spp(spp)
    with Renderer(scene, size, **settings) as renderer:
        warn_if_dark(scene)
        return renderer.render()
