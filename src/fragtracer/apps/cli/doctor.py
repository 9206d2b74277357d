# SPDX-License-Identifier: MIT
"""``fragtracer doctor``: whether this machine's driver computes what it should."""

from pathlib import Path
from typing import Annotated

import typer


def doctor(
    report: Annotated[Path | None, typer.Option(help="Write the findings as a page, .html.")] = None,
) -> None:
    """Check the OpenGL driver in about a minute, without Mitsuba. Status 1 if a check fails."""
    from rich.console import Console

    from fragtracer import __version__
    from fragtracer.apps.doctor import examine
    from fragtracer.apps.doctor.report import write_report
    from fragtracer.gpu.context import create_context, describe, has_images, skips_branches
    from fragtracer.output import check_writable

    if report is not None:
        check_writable(report, {".html"})
    context = create_context()
    machine = {"fragtracer": __version__, **describe(context)}
    console = Console(highlight=False)
    console.print(f"fragtracer {__version__} on {machine['GL renderer']}, {machine['GL version']}")
    if has_images(context) and not skips_branches(context):
        console.print("llvmpipe of Mesa 25 or later would make 1.1 to 2.4 times as many samples a second")
    findings = []
    for finding in examine(context):
        findings.append(finding)
        mark = "[green]passed[/]" if finding.passed else "[bold red]FAILED[/]"
        console.print(f"{mark}  {finding.check:14}{finding.subject:37}", end="")
        console.print(finding.detail, markup=False)
        if not finding.passed:
            console.print(f"        which means: {finding.meaning}")
    failed = sum(not finding.passed for finding in findings)
    console.print(f"{len(findings) - failed} passed, {failed} failed")
    if report is not None:
        write_report(report, machine, findings)
    context.release()
    if failed:
        raise typer.Exit(1)
