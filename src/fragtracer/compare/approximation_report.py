# SPDX-License-Identifier: MIT
"""What :mod:`.approximation` found, in words, as numbers for programs, as a page and as pictures."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fragtracer.compare import charts, pictures, words
from fragtracer.compare.approximation import Approximation, by_roughness_and_angle
from fragtracer.compare.measures import auto_exposure, displayed
from fragtracer.errors import FragtracerError
from fragtracer.images import output

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)  # degrees
_FOLDER = Path(__file__).parent
_CAPTION, _GAP = 22, 8  # pixels
Bytes = NDArray[np.uint8]


def summary(found: Approximation) -> str:
    """A table of the errors for the terminal."""
    lines = [f"{found.scene.name}: the split-sum approximation against the path-traced truth, {found.spp} spp"]
    lines.append(f"{'':28}{'bias':>22}{'rms':>10}")
    for term in found.terms():
        bias = words.with_error(term.bias, term.bias_error)
        lines.append(f"{term.error:28}{bias:>22}{words.percent(term.rms):>10}")
    return "\n".join([*lines, "Relative to the mean radiance of the surfaces in truth; the biases add up to the last."])


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
        "angles": list(ANGLES),
        "spheres": [
            {"metallic": metallic, "roughness": roughness, "difference": [v if v == v else None for v in row]}
            for metallic, roughness, row in by_roughness_and_angle(found)
        ],
        "machine": {"gl_renderer": found.device} | found.machine,
    }


def write_report(path: str | Path, found: Approximation) -> None:
    """Write a page with pictures, .html, that needs nothing but itself.

    Raises
    ------
    OutputError
        If the file cannot be written.
    FragtracerError
        If Jinja is not installed.
    """
    output.check_writable(path, [".html"])
    try:
        from jinja2 import Environment, FileSystemLoader, StrictUndefined
    except ImportError as error:
        raise FragtracerError("Jinja is not installed; pip install 'fragtracer[reference]'") from error
    loader = FileSystemLoader(_FOLDER)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters |= {"percent": words.percent, "minus": words.minus}
    environment.globals |= {"with_error": words.with_error}
    text = environment.get_template("approximation.html.jinja").render(_facts(found))
    with output.replacing(path) as part:
        part.write_text(text, "utf-8", newline="\n")


def _facts(found: Approximation) -> dict[str, Any]:
    total = found.relative()
    limit = pictures.round_limit(total[found.surfaces]) if found.surfaces.any() else 1.0
    maps = [
        (stage.error, pictures.data_uri(pictures.diverging(found.relative(i, i - 1), limit)))
        for i, stage in enumerate(found.stages)
        if i
    ]
    width, height = found.size
    return {
        "found": found,
        "terms": found.terms(),
        "truth": pictures.data_uri(shown(found, 0)),
        "split_sum": pictures.data_uri(shown(found, -1)),
        "total": pictures.data_uri(pictures.diverging(total, limit)),
        "maps": maps,
        "legend": charts.legend(100 * limit, " %"),
        "angles": [f"{low:.0f}° to {high:.0f}°" for low, high in pairwise(ANGLES)],
        "spheres": list(by_roughness_and_angle(found)),
        "settings": {"width": width, "height": height, "spp of each stage": found.spp},
        "machine": {"gl_renderer": found.device} | found.machine,
        "style": (_FOLDER / "report.css").read_text("utf-8"),
    }


def shown(found: Approximation, stage: int) -> Bytes:
    """The picture of a stage as 8-bit sRGB, under the exposure of the truth."""
    exposure = auto_exposure(found.truth.astype(np.float32))
    picture = displayed(found.pictures[stage].astype(np.float32), exposure)
    return np.asarray((picture * 255).round(), np.uint8)


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
    names = ["path traced", "split sum", f"difference, blue -{limit:.0%} to red +{limit:.0%}"]
    _write_row(path, panels, names, found.size)
    return limit


def write_error_maps(path: str | Path, found: Approximation, columns: int = 3) -> float:
    """Write a .png of what each error changes, relative to the truth; returns the end of the scale."""
    maps = [found.relative(i, i - 1) for i in range(1, len(found.stages))]
    limit = pictures.round_limit(np.stack(maps)[:, found.surfaces]) if found.surfaces.any() else 1.0
    panels = [pictures.diverging(values, limit) for values in maps]
    _write_row(path, panels, [stage.error for stage in found.stages[1:]], found.size, columns)
    return limit


def _write_row(
    path: str | Path, panels: list[Bytes], captions: list[str], size: tuple[int, int], columns: int = 3
) -> None:
    output.check_writable(path, [".png"])
    width, height = size
    rows = -(-len(panels) // columns)
    canvas = Image.new(
        "RGBA", (columns * (width + _GAP) - _GAP, rows * (height + _CAPTION + _GAP) - _GAP), (0, 0, 0, 0)
    )
    draw = ImageDraw.Draw(canvas)
    for i, (panel, caption) in enumerate(zip(panels, captions, strict=True)):
        left, top = i % columns * (width + _GAP), i // columns * (height + _CAPTION + _GAP)
        canvas.paste(Image.fromarray(panel), (left, top))
        place = (left + width / 2, top + height + _CAPTION / 2)
        draw.text(place, caption, (128, 128, 128), ImageFont.load_default(13), "mm")
    with output.replacing(path) as part:
        canvas.save(part, "PNG", optimize=True)
