# SPDX-License-Identifier: MIT
"""What the window shows when a program does not compile, the GPU has no memory, or a scene cannot be packed."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fragtracer.errors import DeviceError, FragtracerError, ShaderError
from fragtracer.gpu import accumulation, textures
from fragtracer.sampling.allocation import FIRST_STAGE
from fragtracer.scene import Camera, Material, Scene, Sphere

from .refining import Make, drawn, drawn_anew, everything, grid, until


@pytest.mark.parametrize("error", [ShaderError, DeviceError])
def test_what_fails_when_the_scene_is_compiled_in_keeps_the_program(
    make_refiner: Make, monkeypatch: pytest.MonkeyPatch, error: type[FragtracerError]
) -> None:
    """With what was learned, or without."""
    refiner = make_refiner(everything())
    asked: list[bool] = []

    def broken(plan: Any) -> None:
        asked.append(plan.is_specialised)
        raise error("a file is broken, or the GPU has no memory")

    monkeypatch.setattr(refiner.renderer, "adopt", broken)
    used = refiner.renderer._tracer._key
    until(refiner, lambda: not refiner._specialises)
    spp = refiner.renderer.spp
    until(refiner, lambda: refiner.renderer.spp > spp)
    assert asked == [True], "once, until the shader files change"
    assert refiner.renderer._tracer._key == used


def test_a_broken_file_of_later_stages_is_said_until_it_is_mended(
    make_refiner: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = everything()
    refiner = make_refiner(
        replace(scene, render=replace(scene.render, adaptive="on", guiding="off", light_tracing="off"))
    )
    refiner._specialises = False
    with monkeypatch.context() as patched:

        def broken(*_: object) -> None:
            raise ShaderError("film/gather.frag:1: is broken")

        patched.setattr(accumulation, "FullscreenProgram", broken)
        until(refiner, lambda: bool(refiner.tracing_problem))
        refiner.frame()
        assert refiner.tracing_problem.startswith("film/gather.frag")
        assert refiner.renderer.spp == FIRST_STAGE
    until(refiner, lambda: refiner.renderer.spp > FIRST_STAGE)
    assert not refiner.tracing_problem


@pytest.fixture
def small_gpu(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """It holds few shapes; what this returns undoes that."""
    made = textures.SceneTextures._made

    def limited(self: Any, name: str, table: Any) -> Any:
        if name == "u_shapes" and sum(map(len, table)) > 10_000:
            raise DeviceError("the GPU cannot hold the shapes")
        return made(self, name, table)

    monkeypatch.setattr(textures.SceneTextures, "_made", limited)
    return monkeypatch


def with_mesh(side: int, **fields: Any) -> Scene:
    return replace(everything(), meshes=(grid(side),), **fields)


def too_large() -> Scene:
    """For a small GPU, which holds its dark materials and its lights, but not its shapes."""
    dark = {name: Material(albedo=0.01) for name in "abc"}
    return with_mesh(60, materials=dark, spheres=(), lights=())


@pytest.mark.usefixtures("small_gpu")
@pytest.mark.parametrize("missing", [{}, {"spot_lights": ()}])
def test_what_the_gpu_cannot_hold_leaves_the_picture_of_before(make_refiner: Make, missing: dict[str, Any]) -> None:
    """With a program that is there, or one that another process compiles first."""
    refiner = make_refiner(with_mesh(9, **missing))
    scene = replace(refiner.renderer.scene, camera=Camera((1.0, 2.0, 9.0), (0.0, 0.5, 0.0)))
    refiner.renderer.look(scene.camera)
    before = drawn(refiner.renderer)
    refiner.change(too_large())
    assert refiner.is_preparing == bool(missing)
    until(refiner, lambda: not refiner.is_preparing, limit=1)
    assert refiner.problem == "the GPU cannot hold the shapes"
    assert refiner.renderer.scene == scene
    np.testing.assert_array_equal(drawn_anew(refiner.renderer), before)
    refiner.change(scene)
    assert not refiner.problem
    np.testing.assert_array_equal(drawn(refiner.renderer), before)


@pytest.mark.usefixtures("small_gpu")
def test_what_the_gpu_cannot_hold_is_not_tried_again_until_something_changes(make_refiner: Make) -> None:
    refiner = make_refiner(with_mesh(9))
    refiner.change(too_large())
    start = time.perf_counter()
    until(refiner, lambda: time.perf_counter() > start + 0.5, limit=4)
    assert refiner._compiler._asked == 0
    refiner.look(replace(refiner.camera, position=(0.0, 2.0, 9.0)))
    assert refiner.problem
    assert refiner.renderer.scene == with_mesh(9)


def test_changed_shaders_show_what_the_gpu_can_hold(make_refiner: Make, small_gpu: pytest.MonkeyPatch) -> None:
    """And then what was requested, if it can by now."""
    refiner = make_refiner(with_mesh(9))
    refiner.change(too_large())
    refiner.prepare_shaders()
    until(refiner, refiner.take_shaders, limit=1)
    refiner.reload_shaders()
    assert refiner.problem
    assert refiner.renderer.scene == with_mesh(9)
    small_gpu.undo()
    refiner.reload_shaders()
    until(refiner, lambda: not refiner.is_preparing, limit=1)
    assert not refiner.problem
    assert refiner.renderer.scene == too_large()


def test_what_cannot_be_packed_leaves_the_picture_of_before(make_refiner: Make) -> None:
    """As shapes that are too far away, or a camera, until it comes back."""
    scene = with_mesh(9)
    refiner = make_refiner(scene)
    before = drawn(refiner.renderer)
    refiner.change(replace(scene, spheres=(Sphere((0.0, 0.0, 1e17), 1.0, "a"),)))
    assert "lie 1e+17 m from the middle of the scene" in refiner.problem
    assert refiner.renderer.scene == scene
    refiner.change(scene)
    assert not refiner.problem
    refiner.look(replace(scene.camera, position=(0.0, 0.0, 1e17)))
    assert "the camera lie 1e+17 m from the middle of the scene" in refiner.problem
    refiner.look(scene.camera)
    assert not refiner.problem
    np.testing.assert_array_equal(drawn(refiner.renderer), before)


def test_what_cannot_be_packed_takes_the_place_of_what_is_being_compiled(make_refiner: Make) -> None:
    """Which the window would show without a word."""
    scene = with_mesh(9, spot_lights=())
    refiner = make_refiner(scene)
    refiner.change(with_mesh(9))
    assert refiner.is_preparing
    refiner.change(with_mesh(9, spheres=(Sphere((0.0, 0.0, 1e17), 1.0, "a"),)))
    until(refiner, lambda: refiner._compiler.is_done(1), limit=1)
    refiner.frame(1)
    assert refiner.problem
    assert refiner.renderer.scene == scene
