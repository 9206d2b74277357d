# SPDX-License-Identifier: MIT
"""``fragtracer export-html``: a scene as a page that traces it."""

import re
from pathlib import Path
from typing import Annotated

import typer

from fragtracer.apps.cli import options
from fragtracer.errors import FragtracerError

Page = Annotated[Path, typer.Argument(metavar="PAGE", help="The file to write, .html.")]
Spp = Annotated[int | None, typer.Option(min=1, max=2**24, help="Samples per pixel of the poster.  [the scene's]")]
Time = Annotated[float, typer.Option(min=0.0, metavar="SECONDS", help="Time that the poster may take.")]


def export_html(
    scene: options.SceneArgument,
    output: Page,
    size: options.Size = None,
    spp: Spp = None,
    time: Time = 30.0,
    exposure: options.Exposure = "0",
    tonemap: options.Tonemap = "linear",
    size_limit: Annotated[
        str | None, typer.Option(metavar="5MB|400kB", help="Make images and meshes coarser until the page fits.")
    ] = None,
    fallback: Annotated[
        str | None, typer.Option(metavar="WxH,N", help="Embed N pictures to turn where nothing can be traced.")
    ] = None,
    denoise: Annotated[bool, typer.Option("--denoise", help="Denoise the poster, by Open Image Denoise.")] = False,
) -> None:
    """Write SCENE into one HTML file that shows a poster at once, and then traces the scene live in a browser."""
    from fragtracer.apps.cli.preparation import preparing
    from fragtracer.apps.web import SUFFIXES
    from fragtracer.apps.web import export_html as export
    from fragtracer.io.toml import load
    from fragtracer.output import check_writable

    check_writable(output, SUFFIXES)
    stops, pictures = options.parse_exposure(exposure), _turntable(fallback)
    pixels = options.parse_size(size)
    with preparing():
        made = export(load(scene), output, pixels, spp, time, stops, tonemap, size_limit, pictures, denoise)
    for note in made.notes:
        print(f"{output}: {note}")
    print(f"{output}: {output.stat().st_size / 1e3:,.0f} kB")


def _turntable(text: str | None) -> tuple[int, int, int] | None:
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,4})x(\d{1,4}),(\d{1,3})", text)
    if not match or not all(int(number) >= 1 for number in match.groups()):
        raise FragtracerError(f"--fallback {text}: give width, height and number of pictures, as 320x180,24")
    return int(match[1]), int(match[2]), int(match[3])
