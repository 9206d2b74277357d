# SPDX-License-Identifier: MIT
"""The benchmark as one HTML page that needs nothing else: tables, plots, machine and settings."""

import io
from collections.abc import Iterator
from html import escape

from fragtracer.apps.bench.statistics import Estimate
from fragtracer.apps.bench.tables import Cell, Plot, Results, Row, Table, show
from fragtracer.apps.bench.text import title, used_columns
from fragtracer.errors import FragtracerError

_STYLE = """\
body { font: 15px/1.5 system-ui, sans-serif; max-width: 75em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } th, td { padding: .2em .7em; border-bottom: 1px solid #ddd }
th { text-align: left } td.number { text-align: right; white-space: nowrap } svg { max-width: 100%; height: auto }
.note { color: #666 }
"""


def check_plots() -> None:
    """Raises :class:`FragtracerError` if the library for plots is missing."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise FragtracerError("--report needs matplotlib; pip install 'fragtracer[bench]'") from None


def to_html(results: Results) -> str:
    """The whole page."""
    body = ["<h1>fragtracer bench</h1>"]
    if not results.complete:
        body.append("<p><strong>Ended early: some rows are missing.</strong></p>")
    for table in results.tables:
        body += _table_html(table)
        body += [_svg(table, plot) for plot in table.plots if _has_points(table, plot)]
    body += ["<h2>Machine</h2>", _facts(results.machine)]
    if results.settings:
        body += ["<h2>Settings</h2>", _facts(results.settings)]
    head = f'<meta charset="utf-8"><title>fragtracer bench</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(body) + "\n</body></html>\n"


def _table_html(table: Table) -> Iterator[str]:
    columns = used_columns(table)
    yield f"<h2>{escape(title(table))}</h2>\n<table><tr>"
    yield "".join(f"<th>{escape(column.title)}</th>" for column in columns) + "</tr>"
    for row in table.rows:
        yield "<tr>" + "".join(_cell(row.get(column.name)) for column in columns) + "</tr>"
    yield "</table>"
    for note in table.notes:
        yield f'<p class="note">{escape(note)}</p>'


def _cell(cell: Cell) -> str:
    number = "" if cell is None or isinstance(cell, str) else ' class="number"'
    return f"<td{number}>{escape(show(cell))}</td>"


def _facts(facts: dict[str, str]) -> str:
    rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in facts.items())
    return f"<table>{rows}</table>"


def _svg(table: Table, plot: Plot) -> str:
    """The plot with the spread as bars."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for number, (curve, rows) in enumerate(_curves(table, plot).items()):
        for style, name in zip(("o-", "s--", "^:"), plot.y, strict=False):
            points = _points(rows, plot, name)
            x, y = [x for x, _ in points], [y for _, y in points]
            label = f"{curve}, {name.partition('_')[0]}" if len(plot.y) > 1 else curve
            spread = [[e.value - e.low for e in y], [e.high - e.value for e in y]]
            axes.errorbar(x, [e.value for e in y], spread, fmt=style, color=f"C{number}", label=label, capsize=2)
    axes.set(xscale=plot.x_scale, yscale=plot.y_scale, xlabel=plot.x_title, ylabel=plot.y_title)
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.legend(title=", ".join(column.title for column in table.columns if column.name in plot.by))
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _has_points(table: Table, plot: Plot) -> bool:
    return any(_points(table.rows, plot, name) for name in plot.y)


def _points(rows: list[Row], plot: Plot, name: str) -> list[tuple[float, Estimate]]:
    """Column ``name`` over x, without the cells that are empty or that a logarithm cannot show."""
    points = [(_as_estimate(row.get(plot.x)).value, _as_estimate(row.get(name))) for row in rows if row.get(name)]
    return [
        (x, y) for x, y in points if (x > 0 or plot.x_scale == "linear") and (y.value > 0 or plot.y_scale == "linear")
    ]


def _curves(table: Table, plot: Plot) -> dict[str, list[Row]]:
    """The rows of each curve by what sets it apart."""
    curves: dict[str, list[Row]] = {}
    for row in table.rows:
        curves.setdefault(", ".join(str(row.get(name)) for name in plot.by), []).append(row)
    return curves


def _as_estimate(cell: Cell) -> Estimate:
    if isinstance(cell, Estimate):
        return cell
    value = float(cell or 0)
    return Estimate(value, value, value, 1)
