# SPDX-License-Identifier: MIT
"""What is compiled, and what is uploaded, as a scene is edited in the window."""

import time
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
import pytest

from fragtracer.apps.viewer.live import LiveRenderer
from fragtracer.gpu import textures
from fragtracer.io.toml import load
from fragtracer.sampling.allocation import FIRST_STAGE
from fragtracer.scene import Ambient, Environment, Material, Panorama, Placement, RenderSettings

from .refining import Make, drawn, everything, grid, until

LIGHTS = ("lights", "spot_lights", "directional_lights")
KINDS = ("spheres", "planes", "rectangles", "disks", "triangles", *LIGHTS)


def test_what_is_added_removed_or_changed_shows_at_once(make_refiner: Make, compiled: list[str]) -> None:
    scene = everything()
    materials = dict(scene.materials)
    edits = [replace(scene, **{kind: getattr(scene, kind) * 2}) for kind in KINDS]
    edits += [replace(scene, **{kind: ()}) for kind in KINDS]
    edits += [
        replace(scene, **dict.fromkeys(LIGHTS, ())),
        replace(scene, materials=materials | {"b": Material(metal="gold", roughness=0.2)}),
        replace(scene, materials=materials | {"b": scene.materials["c"], "new": Material(specular=0.1)}),
        replace(scene, materials=materials | {"c": Material()}),
        replace(scene, camera=replace(scene.camera, aperture_radius=0.1)),
        replace(scene, ambient=Ambient((0.1, 0.2, 0.3))),
        replace(scene, render=replace(scene.render, bounces=2)),
        replace(scene, render=replace(scene.render, light_samples=3)),
        scene,
    ]
    refiner = make_refiner(scene)
    refiner._specialises = False
    del compiled[:]
    for edit in edits:
        refiner.change(edit)
        assert not refiner.is_preparing
        assert refiner.renderer.scene == edit
        refiner.frame()
    assert compiled == []
    assert refiner._compiler._asked == 0, "nor elsewhere"


def test_what_was_removed_leaves_no_trace(make_refiner: Make) -> None:
    """A program that has more kinds of lights than there are makes the same picture as one that has not."""
    renderer = make_refiner(everything()).renderer
    for integrator in ("path", "split-sum"):
        scene = everything()
        scene = replace(scene, render=replace(scene.render, integrator=integrator))
        renderer.adopt(renderer.plan(scene))
        edited = replace(scene, **dict.fromkeys(LIGHTS, ()), rectangles=())
        exact = renderer.plan(edited)
        assert not renderer.knows(exact)
        renderer.adopt(renderer.quickest(exact))
        found = drawn(renderer)
        renderer.adopt(exact)
        np.testing.assert_allclose(found, drawn(renderer), rtol=1e-3, atol=1e-5)
        assert found.any()


def test_what_is_new_is_compiled_before_it_shows_and_then_known(make_refiner: Make, compiled: list[str]) -> None:
    scene = everything()
    plain = replace(scene, spot_lights=())
    refiner = make_refiner(plain)
    del compiled[:]
    refiner.change(scene)
    until(refiner, lambda: refiner.renderer.scene == scene)
    assert compiled == ["pathtracer.frag"]
    assert refiner._compiler._asked == 1, "the background process had it first"
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    assert compiled == ["pathtracer.frag"] * 2
    refiner.change(plain)
    assert not refiner.renderer.is_specialised, "the values of before are compiled in"
    refiner.change(scene)
    assert refiner.renderer.is_specialised, "the program of before is still there"
    assert refiner.renderer.scene == scene
    assert len(compiled) <= 2


def test_a_driver_without_a_cache_compiles_what_is_new_at_once_and_the_rest_later(
    make_refiner: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = everything()
    refiner = make_refiner(replace(scene, spot_lights=()))
    monkeypatch.setattr("fragtracer.apps.viewer.refiner._SLOW", -1.0)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    asked = refiner._compiler._asked
    refiner.change(scene)
    assert refiner.renderer.scene == scene
    assert refiner._compiler._asked == asked, "what nobody can load need not be compiled elsewhere"
    changed = refiner._changed_at
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    assert time.perf_counter() - changed > 3.0, "after 3 s without a change"


def test_specialised_program_follows_the_camera_its_lens_and_the_environment(
    make_refiner: Make, compiled: list[str]
) -> None:
    environment = Environment(image=Panorama(np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1))))
    scene = replace(everything(), environment=environment, render=RenderSettings(light_samples=3))
    refiner = make_refiner(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    del compiled[:]
    camera = replace(scene.camera, position=(3.0, 2.0, 8.0), aperture_radius=0.2, focus_distance=5.0)
    refiner.look(camera)
    assert refiner.renderer.is_specialised
    found = drawn(refiner.renderer)
    turned = replace(scene, camera=camera, environment=replace(environment, rotation_degrees=40.0))
    refiner.change(turned)
    assert refiner.renderer.is_specialised
    assert refiner.renderer.scene == turned
    assert compiled == []
    refiner.renderer.adopt(refiner.renderer.plan(replace(scene, camera=camera)))
    assert not refiner.renderer.is_specialised
    np.testing.assert_allclose(found, drawn(refiner.renderer), rtol=1e-3, atol=1e-5)


def test_another_estimator_waits_for_tables_of_its_own(make_refiner: Make) -> None:
    """Of light samples alone, which no frame may make."""
    sky = Panorama(np.random.default_rng(4).random((8, 16, 3), np.float32) ** 9)
    scene = replace(everything(), environment=Environment(image=sky))
    refiner = make_refiner(scene)
    refiner.change(replace(scene, render=replace(scene.render, estimator="nee")))
    assert refiner.is_preparing
    until(refiner, lambda: not refiner.is_preparing)
    assert refiner.renderer.scene.render.estimator == "nee"


@pytest.mark.parametrize("view", ["", "normals", "depth", "albedo"])
def test_views_are_programs_of_their_own(make_refiner: Make, compiled: list[str], view: str) -> None:
    refiner = make_refiner(everything())
    del compiled[:]
    refiner.show_view(view)
    until(refiner, lambda: not refiner.is_preparing)
    assert compiled == (["auxiliary.frag"] if view else [])
    until(refiner, lambda: refiner.renderer.spp > 0)
    image = refiner.renderer.image()
    assert np.ptp(image) > 0
    if view == "normals":
        np.testing.assert_allclose(image[-1, 0], (0.5, 1.0, 0.5), atol=1e-6)


def test_a_mesh_that_moves_keeps_the_program(make_refiner: Make) -> None:
    """Also where the rest of the scene is compiled in."""
    mesh = grid(9)
    scene = replace(everything(), meshes=(mesh,))
    refiner = make_refiner(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    moved = replace(mesh, instances=(Placement(translation=(0.05, 0.0, 0.0)),))
    refiner.change(replace(scene, meshes=(moved,)))
    assert refiner.renderer.is_specialised


@pytest.mark.parametrize("kind", ["spheres", "rectangles", "materials", "lights"])
def test_editing_a_small_thing_does_not_upload_a_mesh(
    make_refiner: Make, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Not even where it leaves the bounds of all else."""
    scene = replace(everything(), meshes=(grid(190),))  # 72,200 triangles
    refiner = make_refiner(scene)
    uploaded: list[int] = []
    write = textures._write_rows

    def counted(texture: Any, part: Any, row: int) -> None:
        uploaded.append(part.nbytes)
        write(texture, part, row)

    monkeypatch.setattr(textures, "_write_rows", counted)
    up = {
        "spheres": (replace(scene.spheres[0], center=(-1.9, 1.2, 9.5)), *scene.spheres[1:]),
        "rectangles": (replace(scene.rectangles[0], corner=(0.2, 1.0, -1.0)),),
        "materials": {**scene.materials, "b": Material(albedo=(0.9, 0.1, 0.1))},
        "lights": (replace(scene.lights[0], position=(0.5, 4.0, 1.0)), *scene.lights[1:]),
    }
    refiner.change(replace(scene, **{kind: up[kind]}))
    assert refiner.renderer.scene != scene
    assert 0 < sum(uploaded) < 20_000


def test_a_room_goes_on_beyond_the_first_stage(ctx: moderngl.Context) -> None:
    """What is shown has all samples: a window makes no picture from differences, and measures nothing beforehand."""
    scene = load("cornell-box")
    with ctx:
        renderer = LiveRenderer(replace(scene, render=replace(scene.render, spp=4096)), (65, 37), ctx)
        renderer.resize((96, 96), 1).release()
        while renderer.film.spp < 2 * FIRST_STAGE:
            renderer.refine(1.0, 16, whole=True)
        assert (renderer.film.read_rows(0, 96).mean[..., 3] == renderer.film.spp).all()
        said = renderer.metadata()
        renderer.close()
    assert said["gradient_domain_decision"] == "off: a window shows single pixels"
    assert said["light_tracing_decision"] == "off: nothing is learned yet"
