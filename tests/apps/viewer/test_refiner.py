# SPDX-License-Identifier: MIT
"""What is compiled, and what is uploaded, as a scene is edited in the window."""

import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from fragtracer import light_tracing
from fragtracer.apps.viewer import lit_film
from fragtracer.apps.viewer.dynamic_resolution import DynamicResolution
from fragtracer.apps.viewer.live import LiveRenderer, Plan
from fragtracer.apps.viewer.refiner import Refiner
from fragtracer.decisions import Decided
from fragtracer.errors import DeviceError, FragtracerError, ShaderError
from fragtracer.gpu import accumulation, textures, tracer
from fragtracer.guiding import Decision
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.resources import folder
from fragtracer.sampling.allocation import FIRST_STAGE
from fragtracer.scene import (
    Ambient,
    Camera,
    DirectionalLight,
    Disk,
    Environment,
    Geometry,
    Light,
    Material,
    Mesh,
    Panorama,
    Placement,
    Plane,
    Rectangle,
    RenderSettings,
    Scene,
    Sphere,
    SpotLight,
    Triangle,
)
from fragtracer.scene import Part as MeshPart

SIZE = (40, 24)
Pixels = NDArray[np.float32]
Make = Callable[[Scene], Refiner]


@pytest.fixture
def make(ctx: moderngl.Context) -> Iterator[Make]:
    """Makes a refiner of a scene."""
    made: list[Refiner] = []

    def refiner(scene: Scene) -> Refiner:
        made.append(Refiner(LiveRenderer(scene, SIZE, ctx), DynamicResolution()))
        return made[-1]

    with ctx:
        yield refiner
        for each in made:
            each.close()


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The programs that have been compiled for tracing."""
    found: list[str] = []
    program = tracer.FullscreenProgram

    def counted(ctx: Any, root: Any, name: str, *rest: Any, **options: Any) -> Any:
        found.append(name)
        return program(ctx, root, name, *rest, **options)

    monkeypatch.setattr(tracer, "FullscreenProgram", counted)
    return found


def until(refiner: Refiner, condition: Callable[[], bool], limit: int | None = None, seconds: float = 120.0) -> None:
    """Turn the loop until ``condition`` holds, with at most ``limit`` samples per pixel: what is drawn while another
    process works takes time from it."""
    start = time.perf_counter()
    while not condition():
        assert time.perf_counter() - start < seconds
        refiner.frame(limit)
        time.sleep(0.01)  # leaves the processor to what compiles and learns


def everything() -> Scene:
    """One of every kind."""
    return Scene(
        Camera((0.0, 1.0, 9.0), (0.0, 0.5, 0.0)),
        {"a": Material(), "b": Material(albedo=(0.2, 0.5, 0.9)), "c": Material(emission=(1.0, 2.0, 3.0))},
        spheres=(Sphere((-2.0, 1.0, 0.0), 0.8, "b"), Sphere((-2.0, 3.0, 0.0), 0.3, "c")),
        planes=(Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "a"),),
        rectangles=(Rectangle((0.0, 1.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "c"),),
        disks=(Disk((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), 0.5, "b"),),
        triangles=(Triangle(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (1.0, 1.0, 0.0)), "a"),),
        lights=(Light((0.0, 4.0, 2.0), power=50.0), Light((2.0, 4.0, 2.0), power=50.0, radius=0.2)),
        spot_lights=(SpotLight((1.0, 4.0, 0.0), (0.0, -1.0, 0.0), (9.0, 9.0, 9.0), 20.0, 40.0),),
        directional_lights=(DirectionalLight((0.0, -1.0, -1.0), (1.0, 1.0, 1.0)),),
    )


LIGHTS = ("lights", "spot_lights", "directional_lights")
KINDS = ("spheres", "planes", "rectangles", "disks", "triangles", *LIGHTS)


def test_what_is_added_removed_or_changed_shows_at_once(make: Make, compiled: list[str]) -> None:
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
    refiner = make(scene)
    refiner._specialises = False
    del compiled[:]
    for edit in edits:
        refiner.change(edit)
        assert not refiner.is_preparing
        assert refiner.renderer.scene == edit
        refiner.frame()
    assert compiled == []
    assert refiner._compiler._asked == 0, "nor elsewhere"


def drawn(renderer: LiveRenderer) -> Pixels:
    """With all light samples, which a slow machine does not take while something moves."""
    renderer.resize(renderer.size, renderer.settings.light_samples).release()
    return drawn_anew(renderer)


def drawn_anew(renderer: LiveRenderer) -> Pixels:
    renderer.restart()
    while renderer.spp < 4:
        renderer.refine(10.0, 4)
    return renderer.image()


def test_what_was_removed_leaves_no_trace(make: Make) -> None:
    """A program that has more kinds of lights than there are makes the same picture as one that has not."""
    renderer = make(everything()).renderer
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


def test_what_is_new_is_compiled_before_it_shows_and_then_known(make: Make, compiled: list[str]) -> None:
    scene = everything()
    plain = replace(scene, spot_lights=())
    refiner = make(plain)
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
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = everything()
    refiner = make(replace(scene, spot_lights=()))
    monkeypatch.setattr("fragtracer.apps.viewer.refiner._SLOW", -1.0)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    asked = refiner._compiler._asked
    refiner.change(scene)
    assert refiner.renderer.scene == scene
    assert refiner._compiler._asked == asked, "what nobody can load need not be compiled elsewhere"
    changed = refiner._changed_at
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    assert time.perf_counter() - changed > 3.0, "after 3 s without a change"


def test_specialised_program_follows_the_camera_its_lens_and_the_environment(make: Make, compiled: list[str]) -> None:
    environment = Environment(image=Panorama(np.tile(np.float32((0.2, 0.5, 0.9)), (8, 16, 1))))
    scene = replace(everything(), environment=environment, render=RenderSettings(light_samples=3))
    refiner = make(scene)
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


def test_another_estimator_waits_for_tables_of_its_own(make: Make) -> None:
    """Of light samples alone, which no frame may make."""
    sky = Panorama(np.random.default_rng(4).random((8, 16, 3), np.float32) ** 9)
    scene = replace(everything(), environment=Environment(image=sky))
    refiner = make(scene)
    refiner.change(replace(scene, render=replace(scene.render, estimator="nee")))
    assert refiner.is_preparing
    until(refiner, lambda: not refiner.is_preparing)
    assert refiner.renderer.scene.render.estimator == "nee"


@pytest.mark.parametrize("view", ["", "normals", "depth", "albedo"])
def test_views_are_programs_of_their_own(make: Make, compiled: list[str], view: str) -> None:
    refiner = make(everything())
    del compiled[:]
    refiner.show_view(view)
    until(refiner, lambda: not refiner.is_preparing)
    assert compiled == (["auxiliary.frag"] if view else [])
    until(refiner, lambda: refiner.renderer.spp > 0)
    image = refiner.renderer.image()
    assert np.ptp(image) > 0
    if view == "normals":
        np.testing.assert_allclose(image[-1, 0], (0.5, 1.0, 0.5), atol=1e-6)


def grid(side: int) -> Mesh:
    """A bumpy square of 2 side^2 triangles, 10 m wide."""
    x, z = np.meshgrid(np.linspace(-5, 5, side + 1), np.linspace(-5, 5, side + 1))
    y = 0.05 * np.sin(3 * x) * np.cos(4 * z)
    i = np.arange(side)[:, None] * (side + 1) + np.arange(side)
    a, b, c, d = i, i + 1, i + side + 1, i + side + 2
    corners = np.stack([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).reshape(-1, 3)
    return Mesh((MeshPart(Geometry(np.stack([x, y, z], -1).reshape(-1, 3), corners), "a"),), (Placement(),))


def test_a_mesh_that_moves_keeps_the_program(make: Make) -> None:
    """Also where the rest of the scene is compiled in."""
    mesh = grid(9)
    scene = replace(everything(), meshes=(mesh,))
    refiner = make(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    moved = replace(mesh, instances=(Placement(translation=(0.05, 0.0, 0.0)),))
    refiner.change(replace(scene, meshes=(moved,)))
    assert refiner.renderer.is_specialised


@pytest.mark.parametrize("kind", ["spheres", "rectangles", "materials", "lights"])
def test_editing_a_small_thing_does_not_upload_a_mesh(make: Make, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Not even where it leaves the bounds of all else."""
    scene = replace(everything(), meshes=(grid(190),))  # 72,200 triangles
    refiner = make(scene)
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


@pytest.mark.parametrize("error", [ShaderError, DeviceError])
def test_what_fails_when_the_scene_is_compiled_in_keeps_the_program(
    make: Make, monkeypatch: pytest.MonkeyPatch, error: type[FragtracerError]
) -> None:
    """With what was learned, or without."""
    refiner = make(everything())
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


def test_a_broken_file_of_later_stages_is_said_until_it_is_mended(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = everything()
    refiner = make(replace(scene, render=replace(scene.render, adaptive="on", guiding="off", light_tracing="off")))
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
def test_what_the_gpu_cannot_hold_leaves_the_picture_of_before(make: Make, missing: dict[str, Any]) -> None:
    """With a program that is there, or one that another process compiles first."""
    refiner = make(with_mesh(9, **missing))
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
def test_what_the_gpu_cannot_hold_is_not_tried_again_until_something_changes(make: Make) -> None:
    refiner = make(with_mesh(9))
    refiner.change(too_large())
    start = time.perf_counter()
    until(refiner, lambda: time.perf_counter() > start + 0.5, limit=4)
    assert refiner._compiler._asked == 0
    refiner.look(replace(refiner.camera, position=(0.0, 2.0, 9.0)))
    assert refiner.problem
    assert refiner.renderer.scene == with_mesh(9)


def test_changed_shaders_show_what_the_gpu_can_hold(make: Make, small_gpu: pytest.MonkeyPatch) -> None:
    """And then what was requested, if it can by now."""
    refiner = make(with_mesh(9))
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


def test_what_cannot_be_packed_leaves_the_picture_of_before(make: Make) -> None:
    """As shapes that are too far away, or a camera, until it comes back."""
    scene = with_mesh(9)
    refiner = make(scene)
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


def test_what_cannot_be_packed_takes_the_place_of_what_is_being_compiled(make: Make) -> None:
    """Which the window would show without a word."""
    scene = with_mesh(9, spot_lights=())
    refiner = make(scene)
    refiner.change(with_mesh(9))
    assert refiner.is_preparing
    refiner.change(with_mesh(9, spheres=(Sphere((0.0, 0.0, 1e17), 1.0, "a"),)))
    until(refiner, lambda: refiner._compiler.is_done(1), limit=1)
    refiner.frame(1)
    assert refiner.problem
    assert refiner.renderer.scene == scene


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


def learned(refiner: Refiner, scene: Scene) -> LiveRenderer:
    """The renderer of ``refiner``, as if it had been learned that light tracing pays."""
    decisions = light_tracing.Decision(True, "on: as learned", 0.5), Decision(None, "off: as learned")
    refiner.renderer.learn(Decided(scene, scene.render, decisions))
    return refiner.renderer


def test_light_is_traced_from_the_lights_while_the_picture_rests(
    make: Make, compiled: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load("caustic")
    refiner = make(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=80)
    until(refiner, lambda: refiner.renderer.spp >= 80, limit=80)
    assert not refiner.is_deciding
    renderer, begun = learned(refiner, scene), refiner.renderer.begun
    assert refiner.is_deciding
    adopt, left = renderer.adopt, list[int]()

    def adopting(plan: Plan) -> None:
        adopt(plan)
        left.append(renderer.spp)

    monkeypatch.setattr(renderer, "adopt", adopting)
    until(refiner, lambda: renderer.traces_light, limit=80)
    assert left == [0], "the samples of before are of all light"
    assert renderer.begun > begun
    assert not refiner.is_deciding
    until(refiner, lambda: renderer.spp > 8)
    assert 0 < refiner.held_weight < 1, "they fade out slowly"
    until(refiner, lambda: refiner.held is None)
    assert renderer.spp >= 20
    assert renderer.metadata()["light_tracing_decision"] == "on: as learned"
    del compiled[:]
    refiner.look(replace(scene.camera, position=(0.1, 2.1, 3.6)))
    assert not renderer.traces_light
    assert renderer.spp == 0, "the samples of before lack the light of the photons"
    assert "once the picture rests" in renderer.metadata()["light_tracing_decision"]
    until(refiner, lambda: renderer.traces_light)
    refiner.compare(True)
    until(refiner, lambda: not refiner.is_moving and renderer.spp > 2)
    assert not renderer.traces_light, "it is compared with pictures of paths"
    refiner.compare(False)
    until(refiner, lambda: renderer.traces_light)
    refiner.resize((48, 32))
    until(refiner, lambda: renderer.traces_light)
    assert renderer.film.size == (48, 32)
    assert compiled == [], "both programs were there"
    refiner.change(replace(scene, ambient=Ambient(0.3)))
    until(refiner, lambda: not refiner.is_moving and renderer.spp > 2)
    assert not renderer.traces_light, "of other light nothing is learned"


@pytest.mark.parametrize("error", [ShaderError, DeviceError, None])
def test_photons_that_fail_leave_all_light_to_paths(
    make: Make, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, error: type[FragtracerError] | None
) -> None:
    """By a broken file of theirs, for want of memory, or by the broken file that adds them to the paths (None)."""

    def broken(*_: object) -> None:
        assert error is not None
        raise error("a file is broken, or the GPU has no memory")

    if error is not None:
        monkeypatch.setattr(light_tracing.LightTracing, "load", broken)
    else:
        root = tmp_path / "shaders"
        shutil.copytree(folder("shaders"), root)
        (root / "film" / "with_light.frag").write_text("broken", "utf-8")
        monkeypatch.setattr(lit_film, "folder", lambda _: root)
    scene = load("caustic")
    refiner = make(scene)
    until(refiner, lambda: refiner.renderer.is_specialised, limit=1)
    renderer = learned(refiner, scene)
    used = renderer._tracer._key
    assert refiner.is_deciding
    until(refiner, lambda: not refiner._traces)
    assert not refiner.is_deciding
    until(refiner, lambda: renderer.spp > 2)
    assert not renderer.traces_light
    assert renderer._tracer._key == used, "the program leaves no light to photons"


def test_photons_bring_the_light_that_a_resting_picture_lacks(make: Make) -> None:
    scene = load("caustic")  # with a larger lamp, which paths meet through glass so often that their error is known
    scene = replace(scene, lights=[replace(light, radius=1.0) for light in scene.lights])
    refiner = make(scene)
    renderer = learned(refiner, scene)
    until(refiner, lambda: renderer.traces_light, limit=1)
    until(refiner, lambda: renderer.spp >= 64)
    whole, paths = renderer._read(), renderer._film.read().mean[..., :3]
    with Renderer(scene, SIZE, light_tracing="off", guiding="off", spp=4096) as reference:
        expected = reference.render()
        error = np.hypot(reference.standard_error(), whole.standard_error())
    lack = np.abs(expected.mean() - paths.mean()) / np.sqrt(np.square(error).sum()) * error.size
    assert lack > 10, "a test of this picture finds out whether there are photons"
    z = (whole.mean[..., :3].mean() - expected.mean()) / np.sqrt(np.square(error).sum()) * error.size
    assert abs(z) < 3.5
