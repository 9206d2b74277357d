# SPDX-License-Identifier: MIT
"""The folder of a checkpoint belongs to one process at a time."""

import errno
import fcntl
import os
import signal
import subprocess
import sys

import pytest
from command import TINY, status_of

from fragtracer.apps.cli.keeping import keeping
from fragtracer.films import SavedFilm
from fragtracer.output import locked, replacing

COMMAND = ("render", "furnace", *TINY, "--spp", 4, "-o")


@pytest.mark.parametrize("more", [(), ("--resume",), ("--turntable", 2), ("--cluster", "local:1")], ids=str)
def test_a_folder_that_is_in_use_is_refused_at_once(tmp_path, monkeypatch, capsys, more) -> None:
    """What the other process is writing stays."""
    folder = tmp_path / "kept"
    monkeypatch.setattr("fragtracer.renderer.Renderer", None)
    monkeypatch.setattr("fragtracer.apps.cluster.connected", None)
    with keeping(folder, 60, False), replacing(folder / "film.npz") as part:
        part.write_bytes(b"half a film")
        assert status_of(monkeypatch, *COMMAND, tmp_path / "a.#.png", "--checkpoint", folder, *more) == 2
        assert part.exists()
    (message,) = capsys.readouterr().err.splitlines()
    assert f"{folder}: another process keeps its checkpoints here; wait until it has ended, or give" in message


def test_a_process_that_was_killed_blocks_nobody(tmp_path) -> None:
    file = tmp_path / "film.lock"
    child = (
        "import os, pathlib, sys\n"
        "from fragtracer.output import locked\n"
        "with locked(pathlib.Path(sys.argv[1])) as has_locks:\n"
        "    assert has_locks\n"
        "    os.kill(os.getpid(), 9)\n"
    )
    assert subprocess.run([sys.executable, "-c", child, file], check=False).returncode == -signal.SIGKILL
    assert file.exists()
    with locked(file) as has_locks:
        assert has_locks
    assert not file.exists()


def test_a_lock_that_is_given_back_meanwhile_is_taken_anew(tmp_path, monkeypatch) -> None:
    """A file that its last owner removes after it was opened keeps nobody out."""
    path, flock, opened = tmp_path / "film.lock", fcntl.flock, []

    def remove_first(file, operation) -> None:
        opened.append(file)
        if len(opened) == 1:
            path.unlink()
        flock(file, operation)

    monkeypatch.setattr(fcntl, "flock", remove_first)
    with locked(path), pytest.raises(BlockingIOError), locked(path):
        pass
    assert len(opened) == 3


def test_a_file_system_without_locks_is_used_without(tmp_path, monkeypatch, capsys) -> None:
    """Nothing is said, and no temporary file removed: it may be of a process that lives."""

    def refuse(*_) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    with replacing(tmp_path / "film.npz") as part:
        part.write_bytes(b"half a film")
        assert status_of(monkeypatch, *COMMAND, tmp_path / "a.npy", "--checkpoint", tmp_path) == 0
        assert part.exists()
    assert capsys.readouterr().err == ""


def test_what_a_killed_writer_has_left_is_removed(tmp_path, monkeypatch) -> None:
    """And nothing that others are writing in that folder; of the lock nothing is left."""
    film = tmp_path / "film.npz"
    with replacing(tmp_path / "b.png") as of_other, replacing(film) as left:
        of_other.write_bytes(b"half a picture")
        left.write_bytes(b"half a film")
        assert status_of(monkeypatch, *COMMAND, tmp_path / "a.npy", "--checkpoint", tmp_path) == 0
        assert of_other.exists()
        assert not left.exists()
        left.write_bytes(film.read_bytes())  # which replacing() puts in its place
    assert SavedFilm.read(film).spp == 4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy", "b.png", "film.npz"]
