# SPDX-License-Identifier: MIT
"""Controls of the animations of models: which one moves a mesh, and the moment that is shown."""

from collections.abc import Sequence

from imgui_bundle import imgui

from fragtracer.apps.viewer.panels import objects, widgets
from fragtracer.apps.viewer.session import Session
from fragtracer.errors import FragtracerError
from fragtracer.io.playing import played
from fragtracer.scene import Mesh

_NONE = "none"
_MOST_MESHES = 16  # that are shown


def can_move(session: Session) -> list[int]:
    """The numbers of the meshes whose files have animations."""
    names = session.playback.names
    if not any(names.values()):
        return []
    return [i for i, mesh in enumerate(session.document.scene.meshes) if names.get(mesh.file or "")]


def edit(session: Session) -> None:
    """Controls for what :func:`can_move`."""
    scene, playback = session.document.scene, session.playback
    numbers = can_move(session)
    for number in numbers[:_MOST_MESHES]:
        mesh = scene.meshes[number]
        names = playback.names[mesh.file or ""]
        before = _chosen(mesh, names)
        imgui.push_id(number)
        after = widgets.choice(objects.title(scene, ("meshes", number)), before, [_NONE, *names])
        if mesh.pose is not None and mesh.pose.time is not None:
            widgets.pair("held at", f"{mesh.pose.time:g} s")
        imgui.pop_id()
        if after != before:
            _animate(session, number, None if after == _NONE else after)
    if len(numbers) > _MOST_MESHES:
        imgui.text_disabled(f"and {len(numbers) - _MOST_MESHES} more meshes")
    if played(scene):
        playback.plays = widgets.check("Play", playback.plays)
        time = widgets.slider("Time", playback.time, 0.0, playback.duration, "%.2f s")
        if time != playback.time:
            playback.plays, playback.time = False, time


def _chosen(mesh: Mesh, names: Sequence[str]) -> str:
    """The name of the animation that a mesh has, by name or by number."""
    if mesh.pose is None:
        return _NONE
    found = mesh.pose.animation
    return names[int(found)] if found not in names and found.isdecimal() and int(found) < len(names) else found


def _animate(session: Session, number: int, animation: str | None) -> None:
    try:
        session.animate(number, animation)
    except FragtracerError as error:
        session.problem = str(error)
