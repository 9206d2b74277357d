# SPDX-License-Identifier: MIT
"""Opens the viewer, for a user or for a measurement."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.app import Viewer
from fragtracer.apps.viewer.session import Session, path_of
from fragtracer.apps.viewer.settings import Limits, config_folder, remember, remembered_display, remembered_limits
from fragtracer.errors import FragtracerError
from fragtracer.interruption import deferred
from fragtracer.io import toml
from fragtracer.output import check_writable, replacing
from fragtracer.scene import Scene

_ORBIT = np.radians(2.0)  # for each frame
_EDIT_EVERY = 100  # frames


def view(
    scene: Scene | str | Path,
    size: tuple[int, int] = (1280, 720),
    frames: int | None = None,
    screenshot: Path | None = None,
    stats: Path | None = None,
    orbit: bool = False,
    animation: str | int | None = None,
) -> None:
    """Open a window on a scene; returns when it is closed.

    Parameters
    ----------
    scene
        A scene, the name of a bundled one, or the path of a .toml file or a model.
    size
        Width and height of the window, in screen coordinates.
    frames
        Close after so many frames, and refine without end; left out, close when the user does, and refine up to
        the limits that are remembered.
    screenshot
        A .png file to write the window to, panels and all, when it closes.
    stats
        A .json file to write the times of the frames to.
    orbit
        Turn the camera about its target in each frame, and edit a material in every 100th, to
        measure response times.
    animation
        One that plays, of a model or of meshes of a scene, by name or number, in place of those of the file.

    Raises
    ------
    FragtracerError
        If the scene cannot be read, a file cannot be written, or there is no display.
    KeyboardInterrupt
        On Ctrl-C, after the frame that is being drawn; the files are written.
    """
    for path, suffix in ((screenshot, ".png"), (stats, ".json")):
        if path is not None:
            check_writable(path, [suffix])
    file = None if isinstance(scene, Scene) else path_of(scene)
    if animation is not None and isinstance(scene, Scene):
        raise FragtracerError("animation is for a scene that is read from a file; give its meshes a pose instead")
    loaded = scene if isinstance(scene, Scene) else toml.load(scene, animation=animation)
    name = None if animation is None else str(animation)
    ini = None if frames is not None else config_folder() / "viewer.ini"
    with Viewer(loaded, file, size, ini, name) as viewer:
        by_hand = frames is None
        if by_hand:
            viewer.session.display = remembered_display()
            limits = remembered_limits()
            viewer.session.max_samples, viewer.session.target_error = limits.samples, limits.error
        try:
            with rescue(viewer):
                with deferred():
                    viewer.frame()  # with which the window appears
                viewer.times.keeps_all = stats is not None
                _loop(viewer, frames, orbit)
            if by_hand:
                limits = Limits(viewer.session.max_samples, viewer.session.target_error)
                remember(viewer.session.display, limits)
        except KeyboardInterrupt:
            _write(viewer, screenshot, stats)
            raise
        _write(viewer, screenshot, stats)


def _loop(viewer: Viewer, frames: int | None, orbit: bool) -> None:
    done = 0
    while viewer.is_open and (frames is None or done < frames):
        if orbit:
            viewer.session.camera = cameras.orbit(viewer.session.camera, _ORBIT, 0.0)
            if done % _EDIT_EVERY == _EDIT_EVERY - 1:
                _edit(viewer.session)
        with deferred():
            viewer.frame()
        done += 1


def _edit(session: Session) -> None:
    """Give the first material another roughness."""
    name, material = next(iter(session.document.scene.materials.items()))
    edited = replace(material, roughness=0.6 if material.roughness < 0.55 else 0.5)
    session.edit(session.document.with_material(name, edited), "measure")
    session.saved = session.document.scene  # an edit that need not be rescued


@contextmanager
def rescue(viewer: Viewer) -> Iterator[None]:
    """Write an edited scene to the user's folder of settings when the block ends, however it ends.

    Raises
    ------
    FragtracerError
        In place of any other error, such as of a driver that gave up: it says where the scene is.
    """
    try:
        yield
    except Exception as error:
        path = viewer.session.rescue()
        place = f"; the scene is in {path}" if path else ""
        raise FragtracerError(f"the viewer cannot go on: {error}{place}") from error
    finally:
        if path := viewer.session.rescue():
            print(f"fragtracer: the edits that were not saved are in {path}", file=sys.stderr)


def _write(viewer: Viewer, screenshot: Path | None, stats: Path | None) -> None:
    if screenshot is not None:
        save_window(viewer, screenshot)
    if stats is not None:
        _write_stats(viewer, stats)


def save_window(viewer: Viewer, path: Path) -> None:
    """Write what the window shows to a .png file."""
    from PIL import Image

    with replacing(path) as part:
        Image.fromarray(viewer.grab()).save(part, format="PNG")


def _write_stats(viewer: Viewer, path: Path) -> None:
    figures = asdict(viewer.figures) | {"frame_milliseconds": viewer.times.summary()}
    with replacing(path) as part:
        part.write_text(json.dumps(figures, indent=2) + "\n", "utf-8")
