# SPDX-License-Identifier: MIT
"""Errors for the shaders, each a slip that someone has made: what it is, where, the text it replaces, and the test of
the suite that must find it.

Every one changes what the picture converges to, or hides that something went wrong. Of the tests that find it, the one
named is among the quickest; a few are given to the comparison with Mitsuba, which has to find errors as well.
"""

from mutations import bsdf, core, film, integrator, light, material, medium, photons, shape

MUTATIONS = [
    mutation
    for module in (bsdf, core, film, integrator, light, material, medium, photons, shape)
    for mutation in module.MUTATIONS
]
