# SPDX-License-Identifier: MIT
"""``fragtracer merge``: films of disjoint samples into one."""

from pathlib import Path
from typing import Annotated

import typer

from fragtracer.apps.cli import options
from fragtracer.apps.cli.words import counted

Films = Annotated[list[Path], typer.Argument(metavar="FILM...", help="Folders of checkpoints, or .npz films.")]
Output = Annotated[
    Path, typer.Option("--output", "-o", help="Image file, or .npz for a film that can be merged again.")
]


def merge(
    films: Films,
    output: Output,
    exposure: options.Exposure = "0",
    tonemap: options.Tonemap = "linear",
    gamma: options.Gamma = 1.0,
) -> None:
    """Join FILMs of one scene and settings, rendered with --checkpoint, --no-adaptive and disjoint samples."""
    from fragtracer import films as saved
    from fragtracer.display.look import Look
    from fragtracer.errors import FilmError
    from fragtracer.io.images import check_writable, write_image
    from fragtracer.output import check_writable as check_file

    is_film = output.suffix.lower() == ".npz"
    if is_film:
        check_file(output, (".npz",))
    else:
        check_writable(output)
    look = (options.parse_exposure(exposure), tonemap, gamma)
    Look(*look)
    paths = [path / saved.NAME if path.is_dir() else path for path in films]
    if twice := next((path for path in paths if paths.count(path) > 1), None):
        raise FilmError(f"{twice}: is named more than once")
    joined = saved.merge({str(path): saved.SavedFilm.read(path) for path in paths})
    if is_film:
        joined.write(output)
    else:
        write_image(output, joined.pixels.mean[..., :3], joined.metadata, *look)
    error = joined.pixels.relative_error()
    print(f"{output}: {joined.spp} samples per pixel of {counted(len(paths), 'film')}, {100 * error:.2g} % mean error")
