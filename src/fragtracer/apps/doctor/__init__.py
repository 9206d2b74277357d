# SPDX-License-Identifier: MIT
"""Does this driver compute correctly? Checks that need no other renderer.

Each check is a function of a context that yields :class:`Finding`; :func:`examine` runs them all.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from fragtracer.errors import FragtracerError

# The module of each check, and what its failure means.
CHECKS = {
    "compile": "the driver's GLSL compiler rejects a program: report it, with the message",
    "numbers": "integer or bit operations differ from the standard: images are noise, or biased",
    "samplers": "directions do not follow their pdf: images are biased",
    "intersections": "rays hit the wrong shape: holes, acne or light leaks",
    "traversal": "rays miss the nearest of many shapes, or read other texels: holes, or wrong colours",
    "furnace": "the integrator loses or gains energy on this driver: brightness is wrong",
    "estimators": "light sampling and BSDF sampling disagree: shadows or reflections are wrong",
    "determinism": "the same seed gives different images: results cannot be repeated",
}


@dataclass(frozen=True)
class Finding:
    """The result of one check on one ``subject``; ``seconds`` is its duration."""

    check: str
    subject: str
    passed: bool
    detail: str
    seconds: float = 0.0

    @property
    def meaning(self) -> str:
        """What the failure means; empty if it passed."""
        return "" if self.passed else CHECKS[self.check]


def examine(context: Any) -> Iterator[Finding]:
    """Run all checks on ``context`` (a moderngl context, current), yielding findings as they come.

    A check that the driver stops with an error becomes a finding that did not pass.
    """
    for check in CHECKS:
        module = import_module(f"fragtracer.apps.doctor.{check}")
        start = time.perf_counter()
        try:
            for finding in module.findings(context):
                yield replace(finding, seconds=time.perf_counter() - start)
                start = time.perf_counter()
        except FragtracerError as error:
            yield Finding(check, "runs at all", False, str(error), time.perf_counter() - start)
