# SPDX-License-Identifier: MIT
"""``render --animation``: stills and frames of models that move."""

from dataclasses import replace

import numpy as np
import pytest
from command import TINY, interrupted, status_of
from files.data import Gltf
from moving_model import model

from fragtracer import light_tracing
from fragtracer.apps.cli.frames import frames_of
from fragtracer.apps.cli.info import contents
from fragtracer.camera_path import turntable
from fragtracer.gpu import tracer
from fragtracer.io.images import read_image, read_metadata
from fragtracer.io.playing import Playing
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import Pose

OPTIONS = (*TINY, "--spp", 4)


@pytest.fixture
def glb(tmp_path):
    return model(tmp_path / "x.glb")


def test_frames_are_those_of_the_moments(tmp_path, monkeypatch, glb):
    """By one program; camera and lamp move with the model. A still of the moment is the frame. Another rate has other
    frames, but for the first; what is finished is not rendered again."""
    programs, compile_one = [], tracer.FullscreenProgram.__init__

    def counted(program, *arguments, **options):
        programs.append(program)
        compile_one(program, *arguments, **options)

    command = ["render", glb, *OPTIONS, "--animation", "rise", "-o", tmp_path / "a.#.hdr"]
    with monkeypatch.context() as patch:
        patch.setattr(tracer.FullscreenProgram, "__init__", counted)
        assert status_of(monkeypatch, *command, "--fps", 2) == 0
    assert len(programs) == 1
    files = sorted(tmp_path.glob("a.*.hdr"))
    assert [file.name for file in files] == ["a.1.hdr", "a.2.hdr", "a.3.hdr"]
    second = load(glb, animation="rise", time=0.5)
    assert second.camera.position == (0, 1, 9)
    assert second.lights[0].position == (0, 3, 3)
    with Renderer(second, (16, 12), bounces=1, seed=2, moves=True) as renderer:
        np.testing.assert_allclose(read_image(files[1]), renderer.render(4), rtol=0.02, atol=1e-3)
    assert np.abs(read_image(files[2]) - read_image(files[1])).max() > 0.1
    before = {file: (file.stat().st_mtime_ns, file.read_bytes()) for file in files}
    files[1].unlink()
    assert status_of(monkeypatch, *command, "--fps", 2) == 0
    assert [file.stat().st_mtime_ns == before[file][0] for file in files] == [True, False, True]
    assert files[1].read_bytes() == before[files[1]][1]
    assert status_of(monkeypatch, *command, "--fps", 1, "--frames", "1-2") == 0
    assert [file.read_bytes() == before[file][1] for file in files] == [True, False, True]
    assert len({read_metadata(file)["frame_digest"] for file in files}) == 3


def test_a_camera_moves_while_an_animation_plays_or_is_held(tmp_path, glb):
    """The path of the camera says how many frames there are, and the camera of the file stays behind."""
    scene, held = load(glb, animation="rise"), load(glb, animation="rise", time=1)
    output = tmp_path / "a.#.exr"
    frames = frames_of(scene, output, None, None, 4, 2, Playing(scene, True))
    still = frames_of(held, output, None, None, 4, None, Playing(held, True) or None)
    assert list(frames.files) == list(still.files) == [1, 2, 3, 4]
    top = [[made.scene(n).meshes[0].parts[0].geometry.positions[2, 1] for n in (1, 2, 4)] for made in (frames, still)]
    assert top == [[1, 3, 5], [5, 5, 5]]
    for made, camera in ((frames, scene.camera), (still, held.camera)):
        assert made.scene(2).camera == turntable(camera, 4).camera(2)
        assert made.scene(2).render.seed == scene.render.seed + 2
    assert frames.previous_camera(2) is None  # objects move, too
    assert still.previous_camera(2) == held.camera


def test_meshes_of_a_scene_play(tmp_path, monkeypatch, glb, capsys):
    """Those without a time; the others, and the camera, stay where the file has them. The command may choose."""
    text = '[ambient]\nradiance = 1\n[[mesh]]\nfile = "x.glb"\nanimation = "rise"\n'
    text += '[[mesh]]\nfile = "x.glb"\nanimation = "rise"\ntime = 0.25\n[[mesh]]\nfile = "x.glb"\nanimation = 1\n'
    (tmp_path / "s.toml").write_text(text)
    scene = load(tmp_path / "s.toml")
    playing = Playing(scene, False)
    assert playing.duration == 1
    later = playing.at(0.5)
    assert [new == old for new, old in zip(later.meshes, scene.meshes, strict=True)] == [False, True, False]
    assert replace(later, meshes=scene.meshes) == scene
    heights = [mesh.parts[0].geometry.positions[2, 1] for made in (scene, later) for mesh in made.meshes]
    assert heights == [1, 2, 1, 3, 2, 1]
    repeated = Playing(scene, False, repeats=True)
    for time, as_at in ((1, 1), (1.5, 0.5), (4.25, 0.25)):
        assert repeated.at(time).meshes[0] == playing.at(as_at).meshes[0]
    assert repeated.at(1.5).meshes[2] == playing.at(0).meshes[2] != playing.at(1.5).meshes[2]
    held = load(tmp_path / "s.toml", time=0.5)
    assert not Playing(held, False)
    assert held.meshes[0].parts == later.meshes[0].parts
    turned = load(tmp_path / "s.toml", animation="turn")
    assert [mesh.pose for mesh in turned.meshes] == [Pose("turn")] * 3
    capsys.readouterr()
    for problem, options in (("x.glb: there is no animation 'fall'", ["--animation", "fall"]), ("none of its", [])):
        (tmp_path / "t.toml").write_text('[[mesh]]\nfile = "x.glb"\n')
        command = ["render", tmp_path / "t.toml", "-o", tmp_path / "a.png", "--animation-time", 1, *options]
        assert status_of(monkeypatch, *command) == 2
        (message,) = capsys.readouterr().err.splitlines()
        assert f"t.toml: {problem}" in message or f"t.toml: {tmp_path / problem}" in message
    command = ["render", tmp_path / "s.toml", *OPTIONS, "--fps", 1, "-o", tmp_path / "a.#.png", "--exposure", "auto"]
    assert status_of(monkeypatch, *command) == 0
    assert sorted(file.name for file in tmp_path.glob("*.png")) == ["a.1.png", "a.2.png"]
    assert "for all frames" in capsys.readouterr().out


def test_a_model_without_a_camera_is_framed_all_the_time(tmp_path):
    path = model(tmp_path / "y.glb", has_camera=False)
    start, end = (load(path, animation="rise", time=time) for time in (0, 1))
    assert start.camera == end.camera
    assert start.lights != end.lights
    assert np.linalg.norm(start.camera.position) > 1.2 * np.linalg.norm(load(path, animation="turn").camera.position)


def test_it_is_learned_once_for_all_poses(tmp_path, monkeypatch, glb):
    """By where things are at the beginning, whichever frames are asked for."""
    asked = []

    def decided(context, scene, *arguments):
        asked.append((scene.meshes, arguments[-1]))
        return light_tracing.decide_both(context, scene, *arguments)

    monkeypatch.setattr("fragtracer.decisions.decide_both", decided)
    command = ["render", glb, *OPTIONS, "--animation", "rise", "--fps", 2, "--frames", "2-3"]
    assert status_of(monkeypatch, *command, "-o", tmp_path / "a.#.hdr") == 0
    assert asked == [(load(glb, animation="rise").meshes, 3)]


def test_an_interrupted_frame_goes_on(tmp_path, monkeypatch, glb):
    command = ["render", glb, *TINY, "--spp", 80, "--rays", 16, "--no-adaptive", "--animation", "rise", "--fps", 1]
    assert status_of(monkeypatch, *command, "-o", tmp_path / "whole.#.exr") == 0
    passes = interrupted(monkeypatch, 8)  # in the second frame
    kept = ["-o", tmp_path / "a.#.exr", "--checkpoint", tmp_path / "kept"]
    assert status_of(monkeypatch, *command, *kept) == 130
    assert status_of(monkeypatch, *command, *kept, "--resume") == 0
    assert passes[8] == passes[7] > 0
    for number in (1, 2):
        np.testing.assert_array_equal(*(read_image(tmp_path / f"{name}.{number}.exr") for name in ("a", "whole")))


def test_info_lists_animations(tmp_path, glb):
    found = [line[20:] for line in contents(load(glb, animation="turn")) if line.startswith("animation ")]
    assert found == ["0 rise: 1 s, 3 channels", "1 turn: 0.5 s, 1 channel"]
    gltf = Gltf(animations=[{"name": "broken"}])
    gltf.triangle()
    gltf.write(tmp_path / "y.gltf")
    with pytest.warns(UserWarning, match="ignored: animations"):
        text = "\n".join(contents(load(tmp_path / "y.gltf")))
    assert f"0 broken: not known: {tmp_path / 'y.gltf'}: animations[0]: channels: is missing" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--animation", "fall"], "x.glb: there is no animation 'fall'; choose from rise, turn"),
        (["--animation-time", 1], "x.glb: name the animation that the time is of: rise, turn"),
        (["--animation", "rise", "--frames", "1-26", "-o", "a.#.png"], "the animation plays from frame 1 to 25"),
        (["--animation", "rise", "-o", "a.#.exr", "--aov", "all"], "--aov motion knows moving cameras alone"),
        (["--animation", "rise", "-o", "a.#.png", "--cluster", "local:1"], "give each machine some of the --frames"),
        (["--animation", "rise", "-o", "a.#.png", "--first-sample", 0], "leave it out where the camera moves"),
        (["--animation", "rise", "--animation-time", 1, "-o", "a.mp4"], "frames need a moving camera"),
        (["--animation", "rise", "--loop"], "--loop is for frames while an animation plays"),
    ],
)
def test_mistakes_get_one_message(tmp_path, monkeypatch, capsys, glb, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert status_of(monkeypatch, "render", "x.glb", *OPTIONS, "-o", "a.png", *arguments) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1 + ("ignored: animations" in err)
    assert list(tmp_path.iterdir()) == [glb]
