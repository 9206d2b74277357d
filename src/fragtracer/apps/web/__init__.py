# SPDX-License-Identifier: MIT
"""A scene in one HTML file that traces it, by the shaders of the desktop, in WebGL 2."""

import base64
import hashlib
import html
import io
import json
import logging
import operator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fragtracer import __version__
from fragtracer.aov import DENOISING
from fragtracer.apps.web.payload import packed_for_page, scene_payload
from fragtracer.apps.web.smaller import with_quantised_meshes, with_smaller_images
from fragtracer.arguments import check_scene, checked_bytes, checked_seconds, checked_size, checked_spp
from fragtracer.camera_path import turntable
from fragtracer.denoising import check_installed
from fragtracer.denoising import denoise as denoised
from fragtracer.display.look import Look
from fragtracer.errors import FragtracerError, SceneError
from fragtracer.light_tracing import is_needed
from fragtracer.output import check_writable, replacing
from fragtracer.renderer import Renderer, expected_spp
from fragtracer.scene import RenderSettings, Scene

if TYPE_CHECKING:
    from fragtracer.apps.web.notebook import Widget

_log = logging.getLogger(__name__)

SUFFIXES = (".html", ".htm")
POSTER_SECONDS = 30.0
CELL_SECONDS = 5.0  # of a cell of a notebook
_QUALITY, _MOST_PIXELS = 85, 16383  # of WebP, the second a side
_MOST_HALVINGS = 4  # of images
_FIRST_BITS = 18  # of vertices, two fewer at each step
_LACKS = (
    "the live picture lacks what lights without a size throw through smooth glass or off mirrors onto other things: "
    "light tracing alone brings that, and pages trace paths"
)


@dataclass(frozen=True)
class Page:
    """The text of a page, what was done to make it small and what it lacks, a line each, and what it begins with."""

    text: str
    notes: list[str]
    settings: RenderSettings
    look: Look
    poster: bytes  # WebP

    def _repr_html_(self) -> str:
        """For a notebook: the page in a frame of its own."""
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" title="A live picture" allow="clipboard-write" '
            'style="width: 100%; height: 36rem; border: 0"></iframe>'
        )


def export_html(
    scene: Scene,
    path: str | Path,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seconds: float = POSTER_SECONDS,
    exposure: float | Literal["auto"] = 0.0,
    tonemap: str = "linear",
    size_limit: int | str | None = None,
    fallback: tuple[int, int, int] | None = None,
    denoise: bool = False,
) -> Page:
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
        The time that the picture may take, and as much again that all of ``fallback`` may take.
    exposure
        Brightness in stops, or "auto".
    tonemap
        "linear", "reinhard", "aces" or "agx".
    size_limit
        Bytes that the page may have, or a text as "5MB": images lose texels and meshes digits until it fits.
    fallback
        Width, height and number of pictures from all around, which can be turned where nothing can be traced.
    denoise
        Whether the picture, and those of ``fallback``, are denoised by Open Image Denoise; their text says so.

    Raises
    ------
    OutputError
        If the file cannot be written.
    FragtracerError
        If pictures are to be denoised, and Open Image Denoise is not installed; if an argument is not of its kind.
    SceneError
        If the scene is more than a browser can hold, or cannot be made as small.
    """
    check_scene(scene)
    check_writable(path, SUFFIXES)
    made = page(scene, size, spp, seconds, Look(exposure, tonemap), size_limit, fallback, denoise)
    with replacing(path) as part:
        part.write_text(made.text, encoding="utf-8")
    return made


def show(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    *,
    exposure: float | Literal["auto"] = 0.0,
    tonemap: str = "linear",
    **options: Any,
) -> Page:
    """The page of ``scene`` for a notebook, which shows it as the value of a cell.

    The arguments are those of :func:`export_html`, but ``seconds`` is 5 where it is left out.
    """
    return page(scene, size, spp, **{"seconds": CELL_SECONDS, "look": Look(exposure, tonemap), **options})


def widget(scene: Scene, size: tuple[int, int] | None = None, spp: int | None = None, **options: Any) -> "Widget":
    """The page of ``scene`` as a widget of a notebook, whose camera and settings can be read and set from Python.

    The arguments are those of :func:`show`.

    Raises
    ------
    FragtracerError
        If anywidget is not installed.
    """
    try:
        from fragtracer.apps.web.notebook import Widget
    except ImportError as error:
        raise FragtracerError("a widget needs anywidget; pip install 'fragtracer[notebook]'") from error
    return Widget(scene, show(scene, size, spp, **options))


def page(
    scene: Scene,
    size: tuple[int, int] | None = None,
    spp: int | None = None,
    seconds: float = POSTER_SECONDS,
    look: Look | None = None,
    size_limit: int | str | None = None,
    fallback: tuple[int, int, int] | None = None,
    denoise: bool = False,
) -> Page:
    """The page that :func:`export_html` writes."""
    check_scene(scene)
    look = look or Look()
    size = checked_size((scene.render.width, scene.render.height) if size is None else size, _MOST_PIXELS)
    width, height = size
    settings = replace(scene.render, width=width, height=height)
    spp = checked_spp(spp or settings.spp)
    seconds = checked_seconds(seconds)
    limit = np.inf if size_limit is None else checked_bytes(size_limit)
    fallback = None if fallback is None else _checked_fallback(fallback)
    if denoise:
        check_installed()
    packed_for_page(scene, settings)  # refused here, not after the work
    lacks = [_LACKS] if settings.light_tracing != "off" and is_needed(scene, settings) else []
    style = Template(_text("page.css")).substitute(width=width, height=height)
    script = _text("runner.js")
    template = Template(_text("page.html"))
    fields = {
        "style_hash": _hash(style),
        "script_hash": _hash(script),
        "version": __version__,
        "name": html.escape(scene.name),
        "rendered": "rendered and denoised" if denoise else "rendered",
        "style": style,
        "width": width,
        "height": height,
        "lacks": "".join(f"{line[0].upper()}{line[1:]}." for line in lacks),
        "script": script,
    }

    def written(step: int, look: Look, poster: bytes = b"", turntable: str = "[]") -> tuple[str, list[str]]:
        smaller, notes = _made_smaller(scene, step)
        payload = scene_payload(smaller, settings, look)
        pictures = {"poster": _base64(poster), "turntable": turntable}
        return template.substitute(fields, scene=_base64(payload), **pictures), notes

    def check_fits(text: str) -> None:
        if len(text.encode()) > limit:
            raise SceneError(f"the page takes {len(text) / 1e3:,.0f} kB at least; the limit is {limit / 1e3:,.0f} kB")

    last = _MOST_HALVINGS if _has_images(scene) or scene.meshes else 0
    if size_limit is not None:
        check_fits(written(last, Look())[0])  # without its pictures
    with Renderer(scene, size, spp=expected_spp(settings, spp, seconds)) as renderer:
        _log.info("rendering the poster")
        image = _rendered(renderer, spp, seconds, denoise)
    look = replace(look, exposure=look.stops(image))
    poster = _picture(image, look)
    turntable = "[]" if fallback is None else json.dumps(_turntable(scene, fallback, look, seconds, denoise))
    for step in range(last + 1):
        text, notes = written(step, look, poster, turntable)
        if len(text.encode()) <= limit:
            break
    check_fits(text)
    return Page(text, notes + lacks, settings, look, poster)


def _checked_fallback(fallback: Any) -> tuple[int, int, int]:
    try:
        width, height, count = map(operator.index, fallback)
    except (TypeError, ValueError):
        width = height = count = 0
    if not (1 <= width <= _MOST_PIXELS and 1 <= height <= _MOST_PIXELS and count >= 1):
        raise FragtracerError(f"fallback = {fallback!r}: give width, height and number of pictures, as (320, 180, 24)")
    return width, height, count


def _has_images(scene: Scene) -> bool:
    is_lit = scene.environment is not None and scene.environment.image is not None
    return is_lit or any(material.textures for material in scene.materials.values())


def _made_smaller(scene: Scene, step: int) -> tuple[Scene, list[str]]:
    """The scene as it is at step 0, then ever smaller, and what was done to it."""
    if step == 0:
        return scene, []
    smaller, side = with_smaller_images(scene, step)
    bits = _FIRST_BITS - 2 * step
    notes = [f"to keep it small, images have {side} texels a side at most"] if _has_images(scene) else []
    notes += [f"to keep it small, vertices of meshes lie on a grid of 2^{bits} steps"] if scene.meshes else []
    return with_quantised_meshes(smaller, bits), notes


def _rendered(renderer: Renderer, spp: int, seconds: float, denoise: bool) -> NDArray[np.float32]:
    image = renderer.render(spp=spp, seconds=seconds)
    return denoised(image, *map(renderer.aov, DENOISING)) if denoise else image


def _turntable(scene: Scene, fallback: tuple[int, int, int], look: Look, seconds: float, denoise: bool) -> list[str]:
    """Pictures from all around the target, the first that of the camera, each further to its left."""
    width, height, count = fallback
    pictures = []
    settings = replace(scene.render, width=width, height=height)
    spp = expected_spp(settings, settings.spp, seconds / count)
    with Renderer(scene, (width, height), specialised=False, spp=spp) as renderer:
        for number, camera in turntable(scene.camera, count).keys.items():
            _log.info("rendering picture %d of %d", number, count)
            renderer.reset(replace(scene, camera=camera))
            image = _rendered(renderer, scene.render.spp, seconds / count, denoise)
            pictures.append(_base64(_picture(image, look)))
    return pictures


def _picture(image: NDArray[np.float32], look: Look) -> bytes:
    """As WebP."""
    data = io.BytesIO()
    Image.fromarray(np.uint8(np.rint(255 * look.show(image)))).save(data, "webp", quality=_QUALITY)
    return data.getvalue()


def _text(name: str) -> str:
    return files("fragtracer.apps.web").joinpath(name).read_text(encoding="utf-8")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _hash(text: str) -> str:
    """As a policy names an inline script or style."""
    return _base64(hashlib.sha256(text.encode()).digest())
