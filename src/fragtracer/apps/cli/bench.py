# SPDX-License-Identifier: MIT
"""``fragtracer bench``: how fast, how its cost grows, and against Mitsuba."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from fragtracer.apps.cli.options import parse_size
from fragtracer.errors import FragtracerError

if TYPE_CHECKING:
    from fragtracer.apps.bench.plan import Plan, Progress
    from fragtracer.apps.bench.tables import Results

# Of bench/suite.py, which is slow to import.
NAMES = (
    "sweep",
    "speed",
    "error",
    "ablations",
    "sampling",
    "scaling",
    "lights",
    "meshes",
    "spheres",
    "memory",
    "environment",
)


def bench(
    what: Annotated[
        str, typer.Option(metavar="NAME,NAME,..", help=f"What to measure: {', '.join(NAMES)}, or all.")
    ] = "sweep",
    scene: Annotated[list[str] | None, typer.Option(help="On which scene; may be given several times.")] = None,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="Image size in pixels.")] = None,
    rays: Annotated[str | None, typer.Option(metavar="N,N,..", help="Paths per pixel in a frame.")] = None,
    bounces: Annotated[str | None, typer.Option(metavar="N,N,..", help="Scattering events on a path.")] = None,
    light_samples: Annotated[str | None, typer.Option(metavar="N,N,..", help="Shadow rays at each vertex.")] = None,
    runs: Annotated[int | None, typer.Option(min=1, max=1000, help="How often each number is measured.")] = None,
    time: Annotated[float | None, typer.Option(min=0.01, metavar="SECONDS", help="For each renderer and run.")] = None,
    row_limit: Annotated[float, typer.Option(min=0.1, metavar="SECONDS", help="Ignore slower frames.")] = 20.0,
    reference: Annotated[
        Literal["both", "own", "mitsuba"], typer.Option(help="Who makes the two halves of the converged image.")
    ] = "both",
    variant: Annotated[str | None, typer.Option(help="Mitsuba's, as cuda_ad_rgb.  [default: llvm_ad_rgb]")] = None,
    sampler: Annotated[
        Literal["best", "independent", "stratified", "multijitter", "orthogonal", "ldsampler"],
        typer.Option(help="Mitsuba's; best tries all of them on each scene."),
    ] = "best",
    json: Annotated[Path | None, typer.Option(help="Write everything, for --diff.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write the numbers.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page with plots, .html.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print Markdown tables.")] = False,
    diff: Annotated[tuple[Path, Path] | None, typer.Option(metavar="OLD NEW", help="Compare two --json files.")] = None,
) -> None:
    """Measure fragtracer on this machine: frames per second, growth of cost, error over time, against Mitsuba.

    Ctrl-C keeps the rows that are finished. Files are written at the end.
    """
    if diff is not None:
        _print_diff(*diff)
        return
    from fragtracer.apps.bench.plan import Plan, numbers

    plan = Plan(
        tuple(scene) if scene else None,
        parse_size(size),
        numbers(rays, "--rays"),
        numbers(bounces, "--bounces"),
        numbers(light_samples, "--light-samples"),
        runs,
        time,
        row_limit,
        reference,
        variant,
        sampler,
    )
    outputs = {suffix: path for suffix, path in ((".json", json), (".csv", csv), (".html", report)) if path}
    results = _measure(_names(what), plan, outputs)
    _print(results, markdown)
    _write(results, outputs)
    if results.failure:
        raise FragtracerError(results.failure)
    if not results.complete:
        raise typer.Exit(130)


def _names(what: str) -> list[str]:
    names = list(NAMES) if what == "all" else what.split(",")
    for name in names:
        if name not in NAMES:
            raise FragtracerError(f"--what {name}: there are {', '.join(NAMES)}, and all")
    return names


def _measure(names: list[str], plan: "Plan", outputs: dict[str, Path]) -> "Results":
    from fragtracer.apps.bench.cases import case
    from fragtracer.apps.bench.report import check_plots
    from fragtracer.apps.bench.suite import run_suite
    from fragtracer.output import check_writable

    if ".html" in outputs:
        check_plots()
    for suffix, path in outputs.items():
        check_writable(path, [suffix])
    for name in plan.scenes or ():
        case(name)  # a mistake shows now
    with _progress() as progress:
        return run_suite(names, plan, progress)


def _print_diff(old: Path, new: Path) -> None:
    from rich.console import Console

    from fragtracer.apps.bench.difference import difference
    from fragtracer.apps.bench.tables import Results, read_json
    from fragtracer.apps.bench.text import print_results

    print_results(Results({}, {}, [difference(read_json(old), read_json(new))]), Console())


def _print(results: "Results", markdown: bool) -> None:
    from rich.console import Console

    from fragtracer.apps.bench.text import print_results, to_markdown

    if markdown:
        print(to_markdown(results), end="")
    else:
        print_results(results, Console())


def _write(results: "Results", outputs: dict[str, Path]) -> None:
    from fragtracer.apps.bench.report import to_html
    from fragtracer.apps.bench.tables import to_csv, to_json
    from fragtracer.output import replacing, write_each

    writers = {".json": to_json, ".csv": to_csv, ".html": to_html}

    def write(path: Path) -> None:
        with replacing(path) as part:
            text = writers[path.suffix.lower()](results)
            part.write_text(text, encoding="utf-8", errors="replace")  # names of files
        print(f"{path}: written", file=sys.stderr)

    write_each(dict.fromkeys(outputs.values(), write))


@contextmanager
def _progress() -> Iterator["Progress"]:
    """A bar on the terminal with the time left."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda share, text: bar.update(task, completed=share, description=text)
