# SPDX-License-Identifier: MIT
"""Learns in a background process where light comes from, while the picture goes on without guiding and light tracing.

Run as a module, this is that process: it reads pickled (scene, settings) from its input and answers each with pickled
decisions about the two, None where it has failed.
"""

import os
import pickle
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import replace

from fragtracer.decisions import Decided
from fragtracer.guiding import same_light
from fragtracer.light_tracing import Decisions, decide_both
from fragtracer.scene import RenderSettings, Scene

Wanted = tuple[Scene, RenderSettings]
_SAMPLES = 2**14  # of a pixel, at least, that a picture in a window is taken to have: it need not have an end


class Guider:
    """One background process for each scene that is asked for, the next when it has answered."""

    def __init__(self) -> None:
        self._asked: Wanted | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None
        self._answer: Decisions | None = None

    def ask(self, scene: Scene, settings: RenderSettings) -> None:
        """Begin to decide about ``scene`` with ``settings``, unless that is asked already or another is being made."""
        if self._thread is not None:
            return
        if self.has_answered(scene, settings):
            return
        self._asked, self._answer = (scene, settings), None
        self._process = subprocess.Popen(
            [sys.executable, "-m", "fragtracer.apps.viewer.guider"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._thread = threading.Thread(target=self._talk, args=(self._process, self._asked), daemon=True)
        self._thread.start()

    def has_answered(self, scene: Scene, settings: RenderSettings) -> bool:
        """Whether it was asked about these last, and what was decided, if it has not failed, was taken."""
        if self._thread is not None or self._asked is None:
            return False
        return self._asked[1] == settings and same_light(self._asked[0], scene)

    def take(self) -> Decided | None:
        """What has been decided since the last call."""
        if self._thread is None or self._thread.is_alive() or self._asked is None:
            return None
        self._thread = None
        return None if self._answer is None else Decided(*self._asked, self._answer)

    def _talk(self, process: "subprocess.Popen[bytes]", wanted: Wanted) -> None:
        with suppress(OSError, pickle.UnpicklingError, EOFError):
            answer, _ = process.communicate(pickle.dumps(wanted))
            self._answer = pickle.loads(answer)

    def close(self) -> None:
        if self._process is not None and self._thread is not None:
            self._process.kill()
            self._thread.join()


def main() -> None:
    """Decide about what comes in on the standard input."""
    from fragtracer.errors import FragtracerError
    from fragtracer.gpu.context import create_context

    if hasattr(os, "nice"):
        os.nice(5)  # the window's frames go first
    answers = sys.stdout.buffer
    sys.stdout = sys.stderr  # nothing else may write into the answer
    scene, settings = pickle.load(sys.stdin.buffer)
    decisions: Decisions | None = None
    with suppress(FragtracerError), create_context() as context:
        decisions = decide_both(context, scene, replace(settings, spp=max(_SAMPLES, settings.spp)))
    pickle.dump(decisions, answers)
    answers.flush()


if __name__ == "__main__":
    main()
