# SPDX-License-Identifier: MIT
"""The OpenGL context that the tests share."""

import copy
import os
from collections.abc import Iterator

import moderngl
import pytest

from fragtracer.gpu.context import create_context


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long comes first, so that no process is left with it while the others have nothing more to do."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(scope="session")
def ctx() -> Iterator[moderngl.Context]:
    """A headless context, current during each test that asks for it."""
    context = create_context()
    yield context
    context.release()


@pytest.fixture(autouse=True, scope="session")
def _cache_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The tests leave the user's cache alone, and find nothing there that an earlier run computed. All processes of a
    run share it."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FRAGTRACER_CACHE", str(folder / "cache"))
        # The command asks for wider vectors where it can; here all processes have the same.
        patch.setenv("LP_NATIVE_VECTOR_WIDTH", os.environ.get("LP_NATIVE_VECTOR_WIDTH", "256"))
        patch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)  # processes that tests start need not all compile Python
        yield


@pytest.fixture(autouse=True)
def _same_numbers_in_any_order(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test of a module with random numbers, ``RNG``, has the same ones, whichever tests its process had before."""
    if hasattr(request.module, "RNG"):
        monkeypatch.setattr(request.module, "RNG", copy.deepcopy(request.module.RNG))


@pytest.fixture(autouse=True)
def _no_gl_errors(request: pytest.FixtureRequest) -> Iterator[None]:
    """Each test that uses ``ctx`` must find it free of errors, and leave it so."""
    if "ctx" not in request.fixturenames:
        yield
        return
    context = request.getfixturevalue("ctx")
    with context:
        assert context.error == "GL_NO_ERROR", "an error was there before the test"
        yield
    with context:  # the test may have made another one current
        assert context.error == "GL_NO_ERROR"
