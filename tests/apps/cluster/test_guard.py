# SPDX-License-Identifier: MIT
"""What a worker unpickles."""

import json
import os
import pickle
from dataclasses import replace

import cloudpickle
import numpy as np
import pytest

import fragtracer.scene as scene_model
from fragtracer.apps import cluster
from fragtracer.apps.cluster import guard
from fragtracer.apps.cluster.sampling import EvenSampling
from fragtracer.apps.cluster.work import Block, Frame, empty
from fragtracer.apps.cluster.worker import render_part, versions
from fragtracer.io.toml import load
from fragtracer.sampling.allocation import StagePart, Window
from fragtracer.scene import Environment, Panorama


def test_all_that_scenes_are_made_of_is() -> None:
    found = [value for value in vars(scene_model).values() if isinstance(value, type)]
    classes = [value for value in found if value.__module__.startswith("fragtracer")]
    assert len(classes) > 20
    for value in classes:
        assert guard.loads(pickle.dumps(value)) is value


@pytest.mark.parametrize("name", ["still-life", "weekend"])
def test_scenes_are(name) -> None:
    """With the arrays of meshes, textures and images."""
    scene = load(name)
    scene = replace(scene, environment=Environment(image=Panorama(np.ones((2, 4, 3), np.float32))))
    content, _ = cluster._packed(scene)
    settings = replace(scene.render, adaptive="off", light_tracing="off", gradient_domain="off")
    assert guard.loads(content) == replace(scene, render=settings)


def test_tasks_are() -> None:
    items = np.ones((2, 3), np.int32)
    part = StagePart(Window(0, 0, 3, 2), 1, empty(2, 3), items, ((items, 4), (items, 16)))
    task = (render_part, "key", Frame(load("three-spheres").camera, 7), part)
    buffers: list[pickle.PickleBuffer] = []
    for content, kept in (
        (pickle.dumps(task), []),
        (pickle.dumps(task, protocol=5, buffer_callback=buffers.append), buffers),
    ):
        function, key, frame, found = guard.loads(content, buffers=kept)
        assert (function, key, frame, found.window) == (*task[:3], part.window)
        np.testing.assert_array_equal(found.samples, part.samples)
        np.testing.assert_array_equal(found.film.mean, part.film.mean)
    assert guard.loads(pickle.dumps(versions)) is versions


@pytest.mark.parametrize("value", [os.system, lambda: 1, EvenSampling, json.JSONDecoder, guard.loads])
def test_nothing_else_is(value) -> None:
    content = cloudpickle.dumps((render_part, Block(Window(0, 0, 8, 8), 32), value))
    with pytest.raises(pickle.UnpicklingError, match="this worker renders for fragtracer, and does nothing with"):
        guard.loads(content)
