# SPDX-License-Identifier: MIT
"""Pages in a browser: the picture is the desktop's, and the controls do what they say, by real events."""

import base64
import time
from dataclasses import replace

import numpy as np
import pytest
from chromium import Chromium

import fragtracer as ft
from fragtracer.apps.viewer import camera as moves
from fragtracer.apps.web import page
from fragtracer.display.look import Look
from fragtracer.display.tone import srgb_decode
from fragtracer.gpu.specialise import MOST_LISTED
from fragtracer.packing import pack
from fragtracer.packing.random_texture import random_texture
from fragtracer.renderer import Renderer
from fragtracer.sampling.pixels import Pixels
from fragtracer.scene import Scene

from .conftest import open_scene, pixels

WIDTH, HEIGHT, SPP, SEED = 64, 48, 8, 3
MIDDLE = (200.0, 150.0)  # of the picture, in the page of 400 x 500


def desktop(scene: Scene, spp: int = SPP, **settings) -> Pixels:
    """The same samples on the desktop."""
    settings = {"seed": SEED, "adaptive": "off", "guiding": "off"} | settings
    with Renderer(scene, (WIDTH, HEIGHT), **settings) as renderer:
        renderer.sample(spp)
        with renderer.context:
            return renderer._film.read()


def traced(browser: Chromium, spp: int = SPP) -> Pixels:
    return pixels(browser.run(f"fragtracer.trace({WIDTH}, {HEIGHT}, {spp}, {SEED})"), WIDTH, HEIGHT)


def assert_same(found: Pixels, expected: Pixels, nearly_all: float = 0.99) -> None:
    """Every pixel has all its samples, and nearly all have the same paths: what they differ by is rounding. In others
    rounding has sent a path elsewhere, which leaves the mean as it is but for noise."""
    assert (found.mean[..., 3] + found.variance[..., 3] == expected.mean[..., 3] + expected.variance[..., 3]).all()
    mean, other = found.mean[..., :3].astype(np.float64), expected.mean[..., :3].astype(np.float64)
    size = np.abs(other).max(axis=2) + 1e-3 * np.abs(other).mean()
    assert (np.abs(mean - other).max(axis=2) < 2**-10 * size).mean() > nearly_all
    error = np.linalg.norm(expected.standard_error().mean(axis=(0, 1))) / mean.size**0.5
    assert np.abs(mean.mean() - other.mean()) < 4 * error


@pytest.mark.parametrize("name", ["three-spheres", "cornell-box", "grille", "fog"])
def test_the_picture_is_that_of_the_desktop(opened, name):
    """The program, records, BVH, images, environment and random numbers are the same, and the driver too."""
    assert_same(traced(opened(ft.load(name))), desktop(ft.load(name)))


def test_shapes_stored_as_for_a_gpu_give_the_same_picture(opened, monkeypatch):
    monkeypatch.setitem(MOST_LISTED, "default", MOST_LISTED["page"])
    browser = opened(ft.load("cornell-box"))
    assert browser.run("fragtracer.live.payload.header.uniforms.u_bvh_root") >= 0
    found = traced(browser)
    monkeypatch.undo()
    assert_same(found, desktop(ft.load("cornell-box")))


def test_the_picture_is_that_of_another_driver(swiftshader, tmp_path):
    scene = ft.load("three-spheres")
    open_scene(swiftshader, scene, tmp_path)
    assert_same(traced(swiftshader), desktop(scene))


def test_the_random_numbers_are_those_of_the_desktop(opened):
    found = opened(ft.load("cornell-box")).run("fragtracer.randomTexture()")
    assert base64.b64decode(found) == random_texture().tobytes()


def test_the_display_is_that_of_the_desktop(opened):
    """Exposure, tone curve and transfer function, by the shader that the window has too."""
    browser = opened(ft.load("three-spheres"))
    browser.wait("fragtracer.state.samples > 0")
    browser.run("fragtracer.live.setPaused(true)")
    set_control(browser, "exposure", 1.5)
    for tonemap in ("reinhard", "aces", "agx", "linear"):
        set_control(browser, "tonemap", tonemap)
        browser.wait(f"fragtracer.live.shows('{tonemap}')")
        width, height = browser.run("[picture.width, picture.height]")
        film = pixels(browser.run("fragtracer.film()"), width, height)
        shown = base64.b64decode(browser.run("fragtracer.live.show(), fragtracer.pixels()"))
        found = np.frombuffer(shown, np.uint8).reshape(height, width, 4)[::-1, :, :3]
        expected = 255 * Look(1.5, tonemap).show(np.ascontiguousarray(film.mean[..., :3]))
        assert np.abs(found - expected).max() <= 1


def test_settings_do_what_they_say(opened):
    """By real events on the sliders; the sky turns with its sun, in a program that was compiled for another."""
    scene = ft.load("sun-sky")
    browser = opened(scene)
    for name, value in {"rotation": 40, "strength": 0.08, "bounces": 2, "light_samples": 3}.items():
        set_control(browser, name, value)
    environment = replace(scene.environment, rotation_degrees=40, strength=0.08)
    found = traced(browser, 4)
    expected = desktop(replace(scene, environment=environment), 4, bounces=2, light_samples=3)
    assert_same(found, expected, nearly_all=0.98)


def test_settings_that_are_left_out_stay(opened):
    browser = opened(ft.load("three-spheres"))
    before = browser.run("fragtracer.live.settings")
    browser.run("fragtracer.set(fragtracer.live.camera, {bounces: 2})")
    assert browser.run("fragtracer.live.settings") == {**before, "bounces": 2}
    browser.run("fragtracer.set(fragtracer.live.camera, {exposure: 0.123})")  # between two steps of its slider
    assert browser.run("document.querySelector('output[for=control-exposure]').textContent") == "0.123 stops"


def test_as_many_bounces_as_there_are_leave_no_sample_out(opened):
    """llvmpipe stops a draw after so many rounds of loops, at which paths in it are lost: passes have fewer paths."""
    scene = ft.load("three-spheres")
    browser = opened(scene)
    for name, value in {"bounces": 32, "light_samples": 16}.items():
        set_control(browser, name, value)
    browser.wait("fragtracer.live.drawn === fragtracer.live.version")
    rays = browser.run("fragtracer.live.tracer.rays({width: 1, height: 1})")
    settings = replace(scene.render, bounces=32, light_samples=16)
    packed = pack(scene, settings, WIDTH, HEIGHT, MOST_LISTED["default"])
    assert 1 <= rays <= 65_535 // packed.path_rounds


def set_control(browser: Chromium, name: str, value: float | str) -> None:
    browser.run(
        f"(() => {{ const field = document.getElementById('control-{name}'); field.value = '{value}';"
        "field.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )


def camera_of(browser: Chromium) -> ft.Camera:
    return ft.Camera(**browser.run("fragtracer.live.camera"))


def assert_camera(browser: Chromium, expected: ft.Camera) -> None:
    found = camera_of(browser)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-9)
    np.testing.assert_allclose(found.target, expected.target, atol=1e-9)


def test_keys_and_mouse_move_the_camera_as_in_the_window(opened):
    scene = ft.load("cornell-box")
    browser = opened(scene)
    browser.run("picture.focus()")
    browser.key("ArrowRight")
    expected = moves.orbit(scene.camera, np.pi / 36, 0)
    assert_camera(browser, expected)
    browser.key("+")
    expected = moves.dolly(expected, 1 / 1.1)
    assert_camera(browser, expected)
    height = browser.run("picture.clientHeight")
    browser.drag(MIDDLE, (MIDDLE[0] + 40, MIDDLE[1] + 20))
    expected = moves.orbit(expected, 2 * np.pi * 40 / height, 2 * np.pi * 20 / height)
    assert_camera(browser, expected)
    browser.drag(MIDDLE, (MIDDLE[0] + 40, MIDDLE[1] + 20), "right")
    expected = moves.pan(expected, 40 / height, 20 / height)
    assert_camera(browser, expected)
    browser.mouse("mouseWheel", *MIDDLE, {"deltaX": 0, "deltaY": 100})
    assert_camera(browser, moves.dolly(expected, np.exp(0.15)))
    browser.mouse("mouseWheel", *MIDDLE, {"deltaX": 0, "deltaY": -3, "modifiers": 2})  # as trackpads say a pinch
    assert_camera(browser, moves.dolly(expected, np.exp(0.15 - 0.03)))
    browser.wait("stage.classList.contains('live')")  # at once, not when the picture is as good as the poster
    browser.run("settings.open = true, document.getElementById('control-exposure').focus()")
    browser.key("R")  # by Caps Lock
    assert_camera(browser, scene.camera)
    assert browser.run("picking.hidden && picture.ariaLabel.includes('Enter chooses')")
    browser.run("picture.focus()")
    browser.key("Enter")
    browser.wait("picked.textContent === 'white'")


def test_fingers_move_the_camera(opened):
    scene = ft.load("cornell-box")
    browser = opened(scene)
    browser.resize(390, 700, 2, mobile=True)
    height = browser.run("picture.clientHeight")
    x, y = 190.0, 150.0
    browser.touch("touchStart", (x, y))
    browser.touch("touchMove", (x + 30, y))
    browser.touch("touchEnd")
    expected = moves.orbit(scene.camera, 2 * np.pi * 30 / height, 0)
    assert_camera(browser, expected)
    browser.touch("touchStart", (x, y), (x + 60, y))
    browser.touch("touchMove", (x - 30, y), (x + 90, y))
    browser.touch("touchEnd")
    moved = camera_of(browser)
    distance = [np.linalg.norm(np.subtract(c.position, c.target)) for c in (moved, expected)]
    np.testing.assert_allclose(distance[0] / distance[1], 60 / 120)
    browser.resize(400, 500)


def test_the_camera_that_is_copied_can_be_loaded(opened, tmp_path):
    scene = ft.load("cornell-box")
    browser = opened(scene)
    browser.run("picture.focus()")
    browser.key("ArrowLeft")
    browser.key("c")
    browser.wait("copied.value")
    text = browser.run("copied.value")
    path = tmp_path / "scene.toml"
    path.write_text(text + "[ambient]\nradiance = [1, 1, 1]\n")
    np.testing.assert_allclose(ft.load(path).camera.position, camera_of(browser).position, rtol=1e-7)


COMPILES_FOR_EVER = """
const compiled = WebGL2RenderingContext.prototype.getProgramParameter;
fragtracer.live.gl.getProgramParameter = function (program, name) {
    return name !== 0x91B1 && compiled.call(this, program, name);  // COMPLETION_STATUS_KHR
};"""


@pytest.mark.parametrize("is_seen", [True, False], ids=["seen", "between-two-looks"])
def test_a_context_that_is_lost_while_a_program_compiles_comes_back(opened, is_seen):
    """Also if nothing looks between its loss and its return; what compiles is the program for edited lights."""
    browser = opened(ft.load("three-spheres"))
    browser.run(f"{{ {COMPILES_FOR_EVER} }}")
    (power,) = (name for name in browser.run("fragtracer.controls.map(({id}) => id)") if name.startswith("power"))
    browser.run(f"fragtracer.set(fragtracer.live.camera, {{'{power}': 2}})")
    browser.wait("fragtracer.live.tracer.general")
    if not is_seen:
        browser.run("void (fragtracer.live.gl.isContextLost = () => false)")
    browser.run("window.loss = fragtracer.live.gl.getExtension('WEBGL_lose_context'); loss.loseContext()")
    browser.wait("note.textContent.includes('lost')")
    browser.run(
        "new Promise((done) => { picture.addEventListener('webglcontextrestored', done); loss.restoreContext(); })"
        ".then(() => { delete fragtracer.live.gl.isContextLost; delete fragtracer.live.gl.getProgramParameter; })"
    )
    browser.wait("!note.textContent", 20)
    browser.wait("fragtracer.state.samples > 0", 20)


def test_a_page_that_cannot_go_on_is_a_still_picture(opened):
    """With no controls that do nothing, and the poster again."""
    browser = opened(ft.load("three-spheres"))
    browser.run("picture.focus()")
    browser.key("ArrowLeft")
    browser.wait("stage.classList.contains('live')")
    browser.run("void (fragtracer.live.gl.getProgramParameter = (program, name) => name !== 0x8B82)")  # LINK_STATUS
    (power,) = (name for name in browser.run("fragtracer.controls.map(({id}) => id)") if name.startswith("power"))
    browser.run(f"fragtracer.set(fragtracer.live.camera, {{'{power}': 2}})")
    browser.wait("note.textContent.startsWith('This is a still picture: ')", 20)
    assert browser.run("panel.hidden")
    assert not browser.run("stage.classList.contains('live')")
    assert not browser.run("document.getElementById('picture')")
    assert browser.run("document.getElementById('status').textContent") == ""
    browser.key("p")
    assert browser.run("actions.firstChild.textContent") == "Pause"


def test_a_lost_context_comes_back(opened):
    browser = opened(ft.load("three-spheres"))
    browser.run("window.loss = fragtracer.live.gl.getExtension('WEBGL_lose_context'); loss.loseContext()")
    browser.wait("note.textContent.includes('lost')")
    assert not browser.run("stage.classList.contains('live')")  # the poster is there
    browser.run("window.version = fragtracer.live.shown; loss.restoreContext()")
    browser.wait("!note.textContent && fragtracer.live.shown && fragtracer.live.shown !== version")
    assert_same(traced(browser, 4), desktop(ft.load("three-spheres"), 4))


LOST_WHILE_TRACING = """
const tracer = fragtracer.live.tracer, { pass } = tracer;
window.loss = fragtracer.live.gl.getExtension('WEBGL_lose_context');
let passes = 0;
tracer.rays = () => 1;
tracer.pass = (...of) => {
    passes++;
    if (passes === 3) loss.loseContext();
    if (passes > 3) throw new Error('draws without a context');
    return pass.apply(tracer, of);
};"""


def test_what_is_traced_begins_anew_after_a_loss_of_the_context(opened):
    browser = opened(ft.load("three-spheres"))
    trace = f"fragtracer.trace({WIDTH}, {HEIGHT}, {SPP}, {SEED}).catch(String)"
    browser.run(f"{{ {LOST_WHILE_TRACING} void {trace}.then((found) => (window.found = found)); }}")
    browser.wait("note.textContent.includes('lost')", 20)
    browser.run("loss.restoreContext()")
    browser.wait("window.found", 20)
    found = browser.run("found")
    assert isinstance(found, list), found
    assert_same(pixels(found, WIDTH, HEIGHT), desktop(ft.load("three-spheres")))


def test_a_hidden_page_rests_and_goes_on(opened):
    browser = opened(ft.load("three-spheres"))
    browser.wait("fragtracer.state.samples > 1")
    browser.run("fragtracer.live.rests = false")
    other = browser.call("Target.createTarget", url="about:blank")["targetId"]
    try:
        browser.wait("document.hidden")
        time.sleep(1.2)  # what had begun is finished, of which a hidden page hears once a second
        before = browser.run("fragtracer.live.shown.samples")
        time.sleep(0.8)
        assert browser.run("fragtracer.live.shown.samples") == before
    finally:
        browser.call("Target.closeTarget", targetId=other)
    browser.wait("!document.hidden")
    browser.wait(f"fragtracer.live.shown.samples > {before}")


def test_a_pause_lasts_until_the_picture_is_moved(opened):
    browser = opened(ft.load("three-spheres"))
    browser.wait("fragtracer.state.samples > 0")
    browser.run("actions.firstChild.click()")
    assert browser.run("actions.firstChild.textContent") == "Go on"
    time.sleep(0.3)  # what had begun is finished
    before = browser.run("fragtracer.live.shown.samples")
    time.sleep(0.3)
    assert browser.run("fragtracer.live.shown.samples") == before
    browser.run("picture.focus()")
    browser.key("ArrowLeft")
    assert browser.run("actions.firstChild.textContent") == "Pause"
    browser.wait(f"fragtracer.live.shown.samples > {before}")


def test_a_good_picture_rests_until_more_is_asked_for(opened):
    """And at as many samples as a film can count, as on the desktop."""
    browser = opened(ft.load("light-size-0"))
    browser.resize(80, 400)
    browser.wait("picture.width < 80")
    browser.wait("fragtracer.live.isDone && actions.firstChild.textContent === 'Go on'", 30)
    found = browser.run("fragtracer.state")
    assert found["samples"] == 4096 or (found["samples"] >= 16 and found["error"] <= 0.005)
    status = "document.getElementById('status').textContent"
    assert browser.run(status).endswith(" % · done")
    time.sleep(0.2)
    assert browser.run("fragtracer.state") == found
    browser.run("actions.firstChild.click()")
    browser.wait(f"fragtracer.state.samples > {found['samples']}")
    assert browser.run("actions.firstChild.textContent") == "Pause"
    browser.run("actions.firstChild.click()")
    time.sleep(0.3)  # what had begun is finished
    browser.run("fragtracer.live.shown.samples = 2 ** 24 - 1, actions.firstChild.click()")
    browser.wait("fragtracer.live.isDone && fragtracer.state.samples === 2 ** 24", 10)
    browser.run("picture.focus()")
    browser.key("ArrowLeft")
    assert browser.run("fragtracer.live.rests")
    browser.wait("fragtracer.state.samples < 2 ** 24")
    frame = "fragtracer.live.onFrame({samples: 20, seconds: 1, error: 1.004, speed: 1.234e9}, true)"
    assert browser.run(f"{frame}, {status}") == "20 samples · 1.0 s · error 100 % · 1,230 M samples/s"
    browser.resize(400, 500)


def test_paper_has_the_picture_as_it_is(opened):
    browser = opened(ft.load("cornell-box"))
    before = browser.run("[picture.width, fragtracer.live.version]")
    browser.call("Page.printToPDF")
    browser.run("new Promise(requestAnimationFrame)")
    assert browser.run("[picture.width, fragtracer.live.version]") == before
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.run("getComputedStyle(panel).display") == "none"
    browser.call("Emulation.setEmulatedMedia", media="")


SLOWLY_COMPILED = """
const compiled = WebGL2RenderingContext.prototype.getProgramParameter;
WebGL2RenderingContext.prototype.getProgramParameter = function (program, name) {
    return name === 0x91B1 ? Boolean(window.isCompiled) : compiled.call(this, program, name);
};"""


def test_a_page_that_is_being_prepared_says_so(mesa, tmp_path):
    """There is no picture to be saved yet."""
    mesa.events.clear()
    path = tmp_path / "page.html"
    path.write_text(page(ft.load("cornell-box"), (48, 32), 1).text, encoding="utf-8")
    script = mesa.call("Page.addScriptToEvaluateOnNewDocument", source=SLOWLY_COMPILED)["identifier"]
    try:
        mesa.open(path)
    finally:
        mesa.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    mesa.wait("window.fragtracer")
    assert mesa.run("note.textContent") == "This is a still picture; the live one is being prepared."
    mesa.run("window.saved = []; HTMLCanvasElement.prototype.toBlob = () => saved.push('black')")
    mesa.run("actions.children[2].click()")
    mesa.key("s")
    mesa.run("window.isCompiled = true")
    mesa.wait("fragtracer.live.shown && !note.textContent")
    assert mesa.run("saved") == []
    mesa.key("s")
    mesa.wait("saved.length === 1")
    assert mesa.problems() == []


@pytest.mark.parametrize("how", ["reset", "bounces", "python"])
def test_a_pause_ends_where_another_picture_is_asked_for(opened, how):
    browser = opened(ft.load("three-spheres"))
    browser.run("picture.focus()")
    browser.key("ArrowLeft")
    browser.key("p")
    set_control(browser, "exposure", 1)  # of the picture as it is
    browser.run("fragtracer.set({...fragtracer.live.camera}, {exposure: 2})")
    assert browser.run("actions.firstChild.textContent") == "Go on"
    if how == "reset":
        browser.key("r")
    elif how == "python":
        browser.run("fragtracer.set({...fragtracer.live.camera, fov_degrees: 12}, {})")
    else:
        set_control(browser, "bounces", 1)
    assert browser.run("[actions.firstChild.textContent, fragtracer.live.paused]") == ["Pause", False]


def test_the_time_of_a_pause_is_not_that_of_the_picture(opened):
    """Nor is time left out: what is shown is what all bands of the picture took."""
    browser = opened(ft.load("three-spheres"))
    browser.wait("fragtracer.state.samples > 1")
    browser.run("fragtracer.live.rests = false, fragtracer.live.setPaused(true)")
    time.sleep(0.5)  # what had begun is drawn
    before = browser.run("fragtracer.state")
    time.sleep(3)
    browser.run(
        """
        window.apart = [];
        const shown = fragtracer.live.onFrame;
        fragtracer.live.onFrame = (state, isCoarse) => {
            shown(state, isCoarse);
            apart.push([state.seconds, fragtracer.live.tracer.seconds - state.seconds, fragtracer.live.lastMetered]);
        };
        fragtracer.live.setPaused(false);
        """
    )
    browser.wait("new Set(apart.map(([, , metered]) => metered)).size > 2")
    (first, *_), *others = browser.run("apart")
    assert first - before["seconds"] < 2
    differences = [difference for _, difference, _ in others]
    assert max(differences) - min(differences) < 1e-6


def test_another_size_of_the_window_is_another_picture(opened):
    browser = opened(ft.load("cornell-box"))
    browser.resize(300, 400)
    browser.wait("picture.width === Math.round(stage.getBoundingClientRect().width)")
    browser.wait("fragtracer.state.samples > 0 && fragtracer.live.shown?.width === picture.width")
    browser.resize(400, 500)


def test_a_screen_with_more_pixels_is_another_picture(opened):
    """As large, in CSS pixels."""
    browser = opened(ft.load("cornell-box"))
    width = browser.run("picture.width")
    for scale, motion in ((2, "reduce"), (1, "no-preference")):
        browser.resize(400, 500, scale)
        # Emulated, the scale alone does not make the browser look at media queries again.
        browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": motion}])
        browser.wait(f"picture.width === {scale * width}", 20)
    browser.call("Emulation.setEmulatedMedia", features=[])


def test_where_nothing_can_be_traced_there_are_pictures(mesa, tmp_path):
    """The poster and a line that says why, or a turntable."""
    mesa.events.clear()
    source = "WebGL2RenderingContext.prototype.getExtension = () => null"
    script = mesa.call("Page.addScriptToEvaluateOnNewDocument", source=source)["identifier"]
    why = "this device cannot draw into float textures, which tracing needs."
    try:
        for fallback, kind in ((None, "a still picture"), ((24, 16, 4), "a series of pictures")):
            path = tmp_path / "page.html"
            path.write_text(
                page(ft.load("three-spheres-ambient"), (48, 32), 1, fallback=fallback).text, encoding="utf-8"
            )
            mesa.open(path)
            mesa.wait("note.textContent.includes('device')")
            assert mesa.run("note.textContent") == f"This is {kind}: {why}"
            mesa.wait("poster.naturalWidth === 48")
            assert mesa.run("getComputedStyle(poster).objectFit") == "contain"  # others have other proportions
    finally:
        mesa.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    pictures = mesa.run("JSON.parse(turntable.textContent)")
    assert len(set(pictures)) == 4
    mesa.run("stage.focus()")
    mesa.key("ArrowLeft")
    assert mesa.run("poster.src").endswith(pictures[1])
    mesa.key("ArrowRight")
    mesa.key("ArrowRight")
    assert mesa.run("poster.src").endswith(pictures[3])
    assert mesa.problems() == []


def test_frames_of_a_notebook_trace_where_they_are_seen(mesa, tmp_path):
    """Browsers have 16 contexts: more pages wait for theirs, and one that has lost it to others gets another."""
    mesa.events.clear()
    mesa.resize(400, 500)
    path = tmp_path / "notebook.html"
    cell = "<p>A cell</p>" + ft.show(ft.load("cornell-box"), (48, 32), 1)._repr_html_()
    path.write_text("<!DOCTYPE html>" + 18 * cell)
    mesa.open(path)
    mesa.wait("frames[0].fragtracer && frames[0].fragtracer.state.samples > 0")
    assert mesa.run("Array.from({length: 17}, (_, i) => frames[i + 1].fragtracer)") == [None] * 17
    assert mesa.problems() == []
    mesa.run("scrollTo(0, 1e6)")
    mesa.wait("frames[17].fragtracer && frames[17].fragtracer.state.samples > 0")
    mesa.run("window.others = Array.from({length: 15}, () => document.createElement('canvas').getContext('webgl2'))")
    mesa.wait("frames[0].document.getElementById('note').textContent.includes('lost')")
    mesa.run("frames[0].fragtracer.state.samples = 0, scrollTo(0, 0)")
    mesa.wait("frames[0].fragtracer.state.samples > 0 && !frames[0].document.getElementById('note').textContent", 30)
    mesa.run("frames[0].document.getElementById('picture').focus(), frames[0].focus()")
    mesa.key("+")
    before, after = (mesa.run(f"frames[{i}].fragtracer.live.camera.position") for i in (17, 0))
    assert before != after


def test_a_hostile_name_does_nothing(opened):
    name = "</script><script>window.alarm = 1</script><img src=x onerror='window.alarm = 1'>"
    browser = opened(replace(ft.load("cornell-box"), name=name))
    assert browser.run("document.title") == name
    assert browser.run("window.alarm") is None


def test_a_picked_object_can_be_changed(opened):
    """By a click, and as if the scene had been written that way: another surface, under a larger and stronger light."""
    scene = ft.load("three-spheres")
    browser = opened(scene)
    click(browser, *place_of(browser, scene.camera, scene.spheres[0].center))
    browser.wait("picked.textContent === 'plastic'")
    controls = browser.run("[...object.querySelectorAll('input')].map((input) => [input.type, input.id])")
    (_, albedo), (_, roughness), (_, metallic) = controls
    for name, value in ((albedo, "#40c080"), (roughness, 0.4), (metallic, 0.75)):
        set_control(browser, name.removeprefix("control-"), value)
    lights = {c["id"].split("-")[0]: c["id"] for c in browser.run("fragtracer.controls") if "object" in c}
    browser.run(
        "fragtracer.live.set(fragtracer.live.camera, "
        f"{{...fragtracer.live.settings, '{lights['power']}': 2, '{lights['size']}': 3}})"
    )
    color = tuple(srgb_decode(np.array([0x40, 0xC0, 0x80], np.float32) / 255).tolist())
    plastic = replace(scene.materials["plastic"], albedo=color, metallic=0.75, roughness=0.4)
    (light,) = scene.lights
    light = replace(light, power=tuple(2 * watts for watts in light.power), radius=3 * light.radius)
    expected = desktop(replace(scene, materials=dict(scene.materials) | {"plastic": plastic}, lights=(light,)))
    assert_same(traced(browser), expected)
    browser.run("picture.focus()")
    browser.key("r")
    assert_same(traced(browser), desktop(scene))


def place_of(browser: Chromium, camera: ft.Camera, point) -> tuple[float, float]:
    box = browser.run("(({left, top, width, height}) => [left, top, width, height])(picture.getBoundingClientRect())")
    x, y = moves.project(camera, point, 48 / 32)
    return box[0] + x * box[2], box[1] + y * box[3]


def click(browser: Chromium, x: float, y: float) -> None:
    held = {"button": "left", "buttons": 1, "clickCount": 1}
    browser.mouse("mousePressed", x, y, held)
    browser.mouse("mouseReleased", x, y, {**held, "buttons": 0})
