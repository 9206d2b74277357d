# SPDX-License-Identifier: MIT
"""The pictures of a report: what was rendered, where it differs, and how clearly."""

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from fragtracer import output
from fragtracer.apps.compare.measures import displayed, relative
from fragtracer.apps.compare.run import Comparison
from fragtracer.apps.compare.words import exact

Bytes = NDArray[np.uint8]

# ColorBrewer's RdBu, from blue through white to red (Harrower and Brewer 2003, "ColorBrewer.org").
DIVERGING = ("#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b")
_ANCHORS = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in DIVERGING])
_CAPTION, _GAP = 22, 8  # pixels
_COLUMNS = 3


def diverging(values: NDArray[np.floating], limit: float) -> Bytes:
    """Colours of ``values`` between -``limit`` (blue) and ``limit`` (red), with a last axis of three."""
    place = (np.clip(values / limit, -1, 1) + 1) / 2 * (len(DIVERGING) - 1)
    channels = [np.interp(place, np.arange(len(DIVERGING)), _ANCHORS[:, i]) for i in range(3)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def developed(radiance: NDArray[np.floating], exposure: float) -> Bytes:
    """8-bit sRGB of linear ``radiance``, after ``exposure`` stops."""
    return (displayed(radiance.astype(np.float32), exposure) * 255).round().astype(np.uint8)


def shown(comparison: Comparison) -> tuple[Bytes, Bytes]:
    """Ours and Mitsuba's picture as 8-bit sRGB, under one exposure."""
    exposure = comparison.measures.exposure
    return developed(comparison.ours.picture, exposure), developed(comparison.reference.picture, exposure)


def relative_difference(comparison: Comparison) -> NDArray[np.float64]:
    """(ours - Mitsuba's) / Mitsuba's of each pixel's mean of the colours, (height, width)."""
    renderings = (comparison.ours, comparison.reference)
    ours, reference = (rendering.picture.mean(axis=2, dtype=np.float64) for rendering in renderings)
    return relative(ours - reference, reference)


def round_limit(values: NDArray[np.floating]) -> float:
    """The least of 1, 2 and 5 times a power of ten that all but 2 % of ``values`` do not exceed in magnitude."""
    most = max(float(np.quantile(np.abs(values), 0.98)), 1e-4)
    power = 10 ** np.floor(np.log10(most))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= most * (1 - 1e-9)))


def enlarged(parts: Bytes, size: tuple[int, int]) -> Bytes:
    """Colours (rows, columns, 3) of parts over the pixels that they hold, (height, width, 3)."""
    width, height = size
    rows, columns, _ = parts.shape
    row, column = (
        np.searchsorted(np.arange(1, n) * pixels // n, np.arange(pixels), side="right")
        for n, pixels in ((rows, height), (columns, width))
    )
    return np.asarray(parts[row[:, None], column[None, :]])


def data_uri(pixels: Bytes) -> str:
    """``pixels`` (height, width, 3) as a PNG inside a URI."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def write_side_by_side(path: str | Path, comparison: Comparison) -> None:
    """Write a .png of ours, Mitsuba's and their relative difference in a row, with captions.

    The background is transparent and the captions are grey, for light pages and dark ones.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    difference = relative_difference(comparison)
    limit = round_limit(difference)
    panels = [*shown(comparison), diverging(difference, limit)]
    write_panels(path, panels, ["fragtracer", "Mitsuba", difference_caption(limit)])


def difference_caption(limit: float) -> str:
    """What to write below the colours of :func:`diverging`."""
    return f"difference, blue -{exact(limit)} to red +{exact(limit)}"


def write_panels(path: str | Path, panels: Sequence[Bytes], captions: Sequence[str]) -> None:
    """Write pictures of one size to a .png file, in rows of three, each over its caption.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    output.check_writable(path, [".png"])
    height, width, _ = panels[0].shape
    across, down = width + _GAP, height + _CAPTION + _GAP
    rows = -(-len(panels) // _COLUMNS)
    canvas = Image.new("RGBA", (_COLUMNS * across - _GAP, rows * down - _GAP), (0, 0, 0, 0))
    draw = ImageDraw.Draw(canvas)
    for i, (panel, caption) in enumerate(zip(panels, captions, strict=True)):
        left, top = i % _COLUMNS * across, i // _COLUMNS * down
        canvas.paste(Image.fromarray(panel), (left, top))
        place = (left + width / 2, top + height + _CAPTION / 2)
        draw.text(place, caption, (128, 128, 128), ImageFont.load_default(13), "mm")
    with output.replacing(path) as part:
        canvas.save(part, "PNG", optimize=True)
