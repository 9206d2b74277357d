# SPDX-License-Identifier: MIT
"""The independent witness: any fragtracer scene, rendered by Mitsuba 3 with the same formulas."""
