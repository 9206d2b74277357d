# SPDX-License-Identifier: MIT
"""Compiles programs in a background process, so that no frame of the window waits for the driver.

Drivers cache compiled programs on disk. Once the background process has compiled a program and drawn
with it, the window's context loads it from that cache within milliseconds. Run as a module, this is that
process: it reads pickled (packed scene, program, sizes of films, targets of photons) from its input and answers each
with a byte.
"""

import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from fragtracer.gpu.tracer import TracerProgram
from fragtracer.packing import PackedScene
from fragtracer.packing.targets import Targets

Size = tuple[int, int]
Request = tuple[PackedScene, TracerProgram, list[Size], Targets | None]
_PATIENCE = 60.0  # seconds; then the window compiles by itself
_COMMAND = (sys.executable, "-m", "fragtracer.apps.viewer.compiler")


class BackgroundCompiler:
    """The background process, from the first request until :meth:`close`."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None  # that talks to it
        self._requests: queue.SimpleQueue[Request | None] = queue.SimpleQueue()
        self._asked = self._answered = 0
        self._asked_at = 0.0

    def ask(
        self, packed: PackedScene, program: TracerProgram, sizes: Iterable[Size], targets: Targets | None = None
    ) -> int:
        """Have ``program`` compiled for ``packed`` and films of ``sizes``, and that of photons if there are ``targets``
        of them; returns a number for :meth:`is_done`."""
        if self._process is None:
            self._start()
        self._asked += 1
        self._asked_at = time.monotonic()
        self._requests.put((packed, program, sorted({(_like(w), _like(h)) for w, h in sizes}), targets))
        return self._asked

    def is_done(self, number: int) -> bool:
        """Whether the request is answered, or the process has failed or takes too long."""
        process = self._process
        failed = process is None or process.poll() is not None or time.monotonic() - self._asked_at > _PATIENCE
        return self._answered >= number or failed

    def _start(self) -> None:
        self._process = subprocess.Popen(
            _COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self._thread = threading.Thread(target=self._serve, args=(self._process,), daemon=True)
        self._thread.start()

    def _serve(self, process: "subprocess.Popen[bytes]") -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            while (request := self._requests.get()) is not None:
                pickle.dump(request, process.stdin)
                process.stdin.flush()
                if not process.stdout.read(1):
                    return
                self._answered += 1
        except OSError:  # the process has ended; is_done sees it
            return

    def close(self) -> None:
        self._requests.put(None)
        if self._process is not None and self._thread is not None:
            self._process.kill()
            self._process.wait()
            self._thread.join()  # its pipes are broken
            for pipe in (self._process.stdin, self._process.stdout):
                assert pipe is not None
                with suppress(OSError):  # what was still to be written
                    pipe.close()


def _like(side: int) -> int:
    """A small stand-in for ``side``: llvmpipe compiles other code for powers of two."""
    return 64 if side & (side - 1) == 0 else 65


def main() -> None:
    """Compile what comes in on the standard input, until that ends."""
    from fragtracer.errors import FragtracerError
    from fragtracer.gpu.context import create_context
    from fragtracer.gpu.film import Film
    from fragtracer.gpu.tracer import Tracer
    from fragtracer.light_tracing.tracer import LightTracer

    if hasattr(os, "nice"):
        os.nice(5)  # the window's frames go first
    requests, answers = sys.stdin.buffer, sys.stdout.buffer
    sys.stdout = sys.stderr  # nothing else may write among the answers
    tracer: Any = None
    light: Any = None
    with create_context() as context:
        while True:
            try:
                packed, program, sizes, targets = pickle.load(requests)
            except EOFError:
                return
            try:
                if tracer is None:
                    tracer = Tracer(context, packed, program)
                else:
                    tracer.load(packed, program, recompile=True)
                for size in sizes:
                    film = Film(context, *size)
                    tracer.warm_up(film)
                    film.release()
                if targets is not None:
                    light = light or LightTracer(context)
                    light.load(packed, targets, (64, 64), program.level)
                    light.trace(0)
            except FragtracerError:  # the window gets it too, and shows it
                pass
            answers.write(b".")
            answers.flush()


if __name__ == "__main__":
    main()
