# SPDX-License-Identifier: MIT
"""Files whose names are not UTF-8."""

import os

import numpy as np
import pytest
from command import TINY, status_of

from fragtracer.errors import OutputError
from fragtracer.io.images import read_content, write_image
from fragtracer.io.toml import load, save

NAME = os.fsdecode(b"caf\xe9")
SHOWN = "caf\\udce9"
PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
2 0 0
0 1 0
3 0 1 2
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder, with a model in a folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / NAME).mkdir()
    (tmp_path / NAME / f"{NAME}.ply").write_text(PLY)
    (tmp_path / NAME / f"{NAME}.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path / NAME


@pytest.mark.parametrize(("model", "suffix"), [(".obj", ".exr"), (".ply", ".png")])
def test_a_picture_says_what_it_is_of(folder, monkeypatch, capsys, model, suffix):
    output = folder / f"{NAME}{suffix}"
    layers = ["--aov", "object,material"] if suffix == ".exr" else []
    command = ["render", folder / f"{NAME}{model}", *TINY, "--spp", 1, *layers, "-o", output]
    assert status_of(monkeypatch, *command) == 0
    pixels, metadata = read_content(output)
    assert pixels.shape == (12, 16, 3)
    assert metadata["scene"] == SHOWN
    assert f"{SHOWN}{suffix}: 1 samples per pixel" in capsys.readouterr().out


def test_a_panorama_is_read_and_a_picture_developed(folder, monkeypatch):
    image = folder / f"{NAME}.exr"
    write_image(image, np.ones((8, 16, 3)))
    command = ["render", "three-spheres", *TINY, "--spp", 1, "--environment", image, "-o", "a.png"]
    assert status_of(monkeypatch, *command) == 0
    assert status_of(monkeypatch, "develop", image, "-o", folder / f"{NAME}.png") == 0


def test_a_scene_is_looked_into(folder, monkeypatch, capsys):
    scene = folder / f"{NAME}.toml"
    scene.write_text("[ambient]\nradiance = 1.0\n")
    for file, beginning in ((scene, SHOWN), (folder / f"{NAME}.obj", f"{SHOWN}: 1 triangles")):
        assert status_of(monkeypatch, "info", file) == 0
        assert beginning in capsys.readouterr().out
    scene.write_text("sphere = 1")
    assert status_of(monkeypatch, "info", scene) == 2
    assert f"{SHOWN}.toml: " in capsys.readouterr().err


QUICK = ["--rays", "1", "--bounces", "1", "--size", "16x9", "--runs", "1"]


@pytest.mark.parametrize(
    ("command", "options", "outputs"),
    [
        ("bench", ["--scene", "{scene}", *QUICK], {"--json": ".json", "--csv": ".csv", "--report": ".html"}),
        ("export-html", ["{scene}", "{name}.html", "--size", "16x12", "--spp", "1"], {}),
    ],
)
def test_reports_and_exports_are_utf_8(folder, monkeypatch, command, options, outputs):
    words = [word.format(scene=folder / f"{NAME}.obj", name=folder / NAME) for word in options]
    for option, suffix in outputs.items():
        words += [option, folder / f"{NAME}{suffix}"]
    assert status_of(monkeypatch, command, *words) in (0, 2)
    written = [file for file in folder.rglob("*") if file.suffix in (".json", ".csv", ".html", ".xml")]
    assert len(written) == max(len(outputs), 1)
    for file in written:
        assert file.read_text("utf-8")
    if command == "bench":
        assert status_of(monkeypatch, "bench", "--diff", *2 * [folder / f"{NAME}.json"]) == 0


def test_a_scene_that_cannot_name_a_file_is_not_saved(folder):
    scene = load(folder / f"{NAME}.obj")
    with pytest.raises(OutputError, match=r"is UTF-8, which this name is not; rename the file: .*udce9\.obj"):
        save(scene, "a.toml")
    assert not (folder.parent / "a.toml").exists()
