# SPDX-License-Identifier: MIT
"""Drivers that give up."""

import os
from pathlib import Path
from typing import Any

import moderngl
import pytest
from common import GOLD

import fragtracer as ft
from fragtracer.apps.viewer import run
from fragtracer.apps.viewer.app import Viewer
from fragtracer.errors import FragtracerError


def runs_out_of_memory() -> None:
    """A film that does not fit ends with a message, and the edited scene is kept."""
    make = moderngl.Context.framebuffer

    def full(self: Any, textures: Any = (), **options: Any) -> Any:
        if textures and textures[0].size[0] > 700:
            raise moderngl.Error("the framebuffer is not complete")
        return make(self, textures, **options)

    def grow(viewer: Viewer) -> None:
        viewer.session.edit(viewer.session.document.without_part(GOLD), "remove")
        viewer.screen.window.set_size(1200, 700)

    moderngl.Context.framebuffer = full  # type: ignore[method-assign]
    ends_with_the_scene_kept(grow, "no memory for an image")


def loses_its_context() -> None:
    """A driver that gave up ends with a message, and the edited scene is kept."""

    def lose(viewer: Viewer) -> None:
        viewer.session.edit(viewer.session.document.without_part(GOLD), "remove")
        viewer.screen.context = Lost(viewer.screen.context)

    ends_with_the_scene_kept(lose, "lost the window's context")


class Lost:
    """A context that says what one says after a reset."""

    error = "GL_UNKNOWN_ERROR"

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)


def ends_with_the_scene_kept(harm: Any, message: str) -> None:
    """Run the viewer as the command does, and do ``harm`` in the fourth frame."""
    turned, frame = 0, Viewer.frame

    def counted(self: Viewer) -> None:
        nonlocal turned
        turned += 1
        if turned == 4:
            harm(self)
        frame(self)

    Viewer.frame = counted  # type: ignore[method-assign]
    with pytest.raises(FragtracerError, match=message) as caught:
        run.view("three-spheres", (640, 400), frames=600)
    assert turned < 400
    kept = Path(os.environ["XDG_CONFIG_HOME"]) / "fragtracer" / "rescued-three-spheres.toml"
    assert str(kept) in str(caught.value)
    assert len(ft.load(kept).spheres) == 2
