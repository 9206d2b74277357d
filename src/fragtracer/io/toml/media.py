# SPDX-License-Identifier: MIT
"""``[medium.NAME]`` tables of a scene file: coefficients, and the name of a file with a grid."""

from pathlib import Path
from typing import Any

from fragtracer.errors import FragtracerError, OutputError
from fragtracer.io.toml.tables import build, join, plain, show
from fragtracer.io.toml.textures import relative
from fragtracer.io.volumes import read_density
from fragtracer.scene import Medium


def read_medium(table: Any, path: str, folder: Path, mistakes: list[str]) -> Medium | None:
    """Make the medium of the ``table`` at ``path`` of a file in ``folder``; None, with sentences in ``mistakes``, if
    that cannot be done."""
    if not isinstance(table, dict) or "density" not in table:
        return build(Medium, table, path, mistakes)
    file, where = table["density"], join(path, "density")
    if not isinstance(file, str):
        mistakes.append(f"{where}: must be the name of a .npy or .vol file in quotes, got {show(file)}")
        return None
    try:
        return build(Medium, {**table, "density": read_density(folder / file)}, path, mistakes)
    except FragtracerError as error:
        mistakes.append(f"{where}: {error}")
        return None


def plain_medium(medium: Medium, folder: Path) -> dict[str, Any]:
    """The table of ``medium`` for a file in ``folder``, the inverse of :func:`read_medium`.

    Raises
    ------
    OutputError
        If the grid is in no file.
    """
    table = plain(medium)
    if medium.density is not None:
        if medium.density.file is None:
            raise OutputError("density: this grid is in no file; fragtracer.save writes one beside the scene")
        table["density"] = relative(medium.density.file, folder)
    return table
