# SPDX-License-Identifier: MIT
"""What a measurement was made on."""

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fragtracer import __version__
from fragtracer.gpu.context import create_context, describe

_PACKAGES = ("moderngl", "numpy", "mitsuba", "drjit")


def describe_machine() -> dict[str, str]:
    """Processor, OpenGL, versions, date and load, as text by name."""
    facts = {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "fragtracer": __version__,
        "processor": _processor(),
        "cores": str(_cores()),
        "system": f"{platform.system()} {platform.release().partition('-')[0]}, Python {platform.python_version()}",
    }
    if hasattr(os, "getloadavg"):
        facts["load before"] = f"{os.getloadavg()[0]:.1f} processes"
    context = create_context()
    facts |= {k: v for k, v in describe(context).items() if k.startswith("GL ")}
    context.release()
    return facts | {name: found for name in _PACKAGES if (found := _version(name))}


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
