# SPDX-License-Identifier: MIT
"""What is kept on disk is used, and is never trusted."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from fragtracer import cache
from fragtracer.cache import cached

ARRAYS = {"a": np.arange(12, dtype=np.float32).reshape(3, 4), "b": np.array([7], np.int64)}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FRAGTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


class Maker:
    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> dict[str, np.ndarray]:
        self.calls += 1
        return ARRAYS


def check(found: dict[str, np.ndarray]) -> None:
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


def test_second_time_is_not_computed(folder: Path) -> None:
    make = Maker()
    check(cached("maps", "k1", make))
    check(cached("maps", "k1", make))
    assert make.calls == 1
    assert [file.name for file in folder.iterdir()] == ["maps-k1.arrays"]  # and no temporary file is left
    check(cached("maps", "k2", make))
    check(cached("other", "k1", make))
    assert make.calls == 3


def test_a_file_under_a_wrong_name_is_not_used(folder: Path) -> None:
    make = Maker()
    cached("maps", "k1", make)
    (folder / "maps-k1.arrays").rename(folder / "maps-k2.arrays")
    with pytest.warns(UserWarning, match="damaged"):
        check(cached("maps", "k2", make))
    assert make.calls == 2


def test_every_damage_is_noticed(folder: Path) -> None:
    cached("maps", "k1", Maker())
    file = folder / "maps-k1.arrays"
    whole = file.read_bytes()
    random = np.random.default_rng(1)
    damaged = [whole[:n] for n in random.integers(0, len(whole), 40)]
    for place in random.integers(0, len(whole), 200):
        spoiled = bytearray(whole)
        spoiled[place] ^= 1 << int(random.integers(8))
        damaged.append(bytes(spoiled))
    damaged += [b"", b"not an archive", np.random.default_rng(2).bytes(1000)]
    rebuilt = 0
    for content in damaged:
        file.write_bytes(content)
        make = Maker()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(cache.warnings, "warn", lambda *_, **__: None)
            check(cached("maps", "k1", make))  # the right arrays, kept or made anew
        rebuilt += make.calls
        assert not make.calls or file.read_bytes() == whole
    assert rebuilt == len(damaged)


def test_a_folder_that_cannot_be_written_only_warns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FRAGTRACER_CACHE", str(tmp_path / "file" / "below"))
    with pytest.warns(UserWarning, match="nothing is kept"):
        check(cached("maps", "k1", Maker()))


def test_files_that_others_delete_meanwhile_are_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for key in ("k1", "k2"):
        cached("maps", key, Maker())
    monkeypatch.setattr(cache, "LIMIT", 1)
    monkeypatch.setattr(
        Path, "glob", lambda self, _: [folder / f"maps-{key}.arrays" for key in ("k0", "k1", "k2", "k3")]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cached("maps", "k3", Maker())
    assert [file.stem for file in folder.iterdir()] == ["maps-k3"]


def test_the_oldest_go_when_there_is_too_much(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for i, key in enumerate(("k1", "k2", "k3")):
        cached("maps", key, Maker())
        os.utime(folder / f"maps-{key}.arrays", (i, i))
    cached("maps", "k1", Maker())  # used again
    monkeypatch.setattr(cache, "LIMIT", 3 * (folder / "maps-k1.arrays").stat().st_size)
    cached("maps", "k4", Maker())
    assert sorted(file.stem for file in folder.iterdir()) == ["maps-k1", "maps-k3", "maps-k4"]
