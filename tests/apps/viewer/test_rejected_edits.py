# SPDX-License-Identifier: MIT
"""Edits that the scene model rejects: nothing changes, and the viewer goes on."""

import math

import pytest

import fragtracer as ft
from fragtracer.apps.viewer import actions
from fragtracer.apps.viewer.interface import Interface
from fragtracer.apps.viewer.layout import Area
from fragtracer.apps.viewer.panels import lights
from fragtracer.apps.viewer.panels import scene as scene_panel
from fragtracer.apps.viewer.session import Session
from fragtracer.apps.viewer.wipe import Wipe
from fragtracer.scene import Camera, Light, Material, Scene, Sphere


def test_glass_that_is_dragged_into_other_glass_stays_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    materials = {"glass": Material(model="dielectric"), "water": Material(model="dielectric", ior=1.33)}
    spheres = Sphere((0.0, 0.0, 0.0), 1.0, "glass"), Sphere((3.0, 0.0, 0.0), 1.0, "water")
    session = Session.of(Scene(Camera(), materials, spheres=spheres))
    session.selected = ("spheres", 0)
    interface, area = Interface(session, Wipe()), Area(0.0, 0.0, 400.0, 300.0)
    steps = [(0.5, 0.0, 0.0), (1.0, 0.0, 0.0)]
    monkeypatch.setattr(interface._gizmo, "drag", lambda *_: steps.pop(0))
    interface._drag_selected(area)
    assert session.document.scene.spheres[0].center == (0.5, 0.0, 0.0)
    assert session.toast == ""
    interface._drag_selected(area)
    assert session.document.scene.spheres[0].center == (0.5, 0.0, 0.0)
    assert session.toast.startswith("material.water.priority: shapes of 'glass' and 'water' may overlap")


def test_no_light_is_added_that_would_be_too_strong() -> None:
    session = Session.of(ft.load("mirror"))
    before = session.document
    session.camera = Camera((0.0, 0.0, 1e25), (0.0, 0.0, 0.0))
    for kind in ("lights", "spot_lights"):
        actions.carry_out(session, f"add {kind}")
        assert session.document == before
        assert session.selected is None
        assert "less than or equal to" in session.toast


def test_ambient_light_stays_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though imgui reads 1e39 as infinite."""
    session = Session.of(ft.load("mirror"))
    before = session.document
    typed = [(math.inf, 0.0, 0.0), (1.0, 2.0, 3.0)]
    monkeypatch.setattr(scene_panel.widgets, "color", lambda *_, **__: typed.pop(0))
    scene_panel._ambient(session)
    assert session.document == before
    scene_panel._ambient(session)
    assert session.document.scene.ambient.radiance == (1.0, 2.0, 3.0)


def test_a_light_so_large_that_its_power_is_too_large_keeps_its_radiance() -> None:
    light = Light((0.0, 0.0, 0.0), 1e18, radiance=1e10)
    assert lights.in_unit(light, "power") is light
