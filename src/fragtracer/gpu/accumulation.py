# SPDX-License-Identifier: MIT
"""A picture in progress: passes of samples, everywhere alike or where the error is."""

from collections.abc import Generator, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import fields, replace
from typing import Any, Literal, cast

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import nearest_texture
from fragtracer.gpu.film import Film, read_pixels
from fragtracer.gpu.layers import LayerTextures
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.tracer import Tracer
from fragtracer.resources import folder
from fragtracer.sampling import gradients
from fragtracer.sampling.allocation import (
    FIRST_STAGE,
    LEAST_GAIN,
    MOST_STAGES,
    PILOT_SAMPLES,
    PILOT_STREAM,
    Plan,
    StagePart,
    Stages,
    Window,
    WorkList,
    block_order,
    decision,
    picture_weight,
    pilot_gain,
    pilot_list,
    pilot_rate,
    stage_weight,
    work_list,
)
from fragtracer.sampling.gradients import Gradients, Weights
from fragtracer.sampling.pixels import Floats, Pixels

_PLANNING_STEP = 0.005  # seconds after which one may do something else
_MOST_ITEMS = 1 << 20  # of a list that is drawn at once, so that memory stays bounded
_MOST_PART_ITEMS = 1 << 18  # of a part of a picture
_SPARE = 1.02  # a list may have so many more items than there are pixels
_GATHERED = 100_000  # pixels in a draw that gathers
_LIST_WIDTH, _BLOCK = 1024, 4  # items stand in blocks of 4 x 4 texels, as film/gather.frag reads them
_UNITS = {
    name: unit
    for unit, name in enumerate(
        (
            *("u_film_mean", "u_film_variance", "u_film_half_difference", "u_items"),
            *("u_list_mean", "u_list_variance", "u_list_half_difference", "u_finished"),
        )
    )
}


class Accumulation:
    """Samples of an image of ``width`` x ``height`` pixels.

    If ``adaptive`` is "off", every pixel has as many. If it is "on", the samples of later stages go where the error is
    (:mod:`fragtracer.sampling.allocation`), and if it is "auto", they do where a pilot, whose samples are not in the
    picture, finds that it gains ``least_gain``. ``layers`` are drawn besides, without adaptive sampling. A ``window``
    of the image can be sampled alone, evenly and without layers. ``gradient_domain`` says in the same way whether the
    picture is made from differences of neighbours (:mod:`fragtracer.sampling.gradients`), without layers and windows;
    if that is "auto", where adaptive sampling does not pay. Raises :class:`DeviceError` if the GPU cannot hold it.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        width: int,
        height: int,
        adaptive: Literal["auto", "on", "off"],
        layers: LayerTextures | None = None,
        window: Window | None = None,
        least_gain: float = LEAST_GAIN,
        gradient_domain: Literal["auto", "on", "off"] = "off",
    ) -> None:
        assert window is None or (adaptive == gradient_domain == "off" and layers is None)
        self.size = (width, height) if window is None else (window.width, window.height)
        self.adaptive, self.least_gain, self.gradient_domain = adaptive, least_gain, gradient_domain
        self._ctx = ctx
        self._film = Film(ctx, *self.size, layers)
        self._work = None if window is None else _work_texture(ctx, height, window)
        self._gathering: FullscreenProgram | None = None
        self._stages: _StageTextures | None = None
        self._tilings: _Tilings | None = None
        self._planner = ThreadPoolExecutor(1)  # its thread begins with the first stage that is planned
        self.clear()

    def clear(self) -> None:
        """Forget all samples."""
        self._film.clear()
        self._film.stage = 0
        if self._tilings is not None:
            self._tilings.film.clear()
        width, height = self.size
        self.spp = 0  # samples per pixel, in the mean
        self.pass_rays = 0  # samples per pixel of the pass that is being drawn
        self._in_stage = 0  # samples per pixel, in the mean
        self._gain: float | None = None  # of adaptive sampling, as the pilot says
        self._gradients: Gradients | None = None  # what another pilot says of differences
        self._weights: Weights | None = None  # of this stage; without them, pixels are single
        self._plan: Plan | None = None  # of this stage; without one, each pixel has as many samples
        self._has_short_pass = False  # whether a pass had fewer samples than the plan has
        self._passes = 0  # of the plan that are drawn
        self._in_pass = 0  # samples of an item of the next one that are
        self._lists: list[WorkList] = []  # of the pass that is being drawn
        self._finished = Stages.none(height, width)
        self._sampled = np.zeros(width * height, np.int64)  # samples of each pixel in this stage
        self._sampled_before = self._sampled.copy()

    def bands(self, tracer: Tracer, rays: int, most: int | None, budget: float | None = None) -> Iterator[float]:
        """Draw a pass, as :meth:`Tracer.bands` does; one that was abandoned within a stage goes on where it was.

        It has ``rays`` samples per pixel, or as many as its stage has planned, but no more than ``most``, if given.
        """
        if self._stage_is_full:
            if self._plan is None:
                yield from self._decide(tracer, budget)
            if self._is_of_gradients:
                self._begin_gradients()
            elif not self._stays_even:
                yield from self._begin_stage()
        most = 1 << 30 if most is None else most
        if self._plan is None:
            rays = min(rays, FIRST_STAGE - self._in_stage) if self._has_choice else rays
            film, work, texels = self._drawn
            each = max(1, min(rays // texels, most // texels, tracer.max_rays))
            self.pass_rays = texels * each
            sampled = self._sampled
            try:
                yield from tracer.bands(film, each, budget, work)
            finally:
                if sampled is self._sampled:  # it was not cleared since
                    # Of an abandoned pass, perhaps the first of its parts.
                    drawn = texels * film.samples - self._in_stage
                    self._sampled += drawn
                    self._in_stage += drawn
                    self.spp += drawn
        else:
            if not self._lists:
                self._begin_pass(self._plan, min(self._plan.item_samples, most))
            yield from self._draw(tracer, budget)
            self._has_short_pass |= self.pass_rays < self._plan.item_samples
            passes, self._in_pass = divmod(self._in_pass + self.pass_rays, self._plan.item_samples)
            self._passes += passes
            self._in_stage += self.pass_rays
            self.spp += self.pass_rays

    @property
    def is_uneven(self) -> bool:
        """Whether pixels have different numbers of samples."""
        return self._plan is not None

    @property
    def decision(self) -> str:
        """Whether sampling is adaptive, and why."""
        if self._weights is not None:
            return "off: the picture is made from differences of neighbouring pixels"
        return decision(self.adaptive, self._gain, self.least_gain)

    @property
    def gradient_decision(self) -> str:
        """Whether the picture is made from differences of neighbouring pixels, and why."""
        if self._plan is not None:
            return "off: samples are placed adaptively"
        return gradients.decision(self.gradient_domain, self._gradients, self._is_of_gradients)

    @property
    def _is_of_gradients(self) -> bool:
        """Whether the picture is made from differences, once that is known."""
        return self._gradients is not None and (self.gradient_domain == "on" or self._gradients.pays)

    @property
    def shares_numbers(self) -> bool:
        """Whether neighbouring pixels take the same random numbers."""
        return self._weights is not None

    @property
    def _drawn(self) -> tuple[Film, moderngl.Texture | None, int]:
        """What is drawn where all pixels have as many samples: the film, its work, and how many texels a pixel has."""
        if self._weights is None:
            return self._film, self._work, 1
        if self._tilings is None:
            self._tilings = _Tilings(self._ctx, *self.size)
        return self._tilings.film, self._tilings.work, 2

    @property
    def _stays_even(self) -> bool:
        return self.adaptive == "off" or (self._gain is not None and self._gain < self.least_gain)

    @property
    def _has_choice(self) -> bool:
        """Whether samples after the first stage may be others than more of the same."""
        if self._weights is not None:
            return False
        is_asked = self.gradient_domain != "off" and (self._gradients is None or self._is_of_gradients)
        return is_asked or not self._stays_even

    @property
    def _stage_is_full(self) -> bool:
        if self._plan is None:
            return self._has_choice and self._in_stage >= FIRST_STAGE
        return self._passes == self._plan.passes and self._film.stage + 1 < MOST_STAGES

    def _decide(self, tracer: Tracer, budget: float | None) -> Iterator[float]:
        """Find out what to do after the first stage; yields while pilots do."""
        gain, found = self._gain, self._gradients
        has_tiles = len(pilot_list(*self.size).pixels) > 0
        items: Pixels | None = None
        if self.gradient_domain != "on" and self.adaptive == "auto" and gain is None:
            if has_tiles:
                items = yield from self._pilot(tracer, pilot_list(*self.size), budget)
            gain = pilot_gain(items) if items else 1.0
        is_adaptive = self.adaptive == "on" or (gain is not None and gain >= self.least_gain)
        if self.gradient_domain != "off" and found is None and not is_adaptive:
            found = gradients.UNKNOWN
            if has_tiles:
                paired = yield from self._pilot(tracer, gradients.pilot_list(*self.size), budget)
                found = gradients.pilot_gradients(paired, self._film.read())
            if found.pays and self.gradient_domain == "auto":
                if items is None:
                    items = yield from self._pilot(tracer, pilot_list(*self.size), budget)
                found = replace(found, gain=found.gain * pilot_rate(items) ** 2)
        self._gain, self._gradients = gain, found

    def _pilot(self, tracer: Tracer, work: WorkList, budget: float | None) -> Generator[float, None, Pixels]:
        rows = _rows(len(work.pixels), _LIST_WIDTH)
        pilot = _List(self._ctx, self.size[1], Window(0, 0, *self.size), _LIST_WIDTH, rows)
        try:
            for _ in pilot.trace(tracer, work, PILOT_STREAM, PILOT_SAMPLES, budget):
                yield 0.0
            return pilot.read(len(work.pixels))
        finally:
            pilot.release()

    def pilot(self, tracer: Tracer) -> Pixels:
        """What a pilot finds, (items, 1), of the items of :func:`pilot_list`, of which there must be some."""
        steps = self._pilot(tracer, pilot_list(*self.size), None)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return cast(Pixels, end.value)

    def stage_part(self, tracer: Tracer, part: StagePart) -> Pixels:
        """The film of a part of a stage with more samples, beside the one that is held here; the same bits as if it
        were the whole picture that is sampled."""
        window = part.window
        most = max(1, min(int(part.items.sum()), _MOST_PART_ITEMS))
        stages = _StageTextures(self._ctx, self.size[1], window, most, self._gather)
        try:
            film = Film(self._ctx, window.width, window.height)
            try:
                if part.film is not None:
                    film.write(part.film, 0)
                items, sampled = (counts.ravel().astype(np.int64) for counts in (part.items, part.sampled))
                work = work_list(items, sampled, part.rays, block_order(window.width, window.height))
                for some in work.cut(stages.most_items):
                    for _ in stages.list.trace(tracer, some, part.stage, part.rays, None):
                        pass
                    for _ in stages.gather(film, some, 1.0):
                        pass
                return film.read()
            finally:
                film.release()
        finally:
            stages.release()

    @property
    def _gather(self) -> FullscreenProgram:
        if self._gathering is None:
            self._gathering = FullscreenProgram(self._ctx, folder("shaders"), "film/gather.frag")
            self._gathering.set(_UNITS)
        return self._gathering

    def _stage_textures(self) -> "_StageTextures":
        width, height = self.size
        most = min(int(width * height * _SPARE), _MOST_ITEMS)
        return _StageTextures(self._ctx, height, Window(0, 0, width, height), most, self._gather)

    def _begin_stage(self) -> Iterator[float]:
        """Plan the next stage in a thread, so that a window goes on meanwhile; yields until that is done."""
        stage = self._film.stage + 1
        weight = stage_weight(self._film.stage, self._in_stage)
        planning = self._planner.submit(_planned, self._finished, self._film.read(), weight, stage)
        while not wait([planning], _PLANNING_STEP).done:
            yield 0.0
        self._finished, self._plan, shown = planning.result()
        self._sampled_before += self._sampled
        self._sampled[:] = 0
        self._in_stage = self._passes = self._in_pass = 0
        self._film.clear()
        self._film.stage = stage
        if self._stages is None:
            self._stages = self._stage_textures()
        for _ in self._stages.show(shown):
            yield 0.0

    def _begin_gradients(self) -> None:
        """Go on with samples of pixels that share their random numbers with neighbours."""
        self._finished = self._finished.with_stage(self._film.read(), stage_weight(0, self._in_stage))
        self._sampled_before += self._sampled
        self._sampled[:] = 0
        self._in_stage = 0
        self._weigh()
        film, _, _ = self._drawn
        film.clear()
        film.stage = 1

    def _weigh(self) -> None:
        """By what the first stage has found."""
        assert self._gradients is not None
        variance = self._finished.variance.astype(np.float32)
        self._weights = gradients.film_weights(variance, self._gradients.decorrelation)

    def _begin_pass(self, plan: Plan, rays: int) -> None:
        """The next pass of the plan, or a part of it, of fewer ``rays`` for each item."""
        assert self._stages is not None
        self.pass_rays = rays
        items = plan.items_of_pass(self._passes)
        work = work_list(items, self._sampled, rays, block_order(*self.size))
        self._lists = list(work.cut(self._stages.most_items))

    def _draw(self, tracer: Tracer, budget: float | None) -> Iterator[float]:
        assert self._stages is not None
        here = stage_weight(self._film.stage, self._in_stage + self.pass_rays)
        weight = here / picture_weight(self.spp + self.pass_rays)
        lists = len(self._lists)
        for done in range(lists):
            work = self._lists[0]
            for share in self._stages.list.trace(tracer, work, self._film.stage, self.pass_rays, budget):
                yield (done + share) / lists
            for _ in self._stages.gather(self._film, work, weight):
                yield (done + 1) / lists
            self._sampled += self.pass_rays * np.bincount(work.pixels, minlength=len(self._sampled))
            del self._lists[0]

    def read(self) -> Pixels:
        """The picture so far.

        Raises :class:`DeviceError` if the driver ended paths before their time.
        """
        film, _, _ = self._drawn
        pixels = film.read()
        if self._weights is not None:
            pixels = gradients.picture(*_halves(pixels), self._weights)
        if self._plan is not None or self._weights is not None:
            pixels = self._finished.with_stage(pixels, stage_weight(film.stage, self._in_stage)).pixels()
        found = pixels.mean[..., 3] + pixels.variance[..., 3]
        lost = int((found.ravel() < self._sampled_before + self._sampled).sum())
        if lost:
            raise DeviceError(
                f"the driver ended {lost} pixels' paths early, so the image would be wrong; render with fewer bounces"
            )
        return pixels

    def is_whole(self, most: int) -> bool:
        """Whether the next pass, of ``most`` samples per pixel at most, is one that a longer render would draw, too."""
        return most > 0 and (self._plan is None or most >= self._plan.item_samples)

    @property
    def can_go_on(self) -> bool:
        """Whether more samples would give the picture of a render that was never told to stop."""
        return not self._has_short_pass

    def state(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """All that :meth:`restore` needs to go on with the same bits: numbers, and arrays with row 0 at the top.

        Raises :class:`DeviceError` if what is on the GPU is not what was drawn there.
        """
        drawn, _, texels = self._drawn
        film = drawn.read()
        counts = (film.mean[..., 3] + film.variance[..., 3]).ravel()
        if (counts != np.tile(self._sampled // texels, texels)).any():
            raise DeviceError("the film does not hold the samples that were drawn")
        state: dict[str, Any] = {"spp": self.spp, "gain": self._gain, "in_stage": self._in_stage}
        if self._gradients is not None:
            state |= {"gradients": vars(self._gradients), "is_of_gradients": self._weights is not None}
        arrays: dict[str, NDArray[Any]] = {f"film.{name}": image for name, image in vars(film).items()}
        if self._film.layers is not None:
            arrays["film.layers"] = self._film.layers.read()
        if self._plan is not None or self._weights is not None:
            arrays |= {f"finished.{field.name}": getattr(self._finished, field.name) for field in fields(Stages)}
        if self._plan is not None:
            state |= {"stage": self._film.stage, "passes": self._passes, "pass_rays": self.pass_rays}
            arrays |= {"plan.items": self._plan.items, "sampled": self._sampled, "sampled_before": self._sampled_before}
            for name in ("pixels", "first"):
                parts = [getattr(work, name) for work in self._lists]
                arrays[f"list.{name}"] = np.concatenate([np.zeros(0, np.int64), *parts])
        return state, arrays

    def restore(self, state: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what :meth:`state` has returned for a picture of this size; raises KeyError where it is not."""
        self.clear()
        film = Pixels(*(arrays[f"film.{field.name}"] for field in fields(Pixels)))
        self.spp, self._gain, self._in_stage = state["spp"], state["gain"], state["in_stage"]
        if "gradients" in state:
            self._gradients = Gradients(**state["gradients"])
        if "finished.mean" in arrays:
            self._finished = Stages(*(arrays[f"finished.{field.name}"] for field in fields(Stages)))
        if "stage" not in state:
            self._sampled += self._in_stage
            self._sampled_before += self.spp - self._in_stage
            if state.get("is_of_gradients"):
                self._weigh()
            drawn, _, texels = self._drawn
            drawn.write(film, self._in_stage // texels)
            drawn.stage = int(self._weights is not None)
            if self._film.layers is not None:
                self._film.layers.write(arrays["film.layers"])
            return
        self._film.write(film, 0)
        self._film.stage, self._passes, self.pass_rays = state["stage"], state["passes"], state["pass_rays"]
        self._plan = Plan(self._film.stage, arrays["plan.items"])
        self._sampled, self._sampled_before = arrays["sampled"], arrays["sampled_before"]
        if self._stages is None:
            self._stages = self._stage_textures()
        for _ in self._stages.show(_texels(self._finished)):
            pass
        self._lists = list(WorkList(arrays["list.pixels"], arrays["list.first"]).cut(self._stages.most_items))

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """``rows`` rows of the picture from ``bottom`` (0 is the lowest) upwards, to be shown: the error is that of the
        finished stages, diluted by this one."""
        return self._film.read_rows(bottom, rows) if self._plan is None else self._shown.read_rows(bottom, rows)

    @property
    def textures(self) -> tuple[moderngl.Texture, ...]:
        """The picture to be shown, in the order of :class:`Pixels`; row 0 at the bottom."""
        return self._film.textures if self._plan is None else self._shown.textures

    @property
    def _shown(self) -> "_StageTextures":
        assert self._stages is not None
        return self._stages

    def warm_up(self, tracer: Tracer) -> None:
        """Have the driver do now what it defers to the first draw."""
        tracer.warm_up(self._film)

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures."""
        work = 8 * self.size[0] * self.size[1] if self._work else 0
        return self._film.gpu_bytes + work + sum(part.gpu_bytes for part in (self._stages, self._tilings) if part)

    def release(self) -> None:
        self._planner.shutdown(wait=False, cancel_futures=True)
        self._film.release()
        if self._work is not None:
            self._work.release()
        if self._tilings is not None:
            self._tilings.release()
        if self._stages is not None:
            self._stages.release()
        if self._gathering is not None:
            self._gathering.release()


def _planned(finished: Stages, pixels: Pixels, weight: float, stage: int) -> tuple[Stages, Plan, list[Floats]]:
    """All stages, with one more of ``pixels``, the plan of the next, and the texels of :meth:`_StageTextures.show`."""
    together = finished.with_stage(pixels, weight)
    height, width, _ = together.mean.shape
    block_order(width, height)  # remembered
    return together, Plan.by(stage, together.deviation()), _texels(together)


def _texels(stages: Stages) -> list[Floats]:
    shown = stages.pixels()
    half_difference = np.pad(shown.half_difference, [(0, 0), (0, 0), (0, 1)])
    return [np.ascontiguousarray(image[::-1]) for image in (shown.mean, shown.variance, half_difference)]


def _halves(pixels: Pixels) -> tuple[Pixels, Pixels]:
    """What :class:`_Tilings` hold: the film with aligned blocks, and that with shifted ones."""
    upper, lower = (
        Pixels(*parts) for parts in zip(*(np.split(image, 2) for image in vars(pixels).values()), strict=True)
    )
    return lower, upper


def _work_texture(ctx: moderngl.Context, image_height: int, window: Window) -> moderngl.Texture:
    """Film texels as items of a list, each of its pixel in the window (film/work.glsl)."""
    x, y = np.arange(window.width), image_height - window.top - window.height + np.arange(window.height)
    texels = np.empty((window.height, window.width, 2), np.uint32)
    texels[..., 0] = y[:, None] << 16 | x + window.left
    texels[..., 1] = window.first_sample
    return nearest_texture(ctx, (window.width, window.height), 2, texels.tobytes(), "u4")


class _Tilings:
    """An image twice: below, samples that take the random numbers of aligned blocks of pixels, and above it of shifted
    ones (:mod:`fragtracer.sampling.gradients`)."""

    def __init__(self, ctx: moderngl.Context, width: int, height: int) -> None:
        self.film = Film(ctx, width, 2 * height)
        texels = np.zeros((2, height, width, 2), np.uint32)
        texels[..., 0] = np.arange(height)[:, None] << 16 | np.arange(width)
        texels[..., 0] |= np.array([gradients.ALIGNED, gradients.SHIFTED], np.uint32)[:, None, None]
        self.work = nearest_texture(ctx, (width, 2 * height), 2, texels.tobytes(), "u4")

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures."""
        width, height = self.film.size
        return self.film.gpu_bytes + 8 * width * height

    def release(self) -> None:
        self.film.release()
        self.work.release()


class _List:
    """A list of work and its film, of ``width`` x ``height`` items in blocks of 4 x 4 texels, for the pixels of a
    window of an image of ``image_height`` pixels."""

    def __init__(self, ctx: moderngl.Context, image_height: int, window: Window, width: int, height: int) -> None:
        self._ctx, self._image_height, self._window = ctx, image_height, window
        self.film = Film(ctx, width, height)

    def trace(self, tracer: Tracer, work: WorkList, stage: int, rays: int, budget: float | None) -> Iterator[float]:
        """Sample the items, ``rays`` times each; yields the share that is done."""
        width, _ = self.film.size
        y, x = np.divmod(work.pixels, self._window.width)
        rows = _rows(len(x), width)
        texels = np.zeros((rows * width, 2), np.uint32)
        texels[: len(x), 0] = (self._image_height - 1 - self._window.top - y) << 16 | x + self._window.left
        if work.numbers is not None:
            texels[: len(x), 0] |= work.numbers
        texels[: len(x), 1] = work.first
        blocks = texels.reshape(rows // _BLOCK, width // _BLOCK, _BLOCK, _BLOCK, 2).swapaxes(1, 2)
        texture = nearest_texture(self._ctx, (width, rows), 2, np.ascontiguousarray(blocks).tobytes(), "u4")
        self.film.clear()
        self.film.stage = stage
        try:
            yield from tracer.bands(self.film, rays, budget, texture)
        finally:
            texture.release()

    def read(self, items: int) -> Pixels:
        """What the first ``items`` have found, (items, 1)."""
        width, height = self.film.size
        pixels = self.film.read()

        def listed(values: Floats) -> Floats:
            blocks = values[::-1].reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK, -1).swapaxes(1, 2)
            return blocks.reshape(width * height, 1, -1)[:items]

        return Pixels(listed(pixels.mean), listed(pixels.variance), listed(pixels.half_difference))

    def release(self) -> None:
        self.film.release()


class _StageTextures:
    """What stages of a window need besides the film of this one: the finished ones, the picture to be shown, and a list
    of work, of ``most`` items. ``gather`` is the program of film/gather.frag."""

    def __init__(
        self, ctx: moderngl.Context, image_height: int, window: Window, most: int, gather: FullscreenProgram
    ) -> None:
        width, height = window.width, window.height
        self._ctx, self._size, self._gather = ctx, (width, height), gather
        self.list = _List(ctx, image_height, window, _LIST_WIDTH, _rows(most, _LIST_WIDTH))
        self._owned: list[moderngl.Texture] = []
        try:
            self._finished = self._texture(4, "f4")
            self.textures = tuple(self._texture(4, "f4") for _ in range(3))
            self._items = self._texture(2, "u4")
        except moderngl.Error as error:
            self.release()
            _ = ctx.error  # takes the driver's own note of it away
            raise DeviceError(f"the GPU has no memory for adaptive sampling of {width}x{height}: {error}") from None
        self._framebuffer = ctx.framebuffer(self.textures)

    def _texture(self, components: int, dtype: str) -> moderngl.Texture:
        texture = nearest_texture(self._ctx, self._size, components, dtype=dtype)
        self._owned.append(texture)
        return texture

    @property
    def most_items(self) -> int:
        """Items of a list that is drawn at once."""
        width, height = self.list.film.size
        return width * height

    def show(self, texels: list[Floats]) -> Iterator[None]:
        """Begin a stage after those whose picture is ``texels``, in the order of :class:`Pixels`; an upload a step."""
        for texture, image in zip((self._finished, *self.textures), (texels[0], *texels), strict=True):
            texture.write(image)
            yield

    def gather(self, film: Film, work: WorkList, weight: float) -> Iterator[None]:
        """Add the sampled items to the film of this stage, whose weight in the picture is ``weight``, a band of rows
        at a time."""
        width, height = self._size
        items = np.zeros((width * height, 2), np.uint32)
        first = np.flatnonzero(np.diff(work.pixels, prepend=-1))
        items[work.pixels[first]] = np.stack([first, np.diff(first, append=len(work.pixels))], axis=1)
        self._items.write(np.ascontiguousarray(items.reshape(height, width, 2)[::-1]).tobytes())
        picture, *_ = self.textures
        framebuffer = self._ctx.framebuffer([*film.back_textures, picture])
        read = (*film.textures, self._items, *self.list.film.textures, self._finished)
        rows = max(1, _GATHERED // width)
        try:
            for bottom in range(0, height, rows):
                for unit, texture in enumerate(read):
                    texture.use(unit)
                framebuffer.use()
                framebuffer.scissor = (0, bottom, width, min(rows, height - bottom))
                self._gather.set({"u_stage_weight": weight})
                self._gather.draw()
                self._ctx.finish()
                yield
        finally:
            self._ctx.detect_framebuffer(0).use()  # moderngl would bind the released one again
            framebuffer.release()
        film.swap(0)

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """As :meth:`Film.read_rows`, of the picture to be shown."""
        return read_pixels(self._framebuffer, bottom, rows)

    @property
    def gpu_bytes(self) -> int:
        """Size of all textures, without the list of a pass."""
        width, height = self._size
        return self.list.film.gpu_bytes + (4 * 16 + 8) * width * height

    def release(self) -> None:
        self._ctx.detect_framebuffer(0).use()
        self._framebuffer.release()
        for texture in self._owned:
            texture.release()
        self.list.release()


def _rows(items: int, width: int) -> int:
    """Of ``width`` texels, for so many items."""
    return -(-items // (width * _BLOCK)) * _BLOCK
