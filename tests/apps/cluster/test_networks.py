# SPDX-License-Identifier: MIT
"""Clusters as users start them, process by process: schedulers that end, networks that stall, TLS."""

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from command import status_of

from apps.cluster.processes import Network, free_port, scheduler, worker
from fragtracer.apps import cluster
from fragtracer.apps.cli.keeping import Keeping
from fragtracer.apps.cluster import work
from fragtracer.apps.cluster.merge import Tree, assembled
from fragtracer.apps.cluster.worker import versions
from fragtracer.io.images import read_image
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer

pytest.importorskip("distributed", reason="Dask is not installed")
config = pytest.importorskip("dask.config")

# What Dask leaves open when processes are killed.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
SPP, BLOCK, TILE = 300, 32, 16
GUARDED = "--preload", "fragtracer.apps.cluster.guard"
COMMAND = ["render", "three-spheres-ambient", "--size", "40x24", "--bounces", 2, "--no-adaptive"]
COMMAND += ["--spp", SPP, "--block", BLOCK]


@pytest.fixture(autouse=True)
def _small_tiles(monkeypatch):
    monkeypatch.setattr(work, "TILE", TILE)


@pytest.fixture(scope="module")
def scene():
    loaded = load("three-spheres-ambient")
    return replace(loaded, render=replace(loaded.render, width=40, height=24, bounces=2, adaptive="off"))


@pytest.fixture(scope="module")
def expected(scene):
    """The blocks of this process, joined by the tree."""
    with pytest.MonkeyPatch.context() as patch, Renderer(scene) as renderer:
        patch.setattr(work, "TILE", TILE)
        cut = work.Cut(40, 24, BLOCK, SPP)
        trees = {tile: Tree() for tile in range(len(cut.tiles))}
        for task in (task for number in range(cut.rounds or 0) for task in cut.tasks(number)):
            window = replace(task.window, first_sample=cut.first(task.step))
            trees[task.tile].add(task.step, renderer.block(window, cut.spp_of(task.step)))
        return assembled(cut, trees)


def same(pixels, expected) -> bool:
    return all(np.array_equal(image, vars(expected)[name]) for name, image in vars(pixels).items())


@contextmanager
def connected(address: str) -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cluster, "_REACH", 30)
        with cluster.connected(address) as client:
            yield client


def heard(monkeypatch) -> list[float]:
    """The samples of a pixel that commands tell of from now on."""
    counts: list[float] = []

    @contextmanager
    def show(*_):
        yield lambda state: counts.append(state.spp)

    monkeypatch.setattr("fragtracer.apps.cli.render._progress", show)
    return counts


def test_a_scheduler_dies_and_another_goes_on(scene, expected, tmp_path, monkeypatch) -> None:
    """With all that has come back, and the same bits."""
    kept, output = tmp_path / "kept", tmp_path / "a.exr"
    with scheduler(tmp_path / "a.json") as (process, address), worker(address), connected(address) as client:

        def kill(state) -> None:
            if state.spp > SPP / 4:
                process.kill()

        begin = Keeping(kept, 3600, False).begin
        picture = cluster.render(scene, client, spp=SPP, block=BLOCK, progress=kill, patience=5, begin=begin)
    assert "the scheduler of the cluster is gone" in picture.problem
    counts = picture.pixels.mean[..., 3]
    assert BLOCK <= counts.min() < SPP
    monkeypatch.setattr(cluster, "_REACH", 30)
    with scheduler(tmp_path / "b.json") as (_, address), worker(address):
        told = heard(monkeypatch)
        command = [*COMMAND, "--cluster", address, "-o", output, "--checkpoint", kept, "--resume"]
        assert status_of(monkeypatch, *command) == 0
    assert told[0] == pytest.approx(counts.mean(dtype=float))
    np.testing.assert_array_equal(read_image(output), expected.mean[..., :3])


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory):
    """The address of their scheduler, that of the second one, and the network that is between this and all others."""
    network, port = Network(), free_port()
    with scheduler(tmp_path_factory.mktemp("scheduler") / "a.json") as (_, address):
        port_of_scheduler = int(address.rpartition(":")[2])
        through, contact = network.address_of(port_of_scheduler), network.address_of(port)
        addresses = "--listen-address", f"tcp://127.0.0.1:{port}", "--contact-address", contact
        with worker(address, *GUARDED), worker(through, *addresses, *GUARDED), connected(address) as client:
            client.wait_for_workers(2, timeout=30)
            names = list(client.nthreads())
            client.gather([client.submit(versions, workers=[n], pure=False) for n in names])  # takes new processes long
            yield address, contact, network
            network.close()


def test_a_worker_whose_network_stalls_is_left(scene, expected, two_workers) -> None:
    """Its connections stay open; the picture has the same bits."""
    address, bad, network = two_workers
    reports: list[float] = []

    def stall(state) -> None:
        if state.spp > SPP / 4:
            network.flows.clear()
        end = time.monotonic() + 30
        while len(reports) == 1 and not client.has_what([bad])[bad]:  # otherwise the other one may render all before
            assert time.monotonic() < end
            time.sleep(0.05)
        reports.append(state.spp)

    try:
        with (
            connected(address) as client,
            pytest.warns(UserWarning, match=f"the worker {bad} is not used any more: a block did not come within"),
        ):
            picture = cluster.render(scene, client, spp=SPP, block=BLOCK, progress=stall, patience=3)
    finally:
        network.flows.set()
    assert same(picture.pixels, expected)


def test_a_stall_between_client_and_scheduler_ends_the_render(scene, expected, two_workers, tmp_path) -> None:
    """With what has come back; from there it goes on with the same bits."""
    address, _, _ = two_workers
    network, kept = Network(), Keeping(tmp_path, 3600, False)
    through = network.address_of(int(address.rpartition(":")[2]))

    def stall(state) -> None:
        if state.spp > SPP / 4:
            network.flows.clear()

    start = time.monotonic()
    with connected(through) as client:
        picture = cluster.render(scene, client, spp=SPP, block=BLOCK, progress=stall, patience=1, begin=kept.begin)
    assert "the scheduler of the cluster has not answered for 1 s" in picture.problem
    assert BLOCK <= picture.pixels.mean[..., 3].min() < SPP
    assert time.monotonic() - start < 20
    network.close()
    with connected(address) as client:
        begin = replace(kept, resume=True).begin
        picture = cluster.render(scene, client, spp=SPP, block=BLOCK, begin=begin)
    assert same(picture.pixels, expected)


def test_news_that_come_while_a_client_connects(two_workers, monkeypatch) -> None:
    """Of another client or worker: Dask takes them for the wrong answer."""
    import distributed

    address, _, _ = two_workers
    client_of, tried = distributed.Client, []

    def first_disturbed(*arguments, **options):
        tried.append(arguments)
        assert len(tried) > 1
        return client_of(*arguments, **options)

    monkeypatch.setattr(distributed, "Client", first_disturbed)
    with connected(address) as client:
        assert client.status == "running"
    assert len(tried) == 2


@pytest.mark.skipif(shutil.which("openssl") is None, reason="nothing makes certificates here")
def test_tls_as_dask_configures_it(expected, tmp_path, monkeypatch, capsys) -> None:
    """By the environment, as docs/cluster.md has it; who has no certificate is not let in."""
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    command = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=fragtracer"
    subprocess.run([*command.split(), "-keyout", key, "-out", certificate], check=True, capture_output=True)
    tls = "DASK_DISTRIBUTED__COMM__TLS__"
    environment = {f"{tls}CA_FILE": str(certificate)}
    for role in ("SCHEDULER", "WORKER", "CLIENT"):
        environment |= {f"{tls}{role}__CERT": str(certificate), f"{tls}{role}__KEY": str(key)}
    output = tmp_path / "a.exr"
    monkeypatch.setattr(cluster, "_REACH", 30)
    with (
        scheduler(tmp_path / "a.json", "tls://127.0.0.1", **environment) as (_, address),
        worker(address, **environment),
    ):
        assert address.startswith("tls://")
        command = [*COMMAND, "--cluster", address, "-o", output]
        with config.set(config.merge(config.config, config.collect_env(environment))):
            assert status_of(monkeypatch, *command) == 0
        np.testing.assert_array_equal(read_image(output), expected.mean[..., :3])
        capsys.readouterr()
        monkeypatch.setattr(cluster, "_REACH", 1)
        for wrong, why in ((address, " without a certificate"), (address.replace("tls://", "tcp://"), " within 1 s")):
            command[command.index("--cluster") + 1] = wrong
            assert status_of(monkeypatch, *command) == 2
            err = capsys.readouterr().err
            assert f"--cluster {wrong}: cannot be reached{why}" in err
            assert len(err.splitlines()) == 1


def test_a_guarded_worker_runs_nothing_else(two_workers, tmp_path) -> None:
    """It rather ends. That it renders is tested by all that renders on two_workers."""
    address, _, _ = two_workers
    done, port = tmp_path / "done", free_port()
    own = f"tcp://127.0.0.1:{port}"
    with worker(address, *GUARDED, "--worker-port", port) as process, connected(address) as client:
        client.wait_for_workers(3, timeout=30)
        with pytest.raises(Exception, match="'run' handler has been explicitly disallowed"):
            client.run(os.getpid, workers=[own])
        client.submit(os.system, f"touch {done}", workers=[own])
        process.wait(20)
    assert not done.exists()
