# SPDX-License-Identifier: MIT
"""Progress bars on the terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from fragtracer import renderer
from fragtracer.apps.cli.words import counted


@contextmanager
def render_progress(
    spp: int | None, seconds: float | None, pixels: int
) -> Iterator[Callable[["renderer.Progress"], None]]:
    """A bar for a render that ends at ``spp`` samples or after ``seconds``, whichever comes first.

    Yields the function to call with each :class:`fragtracer.renderer.Progress`.
    """
    columns = (
        BarColumn(),
        TextColumn("{task.fields[samples]}"),
        TextColumn("{task.fields[speed]}"),
        TextColumn("{task.fields[error]}"),
        TextColumn("{task.fields[workers]}"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        total = 1.0 if spp is not None or seconds is not None else None
        task = bar.add_task("", total=total, samples="", speed="", error="", workers="")

        def report(state: renderer.Progress) -> None:
            done = [state.spp / spp] if spp is not None else []
            done += [state.seconds / seconds] if seconds else []
            rate = state.spp * pixels / max(state.seconds, 1e-9) / 1e6
            bar.update(
                task,
                completed=min(max(done), 1.0) if done else None,
                samples=f"{state.spp:.0f} spp" if spp is None else f"{state.spp:.0f}/{spp} spp",
                speed=f"{rate:.1f} Msamples/s",
                error="" if state.relative_error is None else f"error {100 * state.relative_error:.2g} %",
                workers="" if state.workers is None else counted(state.workers, "worker"),
            )

        yield report


@contextmanager
def comparison_progress() -> Iterator[Callable[[str, float, int], None]]:
    """A bar for each renderer of a comparison. Yields what :func:`fragtracer.apps.compare.compare_scene` calls."""
    columns = (TextColumn("{task.description:12}"), BarColumn(), TextColumn("{task.fields[samples]}"))
    with Progress(*columns, TimeRemainingColumn(compact=True), console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def report(renderer: str, done: float, spp: int) -> None:
            if renderer not in tasks:
                tasks[renderer] = bars.add_task(renderer, total=spp, samples="")
            bars.update(tasks[renderer], completed=done, samples=f"{done:.0f}/{spp} spp")

        yield report
