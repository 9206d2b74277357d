# SPDX-License-Identifier: MIT
"""Tables for the terminal and for Markdown pages."""

from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from fragtracer.apps.bench.statistics import Estimate
from fragtracer.apps.bench.tables import Column, Results, Table, show

_ENDED_EARLY = "ended early: the rows that were finished are kept"


def print_results(results: Results, console: Console) -> None:
    """Every table, and what must be known to read it."""
    for table in results.tables:
        _print_table(table, console)
    if not results.complete:
        console.print(_ENDED_EARLY)


def _print_table(table: Table, console: Console) -> None:
    columns = used_columns(table)
    grid = RichTable(title=Text(title(table)), title_justify="left")
    for column in columns:
        grid.add_column(column.title, justify="right" if _is_number(table, column) else "left")
    for row in table.rows:
        grid.add_row(*(Text(show(row.get(column.name))) for column in columns))
    console.print(grid)
    for note in table.notes:
        console.print(note, markup=False, highlight=False)


def to_markdown(results: Results) -> str:
    """Tables with machine and date, as they stand in docs/performance.md."""
    parts = []
    for table in results.tables:
        columns = used_columns(table)
        lines = [f"**{title(table)}**", ""]
        lines.append(_line([column.title for column in columns]))
        lines.append(_line(["---:" if _is_number(table, column) else "---" for column in columns]))
        lines += [_line([show(row.get(column.name)) for column in columns]) for row in table.rows]
        parts.append("\n".join(lines))
        parts += ["  \n".join(table.notes)] if table.notes else []
    machine = "; ".join(f"{name} {value}" for name, value in results.machine.items())
    parts += [] if results.complete else [_ENDED_EARLY]
    return "\n\n".join([*parts, f"Measured on: {machine}."]) + "\n"


def used_columns(table: Table) -> list[Column]:
    """The columns that tell something: without the empty ones, and those of keys that never change."""
    return [
        c for c in table.columns if c not in _constant(table) and any(row.get(c.name) is not None for row in table.rows)
    ]


def _constant(table: Table) -> list[Column]:
    if len(table.rows) < 2:
        return []
    keys = [c for c in table.columns if c.name in table.keys]
    return [c for c in keys if len({row.get(c.name) for row in table.rows}) == 1]


def title(table: Table) -> str:
    """The title with the keys that never change."""
    constants = [f"{c.title} {show(table.rows[0].get(c.name))}" for c in _constant(table)]
    return ", ".join([table.title, *constants])


def _is_number(table: Table, column: Column) -> bool:
    return any(isinstance(row.get(column.name), int | float | Estimate) for row in table.rows)


def _line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"
