# SPDX-License-Identifier: MIT
"""The ``fragtracer`` command. Exit status: 0 done, 1 a check failed or nobody reads the output any more, 2 bad input or
output that cannot be written, 130 interrupted."""

import gc
import signal
import sys
import warnings
from typing import Annotated, Any

import typer

from fragtracer import __version__
from fragtracer.apps.cli import bench, compare, develop, doctor, info, merge, render, scenes, streams, view, web
from fragtracer.apps.cli.options import Command
from fragtracer.errors import FragtracerError, OutputError

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
    """Run the command line; errors of input, and at the end those of standard output, become one message and exit
    status 2."""
    # A scene is many small objects that stay: by default, looking for garbage among them takes a third of its loading.
    gc.set_threshold(100_000)
    came = _note_signals()
    warnings.showwarning = lambda message, *_, **__: _tell(f"warning: {message}")
    with streams.lossy("stderr"), streams.lossy("stdout") as output:
        status = _run(came)
        sys.stdout.flush()
        if isinstance(output.error, BrokenPipeError):
            status = status or 1
        elif output.error is not None:
            _tell(f"cannot write to the standard output: {output.error.strerror}")
            status = status or 2
    sys.exit(status)


def _note_signals() -> list[int]:
    """Have SIGTERM and SIGHUP do what Ctrl-C does, and return where the signals that come are noted."""
    came: list[int] = []

    def interrupt(number: int, frame: Any) -> None:
        came.append(number)
        signal.default_int_handler(number, frame)

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, interrupt)
    return came


def _run(came: list[int]) -> int:
    """The exit status of the command. After a signal that ``came`` any error is an interruption."""
    try:
        app()
        status = 0
    except SystemExit as end:
        status = int(end.code or 0)
    except FragtracerError as error:
        status = 130 if came and not isinstance(error, OutputError) else 2
        if status == 2:
            _tell(str(error))
    except MemoryError as error:
        _tell(f"there is not enough memory for this: {error}")
        status = 2
    except KeyboardInterrupt:
        status = 130
    except Exception:
        if not came:
            raise
        status = 130
    if status == 130:
        _tell("interrupted")
    return status


def _tell(message: str) -> None:
    print(f"fragtracer: {message}", file=sys.stderr)
