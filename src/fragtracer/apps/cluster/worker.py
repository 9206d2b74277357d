# SPDX-License-Identifier: MIT
"""What runs on a worker: parts of one scene after the other, by a renderer that stays."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from fragtracer.apps.cluster.guard import loads
from fragtracer.apps.cluster.work import Block, Frame, Part, PilotSamples, pixels_digest
from fragtracer.renderer import Renderer
from fragtracer.sampling.allocation import StagePart
from fragtracer.sampling.pixels import Pixels
from fragtracer.shader_composer import shaders_digest

_gl = ThreadPoolExecutor(1)  # an OpenGL context belongs to a thread


@dataclass
class _Kept:
    """The renderer of the last scene, the frame that it is set to, and its origin then."""

    renderer: Renderer
    frame: Frame | None
    origin: dict[str, str]


_kept: dict[str, _Kept] = {}  # by the digest of its scene


@dataclass(frozen=True)
class Rendered:
    """A part as a worker returns it; ``digest`` is that of its pixels, ``origin`` and ``driver`` what made it. Which
    ``worker`` that was is for those to say who have asked it."""

    pixels: Pixels
    digest: str
    seconds: float
    worker: str
    driver: str
    origin: dict[str, str]


def render_part(scene: bytes, key: str, frame: Frame | None, part: Part, worker: str = "") -> Rendered:
    """A part of a frame of the pickled ``scene``, whose digest is ``key``."""
    return _gl.submit(_render_part, scene, key, frame, part, worker).result()


def _render_part(scene: bytes, key: str, frame: Frame | None, part: Part, worker: str) -> Rendered:
    if key not in _kept:
        _close()
        loaded = loads(scene)
        renderer = Renderer(loaded, moves=frame is not None, pictures=1 if frame is None else frame.count)
        _kept[key] = _Kept(renderer, None, renderer.origin())
    kept = _kept[key]
    if frame is not None and frame != kept.frame:
        scene_of_frame = replace(kept.renderer.scene, camera=frame.camera)
        try:
            kept.renderer.reset(scene_of_frame, seed=frame.seed)
            kept.frame, kept.origin = frame, kept.renderer.origin()
        except Exception:  # of the device too, which may not have let it go back to the frame before
            _close()
            raise
    start = time.perf_counter()
    pixels = _draw(kept.renderer, part)
    seconds = time.perf_counter() - start
    return Rendered(pixels, pixels_digest(pixels), seconds, worker, kept.renderer.driver, kept.origin)


def _draw(renderer: Renderer, part: Part) -> Pixels:
    match part:
        case Block(window, spp):
            return renderer.block(window, spp)
        case StagePart():
            return renderer.stage_part(part)
        case PilotSamples():
            return renderer.pilot()


def versions() -> dict[str, str]:
    """Of what renders here, by the names that they have in an origin."""
    from fragtracer import __version__

    return {"version": __version__, "shaders": shaders_digest()}


def close() -> None:
    """Release what is held on the GPU."""
    _gl.submit(_close).result()


def _close() -> None:
    while _kept:
        _, kept = _kept.popitem()
        kept.renderer.close()
