# SPDX-License-Identifier: MIT
"""What has changed in files, taken over into a scene that has been edited."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

_ABSENT = object()


def merged(base: Any, ours: Any, theirs: Any) -> Any:
    """``ours`` with what has changed from ``base`` to ``theirs``.

    What has changed in both is merged by its parts, and ``ours`` stays where it has none, or where the scene model
    rejects the parts of both together.

    Raises
    ------
    ValueError
        If it rejects the whole.
    """
    if base == theirs or ours == theirs:
        return ours
    if ours == base:
        return theirs
    each = base, ours, theirs
    if all(isinstance(one, Mapping) for one in each):
        found = {name: _part(*(one.get(name, _ABSENT) for one in each)) for name in {**ours, **theirs}}
        return {name: value for name, value in found.items() if value is not _ABSENT}
    if all(isinstance(one, tuple) for one in each) and len({len(one) for one in each}) == 1:
        return tuple(map(_part, *each))
    if is_dataclass(ours) and type(base) is type(ours) is type(theirs):
        names = [field.name for field in fields(ours)]
        values = {name: _part(*(getattr(one, name) for one in each)) for name in names}
        return replace(ours, **values)  # type: ignore[type-var]
    return ours


def _part(base: Any, ours: Any, theirs: Any) -> Any:
    try:
        return merged(base, ours, theirs)
    except ValueError:
        return ours
