# SPDX-License-Identifier: MIT
"""Options that several commands share."""

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fragtracer.errors import FragtracerError

if TYPE_CHECKING:
    from fragtracer.scene import Scene

SCENE_HELP = "Name of a bundled scene, or path of a .toml scene or a model: .obj, .ply, .gltf, .glb, .npz."
SceneArgument = Annotated[str, typer.Argument(help=SCENE_HELP)]


def parse_size(text: str | None) -> tuple[int, int] | None:
    """(width, height) from "640x480"; None stays None.

    Raises
    ------
    FragtracerError
        If the text is not two whole numbers from 1 to 16384.
    """
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match or not all(1 <= int(side) <= 16384 for side in match.groups()):
        raise FragtracerError(f"--size {text}: give width x height in pixels, each from 1 to 16384, as --size 640x480")
    return int(match[1]), int(match[2])


def with_settings(scene: "Scene", **settings: Any) -> "Scene":
    """``scene`` with other render settings; those that are None stay.

    Raises
    ------
    FragtracerError
        If two of them do not go together.
    """
    from pydantic import ValidationError

    changed = {name: value for name, value in settings.items() if value is not None}
    try:
        return replace(scene, render=replace(scene.render, **changed))
    except ValidationError as error:
        raise FragtracerError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None


MultipleScattering = Annotated[
    bool | None, typer.Option(help="Give rough lobes what their facets reflect more than once.")
]
SizeOption = Annotated[
    str | None, typer.Option("--size", metavar="WxH", help="Image size in pixels.  [default: the scene's]")
]
