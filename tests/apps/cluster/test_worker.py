# SPDX-License-Identifier: MIT
"""A worker that cannot render what it is asked for."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from fragtracer.apps.cluster import worker
from fragtracer.apps.cluster.work import Block, Frame, empty
from fragtracer.errors import DeviceError
from fragtracer.io.toml import load
from fragtracer.sampling.allocation import Window


class Renderer:
    """Draws the seed; fails where that is to become 2, when it has been set, and then even to close."""

    driver = "a driver"

    def __init__(self, scene, **_) -> None:
        self.scene, self.seed, self.is_open = scene, 0, True

    def reset(self, scene, seed) -> None:
        self.scene, self.seed = scene, seed
        if seed == 2:
            raise DeviceError("no memory is left")

    def origin(self) -> dict[str, str]:
        return {"seed": str(self.seed)}

    def block(self, window, _):
        return replace(empty(window.height, window.width), mean=np.full((2, 3, 4), self.seed, np.float32))

    def close(self) -> None:
        self.is_open = False
        if self.seed == 2:
            raise DeviceError("nothing is here to be released")


def test_a_frame_that_fails_is_none_of_the_next(monkeypatch) -> None:
    made = []

    def make(*arguments, **options):
        made.append(Renderer(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(worker, "Renderer", make)
    scene, part = load("three-spheres"), Block(Window(0, 0, 3, 2), 32)
    frames = [Frame(scene.camera, seed) for seed in (1, 2)]

    def render(frame):
        return worker.render_part(pickle.dumps(scene), "key", frame, part, "here")

    try:
        render(frames[0])
        with pytest.raises(DeviceError):
            render(frames[1])
        again = render(frames[0])
        assert (again.pixels.mean == 1).all()
        assert again.origin == {"seed": "1"}
        assert [renderer.is_open for renderer in made] == [False, True]
    finally:
        worker.close()
