# SPDX-License-Identifier: MIT
"""The rows of the panels under a mouse and a keyboard, without a window."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from shutil import copyfile
from typing import Any

import numpy as np
import pytest
from imgui_bundle import imgui
from matplotlib.font_manager import findfont

import fragtracer as ft
from fragtracer.apps.viewer import theme
from fragtracer.apps.viewer.document import KINDS, Document
from fragtracer.apps.viewer.panels import render, scene, widgets
from fragtracer.apps.viewer.session import Session
from fragtracer.scene import Light, Material, Medium, Rectangle, Scene, Sphere, SpotLight

from .models import stage, tetrahedra


class Panel:
    """Shows ``row``, which takes and returns ``value``, and is used by hand."""

    def __init__(self, row: Callable[[Any], Any], value: Any) -> None:
        self.row, self.value = row, value
        self._io = imgui.get_io()
        for _ in range(2):
            self._turn()

    def _turn(self) -> None:
        self._io.delta_time = 0.1
        imgui.new_frame()
        imgui.set_next_window_pos(imgui.ImVec2(0, 0))
        imgui.set_next_window_size(imgui.ImVec2(400, 900))
        imgui.begin("panel")
        self.value = self.row(self.value)
        self.low, self.high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        imgui.end()
        imgui.render()

    def drag(self, right: float, at: float = 0.5) -> None:
        """The last item, ``at`` so much of its width, by some units to the right, in ten steps."""
        x, y = self.low.x + at * (self.high.x - self.low.x), (self.low.y + self.high.y) / 2
        self._io.add_mouse_pos_event(x, y)
        self._turn()
        self._io.add_mouse_button_event(0, True)
        self._turn()
        for step in range(1, 11):
            self._io.add_mouse_pos_event(x + right * step / 10, y)
            self._turn()
        self._io.add_mouse_button_event(0, False)
        self._turn()


@pytest.fixture
def panels() -> Iterator[None]:
    """What imgui needs."""
    context = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.display_size = imgui.ImVec2(800, 900)
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    yield
    imgui.destroy_context(context)


@pytest.mark.usefixtures("panels")
@pytest.mark.parametrize("around", [4e-6, 4.0, 4e6])
def test_a_drag_moves_by_a_part_of_what_is_looked_at(around: float) -> None:
    """Whatever its size, and in steps finer than what is shown."""
    places = Panel(lambda v: widgets.point("Position", v, around), (0.25 * around,) * 3)
    lengths = Panel(lambda v: widgets.length("Radius", v, around, 1e-6), 0.25 * around)
    for panel in (places, lengths):
        panel.drag(100.0, at=0.5)
    for before, after in ((0.25 * around, places.value[1]), (0.25 * around, lengths.value)):
        assert after - before == pytest.approx(0.2 * around, rel=0.15)
    lengths.drag(-1000.0)
    assert lengths.value == pytest.approx(1e-6 * around)


@pytest.mark.usefixtures("panels")
@pytest.mark.parametrize(
    ("row", "before"),
    [
        (lambda v: widgets.point("Position", v, 4.0), (0.1, -0.2, 0.123456789)),
        (lambda v: widgets.vector("Direction", v), (0.0, 1.0, 0.123456789)),
        (lambda v: widgets.color("Colour", v), (0.1, 0.2, 0.123456789)),
        (lambda v: widgets.color("Strength", v, hdr=True), (1e-9, 0.2, 123456.789)),
    ],
)
def test_what_is_not_edited_of_a_triple_keeps_all_its_digits(row: Any, before: tuple[float, ...]) -> None:
    """And what is edited has no more of them than it needs."""
    panel = Panel(row, before)
    panel.drag(30.0, at=0.1)
    assert panel.value[0] > before[0]
    assert panel.value[1:] == before[1:]
    assert len(repr(panel.value[0])) <= 11
    assert np.float32(panel.value[0]) != np.float32(before[0])


def everything() -> Scene:
    """Of sizes and strengths that no slider reaches."""
    materials_ = {
        "a": Material(coat=0.5),
        "gold": Material(metal="gold"),
        "glass": Material(model="dielectric", attenuation_color=(1e-5, 0.5, 1.0), attenuation_distance=1e-6),
        "milk": Material(model="dielectric", interior="milk", priority=1, abbe_number=123.0),
        "mixed": Material(blend="gold", blend_weight=0.123456789),
        "lamp": Material(emission=(1e-9, 1e9, 0.0)),
    }
    other = stage()
    return replace(
        other,
        camera=replace(other.camera, aperture_radius=1e-9, focus_distance=1e9),
        materials=materials_,
        media={"milk": Medium(mean_free_path=(2e-6, 1.0, 1e9), g=0.9999), "air": Medium(extinction=1e-12)},
        spheres=tuple(Sphere((i * 1e3, 0.0, 1e6), 1e-9 if i else 1e9, name) for i, name in enumerate(materials_)),
        rectangles=(Rectangle((0.0, 0.0, 0.0), (1e-7, 0.0, 0.0), (0.0, 1e7, 0.0), "a"),),
        meshes=(replace(tetrahedra().meshes[0], material="a"),),
        lights=(Light((1e9, 1e-9, 0.0), 1e-9, radiance=1e-9), Light((0.0, 0.0, 0.0), power=1e9)),
        spot_lights=(SpotLight((0.0, 0.0, 0.0), (1e-9, 1.0, 0.0), (1e9, 1e9, 1e9), 0.01, 0.02),),
        environment=ft.load("sun-sky").environment,
    )


@pytest.mark.usefixtures("panels")
def test_panels_that_are_shown_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor do they make another scene, which takes long where it has many parts."""

    def refused(*_: object) -> None:
        pytest.fail("a scene was made")

    for name in ("with_part", "with_material"):
        monkeypatch.setattr(Document, name, refused)
    monkeypatch.setattr(scene, "_edit", refused)
    session = Session.of(everything())
    before, camera = session.document, session.camera

    def show(_: None) -> None:
        scene.draw(session)
        assert render.edit(session.settings) is session.settings

    for kind in KINDS:
        for index in range(len(getattr(before.scene, kind))):
            session.selected = (kind, index)
            Panel(show, None)
            assert session.document is before, session.selected
            assert session.camera is camera
    assert session.toast == ""


@pytest.mark.usefixtures("panels")
def test_letters_of_other_scripts_are_those_of_a_font_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def has_letters(text: str) -> list[bool]:
        fonts = imgui.get_io().fonts
        fonts.clear_fonts()
        theme.load_font()
        return [fonts.fonts[0].is_glyph_in_font(ord(letter)) for letter in text]

    monkeypatch.setattr(theme, "_SYSTEM_FONTS", ("damaged.ttf", "of-this-test.ttf"))
    monkeypatch.setenv("HOME", str(tmp_path))
    assert has_letters("aЖΩ") == [True] * 3
    assert has_letters("א") == [False]
    folder = tmp_path / ".local" / "share" / "fonts" / "some"
    folder.mkdir(parents=True)
    (folder / "damaged.ttf").write_bytes(b"")
    copyfile(findfont("DejaVu Sans"), folder / "of-this-test.ttf")
    assert has_letters("aא") == [True] * 2
