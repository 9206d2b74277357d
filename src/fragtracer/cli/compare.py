# SPDX-License-Identifier: MIT
"""``fragtracer compare`` and ``export-mitsuba``: the same scene in Mitsuba."""

from pathlib import Path
from typing import Annotated

import typer

from fragtracer.cli.options import SceneArgument, SizeOption, parse_size


def compare(scene: SceneArgument, size: SizeOption = None) -> None:
    """Render SCENE here and in Mitsuba and test whether the two agree."""
    raise NotImplementedError(scene, parse_size(size))


def export_mitsuba(
    scene: SceneArgument,
    folder: Annotated[Path, typer.Argument(help="Folder to write scene.xml into.")],
    plugin: Annotated[
        bool, typer.Option(help="Materials as fragtracer's own plugin, not the nearest built-in.")
    ] = False,
) -> None:
    """Write SCENE as a Mitsuba XML file."""
    from fragtracer.reference.export import export_mitsuba as export
    from fragtracer.scene_file import load

    for note in export(load(scene), folder, plugin):
        print(note)
    print(f"{folder / 'scene.xml'}: written")
