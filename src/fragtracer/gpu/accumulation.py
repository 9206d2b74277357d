# SPDX-License-Identifier: MIT
"""A picture in progress: passes of samples, everywhere alike or where the error is."""

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import fields
from typing import Any, Literal, cast

import moderngl
import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import DeviceError
from fragtracer.gpu.film import Film
from fragtracer.gpu.layers import LayerTextures
from fragtracer.gpu.pilots import PilotTracer
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.tracer import CUT_SHORT, Tracer
from fragtracer.gpu.work import StageTextures, Tilings, work_texture
from fragtracer.resources import folder
from fragtracer.sampling import gradients
from fragtracer.sampling.allocation import (
    FIRST_STAGE,
    LEAST_GAIN,
    MOST_STAGES,
    Plan,
    StagePart,
    Stages,
    Window,
    WorkList,
    block_order,
    decision,
    picture_weight,
    stage_weight,
    work_list,
)
from fragtracer.sampling.gradients import Gradients, Weights
from fragtracer.sampling.pilot import Pilot, tiles_of
from fragtracer.sampling.pixels import Floats, Pixels

_PLANNING_STEP = 0.005  # seconds after which one may do something else
_MOST_ITEMS = 1 << 20  # of a list that is drawn at once, so that memory stays bounded
_MOST_PART_ITEMS = 1 << 18  # of a part of a picture
_SPARE = 1.02  # a list may have so many more items than there are pixels
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

    If :attr:`adaptive` is "off", every pixel has as many. If it is "on", the samples of later stages go where the error
    is (:mod:`fragtracer.sampling.allocation`), and if it is "auto", they do where a pilot, whose samples are not in the
    picture, finds that it gains :attr:`least_gain`. :attr:`gradient_domain` says in the same way whether the picture is
    made from differences of neighbours (:mod:`fragtracer.sampling.gradients`), without layers and windows; where both
    pay, what is farther above its least gain. ``layers`` are drawn besides, without adaptive sampling. A ``window`` of
    the image can be sampled alone, evenly and without layers. Raises :class:`DeviceError` if the GPU cannot hold it.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        width: int,
        height: int,
        adaptive: Literal["auto", "on", "off"],
        layers: LayerTextures | None = None,
        window: Window | None = None,
    ) -> None:
        assert window is None or (adaptive == "off" and layers is None)
        self.size = (width, height) if window is None else (window.width, window.height)
        self.adaptive = adaptive
        self.gradient_domain: Literal["auto", "on", "off"] = "off"
        self.least_gain = LEAST_GAIN
        self.is_rare = False  # whether what noise there is comes of rare, bright samples, which a short pilot may miss
        self._ctx = ctx
        self._film = Film(ctx, *self.size, layers)
        self._work = None if window is None else work_texture(ctx, height, window)
        self._gathering: FullscreenProgram | None = None
        self._stages: StageTextures | None = None
        self._tilings: Tilings | None = None
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
        self._in_pass = 0  # samples per pixel, in the mean, of the next one that are
        self._lists: list[WorkList] = []  # of the pass that is being drawn
        self._item_rays = 0  # samples of an item of theirs
        self._finished = Stages.none(height, width)
        self._sampled = np.zeros(width * height, np.int64)  # samples of each pixel in this stage
        self._sampled_before = self._sampled.copy()

    def bands(self, tracer: Tracer, rays: int, most: int | None, budget: float | None = None) -> Iterator[float]:
        """Draw a pass, as :meth:`Tracer.bands` does; one that was abandoned within a stage goes on where it was.

        It has ``rays`` samples per pixel, of each tiling where the picture is made from differences, or as many as its
        stage has planned, but no more than ``most``, if given.
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
            each = max(1, min(rays, most // texels, tracer.max_rays))
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
        if self.adaptive == "auto" and self._gain is None and self._is_left_even:
            return "off: as it was begun"
        return decision(self.adaptive, self._gain, self.least_gain)

    @property
    def gradient_decision(self) -> str:
        """Whether the picture is made from differences of neighbouring pixels, and why."""
        if self._plan is not None:
            return "off: samples are placed adaptively"
        if self.gradient_domain == "auto" and self._gradients is None and self._is_left_even:
            return "off: as it was begun"
        return gradients.decision(self.gradient_domain, self._gradients, self._is_of_gradients)

    @property
    def _is_left_even(self) -> bool:
        """Whether it has gone on evenly after the first stage, and will."""
        return self._plan is None and self._weights is None and self._in_stage > FIRST_STAGE

    @property
    def _is_of_gradients(self) -> bool:
        """Whether the picture is made from differences, once that is known."""
        if self._plan is not None:
            return False
        if self._gradients is None or self.gradient_domain == "on":
            return self._gradients is not None
        return self._gradients.pays and self._gradients.gain >= self._least_of_gradients(self._gain)

    def _least_of_gradients(self, gain: float | None) -> float:
        """The least gain by differences where adaptive sampling promises another: as far above their own least gain."""
        return gradients.LEAST_GAIN * max(1.0, (gain or 0.0) / self.least_gain)

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
            self._tilings = Tilings(self._ctx, *self.size)
        return self._tilings.film, self._tilings.work, 2

    @property
    def _stays_even(self) -> bool:
        return self.adaptive == "off" or (self._gain is not None and self._gain < self.least_gain)

    @property
    def _has_choice(self) -> bool:
        """Whether samples after the first stage may be others than more of the same."""
        if self._weights is not None or self._is_left_even:
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
        asks_adaptive = self.adaptive == "auto" and gain is None and self.gradient_domain != "on"
        asks_gradients = self.gradient_domain != "off" and found is None and self.adaptive != "on"
        if asks_adaptive:
            gain = 1.0
        if asks_gradients:
            found = gradients.UNKNOWN
        if (asks_adaptive or asks_gradients) and tiles_of(*self.size):
            pilots = PilotTracer(self._ctx, self.size, tracer, budget)
            tiles = pilots.tiles(self.least_gain, self.is_rare) if asks_adaptive else pilots.first_tiles()
            pilot = Pilot.of((yield from tiles), *self.size)
            if asks_adaptive:
                gain = pilot.gain()
            if asks_gradients:
                found = yield from pilots.gradients(pilot, self._least_of_gradients(gain))
        self._gain, self._gradients = gain, found

    def pilot(self, tracer: Tracer) -> Pixels:
        """The items of :meth:`Pilot.of`, for an image that has tiles."""
        steps = PilotTracer(self._ctx, self.size, tracer).tiles(self.least_gain, self.is_rare)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return cast(Pixels, end.value)

    def stage_part(self, tracer: Tracer, part: StagePart) -> Pixels:
        """The film of a part of a stage with more samples, beside the one that is held here; the same bits as if it
        were the whole picture that is sampled."""
        window = part.window
        most = max(1, min(max(int(items.sum()) for items, _ in part.work), _MOST_PART_ITEMS))
        stages = StageTextures(self._ctx, self.size[1], window, most, self._gather)
        try:
            film = Film(self._ctx, window.width, window.height)
            try:
                if part.film is not None:
                    film.write(part.film, 0)
                sampled, order = part.sampled.ravel().astype(np.int64), block_order(window.width, window.height)
                for counts, rays in part.work:
                    items = counts.ravel().astype(np.int64)
                    for some in work_list(items, sampled, rays, order).cut(stages.most_items):
                        for _ in stages.list.trace(tracer, some, part.stage, rays, None):
                            pass
                        for _ in stages.gather(film, some, 1.0):
                            pass
                    sampled += rays * items
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

    def _stage_textures(self) -> "StageTextures":
        width, height = self.size
        most = min(int(width * height * _SPARE), _MOST_ITEMS)
        return StageTextures(self._ctx, height, Window(0, 0, width, height), most, self._gather)

    def _begin_stage(self) -> Iterator[float]:
        """Plan the next stage in a thread, so that a window goes on meanwhile; yields until that is done."""
        if self._stages is None:
            self._stages = self._stage_textures()
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
        """The next pass of the plan, or a part of it, of fewer ``rays`` per pixel, in the mean."""
        assert self._stages is not None
        self.pass_rays = rays
        ((items, self._item_rays),) = plan.work(self._passes, 1, rays)
        work = work_list(items, self._sampled, self._item_rays, block_order(*self.size))
        self._lists = list(work.cut(self._stages.most_items))

    def _draw(self, tracer: Tracer, budget: float | None) -> Iterator[float]:
        assert self._stages is not None
        here = stage_weight(self._film.stage, self._in_stage + self.pass_rays)
        weight = here / picture_weight(self.spp + self.pass_rays)
        lists = len(self._lists)
        for done in range(lists):
            work = self._lists[0]
            for share in self._stages.list.trace(tracer, work, self._film.stage, self._item_rays, budget):
                yield (done + share) / lists
            for _ in self._stages.gather(self._film, work, weight):
                yield (done + 1) / lists
            self._sampled += self._item_rays * np.bincount(work.pixels, minlength=len(self._sampled))
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
        lost = int(are_fewer(found.ravel(), self._sampled_before + self._sampled).sum())
        if lost:
            raise DeviceError(f"the image would be wrong: paths of {lost} pixels {CUT_SHORT}")
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
            state["item_rays"] = self._item_rays
            arrays |= {"plan.first": self._plan.first, "plan.items": self._plan.items}
            arrays |= {"sampled": self._sampled, "sampled_before": self._sampled_before}
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
        self._item_rays = state["item_rays"]
        self._plan = Plan(self._film.stage, arrays["plan.first"], arrays["plan.items"])
        self._sampled, self._sampled_before = arrays["sampled"], arrays["sampled_before"]
        if self._stages is None:
            self._stages = self._stage_textures()
        for _ in self._stages.show(_texels(self._finished.pixels())):
            pass
        self._lists = list(WorkList(arrays["list.pixels"], arrays["list.first"]).cut(self._stages.most_items))

    def read_rows(self, bottom: int, rows: int) -> Pixels:
        """``rows`` rows of the picture from ``bottom`` (0 is the lowest) upwards, to be shown: the error is that of the
        finished stages, diluted by this one."""
        return self._film.read_rows(bottom, rows) if self._plan is None else self._shown.read_rows(bottom, rows)

    @property
    def version(self) -> object:
        """Changes with what the :attr:`textures` hold."""
        return self._film.stage, self.spp, self._film.samples, len(self._lists)

    @property
    def textures(self) -> tuple[moderngl.Texture, ...]:
        """The picture to be shown, in the order of :class:`Pixels`; row 0 at the bottom."""
        return self._film.textures if self._plan is None else self._shown.textures

    @property
    def _shown(self) -> "StageTextures":
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


def are_fewer(found: NDArray[np.float32], drawn: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Where fewer samples were found than drawn, as far as float32 tells them, which counts to 2^24."""
    return np.asarray(found < drawn.astype(np.float32))


def _planned(finished: Stages, pixels: Pixels, weight: float, stage: int) -> tuple[Stages, Plan, list[Floats]]:
    """All stages, with one more of ``pixels``, the plan of the next, and the texels of :meth:`StageTextures.show`."""
    together = finished.with_stage(pixels, weight)
    height, width, _ = together.mean.shape
    block_order(width, height)  # remembered
    shown = together.pixels()
    return together, Plan.by(stage, together.deviation(shown)), _texels(shown)


def _texels(shown: Pixels) -> list[Floats]:
    half_difference = np.pad(shown.half_difference, [(0, 0), (0, 0), (0, 1)])
    return [np.ascontiguousarray(image[::-1]) for image in (shown.mean, shown.variance, half_difference)]


def _halves(pixels: Pixels) -> tuple[Pixels, Pixels]:
    """What :class:`Tilings` hold: the film with aligned blocks, and that with shifted ones."""
    upper, lower = (
        Pixels(*parts) for parts in zip(*(np.split(image, 2) for image in vars(pixels).values()), strict=True)
    )
    return lower, upper
