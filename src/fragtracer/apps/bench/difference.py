# SPDX-License-Identifier: MIT
"""Two results of the benchmark against each other: ratios, with a verdict only where the spread allows one."""

from collections.abc import Iterator

from fragtracer.apps.bench.statistics import Estimate, compare
from fragtracer.apps.bench.tables import Column, Results, Row, Table, row_label, show

_SAME = ("processor", "cores", "GL renderer", "GL version", "mitsuba")


def difference(old: Results, new: Results) -> Table:
    """A table with a row for each number that both have."""
    result = Table(
        "diff",
        "new / old",
        (
            Column("table", "table"),
            Column("row", "row"),
            Column("number", "number"),
            Column("old", "old"),
            Column("new", "new"),
            Column("ratio", "new / old"),
            Column("verdict", "verdict"),
        ),
        keys=("table", "row", "number"),
        notes=list(_caveats(old, new)),
    )
    before = {table.name: table for table in old.tables}
    for table in new.tables:
        if table.name in before:
            result.rows += _table_rows(before[table.name], table)
    if not result.rows:
        result.notes.append("the two have no row in common")
    return result


def _caveats(old: Results, new: Results) -> Iterator[str]:
    for name in _SAME:
        if old.machine.get(name) != new.machine.get(name):
            yield f"not the same {name}: {old.machine.get(name)} against {new.machine.get(name)}"
    for results, which in ((old, "old"), (new, "new")):
        if not results.complete:
            yield f"the {which} run was interrupted"


def _table_rows(old: Table, new: Table) -> Iterator[Row]:
    before = {row_label(old, row): row for row in old.rows}
    for row in new.rows:
        label = row_label(new, row)
        for column in new.columns:
            pair = before.get(label, {}).get(column.name), row.get(column.name)
            if column.better is not None and (cells := _verdict(*pair, column.better == "more")):
                yield {"table": new.name, "row": label, "number": column.title, **cells}


def _verdict(old: object, new: object, more_is_better: bool) -> Row | None:
    if not isinstance(old, Estimate) or not isinstance(new, Estimate):
        return None
    ratio = new.value / old.value if old.value else None
    return {"old": show(old), "new": show(new), "ratio": ratio, "verdict": compare(old, new, more_is_better)}
