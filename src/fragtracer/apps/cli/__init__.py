# SPDX-License-Identifier: MIT
"""The ``fragtracer`` command. Exit status: 0 done, 1 a check failed, 2 bad input, 130 interrupted."""

import signal
import sys
import warnings

import typer

from fragtracer.apps.cli import bench, compare, develop, doctor, info, render, scenes, view
from fragtracer.errors import FragtracerError

app = typer.Typer(
    help="A path tracer in one GLSL fragment shader, proved against Mitsuba.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (
    view.view,
    render.render,
    develop.develop,
    compare.compare,
    compare.export_mitsuba,
    bench.bench,
    doctor.doctor,
    info.info,
    scenes.scenes,
):
    app.command()(command)


def main() -> None:
    """Run the command line; errors of input become one message and exit status 2."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
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
