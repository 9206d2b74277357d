# SPDX-License-Identifier: MIT
"""What menu items and keys do to a session."""

import shlex
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from fragtracer.resources import folder
from fragtracer.scene import RenderSettings
from fragtracer.viewer import camera as cameras
from fragtracer.viewer import picking
from fragtracer.viewer.input import Click
from fragtracer.viewer.panels import scene as scene_panel
from fragtracer.viewer.session import Session

_OPTIONS = ("bounces", "rays", "light_samples", "seed", "geometry", "estimator", "sampler", "pixel_filter")


def carry_out(session: Session, action: str) -> bool:
    """Do what ``action`` says; False if it is not for the session."""
    verb, _, rest = action.partition(" ")
    match verb, rest:
        case "undo", _:
            session.undo()
        case "redo", _:
            session.redo()
        case "save", _:
            session.save(save_path(session))
        case "reload", _:
            session.reload()
        case "open", name:
            session.open(name)
        case "pause", _:
            session.paused = not session.paused
        case "home", _:
            session.camera = session.home
        case "keep", slot:
            session.viewpoints[int(slot)] = session.camera
            session.say(f"Viewpoint {slot} kept")
        case "go", slot:
            session.camera = session.viewpoints.get(int(slot), session.camera)
        case "look", _:
            look_at_selected(session)
        case "hide", _ if session.selected is not None:
            session.edit(session.document.with_hidden(session.selected, True), f"hide {session.selected}")
            session.history.close()
        case "show", _:
            session.edit(replace(session.document, hidden=frozenset()), "show all")
        case "remove", _ if session.selected is not None:
            scene_panel.remove(session, session.selected)
        case "add", _:
            scene_panel.add_light(session)
        case _:
            return False
    return True


def click(session: Session, where: Click, aspect: float) -> None:
    """Select what was clicked, or put it in focus."""
    origin, direction = cameras.ray(session.camera, where.x, where.y, aspect)
    hit = picking.pick(session.document, origin, direction)
    if not where.focuses:
        session.selected = hit[0] if hit else None
    elif hit:
        _, _, forward = cameras.axes(session.camera)
        distance = float(hit[1] * (direction @ forward))
        session.camera = replace(session.camera, focus_distance=distance)
        opened = "" if session.camera.aperture_radius > 0 else "; open the aperture to see it"
        session.say(f"Focus at {distance:.3g} m{opened}")


def look_at_selected(session: Session) -> None:
    """Turn and move the camera to what is selected."""
    if session.selected is None:
        session.say("Select something to look at: click on it")
        return
    ball = picking.bounds(session.document.part(session.selected))
    if ball is None:
        session.say("This goes on for ever; it cannot be looked at as a whole")
        return
    session.camera = cameras.frame(session.camera, *ball)


def save_path(session: Session) -> Path:
    """Where Ctrl+S writes: the scene's own file, or for a bundled scene a new one in the current folder."""
    if session.path is not None and session.path.parent != folder("scenes"):
        return session.path
    return fresh(Path.cwd() / f"{session.document.scene.name}.toml")


def fresh(path: Path) -> Path:
    """``path``, or with a number where there is such a file."""
    number, free = 1, path
    while free.exists():
        number += 1
        free = path.with_stem(f"{path.stem}-{number}")
    return free


def render_command(session: Session, size: tuple[int, int], spp: int) -> str:
    """The command line that makes the picture in the window; save the scene first if it was edited."""
    settings, default = session.document.scene.render, RenderSettings()
    if session.is_saved and session.path is not None:
        settings_in_file: RenderSettings = session.document.scene.render
        name = session.path.stem if session.path.parent == folder("scenes") else str(session.path)
    else:
        settings_in_file, name = default, str(save_path(session))
    words = ["fragtracer", "render", name, "-o", f"{session.document.scene.name}.png"]
    words += ["--size", f"{size[0]}x{size[1]}", "--spp", str(max(spp, 1))]
    for field in fields(settings):
        value = getattr(settings, field.name)
        if field.name in _OPTIONS and value != getattr(settings_in_file, field.name):
            words += [f"--{field.name.replace('_', '-')}", str(value)]
    shown = session.display
    if shown.exposure:
        words += ["--exposure", f"{shown.exposure:g}"]
    if shown.tone_curve != "linear":
        words += ["--tonemap", shown.tone_curve]
    return shlex.join(words)


def camera_moved(session: Session) -> bool:
    """Whether the camera is not the file's."""
    return not np.allclose(session.camera.position, session.home.position) or session.camera != session.home
