# SPDX-License-Identifier: MIT
"""The ``fragtracer`` command. Exit status: 0 done, 1 a check failed, 2 bad input, 130 interrupted."""

import gc
import io
import signal
import sys
import warnings
from typing import Annotated

import typer

from fragtracer import __version__
from fragtracer.apps.cli import bench, compare, develop, doctor, info, merge, render, scenes, view, web
from fragtracer.apps.cli.options import Command
from fragtracer.errors import FragtracerError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (
    view.view,
    render.render,
    merge.merge,
    develop.develop,
    compare.compare,
    compare.export_mitsuba,
    bench.bench,
    doctor.doctor,
    web.export_html,
    info.info,
    scenes.scenes,
):
    app.command(cls=Command)(command)


_WITHOUT_WINDOW = {"render", "compare", "bench", "doctor", "info"}  # of the commands that draw


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"fragtracer {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """A path tracer in one GLSL fragment shader, proved against Mitsuba."""
    if context.invoked_subcommand in _WITHOUT_WINDOW:
        from fragtracer.gpu.context import use_wide_vectors

        use_wide_vectors()


def main() -> None:
    """Run the command line; errors of input become one message and exit status 2."""
    # A scene is many small objects that stay: by default, looking for garbage among them takes a third of its loading.
    gc.set_threshold(100_000)
    for name in ("SIGTERM", "SIGHUP"):  # as Ctrl-C: what there is is written; Windows has no SIGHUP
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # not all of them know minus signs, or the names of all files
            stream.reconfigure(errors="backslashreplace")
    warnings.showwarning = lambda message, *_, **__: print(f"fragtracer: warning: {message}", file=sys.stderr)
    try:
        app()
    except FragtracerError as error:
        print(f"fragtracer: {error}", file=sys.stderr)
        sys.exit(2)
    except MemoryError as error:
        print(f"fragtracer: there is not enough memory for this: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("fragtracer: interrupted", file=sys.stderr)
        sys.exit(130)
