# SPDX-License-Identifier: MIT
"""``fragtracer info``: what this machine offers, and what is missing with the mend."""

import platform
from importlib.util import find_spec

import typer

from fragtracer import __version__
from fragtracer.errors import FragtracerError


def info() -> None:
    """Print the OpenGL vendor, renderer, version and limits, and what is missing."""
    print(f"fragtracer {__version__}, Python {platform.python_version()}, {platform.platform()}")
    works = _print_opengl()
    _print_mitsuba()
    if not works:
        raise typer.Exit(2)


def _print_opengl() -> bool:
    from fragtracer.gpu.context import create_context, describe

    try:
        context = create_context()
    except FragtracerError as error:
        print(f"OpenGL         missing: {error}")
        return False
    for name, value in describe(context).items():
        print(f"{name:14} {value}")
    context.release()
    return True


def _print_mitsuba() -> None:
    if find_spec("mitsuba") is None:
        print("Mitsuba        missing: pip install 'fragtracer[reference]' (needed by compare alone)")
        return
    from importlib.metadata import version

    from fragtracer.reference.variant import choose_variant

    print(f"Mitsuba        {version('mitsuba')}, variant {choose_variant()}")
