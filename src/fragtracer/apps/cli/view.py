# SPDX-License-Identifier: MIT
"""``fragtracer view``: a scene in a window."""

from pathlib import Path
from typing import Annotated

import typer

from fragtracer.apps.cli.options import SceneArgument, parse_size


def view(
    scene: SceneArgument = "three-spheres",
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the window.")] = "1280x720",
    frames: Annotated[int | None, typer.Option(min=1, help="Close after so many frames.")] = None,
    screenshot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Write the window to a file when it closes.")
    ] = None,
    stats: Annotated[Path | None, typer.Option(metavar="FILE.json", help="Write how long the frames took.")] = None,
    animation: Annotated[
        str | None, typer.Option(metavar="NAME", help="Play this animation of a glTF model, by name or number.")
    ] = None,
    orbit: Annotated[bool, typer.Option(help="Turn the camera and edit all the time, to measure.")] = False,
) -> None:
    """Open SCENE in a window, where it refines while you look around and edit it. F1 lists the keys."""
    from fragtracer.apps.viewer import view as open_viewer

    open_viewer(scene, parse_size(size) or (1280, 720), frames, screenshot, stats, orbit, animation)
