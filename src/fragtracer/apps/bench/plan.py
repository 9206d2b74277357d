# SPDX-License-Identifier: MIT
"""What to measure, and how long."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Literal, Protocol

from fragtracer.apps.bench.tables import Table
from fragtracer.errors import FragtracerError


class Progress(Protocol):
    """Called with the share that is done, and what comes now."""

    def __call__(self, share: float, text: str) -> None: ...


_LIMITS = {"rays": (1, 1024), "bounces": (0, 10000), "light_samples": (1, 1024)}


@dataclass(frozen=True)
class Plan:
    """What the user asks for; None leaves a choice to the benchmark.

    ``seconds`` is the time of each renderer in a run. A row of the sweep ends early when one frame takes longer than
    ``row_limit`` seconds.
    """

    scenes: tuple[str, ...] | None = None
    size: tuple[int, int] | None = None
    rays: tuple[int, ...] | None = None
    bounces: tuple[int, ...] | None = None
    light_samples: tuple[int, ...] | None = None
    runs: int | None = None
    seconds: float | None = None
    row_limit: float = 20.0
    reference: Literal["both", "own", "mitsuba"] = "both"
    variant: str | None = None  # of Mitsuba
    sampler: str = "best"  # of Mitsuba, or that which does most for a scene

    def __post_init__(self) -> None:
        for name, (low, high) in _LIMITS.items():
            for value in getattr(self, name) or ():
                if not low <= value <= high:
                    option = "--" + name.replace("_", "-")
                    raise FragtracerError(f"{option} {value}: give whole numbers from {low} to {high}")

    def describe(self) -> dict[str, str]:
        """What was asked for, as text by name."""
        chosen = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: _text(value) for name, value in chosen.items() if value is not None}


@dataclass(frozen=True)
class Benchmark:
    """``table`` makes an empty table; ``run`` appends its rows one by one, so that an interrupted run keeps those that
    are finished."""

    table: Callable[[Plan], Table]
    run: Callable[[Plan, Table, Progress], None]


def numbers(text: str | None, option: str) -> tuple[int, ...] | None:
    """(5, 10) from "5,10"; None stays None.

    Raises :class:`FragtracerError` if it is anything but whole numbers with commas between them.
    """
    if text is None:
        return None
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise FragtracerError(f"{option} {text}: give whole numbers with commas between them, as 5,10") from None


def steps(progress: Progress, names: list[str]) -> Iterator[tuple[int, Progress]]:
    """The places in ``names`` one by one, each with a progress of its own part."""
    for place, name in enumerate(names):

        def part(share: float, text: str, place: int = place, name: str = name) -> None:
            progress((place + min(share, 1.0)) / len(names), f"{name} {text}".strip())

        part(0.0, "")
        yield place, part
    progress(1.0, "")


def _text(value: object) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
