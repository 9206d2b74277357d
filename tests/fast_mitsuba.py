# SPDX-License-Identifier: MIT
"""For tests that take too long without LLVM."""

import pytest

from fragtracer.reference.variant import OLDEST_LLVM, find_llvm


def need_fast_mitsuba() -> None:
    """Skip where Mitsuba is not installed, or would run as ``scalar_rgb``."""
    pytest.importorskip("mitsuba", reason="Mitsuba is not installed: pip install 'fragtracer[reference]'")
    if find_llvm() is None:
        pytest.skip(
            f"no LLVM of version {OLDEST_LLVM} or newer on this machine: scalar_rgb is too slow for these tests"
        )
