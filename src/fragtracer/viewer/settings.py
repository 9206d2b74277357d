# SPDX-License-Identifier: MIT
"""Where the viewer remembers its layout between runs."""

import os
import sys
from pathlib import Path


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
