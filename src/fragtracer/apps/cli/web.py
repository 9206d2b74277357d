# SPDX-License-Identifier: MIT
"""``fragtracer export-html``: a scene as a page that traces it."""

from pathlib import Path
from typing import Annotated

import typer

from fragtracer.apps.cli import options

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
) -> None:
    """Write SCENE into one HTML file that shows a poster at once, and then traces the scene live in a browser."""
    from fragtracer.apps.web import SUFFIXES
    from fragtracer.apps.web import export_html as export
    from fragtracer.io.toml import load
    from fragtracer.output import check_writable

    check_writable(output, SUFFIXES)
    stops = options.parse_exposure(exposure)
    for line in export(load(scene), output, options.parse_size(size), spp, time, stops, tonemap):
        print(line)
    print(f"{output}: {output.stat().st_size / 1e3:,.0f} kB")
