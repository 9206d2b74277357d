# SPDX-License-Identifier: MIT
"""The menu bar and its keyboard shortcuts; both return the name of an action, which the viewer carries out."""

from collections.abc import Sequence

from imgui_bundle import imgui

from fragtracer.apps.viewer.panels import lights
from fragtracer.apps.viewer.session import Session

_KEY, _CTRL, _SHIFT, _ALT = imgui.Key, imgui.Key.mod_ctrl, imgui.Key.mod_shift, imgui.Key.mod_alt
KEYS = {
    _CTRL | _KEY.z: "undo",
    _CTRL | _SHIFT | _KEY.z: "redo",
    _CTRL | _KEY.y: "redo",
    _CTRL | _KEY.s: "save",
    _KEY.f12: "image png",
    _KEY.space: "pause",
    _KEY.p: "play",
    _KEY.tab: "panels",
    _KEY.f1: "help",
    _KEY.f: "look at selected",
    _KEY.m: "reference",
    _KEY.home: "home",
    _KEY.h: "hide",
    _ALT | _KEY.h: "show all",
    _KEY.delete: "remove",
    _KEY.escape: "dismiss",
}


def keys() -> str:
    """The action whose keys were pressed in this frame; "" for none."""
    if imgui.get_io().want_text_input:
        return ""
    for chord, action in KEYS.items():
        if imgui.is_key_chord_pressed(int(chord)):
            return action
    for slot in range(1, 10):
        key = getattr(_KEY, f"_{slot}")
        if imgui.is_key_chord_pressed(int(_CTRL | key)):
            return f"keep {slot}"
        if imgui.is_key_chord_pressed(int(key)):
            return f"go {slot}"
    return ""


def draw(session: Session, scenes: Sequence[str]) -> str:
    """The menu bar; returns the action that was chosen, "" for none."""
    chosen = ""

    def item(text: str, action: str, shortcut: str = "", enabled: bool = True, ticked: bool = False) -> None:
        nonlocal chosen
        if imgui.menu_item(text, shortcut, ticked, enabled)[0]:
            chosen = action

    if imgui.begin_menu("File"):
        if imgui.begin_menu("Open bundled scene"):
            for name in scenes:
                item(name, f"open {name}")
            imgui.end_menu()
        item("Reload", "reload", enabled=session.path is not None)
        item("Save scene", "save", "Ctrl+S")
        imgui.separator()
        item("Save image as PNG", "image png", "F12")
        item("Save image as EXR", "image exr")
        item("Copy as render command", "copy command")
        imgui.separator()
        item("Close", "close")
        imgui.end_menu()
    if imgui.begin_menu("Edit"):
        item("Undo", "undo", "Ctrl+Z", bool(session.history.past))
        item("Redo", "redo", "Ctrl+Shift+Z", bool(session.history.future))
        imgui.separator()
        for kind, name in lights.NEW.items():
            item(f"Add {name}", f"add {kind}")
        item("Hide selected", "hide", "H", session.selected is not None)
        item("Show all", "show all", "Alt+H", bool(session.document.hidden))
        item("Remove selected", "remove", "Del", session.selected is not None)
        imgui.end_menu()
    if imgui.begin_menu("View"):
        item("Panels", "panels", "Tab", ticked=True)
        item("Default layout", "layout")
        item("Home", "home", "Home")
        item("Compare with Mitsuba", "reference", "M")
        item("Play animations", "play", "P", session.playback.duration > 0, session.playback.plays)
        item("Frame selected", "look at selected", "F", session.selected is not None)
        imgui.end_menu()
    if imgui.begin_menu("Help"):
        item("Mouse and keys", "help", "F1")
        imgui.end_menu()
    return chosen
