# SPDX-License-Identifier: MIT
"""What :mod:`.approximation` found, in words, as numbers for programs, as a page and as pictures."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.apps.compare import pictures, words
from fragtracer.apps.compare.approximation import ANGLES, Approximation, by_roughness_and_angle
from fragtracer.apps.compare.measures import auto_exposure
from fragtracer.apps.compare.page import write_page


def summary(found: Approximation) -> str:
    """A table of the errors for the terminal."""
    lines = [f"{found.scene.name}: the split-sum approximation against the path-traced truth, {found.spp} spp"]
    lines.append(f"{'':28}{'bias':>22}{'rms':>10}")
    for term in found.terms():
        bias = words.with_error(term.bias, term.bias_error)
        lines.append(f"{term.error:28}{bias:>22}{words.percent(term.rms):>10}")
    lines.append("Relative to the mean radiance of the surfaces in truth; the biases add up to the last.")
    return "\n".join([*lines, *doubts(found)])


def doubts(found: Approximation) -> list[str]:
    """What makes rows of the table mean something else, a sentence; empty if nothing does."""
    if not found.others:
        return []
    names = ", ".join(found.others)
    what = "what is not isotropic metallic-roughness without sheen, films and diffuse transmission"
    return [f"Rows mix in what the approximation leaves out of {what}: {names}."]


def to_json(found: Approximation) -> dict[str, Any]:
    """All numbers, as ``json.dump`` takes them: ``terms`` in order, the last being the whole difference, and
    ``spheres``, the relative difference by metallic, roughness and angle of view (``angles``, degrees)."""
    width, height = found.size
    return {
        "schema": 1,
        "scene": found.scene.name,
        "settings": {"width": width, "height": height, "spp": found.spp},
        "stages": [stage.name for stage in found.stages],
        "terms": [dict(vars(term)) for term in found.terms()],
        "doubts": doubts(found),
        "angles": list(ANGLES),
        "spheres": [
            {"metallic": metallic, "roughness": roughness, "difference": [v if v == v else None for v in row]}
            for metallic, roughness, row in by_roughness_and_angle(found)
        ],
        "machine": {"gl_renderer": found.device} | found.machine,
    }


def write_report(path: str | Path, found: Approximation) -> None:
    """Write a page with pictures, .html, that needs nothing but itself; errors as of :func:`.page.write_page`."""
    write_page(path, "approximation.html.jinja", _facts(found))


def _facts(found: Approximation) -> dict[str, Any]:
    total = found.relative()
    limit = pictures.round_limit(total[found.surfaces]) if found.surfaces.any() else 1.0
    maps = [_map(found, i) for i in range(1, len(found.stages))]
    width, height = found.size
    return {
        "found": found,
        "terms": found.terms(),
        "doubts": doubts(found),
        "truth": pictures.data_uri(shown(found, 0)),
        "split_sum": pictures.data_uri(shown(found, -1)),
        "total": pictures.data_uri(pictures.diverging(total, limit)),
        "maps": maps,
        "diverging": pictures.DIVERGING,
        "limit": limit,
        "angles": [f"{low:.0f}° to {high:.0f}°" for low, high in pairwise(ANGLES)],
        "spheres": list(by_roughness_and_angle(found)),
        "settings": {"width": width, "height": height, "spp of each stage": found.spp},
        "machine": {"gl_renderer": found.device} | found.machine,
    }


def _map(found: Approximation, stage: int) -> tuple[str, str]:
    """The caption and the picture of what one error changes, its colours as wide as it needs."""
    change = found.relative(stage, stage - 1)
    limit = pictures.round_limit(change[found.surfaces]) if found.surfaces.any() else 1.0
    caption = f"{found.stages[stage].error}, ±{words.exact(limit)}"
    return caption, pictures.data_uri(pictures.diverging(change, limit))


def shown(found: Approximation, stage: int) -> pictures.Bytes:
    """The picture of a stage as 8-bit sRGB, under the exposure of the truth."""
    return pictures.developed(found.pictures[stage], auto_exposure(found.truth.astype(np.float32)))


def write_pictures(path: str | Path, found: Approximation) -> float:
    """Write a .png of the truth, the approximation and their relative difference in a row; returns the
    difference at the end of the scale.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    difference = found.relative()
    limit = pictures.round_limit(difference[found.surfaces]) if found.surfaces.any() else 1.0
    panels = [shown(found, 0), shown(found, -1), pictures.diverging(difference, limit)]
    pictures.write_panels(path, panels, ["path traced", "split sum", pictures.difference_caption(limit)])
    return limit


def write_error_maps(path: str | Path, found: Approximation) -> float:
    """Write a .png of what each error changes, relative to the truth; returns the end of the scale."""
    maps = [found.relative(i, i - 1) for i in range(1, len(found.stages))]
    limit = pictures.round_limit(np.stack(maps)[:, found.surfaces]) if found.surfaces.any() else 1.0
    panels = [pictures.diverging(values, limit) for values in maps]
    pictures.write_panels(path, panels, [stage.error for stage in found.stages[1:]])
    return limit
