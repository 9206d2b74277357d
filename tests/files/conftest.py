# SPDX-License-Identifier: MIT
"""The variant of Mitsuba that files are read with."""

from collections.abc import Iterator

import pytest

from fragtracer.io.mitsuba.nodes import VARIANT
from fragtracer.reference.variant import choose_variant


@pytest.fixture(autouse=True, scope="module")
def _variant_stays(request: pytest.FixtureRequest) -> Iterator[None]:
    """To switch between it and the one that renders takes 0.1 s, and to read a file is to switch twice."""
    if "mitsuba" not in request.module.__name__:
        yield
        return
    mitsuba = pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
    mitsuba.set_variant(VARIANT)
    yield
    mitsuba.set_variant(choose_variant())
