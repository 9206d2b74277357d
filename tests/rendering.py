# SPDX-License-Identifier: MIT
"""Renders for tests, and errors planted in the shaders to see whether a test finds them."""

import shutil
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer.gpu import tracer
from fragtracer.gpu.context import is_software
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.gpu.specialise import MOST_LISTED, Level
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.scene import PLAIN, Scene

ESTIMATORS = ("nee", "bsdf", "mis")
CHUNK = 512  # samples per pixel drawn by one call

Image = NDArray[np.float32]


def rendered(ctx: moderngl.Context, scene: Scene, spp: int, size: tuple[int, int] = (32, 32), **settings: Any) -> Image:
    """The image, (height, width, 3); no sample may have been NaN or infinite."""
    return batches(ctx, scene, spp, [settings.pop("seed", 0)], size=size, **settings)[0]


def batches(
    ctx: moderngl.Context,
    scene: Scene,
    spp: int,
    seeds: Iterable[int],
    size: tuple[int, int] = (32, 32),
    specialised: bool = True,
    shared: bool = False,
    **settings: Any,
) -> Image:
    """Independent images, one for each seed, (seeds, height, width, 3); without guiding, adaptive sampling and light
    tracing, unless they are asked for.

    ``shared``: by a renderer with nothing compiled in but the kinds of things that there are, which may have rendered
    other scenes before. Where samples are few and only values differ between tests, this takes less time.
    """
    images = []
    settings = {"rays": min(spp, CHUNK), "specialised": specialised} | PLAIN | settings
    with (
        nullcontext(_shared(ctx, scene, size, settings))
        if shared
        else Renderer(scene, size, context=ctx, **settings) as renderer
    ):
        for seed in seeds:
            renderer.reset(seed=seed)
            renderer.sample(spp)
            assert renderer.non_finite_samples() == 0
            images.append(renderer.image())
    assert np.isfinite(images).all()
    assert np.min(images) >= 0
    return np.stack(images)


_renderers: dict[str, Renderer] = {}  # the last ones used, the newest last


def _shared(ctx: moderngl.Context, scene: Scene, size: tuple[int, int], settings: dict[str, Any]) -> Renderer:
    """One of the last renderers with these settings, or a new one."""
    made_of = id(ctx), tracer.folder("shaders"), MOST_LISTED, size, scene.render, sorted(settings.items())
    key = repr(made_of)
    if (renderer := _renderers.pop(key, None)) is None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("fragtracer.renderer.picture_level", lambda *_: Level.KINDS)
            renderer = Renderer(scene, size, context=ctx, **settings)
    renderer.reset(scene)
    _renderers[key] = renderer
    if len(_renderers) > 8:
        _renderers.pop(next(iter(_renderers))).close()
    return renderer


def assert_same(ctx: moderngl.Context, a: Image, b: Image) -> None:
    """Two programs have rendered the same picture: to the bit, but for a GPU's driver, which may round the same
    expression in another way in each of them."""
    np.testing.assert_allclose(a, b, rtol=0 if is_software(ctx) else 1e-6)


def ends_loops(ctx: moderngl.Context) -> bool:
    """Whether the driver stops a shader after 65,535 rounds of its loops: llvmpipe of Mesa 22.3 does, of 25.0 not."""
    loop = "int count = 0;\n    while (count < u_rounds) count++;\n    color = vec4(count);"
    text = f"uniform int u_rounds;\nout vec4 color;\nvoid main() {{\n    {loop}\n}}\n"
    program = FullscreenProgram(ctx, folder("shaders"), "loop.frag", generated={"loop.frag": text})
    program.set({"u_rounds": 70_000})
    count = drawn(ctx, program)[0]
    program.release()
    return count < 70_000


def drawn(ctx: moderngl.Context, program: FullscreenProgram) -> list[float]:
    """What ``program`` draws into a pixel."""
    outside = ctx.detect_framebuffer()
    target = ctx.texture((1, 1), 4, dtype="f4")
    framebuffer = ctx.framebuffer([target])
    framebuffer.use()
    program.draw()
    pixel = np.frombuffer(target.read(), np.float32).tolist()
    outside.use()
    for resource in (framebuffer, target):
        resource.release()
    return pixel


def in_long_passes(scene: Scene) -> Scene:
    """The same scene, of which a software renderer draws the same bits in less time."""
    return replace(scene, render=replace(scene.render, rays=CHUNK))


def list_at_most(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """Have all renderers made afterwards test rays against each shape where there are at most ``count``, and else
    against a BVH."""
    for kind in MOST_LISTED:
        monkeypatch.setitem(MOST_LISTED, kind, count)


class Planter:
    """Replaces text in a copy of the shaders, from which all renderers made afterwards are built."""

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        root: Path,
        modules: Iterable[str] = ("gpu.tracer", "light_tracing.tracer", "probe"),
    ) -> None:
        self._copy = root / "shaders"
        shutil.copytree(folder("shaders"), self._copy)
        for module in modules:
            monkeypatch.setattr(f"fragtracer.{module}.folder", lambda name: root / name)

    def __call__(self, file: str, text: str, replacement: str) -> None:
        path = self._copy / file
        source = path.read_text("utf-8")
        assert source.count(text) == 1, f"{text!r} occurs {source.count(text)} times in {file}"
        path.write_text(source.replace(text, replacement), "utf-8")
