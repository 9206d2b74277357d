# SPDX-License-Identifier: MIT
"""``fragtracer bench`` as a user types it."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fragtracer.apps.bench.tables import read_json
from fragtracer.apps.cli import app
from fragtracer.errors import FragtracerError

QUICK = ["--rays", "1", "--bounces", "1", "--size", "16x9", "--runs", "1"]


def _bench(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["bench", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_files_and_difference(tmp_path: Path) -> None:
    json, csv, html = (tmp_path / f"a.{suffix}" for suffix in ("json", "csv", "html"))
    output = _bench(*QUICK, "--json", str(json), "--csv", str(csv), "--report", str(html))
    assert "frames/s" in output
    assert read_json(json).settings["rays"] == "1"
    assert csv.read_text().startswith("table,row,column,value")
    assert "<svg" in html.read_text()
    assert "too few runs" in _bench("--diff", str(json), str(json)).replace("\n", " ")


def test_markdown() -> None:
    assert "| rays |" in _bench(*QUICK, "--rays", "1,2", "--markdown")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--rays", "0"], "--rays 0: give whole numbers from 1 to 1024"),
        (["--rays", "5;6"], "--rays 5;6: give whole numbers with commas between them"),
        (["--what", "sped"], "--what sped: there are sweep, speed"),
        (["--scene", "nowhere"], "nowhere: no such file or bundled scene"),
        (["--size", "0x5"], "--size 0x5"),
        (["--size", "16384x16384", "--rays", "1"], "16384x16384"),
        (["--json", "nowhere/a.json"], "there is no folder"),
        (["--report", "a.txt"], "cannot write .txt"),
        (["--diff", "a.json", "b.json"], "a.json: cannot read"),
    ],
)
def test_bad_input_gets_one_clear_message(arguments: list[str], message: str) -> None:
    with pytest.raises(FragtracerError, match=r"^[^\n]*$") as error:
        CliRunner().invoke(app, ["bench", *arguments], catch_exceptions=False)
    assert message in str(error.value)


def test_interruption_keeps_rows_and_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fragtracer.apps.bench import sweep

    rows = iter(range(2))

    def count_or_interrupt(scene: object) -> object:
        if next(rows, None) is None:
            raise KeyboardInterrupt
        return original(scene)  # type: ignore[arg-type]

    original = sweep.count_work
    monkeypatch.setattr(sweep, "count_work", count_or_interrupt)
    path = tmp_path / "a.json"
    result = CliRunner().invoke(app, ["bench", *QUICK, "--rays", "1,2,3", "--json", str(path)])
    assert result.exit_code == 130
    results = read_json(path)
    assert not results.complete
    assert [row["rays"] for row in results.tables[0].rows] == [1, 2]
