# SPDX-License-Identifier: MIT
"""What is made of what workers return, by workers of this process that draw nothing but grey."""

import concurrent.futures
import gc
import weakref
from collections import Counter
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from fragtracer.apps import cluster
from fragtracer.apps.cli.keeping import Keeping
from fragtracer.apps.cluster import picture, work
from fragtracer.apps.cluster.guard import loads
from fragtracer.apps.cluster.work import Block, Frame, Part, pixels_digest
from fragtracer.apps.cluster.worker import Rendered
from fragtracer.errors import DeviceError, FragtracerError
from fragtracer.films import SavedFilm, origin_of
from fragtracer.io.toml import load
from fragtracer.sampling.pixels import Pixels

pytest.importorskip("distributed", reason="Dask is not installed")
workers = pytest.importorskip("fragtracer.apps.cluster.workers")

A, B, C = NAMES = ("tcp://a:1", "tcp://b:1", "tcp://c:1")


class Asked(NamedTuple):
    address: str
    frame: Frame | None
    part: Part


def drawn(part) -> Pixels:
    """Samples of mean and variance 1, with a noise that depends on the pixel and its samples alone."""
    shape = part.window.height, part.window.width, 1
    is_block = isinstance(part, Block)
    counts = np.full(shape, part.spp) if is_block else part.samples[..., None]
    rng = np.random.default_rng([is_block, part.window.first_sample if is_block else part.stage])
    noise = rng.standard_normal((24, 40, 3))[work.at(part.window)] / np.sqrt(counts - 1)
    ones = np.ones_like(noise)
    images = np.dstack([ones, counts]), np.dstack([ones, 0 * counts]), noise
    return Pixels(*(image.astype(np.float32) for image in images))


@cache
def origin_of_content(content: bytes, seed: int | None) -> dict[str, str]:
    scene = loads(content)
    return origin_of(scene, scene.render if seed is None else replace(scene.render, seed=seed))


class InProcess(workers.Workers):
    """Three workers that draw what they are given at once; ``returned`` is what becomes of it on the way back."""

    @staticmethod
    def returned(_, rendered):
        return rendered

    def greet(self, _) -> None: ...

    def known(self):
        return NAMES

    def _send_scene(self, _):
        future = concurrent.futures.Future()
        future.set_result("the scene")
        return future

    def submit(self, address, key, frame, part, priority=0):
        pixels, origin = drawn(part), origin_of_content(self._content, frame and frame.seed)
        rendered = Rendered(pixels, pixels_digest(pixels), 0.01, "", "a driver", origin)
        future = concurrent.futures.Future()
        future.key = str(id(future))
        try:
            future.set_result(self.returned(Asked(address, frame, part), rendered))
        except Exception as error:
            future.set_exception(error)
        return future

    def fetch(self, future):
        return future


@pytest.fixture(autouse=True)
def _in_process(monkeypatch):
    monkeypatch.setattr(work, "TILE", 16)
    monkeypatch.setattr("fragtracer.apps.cluster.dispatch.Workers", InProcess)


@pytest.fixture
def returning(monkeypatch):
    """Has workers return what a function makes of what they were asked for, and of what they have rendered."""
    return lambda change: monkeypatch.setattr(InProcess, "returned", staticmethod(change))


def scene(adaptive="off"):
    loaded = load("three-spheres-ambient")
    return replace(loaded, render=replace(loaded.render, width=40, height=24, adaptive=adaptive))


def render(of, progress=None, **options):
    """Without a loop that never ends."""
    reports = []

    def report(state) -> None:
        reports.append(state)
        assert len(reports) < 100, "it does not end"
        if progress is not None:
            progress(state)

    return cluster.render(of, None, progress=report, block=32, **options)


def same(one, other) -> bool:
    pairs = zip(vars(one.pixels).values(), vars(other.pixels).values(), strict=True)
    return all(np.array_equal(first, second) for first, second in pairs)


@pytest.mark.parametrize("limit", [{"spp": 128}, {"until": 0.1}], ids=str)
def test_nothing_is_added_to_a_checkpoint_that_is_finished(tmp_path, limit) -> None:
    kept = Keeping(tmp_path, 3600, False)
    before = render(scene("on"), begin=kept.begin, **limit)
    again = render(scene("on"), begin=replace(kept, resume=True).begin, **limit)
    assert again.tasks == 0
    assert same(before, again)
    assert again.metadata == before.metadata


def test_a_checkpoint_that_is_finished_goes_on_to_less_error(tmp_path) -> None:
    """With the bits of a render that was asked for it at once; so does one of an earlier version, which does not say
    that it is finished."""
    kept, path = Keeping(tmp_path, 3600, False), tmp_path / "film.npz"
    again = replace(kept, resume=True).begin
    render(scene("on"), until=0.1, begin=kept.begin)
    film = SavedFilm.read(path)
    assert same(render(scene("on"), until=0.05, begin=again), render(scene("on"), until=0.05))
    state = {name: value for name, value in film.state.items() if name not in ("error", "authors", "checked")}
    replace(film, state=state).write(path)
    longer = render(scene("on"), until=0.1, begin=again)
    assert longer.tasks > 0
    assert longer.metadata["gl_renderer"] == "a driver"


def test_a_short_picture_asks_no_pilot_and_goes_on_evenly(tmp_path) -> None:
    kept = Keeping(tmp_path, 3600, False)
    short = render(scene("auto"), spp=48, begin=kept.begin)
    assert "the 48 samples per pixel are too few" in short.metadata["adaptive_decision"]
    longer = render(scene("auto"), spp=128, begin=replace(kept, resume=True).begin)
    assert longer.metadata["adaptive_decision"] == "off: as it was begun"
    assert (longer.pixels.mean[..., 3] == 128).all()


@pytest.fixture
def _no_collector():
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("_no_collector")
@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_frames_that_are_written_are_let_go(monkeypatch, returning, adaptive) -> None:
    """At once. A worker that is found out later is known to have had a part in them."""
    alive, written, found, before = weakref.WeakSet(), [], [], []
    init = picture.Render.__init__

    def count(self, *arguments) -> None:
        init(self, *arguments)
        alive.add(self.sampling)

    def shorten_at_last(task, rendered):
        if task.address == B and len(written) >= 9:
            before.append(len(written))
            return replace(rendered, pixels=work.empty(1, 1))
        return rendered

    def write(number, _) -> None:
        found.append(len(alive))
        written.append(number)

    monkeypatch.setattr(picture.Render, "__init__", count)
    returning(shorten_at_last)
    frames = {number: scene(adaptive) for number in range(12)}
    counts = []
    with (
        pytest.warns(UserWarning, match=f"the worker {B} is not used any more"),
        pytest.warns(UserWarning, match=f"frames that are written have parts of {B}") as warned,
    ):
        cluster.render_frames(
            scene(), frames, None, write, until=0.2, block=32, progress=lambda state: counts.append(state.spp)
        )
    assert written == list(range(12))
    assert max(found) <= 6, found
    assert any(str(one.message).startswith(f"{before[0]} frames") for one in warned)
    assert max(counts) > 11 * 32


def test_tries_of_a_frame_are_none_of_another(returning) -> None:
    """That has taken its place in memory."""
    tries = Counter()

    def fail_three_times(task, rendered):
        tries[task.frame, task.part] += 1
        if tries[task.frame, task.part] <= 3:
            raise DeviceError("not now")
        return rendered

    returning(fail_three_times)
    frames = {n: replace(scene(), render=replace(scene().render, seed=n)) for n in range(12)}
    cluster.render_frames(scene(), frames, None, lambda *_: gc.collect(), spp=32, block=32)
    assert len(tries) == 12 * 6


def version_of_another(_, rendered):
    return replace(rendered, origin=rendered.origin | {"version": "0.0.1"})


def cannot_render(_, __):
    raise DeviceError("there is no OpenGL")


def cannot_import(_, __):
    raise ModuleNotFoundError("No module named 'fragtracer'")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (version_of_another, r"it would render another picture: version is 0\.0\.1 there"),
        (cannot_render, "it cannot render: there is no OpenGL"),
        (cannot_import, "it cannot render: No module named 'fragtracer'"),
    ],
)
def test_a_worker_that_does_not_fit_is_left(returning, change, why) -> None:
    """Also where it is the one that is asked first."""
    right = render(scene(), spp=256)
    for bad in (A, B):
        returning(lambda task, rendered, bad=bad: change(task, rendered) if task.address == bad else rendered)
        with pytest.warns(UserWarning, match=f"the worker {bad} is not used any more: {why}") as warned:
            found = render(scene(), spp=256)
        assert len(warned) == 1
        assert same(found, right)
        assert found.metadata["banned_workers"].startswith(bad)


def test_where_no_worker_can_render_all_are_told_of(returning, monkeypatch) -> None:
    monkeypatch.setattr(workers, "_GLANCE", 0)
    returning(cannot_render)
    with (
        pytest.warns(UserWarning, match="is not used any more: it cannot render"),
        pytest.raises(FragtracerError, match="no worker of the cluster is left to render") as error,
    ):
        render(scene(), spp=128)
    assert all(f"{name}: it cannot render: there is no OpenGL" in str(error.value) for name in NAMES)


@pytest.mark.parametrize("wrong", ["size", "colours"])
def test_a_faulty_worker_cannot_blame_another(returning, wrong) -> None:
    def blame(task, rendered):
        if task.address != B:
            return rendered
        pixels = work.empty(1, 1)
        if wrong == "colours":
            pixels = replace(rendered.pixels, half_difference=2 * rendered.pixels.half_difference)
        return replace(rendered, worker=A, pixels=pixels, digest=pixels_digest(pixels))

    right = render(scene(), spp=128)
    returning(blame)
    with pytest.warns(UserWarning, match=f"the worker {B} is not used any more"):
        found = render(scene(), spp=128)
    assert found.metadata["banned_workers"].startswith(B)
    assert A not in found.metadata["banned_workers"]
    assert same(found, right)


def test_workers_have_the_addresses_that_the_scheduler_knows(returning) -> None:
    """Though Dask may tell a worker another name of its own."""
    returning(lambda _, rendered: replace(rendered, worker="tcp://localhost:1"))
    assert render(scene(), spp=128).metadata["workers"] == "3"


def test_the_third_opinion_is_named_by_its_address(returning) -> None:
    def disagree(task, rendered):
        change = 1 + NAMES.index(task.address)
        pixels = replace(rendered.pixels, half_difference=change * rendered.pixels.half_difference)
        return replace(rendered, worker="tcp://z:1", pixels=pixels, digest=pixels_digest(pixels))

    returning(disagree)
    problem = render(scene(), spp=128).problem
    assert "each render another picture" in problem
    assert all(name in problem for name in NAMES)


@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_a_picture_that_goes_on_tells_who_began_it(tmp_path, returning, adaptive) -> None:
    """And warns, once, of a driver that is another one."""

    def stop(state) -> None:
        if state.spp >= 32:
            raise KeyboardInterrupt

    kept = Keeping(tmp_path, 3600, False)
    again = replace(kept, resume=True).begin
    before = render(scene(adaptive), stop, spp=512, begin=kept.begin)
    assert before.metadata["workers"] == "3"
    checked = int(before.metadata["checked_blocks"])
    assert checked > 0
    same_driver = render(scene(adaptive), stop, spp=512, begin=again)
    assert same_driver.metadata["gl_renderer"] == "a driver"
    returning(lambda _, rendered: replace(rendered, driver="another driver"))
    with pytest.warns(UserWarning, match="was rendered by a driver, and goes on with another driver") as warned:
        after = render(scene(adaptive), spp=512, begin=again)
    assert len(warned) == 1
    assert after.metadata["gl_renderer"] == "a driver, another driver"
    assert after.metadata["workers"] == "3"
    assert int(after.metadata["checked_blocks"]) > checked
    film = SavedFilm.read(tmp_path / "film.npz")
    assert film.driver == "a driver, another driver"


def test_who_has_no_part_any_more_is_not_told_of(tmp_path, returning) -> None:
    """Where one that has had a part in a stage is found out later, and all is rendered again."""

    def spoil_later(task, rendered):
        is_spoilt = task.address == B and task.part.stage == 3
        return replace(rendered, driver="another driver", pixels=work.empty(1, 1) if is_spoilt else rendered.pixels)

    def stop(state) -> None:
        if state.spp >= 32:
            raise KeyboardInterrupt

    kept = Keeping(tmp_path, 3600, False)
    right = render(scene("on"), spp=2048)
    render(scene("on"), stop, spp=2048, begin=kept.begin)
    returning(spoil_later)
    with (
        pytest.warns(UserWarning, match=f"the worker {B} is not used any more"),
        pytest.warns(UserWarning, match="goes on with another driver"),
    ):
        found = render(scene("on"), spp=2048, begin=replace(kept, resume=True).begin)
    assert (found.metadata["gl_renderer"], found.metadata["workers"]) == ("another driver", "2")
    assert same(found, right)


@pytest.fixture
def begun(tmp_path, monkeypatch, returning):
    """Begins a render in which all of B's parts are wrong, and nobody checks that; ends it with a checkpoint of its
    middle, from which the returned one goes on. B is found out at its next part."""

    def begin(start):
        with monkeypatch.context() as unchecked:
            unchecked.setattr(InProcess, "other", lambda *_: None)
            returning(lambda task, rendered: darkened(rendered) if task.address == B else rendered)
            start(Keeping(tmp_path, 3600, False).begin)
        returning(lambda task, rendered: replace(rendered, pixels=work.empty(1, 1)) if task.address == B else rendered)
        return Keeping(tmp_path, 3600, True).begin

    return begin


def darkened(rendered):
    mean = rendered.pixels.mean * np.float32([0.5, 0.5, 0.5, 1])
    pixels = replace(rendered.pixels, mean=mean)
    return replace(rendered, pixels=pixels, digest=pixels_digest(pixels))


def stop(state) -> None:
    if state.spp >= 100:
        raise KeyboardInterrupt


@pytest.mark.parametrize("knows_authors", [True, False], ids=["now", "earlier version"])
@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_parts_of_a_checkpoint_are_rendered_again(tmp_path, begun, adaptive, knows_authors) -> None:
    """Where who has rendered them is found out after it, or perhaps has rendered them."""
    right = render(scene(adaptive), spp=512)
    again = begun(lambda begin: render(scene(adaptive), stop, spp=512, begin=begin))
    film = SavedFilm.read(tmp_path / "film.npz")
    assert B in dict(film.state["authors"])
    if not knows_authors:
        state = {name: value for name, value in film.state.items() if name != "rendered_by"}
        replace(film, state=state).write(tmp_path / "film.npz")
    with pytest.warns(UserWarning, match=f"the worker {B} is not used any more"):
        found = render(scene(adaptive), spp=512, begin=again)
    assert same(found, right)
    assert found.metadata["workers"] == "2"


def test_parts_of_a_frame_that_goes_on_later_are_rendered_again(tmp_path, begun) -> None:
    """Where who has rendered them is found out in the frame before."""

    def frame(number):
        return replace(scene(), render=replace(scene().render, seed=number))

    right, found = {}, {}
    options = {"spp": 512, "block": 32, "count": 2}
    frames = {number: frame(number) for number in (1, 2)}
    cluster.render_frames(scene(), frames, None, right.__setitem__, **options)

    def start(begin) -> None:
        with pytest.raises(KeyboardInterrupt):
            cluster.render_frames(scene(), {2: frame(2)}, None, None, progress=stop, begin=numbered(begin), **options)

    def numbered(begin):
        return lambda one, number: begin(one, str(number))

    again = begun(start)
    with pytest.warns(UserWarning, match=f"the worker {B} is not used any more"):
        cluster.render_frames(scene(), frames, None, found.__setitem__, begin=numbered(again), **options)
    assert all(same(found[number], right[number]) for number in frames)
