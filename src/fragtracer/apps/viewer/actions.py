# SPDX-License-Identifier: MIT
"""What menu items and keys do to a session."""

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer import picking
from fragtracer.apps.viewer.display import DisplaySettings
from fragtracer.apps.viewer.document import is_light
from fragtracer.apps.viewer.input import Click
from fragtracer.apps.viewer.panels import scene as scene_panel
from fragtracer.apps.viewer.session import Session, file_name, fresh
from fragtracer.errors import SceneError
from fragtracer.io import toml
from fragtracer.io.playing import played
from fragtracer.resources import folder

_LIGHT_SHARE = 0.1  # of the distance to the target, that is framed around a light that is smaller


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
        case "play", _:
            if played(session.document.scene):
                session.playback.plays = not session.playback.plays
            else:
                session.say("Nothing plays here: models with animations have a choice of them in the scene panel")
        case "home", _:
            session.camera = session.home
        case "keep", slot:
            session.keep_viewpoint(int(slot))
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
        case "add", kind:
            scene_panel.add_light(session, kind)
        case _:
            return False
    return True


def take(session: Session, path: Path) -> None:
    """Take a dropped file: an .hdr or .exr image becomes the environment, anything else is opened.

    Raises
    ------
    FragtracerError
        If that is impossible; nothing has changed then.
    """
    suffix = path.suffix.lower()
    if suffix in (".png", ".jpg", ".jpeg"):
        raise SceneError(f"{path}: a picture that is dropped becomes the environment, and must be an .hdr or .exr file")
    if suffix in (".hdr", ".exr"):
        session.light_by(path)
    else:
        session.open(path)


def click(session: Session, where: Click, aspect: float, has_marks: bool = False) -> None:
    """Select what was clicked, or put it in focus; ``has_marks`` if those of lights lie over the picture."""
    origin, direction = cameras.ray(session.camera, where.x, where.y, aspect)
    hit = picking.pick(session.posed, origin, direction)
    if not where.focuses:
        mark = picking.pick_mark(session.posed, session.camera, where.x, where.y, aspect) if has_marks else None
        session.selected = mark or (hit[0] if hit else None)
    elif hit:
        _, _, forward = cameras.axes(session.camera)
        distance = float(hit[1] * (direction @ forward))
        session.camera = replace(session.camera, focus_distance=distance)
        opened = "" if session.camera.aperture_radius > 0 else "; open the aperture to see it"
        session.say(f"Focus at {distance:.3g} m{opened}")


def look_at_selected(session: Session) -> None:
    """Move the camera so that the selection fills the picture."""
    if session.selected is None:
        session.say("Nothing is selected: click on an object to frame it")
        return
    part = session.posed.part(session.selected)
    ball = picking.bounds(part)
    if ball is None:
        session.say("This has no bounds to frame")
        return
    center, radius = ball
    least = _LIGHT_SHARE * cameras.distance(session.camera) if is_light(part) else 0.0
    session.camera = cameras.frame(session.camera, center, max(radius, least))


def save_path(session: Session) -> Path:
    """Where Ctrl+S writes: the scene's own file, or for a bundled scene or a model a new one in the current folder."""
    is_scene = session.path is not None and session.path.suffix.lower() == ".toml"
    if is_scene and session.path is not None and session.path.parent != folder("scenes"):
        return session.path
    return fresh(Path.cwd() / f"{file_name(session.document.scene.name)}.toml")


def render_command(session: Session, size: tuple[int, int], spp: int) -> str:
    """The command line that renders the picture in the window.

    A scene that differs from its file, be it by the camera alone, is written to a new one in the current folder.
    """
    scene = session.document.scene
    is_as_in_file = session.is_saved and session.camera == session.home
    if is_as_in_file and session.path is not None and not (session.document.hidden or session.playback.models):
        name = scene.name if session.path.parent == folder("scenes") else str(session.path)
    else:
        path = fresh(Path.cwd() / f"{file_name(scene.name)}.toml")
        toml.save(session.shown, path)
        name = path.name
    words = ["fragtracer", "render", name, "-o", f"{file_name(scene.name)}.png"]
    words += ["--size", f"{size[0]}x{size[1]}", "--spp", str(max(spp, 1))]
    usual = look(DisplaySettings())
    for key, value in look(session.display).items():
        option = f"--{key.replace('_', '-')}"
        if value != usual[key]:
            words += [option] if value is True else [option, value if isinstance(value, str) else f"{value:g}"]
    return shlex.join(words)


def look(shown: DisplaySettings) -> dict[str, Any]:
    """How the window shows radiance, as :func:`fragtracer.write_image` takes it."""
    return {
        "exposure": "auto" if shown.auto_exposure else shown.exposure,
        "tonemap": shown.tone_curve,
        "gamma": shown.gamma,
        "bloom": shown.bloom_strength if shown.has_bloom else 0.0,
        "bloom_threshold": shown.bloom_threshold,
        "bloom_alone": shown.view == "bloom",
    }
