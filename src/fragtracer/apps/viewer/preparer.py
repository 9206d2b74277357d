# SPDX-License-Identifier: MIT
"""Makes the tables of environments in a thread, so that no frame of the window waits for a sky."""

import threading

from fragtracer.packing.environment import compensates, environment_tables
from fragtracer.scene import Scene
from fragtracer.scene.environment import Source


class Preparer:
    """Makes tables one after the other; those of ``known`` are already there."""

    def __init__(self, known: Scene) -> None:
        self._ready = _wanted(known)
        self._scene = known  # that the thread is for
        self._thread: threading.Thread | None = None

    def begin(self, scene: Scene) -> bool:
        """Whether the tables for ``scene`` are ready; if not, begin to make them unless others are being made."""
        wanted = _wanted(scene)
        if wanted is None or wanted == self._ready:
            return True
        if self._thread is None:
            self._scene = scene
            self._thread = threading.Thread(target=environment_tables, args=wanted, daemon=True)
            self._thread.start()
        return False

    def take(self) -> Scene | None:
        """The scene for which tables have been made since the last call."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        self._ready = _wanted(self._scene)
        return self._scene


def _wanted(scene: Scene) -> tuple[Source, bool] | None:
    """What the tables are made from; None for a black environment, which needs none."""
    environment = scene.environment
    if environment is None or max(environment.scale) == 0:
        return None
    return environment.source, compensates(scene.render)
