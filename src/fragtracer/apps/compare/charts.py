# SPDX-License-Identifier: MIT
"""The charts of a report as SVG, whose colours come from the page: ``currentColor`` and its CSS classes."""

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.pictures import DIVERGING

_WIDTH, _HEIGHT, _LEFT, _BOTTOM = 440, 220, 34, 40
_REACH, _BIN = 6.0, 0.5  # the last bins hold everything beyond


def histogram(z: NDArray[np.floating], critical: float) -> str:
    """Counts of ``z`` against what a standard normal distribution would give.

    ``critical`` is the magnitude from which on a test finds a difference; it is marked.
    """
    edges = np.arange(-_REACH, _REACH + _BIN / 2, _BIN)
    counts, _ = np.histogram(np.clip(z, -_REACH, _REACH - 1e-9), edges)
    at = np.linspace(-_REACH, _REACH, 121)
    curve = z.size * _BIN * np.exp(-(at**2) / 2) / np.sqrt(2 * np.pi)
    top = 1.08 * max(counts.max(initial=1), curve.max())
    bars = "".join(
        f'<rect class="bar" x="{_x(left) + 1:.1f}" y="{_y(count / top):.1f}" '
        f'width="{_x(_BIN) - _x(0) - 2:.1f}" height="{_y(0) - _y(count / top):.1f}"/>'
        for left, count in zip(edges, counts, strict=False)
        if count
    )
    points = " ".join(f"{_x(a):.1f},{_y(c / top):.1f}" for a, c in zip(at, curve, strict=True))
    lines = f'<polyline class="curve" points="{points}"/>' + "".join(_critical(s * critical) for s in (-1, 1))
    return _svg(bars + lines + _axes(top), "Histogram of z-scores of blocks against the normal distribution")


def legend(limit: float, unit: str) -> str:
    """The diverging colours from -``limit`` to ``limit``, already in ``unit``."""
    stops = "".join(
        f'<stop offset="{i / (len(DIVERGING) - 1):.3f}" stop-color="{colour}"/>' for i, colour in enumerate(DIVERGING)
    )
    name = f"ramp-{unit.strip('% ') or 'share'}"
    ticks = "".join(
        f'<text x="{x}" y="30" text-anchor="{anchor}">{sign}{abs(value):g}{unit}</text>'
        for x, anchor, sign, value in (
            (0, "start", "−", limit),
            (80, "middle", "−", limit / 2),
            (160, "middle", "", 0),
            (240, "middle", "+", limit / 2),
            (320, "end", "+", limit),
        )
    )
    ramp = f'<defs><linearGradient id="{name}">{stops}</linearGradient></defs>'
    bar = f'<rect width="320" height="14" fill="url(#{name})" class="frame"/>'
    return f'<svg class="legend" viewBox="0 0 320 36" role="img" aria-label="Legend">{ramp}{bar}{ticks}</svg>'


def _svg(content: str, label: str) -> str:
    return f'<svg class="chart" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">{content}</svg>'


def _x(z: float) -> float:
    return float(_LEFT + (z + _REACH) / (2 * _REACH) * (_WIDTH - _LEFT - 8))


def _y(share: float) -> float:
    return float((_HEIGHT - _BOTTOM) * (1 - share) + 4)


def _critical(z: float) -> str:
    x = _x(float(np.clip(z, -_REACH, _REACH)))
    return f'<line class="critical" x1="{x:.1f}" x2="{x:.1f}" y1="{_y(1):.1f}" y2="{_y(0):.1f}"/>'


def _axes(top: float) -> str:
    base = f'<line class="axis" x1="{_x(-_REACH):.1f}" x2="{_x(_REACH):.1f}" y1="{_y(0):.1f}" y2="{_y(0):.1f}"/>'
    names = {-_REACH: f"≤ −{_REACH:g}", _REACH: f"≥ {_REACH:g}"}
    ticks = "".join(
        f'<text x="{_x(z):.1f}" y="{_y(0) + 16:.1f}" text-anchor="{"end" if z == _REACH else "middle"}">'
        f"{names.get(z, f'{z:g}'.replace('-', '−'))}</text>"
        for z in np.arange(-_REACH, _REACH + 1, 2)
    )
    step = next(s for p in range(7) for s in (10**p, 2 * 10**p, 5 * 10**p) if s * 5 >= top)
    counts = "".join(
        f'<text x="{_LEFT - 6}" y="{_y(count / top) + 4:.1f}" text-anchor="end">{count}</text>'
        for count in range(0, int(top) + 1, step)
    )
    return base + ticks + counts + f'<text x="{_x(0):.1f}" y="{_HEIGHT - 4}" text-anchor="middle">z of a block</text>'
