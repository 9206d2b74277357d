# SPDX-License-Identifier: MIT
"""What is written is read back; reports, Markdown and differences say what the tables hold."""

import csv
import io
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from fragtracer.apps.bench.difference import difference
from fragtracer.apps.bench.statistics import Estimate
from fragtracer.apps.bench.tables import Column, Plot, Results, Table, read_json, show, to_csv, to_json
from fragtracer.apps.bench.text import print_results, to_markdown
from fragtracer.errors import FragtracerError


def _results(fps: float, spread: float = 0.05) -> Results:
    rate = Estimate(fps, fps * (1 - spread), fps * (1 + spread), 7)
    table = Table(
        "sweep",
        "Frames <per> second",
        (Column("scene", "scene"), Column("rays", "rays"), Column("fps", "frames/s", "more"), Column("note", "note")),
        keys=("scene", "rays"),
        plots=(Plot("rays", ("fps",), ("scene",), "rays", "fps"),),
        notes=["measured on paper"],
        rows=[
            {"scene": "mirror", "rays": 5, "fps": rate},
            {"scene": "mirror", "rays": 10, "fps": None, "note": 'stopped, "late"'},
        ],
    )
    return Results({"processor": "abacus", "date": "today"}, {"runs": "7"}, [table])


def test_json_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(to_json(_results(60.0)), encoding="utf-8")
    assert read_json(path) == _results(60.0)


@pytest.mark.parametrize("text", ["", "{}", "[1, 2]", '{"machine": 5}'])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(FragtracerError, match="not a file that 'fragtracer bench --json' wrote"):
        read_json(path)
    with pytest.raises(FragtracerError, match="cannot read"):
        read_json(tmp_path / "none.json")


def test_results_of_another_format_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(to_json(replace(_results(60.0), format=99)))
    with pytest.raises(FragtracerError, match="format 99"):
        read_json(path)


def test_csv_has_every_number() -> None:
    rows = list(csv.DictReader(io.StringIO(to_csv(_results(60.0)))))
    first = next(r for r in rows if r["column"] == "fps")
    assert first["row"] == "scene=mirror rays=5"
    assert [float(first[k]) for k in ("value", "low", "high", "runs")] == [60.0, 57.0, 63.0, 7.0]
    assert rows[-1]["value"] == 'stopped, "late"'


def test_markdown_leaves_out_what_never_changes() -> None:
    text = to_markdown(_results(60.0))
    assert "**Frames <per> second, scene mirror**" in text
    assert "| 5 | 60.0 ±5 % |  |" in text
    assert "measured on paper" in text
    assert "processor abacus" in text
    assert "ended early" not in text
    assert "ended early" in to_markdown(replace(_results(60.0), complete=False))


def test_brackets_are_shown(tmp_path: Path) -> None:
    table = Table("a", "of a[b]c", (Column("x", "x"),), keys=(), notes=["pip install 'fragtracer[reference]'"])
    table.rows.append({"x": "a[b]c"})
    with (tmp_path / "shown").open("w") as file:
        print_results(Results({}, {}, [table]), Console(file=file))
    shown = (tmp_path / "shown").read_text()
    assert shown.count("a[b]c") == 2
    assert "fragtracer[reference]" in shown


def test_report_is_one_page_that_needs_nothing_else() -> None:
    pytest.importorskip("matplotlib")
    from fragtracer.apps.bench.report import to_html

    page = to_html(replace(_results(60.0), complete=False))
    assert "Frames &lt;per&gt; second" in page
    assert "60.0 ±5 %" in page
    assert "abacus" in page
    assert "Ended early" in page
    assert "<script" not in page
    assert "src=" not in page
    plot = page[page.index("<svg") : page.index("</svg>") + len("</svg>")]
    ElementTree.fromstring(plot)


def test_report_without_a_number_has_no_plot() -> None:
    pytest.importorskip("matplotlib")
    from fragtracer.apps.bench.report import to_html

    results = _results(60.0)
    for row in results.tables[0].rows:
        row["fps"] = Estimate(-1.0, -2.0, 1.0, 7)
    assert "<svg" not in to_html(results)


@pytest.mark.parametrize(("new", "verdict"), [(90.0, "better"), (30.0, "worse"), (61.0, "within the spread")])
def test_difference(new: float, verdict: str) -> None:
    (row,) = difference(_results(60.0), _results(new)).rows
    assert row["verdict"] == verdict
    assert row["ratio"] == pytest.approx(new / 60)


def test_difference_warns_of_another_machine_and_of_nothing_in_common() -> None:
    other = replace(_results(60.0), machine={"processor": "slide rule"}, complete=False)
    notes = difference(_results(60.0), other).notes
    assert "not the same processor: abacus against slide rule" in notes
    assert "the new run was interrupted" in notes
    assert "the two have no row in common" in difference(_results(60.0), Results({}, {})).notes


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        (None, ""),
        ("a", "a"),
        (7, "7"),
        (1234.5, "1234"),
        (12.345, "12.3"),
        (0.01234, "0.0123"),
        (1.5e-5, "1.50e-05"),
        (0.0, "0"),
        (Estimate(10, 9, 11, 5), "10.0 ±10 %"),
        (Estimate(10, 10, 10, 1), "10.0"),
    ],
)
def test_show(cell: object, text: str) -> None:
    assert show(cell) == text  # type: ignore[arg-type]
