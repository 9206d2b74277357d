# SPDX-License-Identifier: MIT
"""Mitsuba at its best: which of its samplers, in passes of which size, does a scene most good."""

from collections.abc import Callable

from fragtracer.apps.bench.contenders import Mitsuba, Sampling
from fragtracer.apps.bench.plan import Plan
from fragtracer.scene import Scene

# Of all samplers numbers of samples per pixel that they do not round: squares, squares of primes, powers of two.
_SIZES = {
    "independent": (16, 64),
    "stratified": (16, 64),
    "multijitter": (16, 64),
    "orthogonal": (25, 49),
    "ldsampler": (16, 64),
}


def sampling_for(scene: Scene, plan: Plan, cost: Callable[[Mitsuba], float], say: Callable[[str], None]) -> Sampling:
    """The sampler and size of passes of the least ``cost``, a function that samples a warm Mitsuba on ``scene``; of the
    plan's sampler, if it names one. ``say`` hears what is tried."""
    names = tuple(_SIZES) if plan.sampler == "best" else (plan.sampler,)
    found = [Sampling(name, spp) for name in names for spp in _SIZES[name]]
    candidates = [sampling for sampling in found if sampling.fits(scene)] or found[:1]
    if len(candidates) == 1 or plan.sampler != "best":
        return candidates[-1]
    costs = {}
    for sampling in candidates:
        say(f"Mitsuba: {sampling}")
        with Mitsuba(scene, 0, plan.variant, sampling) as mitsuba:
            costs[sampling] = cost(mitsuba)
    return min(costs, key=lambda sampling: costs[sampling])
