# SPDX-License-Identifier: MIT
"""The widget: camera and settings are the same in Python and in the page; and the notebook that shows it."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium

import fragtracer as ft
from fragtracer.apps.viewer import camera as moves
from fragtracer.errors import FragtracerError

NOTEBOOK = Path(__file__).parents[3] / "docs" / "notebook.ipynb"
SIZE = (48, 32)
# What of a host the widget uses: a model of what is shared, which says when something of it is another, and a cell.
HOST = """<!DOCTYPE html><div id="cell"></div><script>
class Model {
    constructor(state) { Object.assign(this, {state, calls: {}, saved: {}, unsaved: {}}); }
    get(name) { return this.state[name]; }
    set(name, value) {
        if (JSON.stringify(value) === JSON.stringify(this.state[name])) return;
        this.state[name] = this.unsaved[name] = value;
        (this.calls["change:" + name] || []).forEach((call) => call());
    }
    save_changes() { Object.assign(this.saved, this.unsaved); this.unsaved = {}; }
    on(event, call) { (this.calls[event] ||= []).push(call); }
    off(event, call) { this.calls[event] = this.calls[event].filter((other) => other !== call); }
}
async function show(esm, state) {
    const url = URL.createObjectURL(new Blob([esm], {type: "text/javascript"}));
    window.model = new Model(state);
    window.end = (await import(url)).default.render({model, el: document.getElementById("cell")});
}
</script>"""
MOVE_SLIDER = "(f => { f.value = '1.5'; f.dispatchEvent(new Event('input')); })"


@pytest.fixture
def widget():
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    return ft.widget(ft.load("cornell-box"), SIZE, 1)


def test_what_is_set_is_checked_and_kept(widget):
    scene = ft.load("cornell-box")
    assert widget.camera == scene.camera
    assert widget.settings["bounces"] == scene.render.bounces
    heard = []
    widget.observe(heard.append, "settings")
    widget.settings = {"bounces": 2, "albedo-0": "#ff8000"}
    assert len(heard) == 1
    assert (widget.settings["bounces"], widget.settings["exposure"]) == (2, 0)
    widget.camera = replace(scene.camera, fov_degrees=20)
    assert widget.scene == replace(scene, camera=widget.camera, render=replace(scene.render, bounces=2))
    widget.settings = {"bounces": np.int64(2), "exposure": np.float32(0.5), "albedo-0": "#FF8000"}
    sent = json.loads(json.dumps(widget.get_state("settings")["settings"]))
    assert [sent[name] for name in ("bounces", "exposure", "albedo-0")] == [2, 0.5, "#ff8000"]
    for settings, message in (
        ({"bounce": 1}, "there is no setting 'bounce'; there are exposure, tonemap, bounces"),
        ({"bounces": -1}, "bounces: must be an integer from 0 to 32, got -1"),
        ({"light_samples": 2.5}, "light_samples: must be an integer from 1 to 16, got 2.5"),
        ({"exposure": True}, "exposure: must be a number"),
        ({"tonemap": "filmic"}, "tonemap: must be one of linear"),
        ({"albedo-0": "red"}, "albedo-0: must be a colour"),
        (3, "settings"),
    ):
        with pytest.raises(pytest.importorskip("traitlets").TraitError, match=message):
            widget.settings = settings
    with pytest.raises(TypeError):
        widget.settings["bounces"] = 3
    assert widget.settings["bounces"] == 2


def test_without_anywidget_it_says_what_to_type(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "fragtracer.apps.web.notebook", raising=False)
    with pytest.raises(FragtracerError, match=r"^a widget needs anywidget; pip install 'fragtracer\[notebook\]'$"):
        ft.widget(ft.load("cornell-box"), SIZE, 1)


def start(widget, mesa: Chromium, folder: Path) -> None:
    """Show a widget by the state as it is sent."""
    path = folder / "host.html"
    path.write_text(HOST)
    mesa.resize(600, 700)
    mesa.open(path)
    state = {name: widget.get_state(name)[name] for name in ("html", "camera", "settings")}
    mesa.run(f"show({json.dumps(widget._esm)}, {json.dumps(state)})")
    mesa.run("window.page = () => frames[0].fragtracer")


def test_page_and_python_follow_each_other(widget, mesa: Chromium, tmp_path):
    """By the state as it is sent, a drag and a slider; nothing is sent that Python has said itself."""
    mesa.events.clear()
    widget.settings = {"bounces": 3}
    start(widget, mesa, tmp_path)
    mesa.wait("frames[0].fragtracer && page().live.settings.bounces === 3")
    assert mesa.run("frames[0].document.getElementById('control-bounces').value") == "3"
    assert mesa.run("model.saved") == {}

    def hear() -> None:
        """What the page has said, as it comes to Python."""
        widget.set_state(mesa.run("model.saved"))
        mesa.run("model.saved = {}")

    stage = mesa.run("frames[0].document.getElementById('stage').getBoundingClientRect().toJSON()")
    frame = mesa.run("document.querySelector('iframe').getBoundingClientRect().toJSON()")
    x, y = (frame[a] + stage[a] + stage[side] / 2 for a, side in (("x", "width"), ("y", "height")))
    height = mesa.run("frames[0].document.getElementById('picture').clientHeight")
    before = widget.camera
    mesa.drag((x, y), (x + 40, y))
    hear()
    expected = moves.orbit(before, 2 * np.pi * 40 / height, 0)
    np.testing.assert_allclose(widget.camera.position, expected.position, atol=1e-9)
    assert (widget.camera.target, widget.camera.fov_degrees) == (before.target, before.fov_degrees)
    mesa.run(f"{MOVE_SLIDER}(frames[0].document.getElementById('control-exposure'))")
    hear()
    assert dict(widget.settings) == mesa.run("page().live.settings")
    assert (widget.settings["exposure"], widget.settings["bounces"]) == (1.5, 3)

    widget.camera = replace(widget.camera, position=(0.3, 0.4, -0.9), fov_degrees=50)
    widget.settings = {"bounces": 1}
    for name in ("camera", "settings"):
        mesa.run(f"model.set('{name}', {json.dumps(widget.get_state(name)[name])})")
    mesa.run("model.unsaved = {}")
    assert ft.Camera(**mesa.run("page().live.camera")) == widget.camera
    assert mesa.run("page().live.settings.bounces") == 1
    assert mesa.run("frames[0].document.getElementById('control-bounces').value") == "1"
    assert mesa.run("model.saved") == {}
    mesa.wait("page().live.shown.samples > 1")
    mesa.run("end()")
    assert mesa.run("[frames.length, Object.values(model.calls).flat().length]") == [0, 0]
    assert mesa.problems() == []


def test_a_size_that_only_a_cpu_can_change_is_known_to_python(mesa: Chromium, tmp_path):
    """Where a CPU renders, more shapes are listed, and a sphere that emits has a size; by a click and its slider."""
    scene = ft.load("three-spheres")
    pebbles = tuple(ft.Sphere((0.1 * i, 0.05, 0.9), 0.03, "plastic") for i in range(8))
    widget = ft.widget(replace(scene, spheres=(*scene.spheres, *pebbles)), SIZE, 1)
    mesa.events.clear()
    start(widget, mesa, tmp_path)
    mesa.wait("frames[0].fragtracer && page().live.shown")
    (size,) = (name for name in mesa.run("page().controls.map(({id}) => id)") if name.startswith("size-"))
    assert mesa.run("page().live.settings") == dict(widget.settings)
    number = int(size.removeprefix("size-"))
    mesa.run(f"page().live.pick = async () => {number}")
    frame = mesa.run("document.querySelector('iframe').getBoundingClientRect().toJSON()")
    held = {"button": "left", "buttons": 1, "clickCount": 1}
    mesa.mouse("mousePressed", frame["x"] + 100, frame["y"] + 100, held)
    mesa.mouse("mouseReleased", frame["x"] + 100, frame["y"] + 100, {**held, "buttons": 0})
    mesa.wait(f"frames[0].document.getElementById('control-{size}')")
    mesa.run(f"{MOVE_SLIDER}(frames[0].document.getElementById('control-{size}'))")
    widget.set_state(mesa.run("model.saved"))
    assert widget.settings[size] == 1.5
    assert mesa.problems() == []


def test_the_notebook_runs(tmp_path):
    for package in ("nbconvert", "nbclient", "ipykernel", "anywidget"):
        pytest.importorskip(package, reason=f"{package} is not installed")
    path = tmp_path / "notebook.ipynb"
    command = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--output", path, NOTEBOOK]
    environment = {**os.environ, "PYTHONPATH": str(Path(ft.__file__).parents[1])}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    kinds = {kind for cell in cells for output in cell["outputs"] for kind in output.get("data", {})}
    assert kinds >= {"text/html", "image/png", "application/vnd.jupyter.widget-view+json"}
    assert not any(cell["outputs"] for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code")
