# SPDX-License-Identifier: MIT
"""A comparison as one HTML page that needs nothing but itself."""

from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.apps.compare import charts, numbers, page, pictures, statistics, words
from fragtracer.apps.compare.run import Comparison

_TEMPLATE = "report.html.jinja"
_Z_LIMIT = 5.0


def write_report(path: str | Path, comparison: Comparison) -> None:
    """Write the report of ``comparison`` to an .html file; errors as of :func:`.page.write_page`.

    Pictures, chart and style are inside, so the file can be mailed or printed as it is.
    """
    page.write_page(path, _TEMPLATE, _facts(comparison) | _pictures(comparison))


def render_report(comparison: Comparison) -> str:
    """The text of the report."""
    return page.rendered(_TEMPLATE, _facts(comparison) | _pictures(comparison))


def _facts(comparison: Comparison) -> dict[str, Any]:
    verdict = comparison.verdict
    return {
        "comparison": comparison,
        "verdict": verdict,
        "measures": comparison.measures,
        "headline": words.headline(comparison),
        "reasons": words.reasons(comparison),
        "bias": float(np.max(verdict.detectable_bias)),
        "colours": words.COLOURS,
        "image": _image_rows(comparison),
        "regions": _region_rows(comparison),
        "settings": numbers.settings(comparison),
        "machine": numbers.machine(comparison),
        "judged": verdict.judged_share,
        "block_biases": verdict.block_biases,
        "relative_mse": (comparison.measures.ours_relative_mse, comparison.measures.reference_relative_mse),
        "power": statistics.POWER,
        "rounding": statistics.ROUNDING,
    }


def _pictures(comparison: Comparison) -> dict[str, Any]:
    ours, reference = pictures.shown(comparison)
    difference = pictures.relative_difference(comparison)
    limit = pictures.round_limit(difference)
    blocks = comparison.verdict.blocks
    z = pictures.diverging(blocks.z, _Z_LIMIT)
    maps = [pictures.enlarged(z[:, :, c], comparison.size) for c in range(3)]
    return {
        "ours_picture": pictures.data_uri(ours),
        "reference_picture": pictures.data_uri(reference),
        "difference_picture": pictures.data_uri(pictures.diverging(difference, limit)),
        "diverging": pictures.DIVERGING,
        "difference_limit": limit,
        "z_pictures": [pictures.data_uri(picture) for picture in maps],
        "z_limit": _Z_LIMIT,
        "histogram": charts.histogram(blocks.noise_z, blocks.critical),
        "critical": blocks.critical,
    }


def _image_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """What is known of the mean of each colour."""
    verdict = comparison.verdict
    pair = verdict.image.pair
    columns = {
        "ours": pair.ours,
        "reference": pair.reference,
        "difference": pair.relative_difference,
        "error": pair.relative_error,
        "z": verdict.image.z,
        "p": verdict.image.p,
        "differs": verdict.image.differs,
        "equivalent": verdict.equivalent_image[None, None],
        "bias": verdict.detectable_bias[None, None],
        "provable": verdict.provable_margin[None, None],
    }
    return [{name: values[0, 0, c] for name, values in columns.items()} for c in range(3)]


def _region_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """For each region its place and, for each colour, the difference, its standard error and what it proves."""
    verdict = comparison.verdict
    scale = verdict.regions
    rows, columns, _ = scale.p.shape
    found = np.where(verdict.judged_regions & verdict.equivalent_regions, "equal", "noisy")
    found = np.where(verdict.judged_regions & ~verdict.equivalent_regions, "open", found)
    found = np.where(~scale.lit, "black", found)
    found = np.where(scale.differs, "differs", found)
    difference, error = scale.pair.relative_difference, scale.pair.relative_error
    return [
        {
            "place": f"{row + 1}, {column + 1}",
            "cells": [
                (difference[row, column, c], error[row, column, c], scale.z[row, column, c], found[row, column, c])
                for c in range(3)
            ],
        }
        for row in range(rows)
        for column in range(columns)
    ]
