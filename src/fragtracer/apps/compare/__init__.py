# SPDX-License-Identifier: MIT
"""Do fragtracer and Mitsuba agree on a scene? Two samples of pictures, a verdict, and a report.

::

    from fragtracer.apps.compare import compare_scene, summary, to_json, write_report

    comparison = compare_scene(ft.load("three-spheres"))
    print(summary(comparison))
    write_report("report.html", comparison)
    json.dump(to_json(comparison), file)
    sys.exit(comparison.exit_status)  # 0 agreement, 1 disagreement, 2 could not compare

:mod:`.verdict` says what is tested and what the verdicts mean, :mod:`.statistics` how.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragtracer.apps.compare.numbers import to_json
    from fragtracer.apps.compare.pictures import write_side_by_side
    from fragtracer.apps.compare.report import write_report
    from fragtracer.apps.compare.run import Comparison, compare_renderings, compare_scene
    from fragtracer.apps.compare.words import summary

_PUBLIC = {
    "Comparison": "run",
    "compare_scene": "run",
    "compare_renderings": "run",
    "summary": "words",
    "to_json": "numbers",
    "write_report": "report",
    "write_side_by_side": "pictures",
}
__all__ = [
    "Comparison",
    "compare_renderings",
    "compare_scene",
    "summary",
    "to_json",
    "write_report",
    "write_side_by_side",
]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'fragtracer.apps.compare' has no attribute {name!r}")
    return getattr(import_module(f"fragtracer.apps.compare.{_PUBLIC[name]}"), name)
