# SPDX-License-Identifier: MIT
"""The tests of fragtracer.apps.compare on the pictures of a viewer, in another process, since importing SciPy
would stop the window for a second.

Repeated tests inflate the probability of a false alarm. They therefore run only at the numbers of pictures
in :data:`LOOKS`, and share the significance level of one comparison (Šidák).
"""

import pickle
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fragtracer.apps.compare.statistics import sidak
from fragtracer.apps.compare.verdict import ALPHA, Means, Outcome, judge_means

LOOKS = (8, 16, 32, 64, 128, 256)  # pictures on each side
_ALPHA = sidak(ALPHA, len(LOOKS))
_CHILD = "from fragtracer.apps.viewer.finding import main; main()"


@dataclass(frozen=True)
class Finding:
    """The verdict (:mod:`fragtracer.apps.compare.verdict`) on ``pictures`` of each side.

    ``z`` and ``differs`` are those of the blocks, (rows, columns, 3); a block differs where |z| is at least
    ``critical``. ``differing`` of all ``comparisons`` find a difference.
    """

    pictures: int
    outcome: Outcome
    margin: float
    comparisons: int
    differing: int
    z: NDArray[np.float64]
    differs: NDArray[np.bool_]
    critical: float


def judged(ours: Sequence[Means], reference: Sequence[Means], non_finite: int = 0) -> Finding:
    """Test as many pictures of ours as of the reference, at one of the looks."""
    verdict = judge_means(_stacked(ours), _stacked(reference), alpha=_ALPHA, non_finite=non_finite)
    blocks = verdict.blocks
    numbers = verdict.margin, verdict.comparisons, verdict.differing
    return Finding(len(ours), verdict.outcome, *numbers, blocks.z, blocks.differs, blocks.critical)


def _stacked(means: Sequence[Means]) -> dict[str, NDArray[np.float64]]:
    return {name: np.concatenate([m[name] for m in means]) for name in means[0]}


def judged_elsewhere(ours: Sequence[Means], reference: Sequence[Means], non_finite: int) -> Finding:
    """:func:`judged` in another process; waits for it."""
    arguments = pickle.dumps((ours, reference, non_finite))
    done = subprocess.run([sys.executable, "-c", _CHILD], input=arguments, stdout=subprocess.PIPE, check=True)
    finding: Finding = pickle.loads(done.stdout)
    return finding


def main() -> None:
    """From the arguments of :func:`judged` on the standard input to what it returns on the standard output."""
    sys.stdout.buffer.write(pickle.dumps(judged(*pickle.load(sys.stdin.buffer))))
