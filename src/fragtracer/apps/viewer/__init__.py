# SPDX-License-Identifier: MIT
"""The interactive viewer: a window in which a scene refines while it is looked at and edited."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragtracer.apps.viewer.run import view

__all__ = ["view"]


def __getattr__(name: str) -> Any:
    """Loads the window when it is asked for: the processes that work for it need none."""
    if name != "view":
        raise AttributeError(f"module 'fragtracer.apps.viewer' has no attribute {name!r}")
    from fragtracer.apps.viewer.run import view

    return view
