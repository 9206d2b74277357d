# SPDX-License-Identifier: MIT
"""The reference picture of what is on the screen, rendered in a background process: by Mitsuba, or for the
split-sum approximation by fragtracer's own path integrator.

Run as a module, this is that process: it reads a pickled (scene, size) from its input and writes to its output
one independent picture after another, each with the means of its blocks.
"""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.verdict import Means, scale_means
from fragtracer.scene import Scene

BATCH = 4  # samples per pixel of each picture
_MOST = 256  # pictures

Image = NDArray[np.float32]


class LiveReference:
    """Renders ``scene`` at ``size`` until :meth:`stop`; ``image`` is the mean so far, ``means`` are the means of
    blocks of each independent picture."""

    def __init__(self, scene: Scene, size: tuple[int, int]) -> None:
        self.image: Image | None = None
        self.spp = 0
        self.means: list[Means] = []
        self.problem = ""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "fragtracer.apps.viewer.reference"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        self._reader = threading.Thread(target=self._read, args=(scene, size), daemon=True)
        self._reader.start()

    def stop(self) -> None:
        """End the process, whatever it is doing."""
        self._process.kill()
        self._process.wait()

    def _read(self, scene: Scene, size: tuple[int, int]) -> None:
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            pickle.dump((scene, size), process.stdin)
            process.stdin.close()
            while True:
                self._add(*pickle.load(process.stdout))
        except (EOFError, OSError, pickle.UnpicklingError):
            if process.wait() > 0 or self.image is None:
                text = process.stderr.read().decode(errors="replace").strip()
                self.problem = text.splitlines()[-1] if text else "it ended without a picture"

    def _add(self, batch: Image, means: Means) -> None:
        done = self.spp // BATCH
        self.image = batch if self.image is None else (self.image * done + batch) / np.float32(done + 1)
        self.spp += BATCH
        self.means.append(means)


def _reference(scene: Scene, size: tuple[int, int]) -> Iterator[Image]:
    from fragtracer.reference.render import ReferenceRenderer

    with ReferenceRenderer(scene, size) as renderer:
        for seed in range(_MOST):
            yield renderer.sample(BATCH, seed).astype(np.float32)


def _truth(scene: Scene, size: tuple[int, int]) -> Iterator[Image]:
    from fragtracer.renderer import Renderer

    with Renderer(scene, size, integrator="path", rays=BATCH) as renderer:
        for seed in range(_MOST):
            renderer.reset(seed=seed)
            renderer.sample(BATCH)
            yield renderer.image()


def main() -> None:
    """Render what comes in on the standard input."""
    from fragtracer.errors import FragtracerError

    if hasattr(os, "nice"):
        os.nice(10)  # the window has priority
    scene, size = pickle.load(sys.stdin.buffer)
    output: Any = sys.stdout.buffer
    sys.stdout = sys.stderr  # only pictures may be written to the output
    try:
        for picture in _truth(scene, size) if scene.render.integrator == "split-sum" else _reference(scene, size):
            if not np.isfinite(picture).all():
                sys.exit("its picture has NaN or infinite pixels")
            pickle.dump((picture, scale_means(picture[None])), output)
            output.flush()
    except FragtracerError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
