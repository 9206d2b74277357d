# SPDX-License-Identifier: MIT
"""The findings as an HTML page to attach to a bug report."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from fragtracer.apps.doctor import Finding
from fragtracer.output import replacing

_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>fragtracer doctor</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }}
table {{ border-collapse: collapse; width: 100%; margin: 1rem 0; }}
td, th {{ text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #8884; vertical-align: top; }}
.failed td {{ background: #d331; font-weight: 600; }} pre {{ white-space: pre-wrap; margin: 0; font-size: 13px; }}
</style>
<h1>fragtracer doctor: {verdict}</h1>
<table>{machine}</table>
<table><tr><th>check<th>subject<th>result<th>detail<th>time</tr>{findings}</table>
</html>
"""


def write_report(path: Path, machine: Mapping[str, str], findings: Sequence[Finding]) -> None:
    """Write a self-contained HTML page; raises :class:`OutputError` if it cannot be written."""
    facts = "".join(f"<tr><th>{escape(name)}<td>{escape(value)}</tr>" for name, value in machine.items())
    rows = "".join(map(_row, findings))
    failed = sum(not finding.passed for finding in findings)
    verdict = f"{failed} of {len(findings)} checks failed" if failed else f"all {len(findings)} checks passed"
    with replacing(path) as temporary:
        temporary.write_text(_PAGE.format(verdict=verdict, machine=facts, findings=rows), encoding="utf-8")


def _row(finding: Finding) -> str:
    style, result = ("", "passed") if finding.passed else (' class="failed"', f"FAILED: {finding.meaning}")
    cells = (finding.check, finding.subject, result)
    return (
        f"<tr{style}>" + "".join(f"<td>{escape(cell)}" for cell in cells)
        + f"<td><pre>{escape(finding.detail)}</pre><td>{finding.seconds:.2f} s</tr>"
    )  # fmt: skip
