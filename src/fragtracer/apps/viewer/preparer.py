# SPDX-License-Identifier: MIT
"""The tables of an environment are made in a thread, so that no frame of the window waits for a sky."""

import threading

from fragtracer.packing.environment import environment_tables
from fragtracer.scene import Environment
from fragtracer.scene.environment import Source


class Preparer:
    """Makes tables one after the other; ``known`` is an environment that has its own already."""

    def __init__(self, known: Environment | None) -> None:
        self._ready = _source(known)
        self._environment: Environment | None = None  # that the thread is for
        self._thread: threading.Thread | None = None

    def begin(self, environment: Environment | None) -> bool:
        """Whether nothing is to be made for ``environment``; else it is begun, if nothing else is being made."""
        source = _source(environment)
        if source is None or source == self._ready:
            return True
        if self._thread is None:
            self._environment = environment
            self._thread = threading.Thread(target=environment_tables, args=(source,), daemon=True)
            self._thread.start()
        return False

    def take(self) -> Environment | None:
        """The environment for which the tables have been made since the last call."""
        if self._thread is None or self._thread.is_alive():
            return None
        self._thread = None
        self._ready = _source(self._environment)
        return self._environment


def _source(environment: Environment | None) -> Source | None:
    """What tables are made of; none for a black environment."""
    return None if environment is None or max(environment.scale) == 0 else environment.source
