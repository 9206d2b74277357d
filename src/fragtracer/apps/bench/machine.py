# SPDX-License-Identifier: MIT
"""What a measurement was made on."""

import os
import platform
from datetime import UTC, datetime

from fragtracer import __version__
from fragtracer.apps.compare.machine import cores, package_version, processor
from fragtracer.gpu.context import create_context, describe

_PACKAGES = ("moderngl", "numpy", "mitsuba", "drjit")


def describe_machine() -> dict[str, str]:
    """Processor, OpenGL, versions, date and load, as text by name."""
    facts = {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "fragtracer": __version__,
        "processor": processor(),
        "cores": str(cores()),
        "system": f"{platform.system()} {platform.release().partition('-')[0]}, Python {platform.python_version()}",
    }
    if hasattr(os, "getloadavg"):
        facts["load before"] = f"{os.getloadavg()[0]:.1f} processes"
    context = create_context()
    facts |= {k: v for k, v in describe(context).items() if k.startswith("GL ")}
    context.release()
    return facts | {name: found for name in _PACKAGES if (found := package_version(name))}
