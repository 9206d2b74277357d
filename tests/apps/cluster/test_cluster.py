# SPDX-License-Identifier: MIT
"""A picture on a cluster of real processes: the same bits, whatever happens to them."""

import os
import re
import signal
import time
import warnings
from dataclasses import replace

import numpy as np
import pytest
from agreement import ROUNDING
from command import status_of

from fragtracer.apps import cluster
from fragtracer.apps.cli.keeping import Keeping
from fragtracer.apps.cluster import work
from fragtracer.errors import FragtracerError
from fragtracer.films import SavedFilm, merge
from fragtracer.io.images import read_image, read_metadata
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer

pytest.importorskip("distributed", reason="Dask is not installed")

# What Dask leaves open when processes are killed.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
SPP, BLOCK, TILE = 150, 32, 16


def scene(adaptive="off"):
    loaded = load("three-spheres-ambient")
    return replace(loaded, render=replace(loaded.render, width=40, height=24, bounces=2, adaptive=adaptive))


@pytest.fixture(autouse=True)
def _small_tiles(monkeypatch):
    monkeypatch.setattr(work, "TILE", TILE)


@pytest.fixture(scope="module")
def client():
    """Of two workers with a thread each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LP_NUM_THREADS", "1")
        with warnings.catch_warnings(), cluster.connected("local:2") as connected:
            yield connected


@pytest.fixture
def spoilt(client, tmp_path):
    """Spoils the second worker by a function until the end of the test; returns its address."""
    flag = tmp_path / "hangs"
    flag.touch()

    def mend() -> None:
        import fragtracer
        from fragtracer.apps.cluster import worker

        worker.Renderer.driver = worker.__dict__.setdefault("_driver", worker.Renderer.driver)
        worker._draw = worker.__dict__.setdefault("_right", worker._draw)
        fragtracer.__version__ = worker.__dict__.setdefault("_version", fragtracer.__version__)
        worker.close()

    client.wait_for_workers(2, timeout=60)  # those of the test before may have died
    client.run(mend)

    def spoil(change, *arguments) -> str:
        (_, bad) = workers_of(client)
        client.run(change, *arguments, workers=[bad])
        return bad

    yield spoil
    flag.unlink()
    client.wait_for_workers(2, timeout=60)  # those of the test before may have died
    client.run(mend)


def workers_of(client) -> list[str]:
    return sorted(client.scheduler_info(n_workers=-1)["workers"])


@pytest.fixture(scope="module")
def expected(client):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work, "TILE", TILE)
        return cluster.render(scene(), client, spp=SPP, block=BLOCK)


@pytest.fixture(scope="module")
def expected_adaptively():
    """On one machine."""
    with Renderer(scene("on")) as renderer:
        renderer.render(SPP)
        return renderer._read()


def same(picture, expected) -> bool:
    pixels = getattr(expected, "pixels", expected)
    pairs = zip(vars(picture.pixels).values(), vars(pixels).values(), strict=True)
    return all(np.array_equal(one, other) for one, other in pairs)


def test_it_is_the_picture(ctx, expected) -> None:
    with Renderer(scene(), context=ctx) as renderer:
        renderer.sample(SPP)
        np.testing.assert_allclose(expected.pixels.mean[..., :3], renderer.image(), rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(expected.pixels.mean[..., 3], SPP)
        assert expected.metadata["gl_renderer"] == renderer.driver
    assert (expected.metadata["spp"], expected.metadata["workers"]) == (str(SPP), "2")
    assert int(expected.metadata["checked_blocks"]) >= 2
    assert not expected.interrupted
    assert expected.wire == 44 * 40 * 24 * -(-SPP // BLOCK)


def test_stages_have_the_bits_of_one_machine(client, expected_adaptively) -> None:
    """Also with a shorter last pass, and where the error ends the render."""
    picture = cluster.render(scene("on"), client, spp=SPP, block=BLOCK)
    assert same(picture, expected_adaptively)
    assert picture.metadata["adaptive_decision"] == "on: as asked for"
    with Renderer(scene("on")) as renderer:
        renderer.render(until=0.02)
        picture = cluster.render(scene("on"), client, until=0.02, block=BLOCK)
        assert same(picture, renderer._read())
        assert renderer.spp > 64
        assert renderer.spp & (renderer.spp - 1)  # within a stage


@pytest.mark.parametrize("least", [1.0, 1e3])
def test_a_pilot_decides_once(client, expected, expected_adaptively, monkeypatch, least) -> None:
    monkeypatch.setattr("fragtracer.sampling.allocation.LEAST_GAIN", least)
    picture = cluster.render(scene("auto"), client, spp=SPP, block=BLOCK)
    assert same(picture, expected_adaptively if least == 1 else expected)
    with Renderer(scene("auto")) as renderer:
        renderer.render(40)
        said, found = renderer.metadata()["adaptive_decision"], picture.metadata["adaptive_decision"]
    assert re.findall(r"by (\S+)", said) == re.findall(r"by (\S+)", found)


@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_a_slow_worker_gets_smaller_parts(client, expected, expected_adaptively, monkeypatch, adaptive) -> None:
    """The smallest there are where it takes a thousand times as long, by clocks that no other work disturbs. The
    picture has the same bits."""
    from fragtracer.apps.cluster.dispatch import Dispatcher
    from fragtracer.apps.cluster.workers import Workers

    _, slow = workers_of(client)
    known, parts = set(), {}
    note, send = Workers.note, Dispatcher._send

    def note_slow(self, address, driver, samples, _):
        known.add(address)
        note(self, address, driver, samples, samples * (1e-3 if address == slow else 1e-6))

    def record(self, address, render, task, suspect=None):
        if suspect is None and len(known) == 2:
            parts.setdefault(address, []).append(task.pixels)
        send(self, address, render, task, suspect)

    monkeypatch.setattr(Workers, "note", note_slow)
    monkeypatch.setattr(Dispatcher, "_send", record)
    monkeypatch.setattr("fragtracer.apps.cluster.workers._SHORTEST", 0)
    picture = cluster.render(scene(adaptive), client, spp=SPP, block=BLOCK)
    assert same(picture, expected if adaptive == "off" else expected_adaptively)
    assert set(parts.pop(slow)) == {64}
    assert max(max(others) for others in parts.values()) == TILE**2


def test_a_worker_that_returns_nonsense_is_found(client, expected, expected_adaptively, spoilt) -> None:
    """Its picture is 1 % too bright. It is named, and what it rendered is rendered again."""

    def brighten() -> None:
        from dataclasses import replace

        from fragtracer.apps.cluster import worker

        def brighter(*arguments):
            pixels = worker._right(*arguments)
            mean = pixels.mean.copy()
            mean[..., :3] *= 1.01
            return replace(pixels, mean=mean)

        worker._draw = brighter

    bad = spoilt(brighten)
    for adaptive, right in (("off", expected), ("on", expected_adaptively)):
        with pytest.warns(UserWarning, match=f"the worker {bad} is not used any more: it rendered a block otherwise"):
            picture = cluster.render(scene(adaptive), client, spp=SPP, block=BLOCK)
        assert same(picture, right)
        assert bad in picture.metadata["banned_workers"]


def test_a_worker_that_hangs_is_left(client, expected, spoilt, tmp_path) -> None:
    def hang(flag) -> None:

        from fragtracer.apps.cluster import worker

        def wait(*_):
            while flag.exists():
                time.sleep(0.05)

        worker._draw = wait

    bad = spoilt(hang, tmp_path / "hangs")
    with pytest.warns(UserWarning, match=f"the worker {bad} is not used any more: a block did not come within 2 s"):
        picture = cluster.render(scene(), client, spp=SPP, block=BLOCK, patience=2)
    assert same(picture, expected)


def test_a_worker_that_falls_silent_is_left(client, expected) -> None:
    """In the middle, as one whose network stalls."""
    pid = min(client.run(os.getpid).values())
    stopped = []

    def report(state) -> None:
        if state.spp > SPP / 5 and not stopped:
            stopped.append(pid)
            os.kill(pid, signal.SIGSTOP)

    try:
        with pytest.warns(UserWarning, match="is not used any more: a block did not come within"):
            picture = cluster.render(scene(), client, spp=SPP, block=BLOCK, progress=report, patience=1)
    finally:
        os.kill(pid, signal.SIGCONT)
    assert stopped
    assert same(picture, expected)


def test_a_block_that_lacks_samples_is_refused(client, expected, spoilt) -> None:
    def shorten() -> None:
        from dataclasses import replace

        from fragtracer.apps.cluster import worker

        worker._draw = lambda renderer, part: worker._right(renderer, replace(part, spp=part.spp - 1))

    bad = spoilt(shorten)
    with pytest.warns(UserWarning, match=f"the worker {bad} .* without all of its samples"):
        picture = cluster.render(scene(), client, spp=SPP, block=BLOCK)
    assert same(picture, expected)


def test_another_version_is_refused(client, spoilt) -> None:
    def age() -> None:
        import fragtracer

        fragtracer.__version__ = "0.0.1"

    bad = spoilt(age)
    with pytest.raises(FragtracerError, match=rf"the worker {bad} has another fragtracer: version is 0\.0\.1 there"):
        cluster.render(scene(), client, spp=SPP, block=BLOCK)


def test_all_drivers_are_listed(client, expected, spoilt) -> None:
    """What one of them has rendered is not compared with what the other has."""

    def rename() -> None:
        from fragtracer.apps.cluster import worker

        worker.Renderer.driver = property(lambda _: "another driver")

    spoilt(rename)
    picture = cluster.render(scene(), client, spp=SPP, block=BLOCK)
    assert picture.metadata["gl_renderer"] == f"another driver, {expected.metadata['gl_renderer']}"
    assert picture.metadata["checked_blocks"] == "0"
    assert "banned_workers" not in picture.metadata


def test_until_stops_at_the_same_round(client) -> None:
    pictures = [cluster.render(scene(), client, until=0.02, block=BLOCK) for _ in range(2)]
    assert same(*pictures)
    assert pictures[0].pixels.relative_error() <= 0.02
    counts = np.unique(pictures[0].pixels.mean[..., 3])
    assert len(counts) == 1
    assert counts[0] % BLOCK == 0
    assert BLOCK < counts[0] < 1000


@pytest.mark.parametrize("adaptive", ["off", "auto", "on"])
def test_after_no_time_each_pixel_has_samples(client, adaptive) -> None:
    picture = cluster.render(scene(adaptive), client, seconds=0.0, block=BLOCK)
    assert picture.pixels.mean[..., 3].min() >= BLOCK


@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_an_interruption_keeps_what_came_back(client, adaptive) -> None:
    def report(state) -> None:
        if state.spp > SPP / 2:
            raise KeyboardInterrupt

    picture = cluster.render(scene(adaptive), client, spp=SPP, block=BLOCK, progress=report)
    assert picture.interrupted
    counts = picture.pixels.mean[..., 3]
    assert counts.min() >= BLOCK  # the first blocks came first
    assert counts.mean() > SPP / 2


def test_an_interrupted_render_goes_on(ctx, client, expected, tmp_path) -> None:
    """With the same bits; what is of another cut is refused, and by a renderer of this machine."""

    def report(state) -> None:
        if state.spp > 0.7 * SPP:
            raise KeyboardInterrupt

    kept = Keeping(tmp_path, 0.0, False)
    picture = cluster.render(scene(), client, spp=SPP, block=BLOCK, progress=report, begin=kept.begin)
    assert picture.interrupted
    again = replace(kept, resume=True).begin
    counts = []
    picture = cluster.render(
        scene(), client, spp=SPP, block=BLOCK, progress=lambda state: counts.append(state.spp), begin=again
    )
    assert counts[0] >= BLOCK
    assert same(picture, expected)
    for spp, block, words in ((SPP, 2 * BLOCK, "--block is 32 there, 64 here"), (140, BLOCK, "beyond --spp 140")):
        with pytest.raises(FragtracerError, match=words):
            cluster.render(scene(), client, spp=spp, block=block, begin=again)
    # Blocks that ended with the samples are followed by others, twice; only rounding tells.
    for spp in (SPP + 6, SPP + BLOCK):
        longer = cluster.render(scene(), client, spp=spp, block=BLOCK, begin=again)
        assert (longer.pixels.mean[..., 3] == spp).all()
    at_once = cluster.render(scene(), client, spp=SPP + BLOCK, block=BLOCK)
    np.testing.assert_allclose(longer.pixels.mean, at_once.pixels.mean, rtol=ROUNDING)
    cluster.render(scene(), client, spp=SPP + BLOCK + 1, block=BLOCK, begin=again)
    with pytest.raises(FragtracerError, match="an odd number of them"):
        cluster.render(scene(), client, spp=SPP + 2 * BLOCK, block=BLOCK, begin=again)
    film = SavedFilm.read(tmp_path / "film.npz")
    with pytest.raises(FragtracerError, match="is the checkpoint of a cluster"):
        merge({"a": film, "b": film})
    with Renderer(scene(), context=ctx) as renderer:
        with pytest.raises(FragtracerError, match="go on with --cluster"):
            renderer.resume(tmp_path / "film.npz")
        renderer.sample(2)
        renderer.save(tmp_path / "film.npz")
    with pytest.raises(FragtracerError, match="go on without --cluster"):
        cluster.render(scene(), client, spp=SPP, block=BLOCK, begin=again)


def test_interrupted_stages_go_on(client, expected_adaptively, tmp_path) -> None:
    """Within a stage, whose parts that are done are not rendered again."""

    def report(state) -> None:
        if state.spp > 75:
            raise KeyboardInterrupt

    kept = Keeping(tmp_path, 0.0, False)
    cluster.render(scene("on"), client, spp=SPP, block=BLOCK, progress=report, begin=kept.begin)
    again, counts = replace(kept, resume=True).begin, []
    picture = cluster.render(
        scene("on"), client, spp=SPP, block=BLOCK, progress=lambda state: counts.append(state.spp), begin=again
    )
    assert counts[0] > 64
    assert same(picture, expected_adaptively)
    assert SavedFilm.read(tmp_path / "film.npz").state["done"]
    with pytest.raises(FragtracerError, match="beyond --spp 70"):
        cluster.render(scene("on"), client, spp=70, block=BLOCK, begin=again)
    with pytest.raises(FragtracerError, match="adaptive is on there, off here"):
        cluster.render(scene(), client, spp=SPP, block=BLOCK, begin=again)


def test_the_command_renders_the_same_bits_with_one_worker(expected, tmp_path, monkeypatch, capsys) -> None:
    output = tmp_path / "a.exr"
    command = [
        "render",
        "three-spheres-ambient",
        "--size",
        "40x24",
        "--bounces",
        2,
        "--spp",
        SPP,
        "--block",
        BLOCK,
        "--no-adaptive",
    ]
    assert status_of(monkeypatch, *command, "--cluster", "local:1", "-o", output) == 0
    assert "150 samples per pixel of 1 worker," in capsys.readouterr().out
    assert read_metadata(output)["block"] == str(BLOCK)
    np.testing.assert_array_equal(read_image(output), expected.pixels.mean[..., :3])


def test_frames_are_rendered_once(client, tmp_path, monkeypatch, capsys) -> None:
    """With the bits of one machine, and again where one is missing."""

    def learned_for() -> list[int]:
        from fragtracer.apps.cluster import worker

        return [kept.renderer._decider.pictures for kept in worker._kept.values()]

    command = ["render", "three-spheres-ambient", "--size", "40x24", "--bounces", 2, "--spp", 70, "--adaptive"]
    command += ["--seed", 5, "--turntable", 2, "-o"]
    on_cluster = [*command, tmp_path / "a.#.exr", "--cluster", client.scheduler.address]
    assert status_of(monkeypatch, *on_cluster, "--checkpoint", tmp_path / "kept", "--frames", 2) == 0
    assert "finished before" not in capsys.readouterr().out
    assert [2] in client.run(learned_for).values()
    assert status_of(monkeypatch, *command, tmp_path / "b.#.exr") == 0
    assert status_of(monkeypatch, *on_cluster) == 0
    assert "1 of 2 frames was finished before" in capsys.readouterr().out
    for number in (1, 2):
        found = read_image(tmp_path / f"a.{number}.exr")
        np.testing.assert_array_equal(found, read_image(tmp_path / f"b.{number}.exr"))
        assert read_metadata(tmp_path / f"a.{number}.exr")["seed"] == str(5 + number)
    assert not list((tmp_path / "kept").iterdir())


@pytest.mark.parametrize("adaptive", ["off", "on"])
def test_a_killed_worker_costs_time_alone(client, expected, expected_adaptively, adaptive) -> None:
    """By signal 9, in the middle."""
    pids = client.run(os.getpid)
    killed = []

    def report(state) -> None:
        if state.spp > SPP / 2 and not killed:
            killed.append(min(pids.values()))
            os.kill(killed[0], signal.SIGKILL)

    picture = cluster.render(scene(adaptive), client, spp=SPP, block=BLOCK, progress=report)
    assert killed
    assert same(picture, expected if adaptive == "off" else expected_adaptively)


def test_all_workers_may_die(client, expected) -> None:
    """The scene, which they had, is sent to those that come after them."""
    killed = []

    def report(state) -> None:
        if state.spp > SPP / 5 and not killed:
            killed.extend(client.run(os.getpid).values())
            for pid in killed:
                os.kill(pid, signal.SIGKILL)

    picture = cluster.render(scene(), client, spp=SPP, block=BLOCK, progress=report)
    assert killed
    assert picture.problem is None
    assert same(picture, expected)
