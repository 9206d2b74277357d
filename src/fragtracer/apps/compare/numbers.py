# SPDX-License-Identifier: MIT
"""A comparison as numbers, for programs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare import statistics
from fragtracer.apps.compare.rendering import as_compared
from fragtracer.apps.compare.run import Comparison
from fragtracer.apps.compare.verdict import Scale, Verdict
from fragtracer.apps.compare.words import summary

SCHEMA = 2


def to_json(comparison: Comparison) -> dict[str, Any]:
    """All numbers of a comparison, as ``json.dump`` takes them.

    Colours are lists of three numbers (red, green, blue). Differences and errors are relative to
    Mitsuba's mean (0.01 is 1 %), radiances linear, times in seconds. What is not finite is null.

    - ``schema``: 2; it changes when a key changes its meaning or goes.
    - ``scene``: its name; ``mitsuba_file``: the name of the scene file that Mitsuba rendered itself, else null.
    - ``verdict``: ``outcome`` ("agreement", "disagreement" or "inconclusive"), ``exit_status``,
      ``summary`` in words, ``margin``, ``alpha``, ``power``, the number of ``comparisons`` and of those
      ``differing``, ``regions_judged`` and ``regions_lit`` (colours counted each), the
      ``detectable_bias_of_blocks`` (``median`` and ``worst`` of those not black), ``non_finite_samples``, and
      ``spp_needed`` for a conclusion.
    - ``image``, ``regions``, ``blocks``: for each scale ``rows``, ``columns``, the ``level`` of one
      test, and as [row][column][colour] ``ours``, ``reference``, ``relative_difference``,
      ``relative_error`` (standard), ``degrees`` of freedom, ``p``, ``z``, ``differs``, ``lit`` (not black in both) and
      ``detectable_bias``. The image also has ``equivalent`` and ``provable_margin``, regions ``equivalent``
      and ``judged`` (precise enough to be asked for equivalence).
    - ``measures``: ``relative_mse`` (relMSE, :mod:`.relative_error`) of one image against the other,
      ``expected_relative_mse`` by noise alone, ``flip``, ``exposure`` in stops under which FLIP saw the images.
    - ``time``: for ``ours`` and ``reference`` ``start`` (loading and compiling), ``render``, the ``relative_mse`` of
      the image by noise and the ``efficiency``, 1 / (relMSE · s); ``efficiency_ratio`` is ours over Mitsuba's.
    - ``settings``: ``width``, ``height``, ``spp``, ``batches``, ``seed``, and the scene's render settings.
    - ``machine``: ``gl_renderer``, ``mitsuba_variant``, date, processor, system and versions.
    """
    verdict = comparison.verdict
    image = _scale(verdict.image) | {"equivalent": _plain(verdict.equivalent_image[None, None])}
    image |= {"provable_margin": _plain(verdict.provable_margin[None, None])}
    judged = {"judged": _plain(verdict.judged_regions), "equivalent": _plain(verdict.equivalent_regions)}
    return {
        "schema": SCHEMA,
        "scene": comparison.scene.name,
        "mitsuba_file": comparison.file and comparison.file.name,
        "verdict": _verdict(verdict) | {"summary": summary(comparison), "spp_needed": comparison.spp_needed},
        "image": image,
        "regions": _scale(verdict.regions) | judged,
        "blocks": _scale(verdict.blocks),
        "measures": _measures(comparison),
        "time": _time(comparison),
        "settings": settings(comparison),
        "machine": machine(comparison),
    }


def settings(comparison: Comparison) -> dict[str, Any]:
    """The settings of both renderers, as they were."""
    width, height = comparison.size
    used = {"width": width, "height": height, "spp": comparison.spp}
    used |= {"batches": comparison.batches, "seed": comparison.seed}
    render = as_compared(comparison.scene.render, comparison.spp // comparison.batches)
    scene = {key: value for key, value in vars(render).items() if not key.startswith("_")}
    return used | {key: value for key, value in scene.items() if key not in used}


def machine(comparison: Comparison) -> dict[str, str]:
    """On what both renderers ran."""
    devices = {"gl_renderer": comparison.ours.device, "mitsuba_variant": comparison.reference.device}
    return devices | comparison.machine


def _verdict(verdict: Verdict) -> dict[str, Any]:
    names = ("outcome", "exit_status", "margin", "alpha", "comparisons", "differing")
    found = {name: getattr(verdict, name) for name in names}
    found |= dict(zip(("regions_judged", "regions_lit"), verdict.judged_share, strict=True))
    biases = dict(zip(("median", "worst"), map(_finite, verdict.block_biases), strict=True))
    found |= {"detectable_bias_of_blocks": biases}
    return found | {"power": statistics.POWER, "non_finite_samples": verdict.non_finite}


def _scale(scale: Scale) -> dict[str, Any]:
    rows, columns, _ = scale.p.shape
    pair = scale.pair
    arrays = {name: getattr(pair, name) for name in ("ours", "reference", "relative_difference", "relative_error")}
    arrays |= {"degrees": pair.degrees(), "p": scale.p, "z": scale.z, "differs": scale.differs, "lit": scale.lit}
    arrays |= {"detectable_bias": scale.detectable_bias}
    head: dict[str, Any] = {"rows": rows, "columns": columns, "level": scale.level}
    return head | {name: _plain(array) for name, array in arrays.items()}


def _measures(comparison: Comparison) -> dict[str, float | None]:
    names = ("relative_mse", "expected_relative_mse", "flip", "exposure")
    return {name: getattr(comparison.measures, name) for name in names}


def _time(comparison: Comparison) -> dict[str, Any]:
    found = comparison.measures
    renderings = (comparison.ours, comparison.reference)
    errors = (found.ours_relative_mse, found.reference_relative_mse)
    ours, reference = (
        {
            "start": rendering.start_seconds,
            "render": rendering.seconds,
            "relative_mse": relative_mse,
            "efficiency": efficiency,
        }
        for rendering, relative_mse, efficiency in zip(renderings, errors, found.efficiencies, strict=True)
    )
    return {"ours": ours, "reference": reference, "efficiency_ratio": found.efficiency_ratio}


def _finite(number: float) -> float | None:
    return number if np.isfinite(number) else None


def _plain(array: NDArray[Any]) -> Any:
    """Nested lists, with None for what JSON has no number for."""
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return np.where(np.isfinite(array), array.astype(object), np.asarray(None)).tolist()
    return array.tolist()
