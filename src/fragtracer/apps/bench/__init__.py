# SPDX-License-Identifier: MIT
"""How fast fragtracer is on this machine, what its cost grows with, and how it fares against Mitsuba.

Each benchmark fills a :class:`fragtracer.apps.bench.tables.Table` row by row, so that an interrupted one
keeps what it has; :mod:`fragtracer.apps.bench.suite` knows them all by name.
"""
