# SPDX-License-Identifier: MIT
"""An error for the shaders, and the check that must find it."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


class Check:
    """A test of the suite, and the arguments it is called with besides its fixtures."""

    def __init__(self, test: Callable[..., None], **arguments: Any) -> None:
        self._test, self._arguments = test, arguments

    def __call__(self, **fixtures: Any) -> None:
        """Raises :class:`AssertionError` where it fails."""
        asked = inspect.signature(self._test).parameters
        self._test(**{name: value for name, value in fixtures.items() if name in asked}, **self._arguments)

    @property
    def is_case(self) -> bool:
        """Whether the suite runs it by itself, with these arguments."""
        left = dict(self._arguments)
        for mark in getattr(self._test, "pytestmark", ()):
            if mark.name == "parametrize":
                names, cases = mark.args
                names = (names,) if isinstance(names, str) else tuple(names)
                asked = tuple(left.pop(name, None) for name in names)
                if repr(asked) not in (repr(tuple(case) if len(names) > 1 else (case,)) for case in cases):
                    return False
        return self._test.__name__.startswith("test_") and not left

    def __str__(self) -> str:
        arguments = "-".join(str(value) for value in self._arguments.values())
        return f"{self._test.__module__}.{self._test.__name__}[{arguments}]"


@dataclass(frozen=True)
class Mutation:
    name: str
    file: str
    text: str
    replacement: str
    check: Check
    kept: bool = False  # whether it is planted where maps and photons are made, too, which are kept on disk
