# SPDX-License-Identifier: MIT
"""Mitsuba for the tests of this folder: the fast variant, started once."""

from collections.abc import Iterator
from typing import Any

import pytest

from fragtracer.reference.variant import find_llvm, mitsuba_variant


@pytest.fixture(scope="session")
def mi() -> Iterator[Any]:
    """Mitsuba with ``llvm_ad_rgb`` active and our material registered."""
    mitsuba = pytest.importorskip("mitsuba")
    if find_llvm() is None:
        pytest.skip("no LLVM of version 16 or newer on this machine: scalar_rgb is too slow for these tests")
    with mitsuba_variant("llvm_ad_rgb"):
        yield mitsuba
