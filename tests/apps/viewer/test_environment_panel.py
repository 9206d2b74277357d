# SPDX-License-Identifier: MIT
"""The environment in the viewer, without a window."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fragtracer as ft
from fragtracer.apps.viewer.actions import take
from fragtracer.apps.viewer.panels.environment import PRESETS, name_of
from fragtracer.apps.viewer.session import Session
from fragtracer.errors import FragtracerError
from fragtracer.scene import Environment, Panorama, Sky


def test_presets_know_their_names() -> None:
    assert [name_of(preset) for preset in PRESETS.values()] == list(PRESETS)
    assert name_of(replace(PRESETS["Overcast"], rotation_degrees=30.0, strength=2.0)) == "Overcast"
    assert name_of(Environment(sky=Sky(turbidity=7.0))) == "Edited"
    assert name_of(Environment(image=Panorama(np.ones((2, 4, 3)), "/tmp/sky.hdr"))) == "sky.hdr"


def test_a_dropped_picture_lights_the_scene(tmp_path: Path) -> None:
    for name, value in (("one.exr", 1.0), ("two.hdr", 2.0)):
        ft.write_image(tmp_path / name, np.full((4, 8, 3), value))
    session = Session.of(ft.load("three-spheres"))
    take(session, tmp_path / "one.exr")
    environment = session.document.scene.environment
    assert environment is not None
    assert (environment.pixels == 1).all()
    turned = replace(session.document.scene, environment=replace(environment, rotation_degrees=20.0))
    session.edit(replace(session.document, scene=turned), "turn")
    take(session, tmp_path / "two.hdr")
    environment = session.document.scene.environment
    assert environment is not None
    assert (environment.pixels == 2).all()
    assert environment.rotation_degrees == 20.0
    with pytest.raises(FragtracerError, match=r"none\.hdr"):
        take(session, tmp_path / "none.hdr")
    assert session.document.scene.environment == environment
