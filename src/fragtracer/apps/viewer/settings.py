# SPDX-License-Identifier: MIT
"""What the viewer remembers between runs, besides imgui's layout: display settings, when to stop, and viewpoints."""

import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field
from pydantic.dataclasses import dataclass

from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.scene import Camera

_KEPT = (
    *("exposure", "auto_exposure", "gamma", "tone_curve", "bloom", "bloom_strength", "bloom_threshold"),
    *("error_range", "depth_range"),
)
_FILE = "viewer.json"
_LIMITS = "limits"
_VIEWPOINTS = "viewpoints.json"
_MOST_SCENES = 100  # whose viewpoints are kept, those that were written last


@dataclass(frozen=True)
class Limits:
    """When to stop refining: at so many ``samples`` per pixel, or at a relative ``error``; 0 for no limit."""

    samples: Annotated[int, Field(ge=0)] = 4096
    error: Annotated[float, Field(ge=0)] = 0.005


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
    """The display settings of the last run, or the defaults."""
    with suppress(ValueError, TypeError):
        kept = _remembered(_FILE)
        return replace(DisplaySettings(), **{name: kept[name] for name in _KEPT if name in kept})
    return DisplaySettings()


def remembered_limits() -> Limits:
    """When the last run stopped refining, or the defaults."""
    with suppress(ValueError, TypeError):
        return Limits(**_remembered(_FILE).get(_LIMITS, {}))
    return Limits()


def remember(display: DisplaySettings, limits: Limits) -> None:
    """Keep both for the next run; does nothing where the folder cannot be written."""
    with suppress(OSError):
        text = json.dumps({name: getattr(display, name) for name in _KEPT} | {_LIMITS: asdict(limits)})
        (config_folder() / _FILE).write_text(text, "utf-8")


def remembered_viewpoints(path: Path | None) -> dict[int, Camera]:
    """The viewpoints that were kept for the scene in the file ``path``, by their numbers."""
    if path is None:
        return {}
    with suppress(OSError, ValueError, TypeError, AttributeError):
        kept = _remembered(_VIEWPOINTS).get(str(path.resolve()), {})
        return {int(slot): Camera(**camera) for slot, camera in kept.items()}
    return {}


def remember_viewpoints(path: Path | None, viewpoints: Mapping[int, Camera]) -> None:
    """Keep the viewpoints of the scene in the file ``path``; does nothing where the folder cannot be written."""
    if path is None or not viewpoints:
        return
    with suppress(OSError, ValueError, TypeError, AttributeError):
        known = _remembered(_VIEWPOINTS)
        known.pop(str(path.resolve()), None)
        known[str(path.resolve())] = {str(slot): asdict(camera) for slot, camera in viewpoints.items()}
        text = json.dumps(dict(list(known.items())[-_MOST_SCENES:]))
        (config_folder() / _VIEWPOINTS).write_text(text, "utf-8")


def _remembered(file: str) -> dict[str, Any]:
    with suppress(OSError, ValueError):
        known = json.loads((config_folder() / file).read_text("utf-8"))
        return known if isinstance(known, dict) else {}
    return {}
