# SPDX-License-Identifier: MIT
"""The gallery: what the method's page shows is in the shaders, and the site works from files, without a network."""

import importlib.util
import re
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from chromium import Chromium

import fragtracer as ft

CHECKOUT = Path(__file__).parents[3]
METHOD = CHECKOUT / "docs" / "method.md"


@pytest.fixture(scope="module")
def gallery() -> ModuleType:
    """scripts/gallery.py"""
    for name in ("mkdocs", "material", "mkdocstrings"):
        pytest.importorskip(name, reason=f"{name} is not installed (extra: docs)")
    spec = importlib.util.spec_from_file_location("gallery", CHECKOUT / "scripts" / "gallery.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_method_shows_lines_of_the_shaders(gallery) -> None:
    text = gallery.method(METHOD.read_text())
    shown = re.findall(r'```glsl title="([^"]+)"\n(.+?)\n```', text, re.DOTALL)
    assert len(shown) == METHOD.read_text().count("```glsl\n")
    for path, code in shown:
        lines = [line.strip() for line in (CHECKOUT / path).read_text().splitlines()]
        assert set(map(str.strip, code.splitlines())) <= set(lines)
    assert all(function in text for function in ("Ray camera_ray_at(", "float power_heuristic(", "uint block = index"))
    assert set(re.findall(r"live/step-([\w-]+)\.html", text)) == set(gallery.steps())


@pytest.mark.parametrize(
    "what", ["camera_ray_of", '"no such text" to "}"', '"camera_ray_at(" to "}"', '"vec4 target" to "no end"']
)
def test_lines_that_are_gone_stop_the_build(gallery, what) -> None:
    text = METHOD.read_text().replace(
        "shaders/camera/camera.glsl: camera_ray_at", f"shaders/camera/camera.glsl: {what}"
    )
    with pytest.raises(ValueError, match=r"camera\.glsl has \d times what docs/method\.md shows of it: "):
        gallery.method(text)


def test_a_site_of_two_scenes_asks_for_nothing(gallery, mesa: Chromium, monkeypatch, tmp_path) -> None:
    """Nor has it a link that leads nowhere, at which strict MkDocs ends."""
    steps = {name: ft.load("three-spheres") for name in gallery.steps()}
    made = replace(gallery.page(steps["hit"], (48, 27), 1), text="<!DOCTYPE html><title>Live</title>")
    monkeypatch.setattr(gallery, "steps", lambda: steps)
    monkeypatch.setattr(gallery, "page", lambda *_, **__: made)
    site = tmp_path / "site"
    gallery.make(tmp_path / "pages", site, ["cornell-box", "furnace"], 0.1)
    for path in site.rglob("*.html"):
        assert not re.search(r'<(script|link|img|iframe)\b[^>]*(src|href)="(https?:)?//', path.read_text())
    mesa.events.clear()
    for name, count in (("gallery", 2), ("docs/method", 0)):
        mesa.open(site / f"{name}.html")
        assert mesa.run("[...document.images].filter((image) => !image.complete || !image.naturalWidth).length") == 0
        pages = mesa.run("[...document.querySelectorAll('.posters a')].map((link) => link.getAttribute('href'))")
        assert len(pages) == count
        assert all((site / page).is_file() for page in pages)
    mesa.run("document.querySelector('.md-search__input').focus()")
    mesa.call("Input.insertText", text="stratification")
    mesa.wait("document.querySelector('.md-search-result__link')")
    found = mesa.run("[...document.querySelectorAll('.md-search-result__link')].map((link) => link.href)")
    assert any(f"{site.as_uri()}/docs/sampling.html" in link for link in found)
    assert [url for url in mesa.requests() if not url.startswith("file:")] == []
    assert mesa.problems() == []
    mesa.call("Page.navigate", url="about:blank")
