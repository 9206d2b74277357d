# SPDX-License-Identifier: MIT
"""The chart of a report as SVG, in colours that can be read on light pages and dark ones."""

import io
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.errors import FragtracerError

_LIMIT, _BIN = 6.0, 0.5  # the last bins hold everything beyond
_GREY = "#808080"
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "fragtracer",
    "axes.edgecolor": _GREY,
    "axes.labelcolor": _GREY,
}
_STYLE |= {"xtick.color": _GREY, "ytick.color": _GREY, "axes.spines.top": False, "axes.spines.right": False}


def histogram(z: NDArray[np.floating], critical: float) -> str:
    """Counts of ``z`` against those of a standard normal distribution.

    ``critical`` is the magnitude from which on a test finds a difference; it is marked.

    Raises
    ------
    FragtracerError
        If Matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as error:
        raise FragtracerError("Matplotlib is not installed; pip install 'fragtracer[reference]'") from error
    edges = np.arange(-_LIMIT, _LIMIT + _BIN / 2, _BIN).tolist()
    at = np.linspace(-_LIMIT, _LIMIT, 121)
    text = io.StringIO()
    with rc_context(_STYLE):
        figure = Figure(figsize=(5, 2.6), layout="constrained", facecolor="none")
        axes = figure.add_subplot(facecolor="none")
        axes.hist(np.clip(z, -_LIMIT, _LIMIT), edges, rwidth=0.85, color="#7a9cc6")
        axes.plot(at, z.size * _BIN * np.exp(-(at**2) / 2) / np.sqrt(2 * np.pi), color="#d6604d")
        for sign in (-1, 1):
            axes.axvline(sign * min(critical, _LIMIT), color=_GREY, linestyle="--", linewidth=1)
        ticks = np.arange(-_LIMIT, _LIMIT + 1, 2)
        names = [f"≤ −{_LIMIT:g}", *(f"{tick:g}".replace("-", "−") for tick in ticks[1:-1]), f"≥ {_LIMIT:g}"]
        axes.set_xticks(ticks, names)
        axes.set(xlabel="z of a block", ylabel="number")
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    svg = text.getvalue()[text.getvalue().index("<svg") :]
    label = 'role="img" aria-label="Histogram of z-scores of blocks against the normal distribution"'
    return re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg).replace("<svg", f"<svg {label}", 1)
