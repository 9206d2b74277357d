# SPDX-License-Identifier: MIT
"""What single choices buy: the default and a variant without one of them, in turns."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Image, Ours
from fragtracer.apps.bench.error import Reference, make_reference, sample_for
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress, steps
from fragtracer.apps.bench.statistics import median
from fragtracer.apps.bench.tables import Column, Row, Table
from fragtracer.apps.bench.variants import (
    NO_PATH_REGENERATION,
    NO_PATHS_BEFORE_VERTICES,
    ONE_BSDF_EVALUATION,
    Edit,
)
from fragtracer.io.toml import bundled
from fragtracer.scene import Scene


@dataclass(frozen=True)
class Variant:
    """By which settings, edits of the shaders and options of the renderer a variant differs from the default, and the
    settings that both share."""

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    edits: Sequence[Edit] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    shared: Mapping[str, Any] = field(default_factory=dict)


VARIANTS = (
    Variant("no adaptive sampling", {"adaptive": "off"}),
    Variant("no guiding", {"guiding": "off"}),
    Variant("no light tracing", {"light_tracing": "off"}),
    Variant("hash sampler, not the texture", {"sampler": "hash"}),
    Variant("no path begins before vertices", edits=NO_PATHS_BEFORE_VERTICES),
    Variant("no path regeneration", edits=NO_PATH_REGENERATION),
    Variant("no Russian roulette, 16 bounces", {"russian_roulette": False}, shared={"bounces": 16}),
    Variant("light sampling alone, no MIS", {"estimator": "nee"}),
    Variant("BSDF sampling alone, no MIS", {"estimator": "bsdf"}),
    Variant("no specialisation", options={"specialised": False}),
    Variant("one BSDF evaluation for 8 light samples", edits=ONE_BSDF_EVALUATION, shared={"light_samples": 8}),
    Variant("geometry term smith-height-correlated, not smith", {"geometry": "smith-height-correlated"}),
    Variant("geometry term schlick-beckmann, not smith", {"geometry": "schlick-beckmann"}),
    Variant("geometry term karis, not smith", {"geometry": "karis"}),
)
_EVEN = {"adaptive": "off", "guiding": "off", "light_tracing": "off", "gradient_domain": "off"}
WHERE_SAMPLES_GO = (
    Variant("even, unguided", _EVEN),
    Variant("adaptive, unguided", {"guiding": "off"}),
    Variant("even, guided", {"adaptive": "off"}),
    Variant("without light tracing", {"light_tracing": "off"}),
)
_SCENES = ("three-spheres", "cornell-box")
_SIZE = (256, 256)
_BOUNCES = 5
_RUNS = 7
_SECONDS = 1.0
_REFERENCE_TIME = 8.0  # for each of its two images, in units of the time of a run


def _table(name: str, plan: Plan) -> Table:
    return Table(
        name,
        "Variants against the default",
        (
            Column("scene", "scene"),
            Column("size", "size"),
            Column("variant", "variant"),
            Column("time", "time of a sample"),
            Column("error", "relMSE at equal samples"),
            Column("efficiency", "efficiency"),
            Column("bias", "relative bias, RMS"),
            Column("default_bias", "the default's"),
        ),
        keys=("scene", "size", "variant"),
        notes=[
            "Times, errors and efficiencies are those of the variant divided by the default's.",
            "Bias is the root mean square over pixels of the difference of expectations, relative to the brightness, "
            "from pairs of independent images. The default has none: its figure is the noise of this measurement. "
            "Another geometry term is another material, so its bias is the difference between the two materials.",
        ],
    )


def _run(variants: Sequence[Variant], scenes: Sequence[str], plan: Plan, result: Table, progress: Progress) -> None:
    places = [(name, variant) for name in plan.scenes or scenes for variant in variants]
    references: dict[tuple[str, int], Reference] = {}
    for place, part in steps(progress, [f"{name}, {variant.name}" for name, variant in places]):
        name, variant = places[place]
        settings = {"bounces": (plan.bounces or (_BOUNCES,))[0], **variant.shared}
        size = plan.size or _SIZE
        default = with_settings(case(name), size, **settings)
        known = (name, settings["bounces"])
        if known not in references:
            part(0.0, "reference")
            references[known] = make_reference(
                default, _REFERENCE_TIME * (plan.seconds or _SECONDS), plan.reference, plan.variant
            )
        changed = with_settings(default, size, **{**settings, **variant.settings})
        key: Row = {"scene": name, "size": f"{size[0]}x{size[1]}", "variant": variant.name}
        result.rows.append(key | _row(default, changed, variant, references[known], plan, part))


def _row(default: Scene, changed: Scene, variant: Variant, reference: Reference, plan: Plan, part: Progress) -> Row:
    runs = plan.runs or _RUNS
    times, errors = [], []
    images: tuple[list[Image], list[Image]] = ([], [])
    for number in range(runs):
        part(number / runs, "")
        with ExitStack() as stack:
            theirs = stack.enter_context(Ours(changed, number, variant.edits, **variant.options))
            ours = stack.enter_context(Ours(default, number))
            sample_for(ours, plan.seconds or _SECONDS)
            while theirs.spp < ours.spp:
                theirs.sample(min(theirs.step, ours.spp - theirs.spp))
            times.append(theirs.seconds / ours.seconds)
            errors.append(reference.relative_mse(theirs.image()) / reference.relative_mse(ours.image()))
            for contender, kept in ((ours, images[0]), (theirs, images[1])):
                kept.append(contender.image())
    row: Row = {"time": median(times), "error": median(errors)}
    if min(errors) > 0:
        row["efficiency"] = median([1 / (t * e) for t, e in zip(times, errors, strict=True)])
    return row | {"default_bias": _bias(images[0], reference), "bias": _bias(images[1], reference)}


def _bias(images: list[Image], reference: Reference) -> float | None:
    """Of the means of the first and the second half of the runs, which are independent."""
    half = len(images) // 2
    if half == 0:
        return None
    return reference.relative_bias(np.mean(images[:half], axis=0), np.mean(images[half:], axis=0))


BENCHMARK = Benchmark(partial(_table, "ablations"), partial(_run, VARIANTS, _SCENES))
SAMPLING = Benchmark(partial(_table, "sampling"), partial(_run, WHERE_SAMPLES_GO, tuple(bundled())))
