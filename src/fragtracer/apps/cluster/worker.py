# SPDX-License-Identifier: MIT
"""What runs on a worker: blocks of one scene after the other, by a renderer that stays."""

import pickle
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from fragtracer.apps.cluster.work import pixels_digest
from fragtracer.films import shaders_digest
from fragtracer.renderer import Renderer
from fragtracer.sampling.allocation import Window
from fragtracer.sampling.pixels import Pixels

_gl = ThreadPoolExecutor(1)  # an OpenGL context belongs to a thread
_kept: dict[str, tuple[Renderer, dict[str, str]]] = {}  # the last one and its origin, by the digest of its scene


@dataclass(frozen=True)
class Rendered:
    """A block as a worker returns it; ``digest`` is that of its pixels, ``origin`` and ``driver`` what made it."""

    pixels: Pixels
    digest: str
    seconds: float
    worker: str
    driver: str
    origin: dict[str, str]


def render_block(scene: bytes, key: str, window: Window, spp: int, worker: str = "") -> Rendered:
    """``spp`` samples of a window of the pickled ``scene``, whose digest is ``key``."""
    return _gl.submit(_render_block, scene, key, window, spp, worker or _address()).result()


def _render_block(scene: bytes, key: str, window: Window, spp: int, worker: str) -> Rendered:
    if key not in _kept:
        _close()
        renderer = Renderer(pickle.loads(scene))
        _kept[key] = renderer, renderer.origin()
    renderer, origin = _kept[key]
    start = time.perf_counter()
    pixels = _draw(renderer, window, spp)
    seconds = time.perf_counter() - start
    return Rendered(pixels, pixels_digest(pixels), seconds, worker, renderer.driver, origin)


def _draw(renderer: Renderer, window: Window, spp: int) -> Pixels:
    return renderer.block(window, spp)


def versions() -> dict[str, str]:
    """Of what renders here, by the names that they have in an origin."""
    from fragtracer import __version__

    return {"version": __version__, "shaders": shaders_digest()}


def close() -> None:
    """Release what is held on the GPU."""
    _gl.submit(_close).result()


def _close() -> None:
    for renderer, _ in _kept.values():
        renderer.close()
    _kept.clear()


def _address() -> str:
    from distributed import get_worker

    return str(get_worker().address)
