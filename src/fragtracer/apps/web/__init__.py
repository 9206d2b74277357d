# SPDX-License-Identifier: MIT
"""A scene in one HTML file that traces it, by the shaders of the desktop, in WebGL 2."""

import base64
import hashlib
import html
import io
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Literal

import numpy as np
from PIL import Image

from fragtracer import __version__
from fragtracer.apps.web.payload import scene_payload
from fragtracer.display.look import Look
from fragtracer.output import check_writable, replacing
from fragtracer.renderer import Renderer
from fragtracer.scene import Scene

SUFFIXES = (".html", ".htm")
POSTER_SECONDS = 30.0
_POSTER_QUALITY = 85  # of WebP


def export_html(
    scene: Scene,
    path: str | Path,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seconds: float = POSTER_SECONDS,
    exposure: float | Literal["auto"] = 0.0,
    tonemap: str = "linear",
) -> list[str]:
    """Write a page that shows a picture of ``scene`` at once, and then traces it live; nothing else is needed.

    Parameters
    ----------
    scene
        What to trace.
    path
        The file, .html or .htm.
    size
        (width, height) of the picture in pixels; left out, the scene's own. The page keeps its proportions.
    spp
        Samples per pixel of the picture; left out, the scene's own, or as many as there is time for.
    seconds
        The time that the picture may take.
    exposure
        Brightness in stops, or "auto".
    tonemap
        "linear", "reinhard", "aces" or "agx".

    Returns
    -------
    list of str
        What was done to make the page small, a line each.

    Raises
    ------
    OutputError
        If the file cannot be written.
    SceneError
        If the scene is more than a browser can hold.
    """
    check_writable(path, SUFFIXES)
    text = page(scene, size, spp, seconds, Look(exposure, tonemap))
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return []


def page(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seconds: float = POSTER_SECONDS,
    look: Look | None = None,
) -> str:
    """The text of the page; see :func:`export_html`."""
    look = look or Look()
    width, height = size or (scene.render.width, scene.render.height)
    settings = replace(scene.render, width=width, height=height, guiding="off")
    with Renderer(scene, (width, height)) as renderer:
        image = renderer.render(spp=spp or settings.spp, seconds=seconds)
    look = replace(look, exposure=look.stops(image))
    shown = Image.fromarray(np.uint8(np.rint(255 * look.show(image))))
    poster = io.BytesIO()
    shown.save(poster, "webp", quality=_POSTER_QUALITY)
    style = Template(_text("page.css")).substitute(width=width, height=height)
    script = _text("runner.js")
    return Template(_text("page.html")).substitute(
        style_hash=_hash(style),
        script_hash=_hash(script),
        version=__version__,
        name=html.escape(scene.name),
        style=style,
        poster=_base64(poster.getvalue()),
        width=width,
        height=height,
        scene=_base64(scene_payload(scene, settings, look)),
        script=script,
    )


def _text(name: str) -> str:
    return files("fragtracer.apps.web").joinpath(name).read_text(encoding="utf-8")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _hash(text: str) -> str:
    """As a policy names an inline script or style."""
    return _base64(hashlib.sha256(text.encode()).digest())
