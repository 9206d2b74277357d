# SPDX-License-Identifier: MIT
"""What benchmarks measure: tables of numbers with their spread, and JSON and CSV of them."""

import csv
import io
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from fragtracer.apps.bench.statistics import Estimate
from fragtracer.errors import FragtracerError

Cell = Estimate | int | float | str | None
Row = dict[str, Cell]
FORMAT = 1


@dataclass(frozen=True)
class Column:
    """``name`` stands in files, ``title`` over the column; ``better`` says which numbers are good."""

    name: str
    title: str
    better: Literal["more", "less"] | None = None


@dataclass(frozen=True)
class Plot:
    """Curves of columns ``y`` over column ``x``, one for each value of columns ``by``."""

    x: str
    y: tuple[str, ...]
    by: tuple[str, ...]
    x_title: str
    y_title: str
    x_scale: Literal["log", "linear"] = "log"
    y_scale: Literal["log", "linear"] = "log"


@dataclass
class Table:
    """The columns of ``keys`` tell rows apart."""

    name: str
    title: str
    columns: tuple[Column, ...]
    keys: tuple[str, ...]
    plots: tuple[Plot, ...] = ()
    notes: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)


@dataclass
class Results:
    """All tables of one run of the benchmark, with the machine and the settings that made them."""

    machine: dict[str, str]
    settings: dict[str, str]
    tables: list[Table] = field(default_factory=list)
    complete: bool = True
    failure: str = ""  # the message of the error that ended it
    format: int = FORMAT


_RESULTS = TypeAdapter(Results)


def to_json(results: Results) -> str:
    """Everything, as :func:`read_json` takes it."""
    return json.dumps(_RESULTS.dump_python(results, mode="json"), indent=1, ensure_ascii=False) + "\n"


def read_json(path: Path) -> Results:
    """Results that were written with :func:`to_json`.

    Raises
    ------
    FragtracerError
        If the file cannot be read or holds something else.
    """
    try:
        results: Results = _RESULTS.validate_json(path.read_bytes())
    except OSError as error:
        raise FragtracerError(f"{path}: cannot read: {error.strerror}") from None
    except ValidationError:
        raise FragtracerError(f"{path}: not a file that 'fragtracer bench --json' wrote") from None
    if results.format != FORMAT:
        raise FragtracerError(f"{path}: format {results.format}, but this version reads {FORMAT}; measure again")
    return results


def to_csv(results: Results) -> str:
    """One line for each number: table, the row's keys as text, column, value, low, high, runs."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["table", "row", "column", "value", "low", "high", "runs"])
    for table in results.tables:
        for row in table.rows:
            label = row_label(table, row)
            for column in table.columns:
                if column.name not in table.keys:
                    writer.writerow([table.name, label, column.name, *_csv_cells(row.get(column.name))])
    return text.getvalue()


def row_label(table: Table, row: Row) -> str:
    """The keys of a row in words."""
    return " ".join(f"{key}={row.get(key)}" for key in table.keys)


def _csv_cells(cell: Cell) -> list[Any]:
    if isinstance(cell, Estimate):
        return [cell.value, cell.low, cell.high, cell.runs]
    return [cell, None, None, None]


def show(cell: Cell) -> str:
    """A cell for people: three digits, the spread behind ±."""
    if cell is None:
        return ""
    if isinstance(cell, Estimate):
        spread = f" ±{_percent(cell.spread)}" if cell.runs > 1 else ""
        return _number(float(cell.value)) + spread
    return cell if isinstance(cell, str) else _number(cell)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.0095 else f"{100 * share:.1f} %"


def _number(value: float) -> str:
    if isinstance(value, int) or value == 0:
        return f"{value:.0f}"
    if not 1e-3 <= abs(value) < 1e6:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"
