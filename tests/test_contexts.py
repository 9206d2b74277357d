# SPDX-License-Identifier: MIT
"""Contexts that others draw on, too, and renderers that several threads use."""

import gc
import os
import threading

import moderngl
import numpy as np
import pytest
from small_pictures import SCENES, SIZE, picture

from fragtracer.errors import DeviceError
from fragtracer.gpu.context import create_context
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN

FLAGS = moderngl.BLEND | moderngl.CULL_FACE | moderngl.RASTERIZER_DISCARD


def test_a_context_may_have_any_state(ctx, monkeypatch):
    """Which it has again afterwards. Textures in place of images, as GPUs have them, see more of it."""
    for module in ("context", "outputs", "program", "textures"):
        monkeypatch.setattr(f"fragtracer.gpu.{module}.has_images", lambda _: False)
    image = picture(ctx, SCENES[0])
    with create_context() as theirs:
        framebuffer = theirs.framebuffer([theirs.texture((100, 80), 1)])
        framebuffer.use()
        framebuffer.viewport, framebuffer.scissor = (1, 2, 30, 40), (0, 0, 50, 80)
        samplers = [theirs.sampler(filter=(moderngl.LINEAR, moderngl.LINEAR)) for _ in range(16)]
        for unit, sampler in enumerate(samplers):
            sampler.use(unit)
        theirs.enable(FLAGS)
        theirs.blend_func = moderngl.ONE, moderngl.ONE
        theirs.wireframe, theirs.cull_face, theirs.point_size = True, "front", 5.0
        with Renderer(load(SCENES[0]), SIZE, context=theirs, **PLAIN) as renderer:
            for _ in range(2):
                renderer.sample(24)
                np.testing.assert_array_equal(renderer.image(), image)
                renderer.reset()
        assert theirs.fbo is framebuffer
        assert theirs.detect_framebuffer().glo == framebuffer.glo
        assert (framebuffer.viewport, framebuffer.scissor) == ((1, 2, 30, 40), (0, 0, 50, 80))
        assert (theirs.wireframe, theirs.point_size) == (True, 5.0)
        theirs.clear(1.0)
        assert not any(framebuffer.read(components=1)), "nothing is drawn while the rasterizer discards it"
        theirs.disable(FLAGS)
        theirs.clear(1.0)
        assert np.frombuffer(framebuffer.read(components=1), np.uint8).sum(dtype=int) == 255 * 50 * 80
        assert theirs.error == "GL_NO_ERROR"
    theirs.release()


def test_a_context_need_not_be_current(ctx):
    """Nor stay so while functions of the caller's are called, which may use the renderer."""
    image, seen = picture(ctx, SCENES[0]), []
    scene = load(SCENES[0])

    def look(_):
        seen.append(renderer.image())
        with create_context() as another:
            another.enable(FLAGS)
        another.release()

    for context in (None, ctx):
        with Renderer(scene, SIZE, context=context, **PLAIN) as renderer, Renderer(scene, SIZE, **PLAIN) as other:
            other.sample(1)
            renderer.render(24, progress=look)
            other.sample(23)
            np.testing.assert_array_equal(renderer.image(), image)
            np.testing.assert_array_equal(other.image(), image)
    assert len(seen) > 1


def test_threads_wait_for_each_other(ctx):
    image, failed = picture(ctx, SCENES[0]), []
    with Renderer(load(SCENES[0]), SIZE, rays=1, **PLAIN) as renderer:

        def sample():
            try:
                for _ in range(24):
                    renderer.sample(1)
            except DeviceError as error:
                failed.append(error)

        worker = threading.Thread(target=sample)
        worker.start()
        while worker.is_alive():
            assert np.isfinite(renderer.image()).all()
        worker.join()
        assert not failed
        np.testing.assert_array_equal(renderer.image(), image)


def test_a_forked_process_is_told_what_to_do(ctx, monkeypatch):
    """Its driver would wait for ever."""
    with Renderer(load("furnace"), SIZE, context=ctx) as renderer, monkeypatch.context() as forked:
        forked.setattr(os, "getpid", lambda: -1)
        for use in (create_context, renderer.image):
            with pytest.raises(DeviceError, match=r'multiprocessing\.get_context\("spawn"\)'):
                use()


def test_a_renderer_that_nobody_has_any_more_is_released(ctx):
    """Whatever is current in the thread that finds that out stays so; without EGL, contexts stay."""
    image, renderer = picture(ctx, SCENES[0]), Renderer(load(SCENES[0]), SIZE, **PLAIN)
    context, uses_egl = renderer.context, renderer.context.extra == "egl"
    with Renderer(load(SCENES[0]), SIZE, **PLAIN) as other:
        renderers = [renderer]
        del renderer

        def let_go(_):
            renderers.clear()
            gc.collect()

        other.sample(24, let_go)
        assert isinstance(context.mglo, moderngl.InvalidObject) == uses_egl
        np.testing.assert_array_equal(other.image(), image)
