# SPDX-License-Identifier: MIT
"""A comparison in words."""

import numpy as np

from fragtracer.apps.compare.run import Comparison
from fragtracer.apps.compare.verdict import Scale

_ENOUGH_BATCHES = 16  # for the noise to be known so well that the power is what is said
COLOURS = ("red", "green", "blue")
_SAYS = {
    "agreement": "fragtracer and Mitsuba agree on {}.",
    "disagreement": "fragtracer and Mitsuba disagree on {}.",
    "inconclusive": "Whether fragtracer and Mitsuba agree on {} cannot be said: the pictures are too noisy.",
}


def percent(share: float | None, signed: bool = False) -> str:
    """Two significant digits, none finer than 0.0001 %; a dash for None."""
    if share is None:
        return "—"
    return minus(f"{100 * share:{'+' if signed else ''}.{_decimals(share)}f} %").replace("inf", "∞")


def with_error(share: float, error: float) -> str:
    """A share and its standard error, both to two digits of the error."""
    digits = _decimals(error)
    return minus(f"{100 * share:+.{digits}f} ± {100 * error:.{digits}f} %")


def exact(share: float) -> str:
    """A share that was asked for, as 1 % or 0.5 %."""
    return f"{100 * share:g} %"


def minus(text: str) -> str:
    """``text`` with minus signs for hyphens."""
    return text.replace("-", "−")


def _decimals(share: float) -> int:
    """How many decimals of a percentage show two significant digits, four at most."""
    value = abs(100 * share)
    return int(np.clip(1 - np.floor(np.log10(value)), 0, 4)) if 0 < value < np.inf else 0


def headline(comparison: Comparison) -> str:
    """The verdict in one sentence."""
    return _SAYS[comparison.verdict.outcome].format(comparison.scene.name)


def summary(comparison: Comparison) -> str:
    """The verdict and what it rests on, a sentence a line."""
    return "\n".join([headline(comparison), *reasons(comparison)])


def reasons(comparison: Comparison) -> list[str]:
    """What the verdict rests on, in sentences."""
    verdict = comparison.verdict
    said = [_differences(comparison), _equivalence(comparison)]
    if verdict.non_finite:
        said.insert(0, f"{verdict.non_finite} samples of fragtracer were NaN or infinite; every one is an error.")
    render = comparison.scene.render
    if ignored := [name.replace("_", " ") for name in ("guiding", "gradient_domain") if getattr(render, name) == "on"]:
        said.append(f"The scene asks for {' and '.join(ignored)}, which compare leaves off.")
    if comparison.reference.pictures.any():
        said += _power(comparison)
    if verdict.outcome == "inconclusive":
        said.append(f"About {comparison.spp_needed} samples per pixel would do: use --spp {comparison.spp_needed}.")
    return said


def _power(comparison: Comparison) -> list[str]:
    """What would have been found."""
    bias = percent(float(np.max(comparison.verdict.detectable_bias)))
    median, worst = (percent(bias) for bias in comparison.verdict.block_biases)
    said = [
        f"A bias of the picture's mean of {bias} would have been found with a probability of 95 %.",
        f"So would one of {median} of the median block's mean, and one of {worst} of any block's.",
    ]
    if comparison.batches < _ENOUGH_BATCHES:
        said.append(f"With {comparison.batches} batches these probabilities are lower: use {_ENOUGH_BATCHES} or more.")
    return said


def _differences(comparison: Comparison) -> str:
    verdict = comparison.verdict
    blocks, regions = (scale.p.shape[0] * scale.p.shape[1] for scale in (verdict.blocks, verdict.regions))
    tests = f"{verdict.comparisons} tests (the picture, {regions} regions and {blocks} blocks, in 3 colours)"
    level = f"where noise alone would find one or more with a probability of {exact(verdict.alpha)}"
    if not verdict.differing:
        return f"None of {tests} finds a difference, {level}."
    finds = f"{verdict.differing} of {tests} find{'s' * (verdict.differing == 1)} a difference, {level}"
    return f"{finds}; the clearest is {_clearest(comparison)}."


def _clearest(comparison: Comparison) -> str:
    scale = max(comparison.verdict.scales, key=lambda s: float(np.max(np.abs(s.z) * s.differs)))
    row, column, colour = np.unravel_index(np.argmax(np.abs(scale.z) * scale.differs), scale.z.shape)
    share = float(scale.pair.relative_difference[row, column, colour])
    z = minus(f"{scale.z[row, column, colour]:.1f}")
    much = f"{percent(share, signed=True)} in {COLOURS[int(colour)]} (z = {z})"
    return f"{much}, {place(comparison, scale, int(row), int(column))}"


def place(comparison: Comparison, scale: Scale, row: int, column: int) -> str:
    """Where a part lies, in pixels from the top left of the picture."""
    if scale.p[..., 0].size == 1:
        return "in the picture as a whole"
    rows, columns = scale.p.shape[:2]
    width, height = comparison.size
    x = f"{column * width // columns} to {(column + 1) * width // columns - 1}"
    y = f"{row * height // rows} to {(row + 1) * height // rows - 1}"
    return f"at pixels x = {x}, y = {y}"


def _equivalence(comparison: Comparison) -> str:
    verdict = comparison.verdict
    judged, lit = verdict.judged_share
    if not lit and not comparison.ours.pictures.any():
        return "Both pictures are black."
    proved = verdict.equivalent_regions & verdict.judged_regions & verdict.regions.lit
    margin = f"within ±{exact(verdict.margin)}"
    mean = "is" if verdict.equivalent_image.all() else "is not shown to be"
    regions = f"of {lit} means of regions that are not black {judged} are precise enough to be tested"
    regions = f"{regions}, {proved.sum()} are equal"
    return f"The picture's mean radiance {mean} equal {margin} in each colour; {regions}."
