# SPDX-License-Identifier: MIT
"""The reference: any scene rendered by Mitsuba 3, with an independent implementation of the same formulas."""
