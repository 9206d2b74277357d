# SPDX-License-Identifier: MIT
"""How fast fragtracer is on this machine, how its cost grows, and how it compares with Mitsuba.

Each benchmark fills a :class:`fragtracer.apps.bench.tables.Table` row by row, so that an interrupted run keeps the rows
that are finished; :mod:`fragtracer.apps.bench.suite` lists them by name.
"""
