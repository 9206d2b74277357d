# SPDX-License-Identifier: MIT
"""Standard output and error that cannot be written."""

import os
import subprocess
import sys
from contextlib import nullcontext

import pytest
from command import TINY, status_of

from fragtracer.apps import cli


def full():
    return open("/dev/full", "w")


def closed():
    return nullcontext(None)


def broken():
    """A pipe that nobody reads."""
    read, write = os.pipe()
    os.close(read)
    return os.fdopen(write, "w")


GONE = [
    (full, 2, "fragtracer: cannot write to the standard output: No space left on device\n"),
    (closed, 2, "fragtracer: cannot write to the standard output: Bad file descriptor\n"),
    (broken, 1, ""),
]


@pytest.mark.parametrize(("stream", "status", "message"), GONE)
@pytest.mark.parametrize("command", ["scenes", "--help", "--version"])
def test_output_that_is_gone_is_one_message_at_most(monkeypatch, capsys, command, stream, status, message):
    with stream() as output:
        monkeypatch.setattr(sys, "stdout", output)
        assert status_of(monkeypatch, command) == status
    assert capsys.readouterr().err == message


@pytest.mark.parametrize("stream", [full, closed, broken])
def test_pictures_are_rendered_all_the_same(tmp_path, monkeypatch, stream):
    command = ["render", "furnace", *TINY, "--spp", 1, "--turntable", 2, "-o", tmp_path / "a.#.png"]
    with stream() as output, stream() as error:
        monkeypatch.setattr(sys, "stdout", output)
        monkeypatch.setattr(sys, "stderr", error)
        assert status_of(monkeypatch, *command) == (1 if stream is broken else 2)
    assert [file.name for file in sorted(tmp_path.iterdir())] == ["a.1.png", "a.2.png"]


def test_another_status_stays(monkeypatch, capsys):
    def fail():
        print("a finding")
        sys.exit(130)

    monkeypatch.setattr(cli, "app", fail)
    for stream, _, message in GONE:
        with stream() as output:
            monkeypatch.setattr(sys, "stdout", output)
            assert status_of(monkeypatch) == 130
        assert capsys.readouterr().err == "fragtracer: interrupted\n" + message


def test_python_is_silent_about_a_broken_pipe_as_it_ends():
    """Also where all is written only then."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    command = [sys.executable, "-m", "fragtracer", "--version"]
    with broken() as output:
        done = subprocess.run(command, stdout=output, stderr=subprocess.PIPE, env=environment, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (1, b"")
