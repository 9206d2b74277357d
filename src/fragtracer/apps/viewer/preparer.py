# SPDX-License-Identifier: MIT
"""Makes the tables of environments in a thread, so that no frame of the window waits for a sky."""

import threading

from fragtracer.packing.environment import environment_tables
from fragtracer.scene import Environment
from fragtracer.scene.environment import Source


class Preparer:
    """Makes tables one after the other; those of ``known`` are already there."""

    def __init__(self, known: Environment | None) -> None:
        self._ready = _source(known)
        self._environment: Environment | None = None  # that the thread is for
        self._thread: threading.Thread | None = None

    def begin(self, environment: Environment | None) -> bool:
        """Whether the tables of ``environment`` are ready; if not, begin to make them unless others are being made."""
        source = _source(environment)
        if source is None or source == self._ready:
            return True
        if self._thread is None:
            self._environment = environment
            # Compensated, as all estimators but one want them.
            self._thread = threading.Thread(target=environment_tables, args=(source, True), daemon=True)
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
    """What its tables are made from; None for a black environment, which needs none."""
    return None if environment is None or max(environment.scale) == 0 else environment.source
