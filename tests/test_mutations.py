# SPDX-License-Identifier: MIT
"""The check that each error of tests/mutations names fails with it, and passes without it: here, if it is no case of
the suite by itself."""

from pathlib import Path

import moderngl
import pytest
from mutations import MUTATIONS
from mutations.mutation import Mutation
from rendering import Planter

# The modules that read the shaders, but for those whose results are kept.
READERS = (
    "gpu.tracer",
    "gpu.accumulation",
    "gpu.splats",
    "light_tracing.tracer",
    "probe",
    "apps.viewer.programs",
    "apps.viewer.lit_film",
)


@pytest.fixture(scope="module")
def passed() -> set[str]:
    """The checks, of those that are no cases of the suite, that have passed without an error."""
    return set()


@pytest.mark.parametrize("mutation", MUTATIONS, ids=[mutation.name for mutation in MUTATIONS])
def test_a_mutation_is_found(
    ctx: moderngl.Context, passed: set[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, mutation: Mutation
) -> None:
    def check() -> None:
        with monkeypatch.context() as patch:
            mutation.check(ctx=ctx, monkeypatch=patch)

    if not mutation.check.is_case and str(mutation.check) not in passed:
        check()
        passed.add(str(mutation.check))
    readers = READERS
    if mutation.kept:
        monkeypatch.setenv("FRAGTRACER_CACHE", str(tmp_path / "cache"))
        readers = (*READERS, "gpu.cube_maps", "guiding.photons")
    Planter(monkeypatch, tmp_path, readers)(mutation.file, mutation.text, mutation.replacement)
    with pytest.raises(AssertionError) as found:
        check()
    assert "too noisy" not in str(found.value), "noise is no difference"
