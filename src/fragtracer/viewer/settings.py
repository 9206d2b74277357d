# SPDX-License-Identifier: MIT
"""What the viewer remembers between runs: imgui its layout, and this how radiance is shown."""

import json
import os
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from fragtracer.viewer.display import DisplaySettings

_KEPT = ("exposure", "gamma", "tone_curve", "error_range", "depth_range")
_FILE = "viewer.json"


def config_folder() -> Path:
    """The user's folder for settings of fragtracer, made if it is not there; the current one if it cannot be."""
    match sys.platform:
        case "win32":
            base = Path(os.environ.get("APPDATA", Path.home() / "AppData" / "Roaming"))
        case "darwin":
            base = Path.home() / "Library" / "Application Support"
        case _:
            base = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    folder = base / "fragtracer"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path.cwd()
    return folder


def remembered_display() -> DisplaySettings:
    """The display of the last run, or the usual one."""
    with suppress(OSError, ValueError, TypeError):
        kept = json.loads((config_folder() / _FILE).read_text("utf-8"))
        return replace(DisplaySettings(), **{name: kept[name] for name in _KEPT if name in kept})
    return DisplaySettings()


def remember_display(settings: DisplaySettings) -> None:
    """Keep ``settings`` for the next run; a folder that cannot be written to is no reason to complain."""
    with suppress(OSError):
        text = json.dumps({name: getattr(settings, name) for name in _KEPT})
        (config_folder() / _FILE).write_text(text, "utf-8")
