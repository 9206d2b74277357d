# SPDX-License-Identifier: MIT
"""The command in the process of a test."""

import signal
import sys
import warnings

import pytest

from fragtracer.apps import cli

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
