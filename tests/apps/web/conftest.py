# SPDX-License-Identifier: MIT
"""Browsers, and pages for them."""

import base64
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium import PROGRAM, Chromium

from fragtracer.apps.web import page
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene

HAS_STARTED = "window.fragtracer && fragtracer.live.shown"


def _browser(driver: str) -> Iterator[Chromium]:
    if PROGRAM is None:
        pytest.skip("Chromium is not installed (Debian: chromium)")
    with Chromium(driver) as browser:
        yield browser


@pytest.fixture(scope="session")
def _swiftshader() -> Iterator[Chromium]:
    yield from _browser("swiftshader")


@pytest.fixture(scope="session")
def _mesa() -> Iterator[Chromium]:
    yield from _browser("mesa")


@pytest.fixture
def swiftshader(_swiftshader: Chromium) -> Iterator[Chromium]:
    """A browser that renders with SwiftShader."""
    yield _swiftshader
    _swiftshader.rest()


@pytest.fixture
def mesa(_mesa: Chromium) -> Iterator[Chromium]:
    """A browser that renders with the OpenGL of the system, as the desktop does."""
    yield _mesa
    _mesa.rest()


@pytest.fixture
def opened(mesa: Chromium, tmp_path: Path) -> Iterator[Callable[[Scene], Chromium]]:
    """Show the page of a scene, which must raise no error and ask for nothing until the end of the test."""
    mesa.resize(400, 500)

    def open_page(scene: Scene) -> Chromium:
        open_scene(mesa, scene, tmp_path)
        return mesa

    yield open_page
    assert mesa.problems() == []
    assert [url for url in mesa.requests() if not url.endswith("/page.html")] == []


def open_scene(browser: Chromium, scene: Scene, folder: Path) -> None:
    """Show the page of a scene, until something is traced."""
    browser.events.clear()
    path = folder / "page.html"
    path.write_text(page(scene, (48, 32), 1).text, encoding="utf-8")
    browser.open(path)
    browser.wait(HAS_STARTED)


def pixels(textures: list[str], width: int, height: int) -> Pixels:
    """What the runner gives of a film."""
    mean, variance, half_difference = (
        np.frombuffer(base64.b64decode(text), np.float32).reshape(height, width, 4)[::-1] for text in textures
    )
    return Pixels(mean, variance, half_difference[..., :3])
