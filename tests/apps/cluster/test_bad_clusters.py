# SPDX-License-Identifier: MIT
"""One message for each way in which there is no cluster."""

import signal
import sys
import warnings

import pytest
from command import TINY, status_of

from fragtracer.apps import cluster
from fragtracer.errors import FragtracerError

COMMAND = ("render", "three-spheres-ambient", *TINY, "-o", "a.png")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--cluster", "somewhere"], "give the address of a Dask scheduler, as tcp://host:8786, or local:2"),
        (["--cluster", "local:0"], "give at least one process"),
        (["--cluster", "local:1", "--block", 33], "--block 33: give an even number, 32 or more"),
        (["--cluster", "local:1", "--integrator", "split-sum"], "--integrator path"),
        (["--cluster", "local:1", "--light-tracing", "on"], "needs --light-tracing auto or off"),
        (["--cluster", "local:1", "--gradient-domain", "on"], "needs --gradient-domain auto or off"),
        (["--cluster", "local:1", "--worst", 5], "give --until in place of --worst"),
        (["--cluster", "local:1", "--first-sample", 0, "--no-adaptive"], "leave out --first-sample"),
        (["--cluster", "local:1", "--turntable", 3, "-o", "a.#.png", "--time", 3], "give --spp or --until for frames"),
        (["--cluster", "local:1", "--turntable", 3, "-o", "a.png"], "mark the place of the frame's number"),
        (["--cluster", "local:1", "--turntable", 3, "-o", "a.#.png", "--block", 30], "--block 30: give an even number"),
        (["--block", 4], "--block is the size of a task of --cluster"),
    ],
)
def test_bad_input_gets_one_message(tmp_path, monkeypatch, capsys, arguments, words) -> None:
    """Before anything is started."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("distributed.LocalCluster", None)
    assert status_of(monkeypatch, *COMMAND, *arguments) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_an_interrupted_start_is_finished_and_closed(monkeypatch) -> None:
    """Dask cannot close a cluster that has started in part."""
    done = []

    class Started:
        def __init__(self, *_, **__):
            signal.raise_signal(signal.SIGINT)
            done.append("started")

        def __enter__(self):
            return self

        def __exit__(self, *_):
            done.append("closed")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # it may be ignored in the background
    monkeypatch.setattr("distributed.LocalCluster", Started)
    monkeypatch.setattr("distributed.Client", Started)
    try:
        with pytest.raises(KeyboardInterrupt), cluster.connected("local:2"):
            done.append("used")
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["started", "started", "closed", "closed"]


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_cluster_that_is_not_there(monkeypatch) -> None:
    monkeypatch.setattr(cluster, "_REACH", 0.5)
    with (
        pytest.raises(FragtracerError, match=r"tcp://127\.0\.0\.1:1: cannot be reached"),
        cluster.connected("tcp://127.0.0.1:1"),
    ):
        pass


def test_without_dask_the_line_to_type_is_told(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(FragtracerError, match=r"pip install 'fragtracer\[cluster\]'"), cluster.connected("local:2"):
        pass


@pytest.mark.parametrize("address", ["tcp://render.example:8786", "ws://10.0.0.7:8786"])
def test_a_scheduler_that_the_world_can_read_is_warned_of(monkeypatch, address) -> None:
    def unreachable(*_, **__):
        raise OSError("no")

    monkeypatch.setattr("distributed.Client", unreachable)
    with (
        pytest.warns(UserWarning, match=r"is not encrypted.*use tls://"),
        pytest.raises(FragtracerError),
        cluster.connected(address),
    ):
        pass


@pytest.mark.parametrize("address", ["tls://render.example:8786", "tcp://127.0.0.1:8786", "tcp://localhost:8786"])
def test_others_are_not(monkeypatch, address) -> None:
    def unreachable(*_, **__):
        raise OSError("no")

    monkeypatch.setattr("distributed.Client", unreachable)
    with warnings.catch_warnings(), pytest.raises(FragtracerError), cluster.connected(address):
        pass
    assert "distributed" in sys.modules
