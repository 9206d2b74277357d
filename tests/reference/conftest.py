# SPDX-License-Identifier: MIT
"""Mitsuba for the tests of this folder: the fast variant, started once."""

from collections.abc import Iterator
from typing import Any

import pytest
from fast_mitsuba import need_fast_mitsuba

from fragtracer.reference.variant import mitsuba_variant


@pytest.fixture(scope="session")
def mi() -> Iterator[Any]:
    """Mitsuba with ``llvm_ad_rgb`` active and our material registered."""
    need_fast_mitsuba()
    with mitsuba_variant("llvm_ad_rgb"):
        import mitsuba

        yield mitsuba
