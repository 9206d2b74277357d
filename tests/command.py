# SPDX-License-Identifier: MIT
"""The command in the process of a test."""

import signal
import sys
import warnings
from typing import Any

import pytest

from fragtracer.apps import cli
from fragtracer.renderer import Renderer

TINY = ("--size", "16x12", "--bounces", "1")


def status_of(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    """The exit status of a command in this process."""
    monkeypatch.setattr(sys, "argv", ["fragtracer", *map(str, words)])
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # which main() changes
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    try:
        cli.main()
    except SystemExit as end:
        return end.code
    return 0


def interrupted(monkeypatch: pytest.MonkeyPatch, number: int) -> list[int]:
    """Interrupts what renders before its pass ``number``. The samples per pixel before each pass, from now on."""
    draw, passes = Renderer._draw_pass, list[int]()

    def interrupting(renderer: Renderer, *arguments: Any) -> None:
        passes.append(renderer.spp)
        if len(passes) == number:
            raise KeyboardInterrupt
        draw(renderer, *arguments)

    monkeypatch.setattr(Renderer, "_draw_pass", interrupting)
    return passes
