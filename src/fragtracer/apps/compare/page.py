# SPDX-License-Identifier: MIT
"""Writes a template of this folder to an .html file that needs nothing but itself."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from fragtracer import output
from fragtracer.apps.compare import words
from fragtracer.errors import FragtracerError

_FOLDER = Path(__file__).parent


def write_page(path: str | Path, template: str, facts: Mapping[str, Any]) -> None:
    """Fill the ``template`` of that name with ``facts``, and with the style that all pages share.

    Raises
    ------
    OutputError
        If the file cannot be written.
    FragtracerError
        If Jinja is not installed.
    """
    output.check_writable(path, [".html"])
    text = rendered(template, facts)
    with output.replacing(path) as part:
        part.write_text(text, "utf-8", newline="\n")


def check_installed() -> None:
    """Raise :class:`FragtracerError` if a library that pages are made with is missing."""
    for module, name in (("jinja2", "Jinja"), ("matplotlib", "Matplotlib")):
        try:
            import_module(module)
        except ImportError as error:
            raise FragtracerError(f"{name} is not installed; pip install 'fragtracer[reference]'") from error


def rendered(template: str, facts: Mapping[str, Any]) -> str:
    """The text of the page."""
    try:
        from jinja2 import Environment, FileSystemLoader, StrictUndefined
    except ImportError as error:
        raise FragtracerError("Jinja is not installed; pip install 'fragtracer[reference]'") from error
    loader = FileSystemLoader(_FOLDER)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters |= {"percent": words.percent, "exact": words.exact, "minus": words.minus}
    environment.globals |= {"with_error": words.with_error}
    return environment.get_template(template).render(facts, style=(_FOLDER / "report.css").read_text("utf-8"))
