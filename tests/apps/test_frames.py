# SPDX-License-Identifier: MIT
"""``render --frames``: numbered pictures and films of a moving camera."""

import os
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction

import numpy as np
import OpenEXR
import pytest
from command import TINY, interrupted, status_of

from fragtracer import light_tracing
from fragtracer.apps.cli.frames import frames_of
from fragtracer.camera_path import turntable
from fragtracer.display.exposure import automatic_exposure
from fragtracer.gpu import tracer
from fragtracer.io.images import read_image, read_metadata, write_image
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer

SCENE = "three-spheres-ambient"
COMMAND = ("render", SCENE, *TINY, "--spp", 4)


@pytest.fixture
def compiled(monkeypatch):
    """Grows by one for each program that is compiled."""
    programs = []

    class Counted(tracer.FullscreenProgram):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            programs.append(self)

    monkeypatch.setattr(tracer, "FullscreenProgram", Counted)
    return programs


def test_a_folder_of_frames_that_cannot_be_made_gets_one_message(tmp_path, monkeypatch, capsys):
    (tmp_path / "a.frames").write_text("")
    assert status_of(monkeypatch, *COMMAND, "--turntable", 2, "-o", tmp_path / "a.mp4") == 2
    assert "a.frames: cannot be the folder of the frames: File exists" in capsys.readouterr().err


def test_a_frame_with_motion_is_rendered_again_where_the_one_before_has_moved(tmp_path, monkeypatch, capsys):
    command = [*COMMAND, "--path", tmp_path / "way.toml", "-o", tmp_path / "a.#.exr", "--frames", 2, "--aov", "motion"]
    for x, finished in ((1.0, False), (1.0, True), (2.0, False)):
        keys = "[[key]]\nframe = {}\nposition = [{}, 1, 6]\n"
        (tmp_path / "way.toml").write_text(keys.format(1, x) + keys.format(2, 3.0))
        assert status_of(monkeypatch, *command) == 0
        assert ("1 of 1 frame was finished before" in capsys.readouterr().out) == finished
    assert status_of(monkeypatch, *command, "--frames", 1) == 0
    assert not read_channels(tmp_path / "a.1.exr")["motion.X"].any()


def test_frames_are_those_of_their_cameras_and_seeds(tmp_path, monkeypatch, compiled):
    """By one program. What is finished, of the same picture and whole, is not rendered again."""
    command = [*COMMAND, "--turntable", 4, "--seed", 7, "-o", tmp_path / "a.##.hdr"]
    assert status_of(monkeypatch, *command) == 0
    assert len(compiled) == 1
    files = [tmp_path / f"a.{number:02}.hdr" for number in range(1, 5)]
    assert sorted(tmp_path.iterdir()) == files
    scene = load(SCENE)
    third = replace(scene, camera=turntable(scene.camera, 4).camera(3))
    with Renderer(third, (16, 12), bounces=1, seed=10, moves=True) as renderer:
        write_image(tmp_path / "third.hdr", renderer.render(4))
    np.testing.assert_allclose(read_image(files[2]), read_image(tmp_path / "third.hdr"), rtol=0.01)
    before = {file: (file.stat().st_mtime_ns, file.read_bytes()) for file in files}
    files[0].unlink()
    files[1].write_bytes(before[files[1]][1][:-100])
    assert status_of(monkeypatch, *command, "--frames", "1-3") == 0
    for file in files:
        time, content = before[file]
        assert (file.stat().st_mtime_ns == time) == (file in files[2:])
        assert file.read_bytes() == content
    assert status_of(monkeypatch, *command, "--frames", "3", "--spp", 5) == 0  # of another picture
    assert read_metadata(files[2])["spp"] == "5"


def test_it_is_learned_for_all_frames(tmp_path, monkeypatch):
    """Also where some are asked for, so that the others fit."""
    asked = []

    def decided(*arguments):
        asked.append(arguments[-1])
        return light_tracing.decide_both(*arguments)

    monkeypatch.setattr("fragtracer.decisions.decide_both", decided)
    command = [*COMMAND, "--turntable", 8, "--frames", "2-3", "-o", tmp_path / "a.#.hdr"]
    assert status_of(monkeypatch, *command) == 0
    assert set(asked) == {8}


def test_frames_have_layers_and_motion(tmp_path, monkeypatch):
    """The motion is that from the frame before, also where that one is not asked for; that of the first is the last."""
    command = [*COMMAND, "--turntable", 8, "--aov", "motion,diffuse", "-o", tmp_path / "a.#.exr"]
    assert status_of(monkeypatch, *command, "--frames", "1-3") == 0
    (tmp_path / "a.3.exr").rename(tmp_path / "third.exr")
    assert status_of(monkeypatch, *command, "--frames", 3, "--denoise") == 0
    channels = {name: read_channels(tmp_path / name) for name in ("a.1.exr", "third.exr", "a.3.exr")}
    motion = {name: np.hypot(found["motion.X"], found["motion.Y"]) for name, found in channels.items()}
    assert motion["a.1.exr"].max() == pytest.approx(motion["a.3.exr"].max(), rel=0.2)
    assert motion["a.3.exr"].max() > 1
    np.testing.assert_array_equal(motion["a.3.exr"], motion["third.exr"])
    assert channels["a.3.exr"]["denoised.R"].any()


def read_channels(path):
    """Each channel, (height, width), by its name."""
    (part,) = OpenEXR.File(str(path), separate_channels=True).parts
    return {name: channel.pixels for name, channel in part.channels.items()}


def test_a_damaged_png_is_rendered_again(tmp_path, monkeypatch, capsys):
    """Of any size."""
    monkeypatch.setattr("PIL.Image.MAX_IMAGE_PIXELS", 16)
    command = [*COMMAND, "--turntable", 2, "-o", tmp_path / "a.#.png"]
    assert status_of(monkeypatch, *command) == 0
    file = tmp_path / "a.1.png"
    content = bytearray(file.read_bytes())
    content[content.index(b"IDAT") + 40] ^= 1
    good = file.read_bytes()
    file.write_bytes(content)
    assert status_of(monkeypatch, *command) == 0
    assert "1 of 2 frames was finished before" in capsys.readouterr().out
    assert file.read_bytes() == good
    assert status_of(monkeypatch, *command, "--exposure", 1) == 0
    assert "were finished" not in capsys.readouterr().out


def test_frames_are_exposed_alike(tmp_path, monkeypatch, capsys):
    """Whichever are asked for, by what is seen on the whole path."""
    command = ["render", "three-spheres", *TINY, "--spp", 16, "--turntable", 4, "--exposure"]
    assert status_of(monkeypatch, *command, 0, "-o", tmp_path / "a.#.hdr") == 0
    apart = [automatic_exposure(read_image(tmp_path / f"a.{number}.hdr")) for number in range(1, 5)]
    assert np.ptp(apart) > 0.6
    for frames, said in (("2", "a.2.png: 16 samples"), ("1-4", "1 of 4 frames was finished before")):
        assert status_of(monkeypatch, *command, "auto", "-o", tmp_path / "a.#.png", "--frames", frames) == 0
        assert said in capsys.readouterr().out
    stops = {float(read_metadata(tmp_path / f"a.{number}.png")["exposure"]) for number in range(1, 5)}
    assert len(stops) == 1
    assert min(apart) + 0.2 < stops.pop() < max(apart) - 0.2


def test_an_interrupted_frame_goes_on_from_its_checkpoint(tmp_path, monkeypatch, capsys):
    command = [*COMMAND, "--spp", 80, "--rays", 16, "--no-adaptive", "--turntable", 2]
    assert status_of(monkeypatch, *command, "-o", tmp_path / "whole.#.exr") == 0
    passes = interrupted(monkeypatch, 8)  # in the second frame
    kept = ["-o", tmp_path / "a.#.exr", "--checkpoint", tmp_path / "kept"]
    assert status_of(monkeypatch, *command, *kept) == 130
    assert (tmp_path / "kept" / "0002" / "film.npz").exists()
    assert not (tmp_path / "a.2.exr").exists()
    assert status_of(monkeypatch, *command, *kept, "--resume") == 0
    assert passes[-4:] == [32, 32, 48, 64]  # the first of which is that of the interruption
    assert not (tmp_path / "kept" / "0002").exists()
    for number in (1, 2):
        images = [read_image(tmp_path / f"{name}.{number}.exr") for name in ("a", "whole")]
        np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_film_has_the_frames(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr("PIL.Image.MAX_IMAGE_PIXELS", 16)
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="there is no FFmpeg to read it")
    output = tmp_path / f"film{suffix}"
    command = ["render", SCENE, "--size", "64x48", "--bounces", 1, "--spp", 64, "--turntable", 3, "--fps", 12]
    assert status_of(monkeypatch, *command, "-o", output) == 0
    reader = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", output, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(reader, capture_output=True, check=True)
    assert b"yuv420p(tv, bt709/bt709/iec61966-2-1" in done.stderr
    assert b"12 fps" in done.stderr
    pictures = np.frombuffer(done.stdout, np.uint8).reshape(3, 48, 64, 3).astype(float)
    for number, picture in enumerate(pictures, start=1):
        expected = 255 * _srgb(read_image(tmp_path / "film.frames" / f"{number:04}.png"))
        assert np.abs(picture - expected).mean() < 4
        assert np.abs((picture - expected).mean(axis=(0, 1))).max() < 2  # another matrix or range would shift colours
        others = [255 * _srgb(read_image(file)) for file in (tmp_path / "film.frames").glob("*.png")]
        assert np.abs(picture - expected).mean() == min(np.abs(picture - other).mean() for other in others)


@pytest.mark.parametrize(
    ("fps", "rate"),
    [
        (23.976, (24000, 1001)),
        (23.98, (24000, 1001)),
        (29.97, (30000, 1001)),
        (119.88, (120000, 1001)),
        (24, (24, 1)),
        (3, (3, 1)),
        (12.5, (25, 2)),
        (23.9, (239, 10)),
    ],
)
def test_rates_of_television_are_whole_ones_by_1001(tmp_path, monkeypatch, fps, rate):
    monkeypatch.setattr("fragtracer.apps.cli.video.check", lambda *_: None)
    assert frames_of(load(SCENE), tmp_path / "a.mp4", None, None, 2, fps).fps == Fraction(*rate)


def _srgb(image):
    return np.where(image <= 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 1e-9) ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--turntable", 4, "--frames", "0-3", "-o", "a.#.png"], "--frames 0-3: the camera moves from frame 1 to 4"),
        (["--turntable", 4, "--frames", "3-1", "-o", "a.#.png"], "--frames 3-1: give the first and the last frame"),
        (["--turntable", 4, "--frames", "all", "-o", "a.#.png"], "as --frames 1-240"),
        (["--frames", "1", "-o", "a.#.png"], "give --path FILE or --turntable FRAMES"),
        (["--path", "a.toml", "--turntable", 4, "-o", "a.#.png"], "one of the two"),
        (["--path", "a.toml", "-o", "a.#.png"], "a.toml: no such file"),
        (["-o", "a.mp4"], "frames need a moving camera"),
        (["--turntable", 4, "-o", "a.png"], "by #, as -o a.####.png"),
        (["--turntable", 4, "-o", "a.#.npy"], "frames are not written to .npy"),
        (["--turntable", 4, "-o", "a.gif"], "a film, .mp4 or .webm, or numbered pictures, as a.####.png, .exr or .hdr"),
        (["--turntable", 4, "-o", "nowhere/a.mp4"], "there is no folder"),
        (["--turntable", 4, "-o", "a.mp4", "--size", "15x12"], "even width and height, not 15x12"),
        (["--turntable", 4, "-o", "a.#.png", "--fps", 12], "--fps is for films"),
        (["--turntable", 4, "-o", "a.#.png", "--first-sample", 0], "leave it out where the camera moves"),
    ],
)
def test_bad_frames_get_one_message(tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert status_of(monkeypatch, *COMMAND, *arguments) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_without_ffmpeg_the_line_to_type_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr("shutil.which", lambda _: None)
    assert status_of(monkeypatch, *COMMAND, "--turntable", 2, "-o", tmp_path / "a.mp4") == 2
    assert "pip install 'fragtracer[video]'" in capsys.readouterr().err


@pytest.fixture
def ffmpeg_without_encoders(tmp_path, monkeypatch):
    """The program of a system, which opens the path where programs are looked for."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "ffmpeg"
    program.write_text('#!/bin/sh\necho "[vost#0:0 @ 0x1] Unknown encoder" >&2\necho "Encoder not found" >&2\nexit 8\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return program


@pytest.mark.parametrize(("suffix", "encoder"), [(".mp4", "libx264"), (".webm", "libvpx-vp9")])
def test_an_encoder_that_is_missing_is_told_before_the_work(
    tmp_path, monkeypatch, capsys, ffmpeg_without_encoders, suffix, encoder
):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert status_of(monkeypatch, *COMMAND, "--turntable", 2, "-o", tmp_path / f"a{suffix}") == 2
    (message,) = capsys.readouterr().err.splitlines()
    problem = f"a{suffix}: {ffmpeg_without_encoders}: Unknown encoder; a film of 16x12 needs an FFmpeg with {encoder}: "
    assert problem in message
    assert "pip install 'fragtracer[video]'" in message
    assert list(tmp_path.iterdir()) == [tmp_path / "bin"]


def test_a_film_of_some_frames_does_not_replace_one_of_more(tmp_path, monkeypatch, capsys):
    """Nor is anything rendered."""
    monkeypatch.setattr("fragtracer.apps.cli.video.check", lambda *_: None)
    monkeypatch.setattr("fragtracer.apps.cli.video.encode", lambda files, film, _: film.write_text(str(len(files))))
    film = tmp_path / "a.mp4"
    command = [*COMMAND, "--turntable", 3, "-o", film]
    for frames, count in ((["--frames", "1-2"], "2"), (["--frames", "1-2"], "2"), ([], "3")):
        assert status_of(monkeypatch, *command, *frames) == 0
        assert film.read_text() == count
    (tmp_path / "a.frames" / "0002.png").unlink()
    assert status_of(monkeypatch, *command, "--frames", 2) == 2
    assert "a.mp4: would be replaced by a film of --frames 2 alone" in capsys.readouterr().err
    assert film.read_text() == "3"
    assert not (tmp_path / "a.frames" / "0002.png").exists()


def test_what_the_system_cannot_encode_another_ffmpeg_does(tmp_path, monkeypatch, ffmpeg_without_encoders):
    pytest.importorskip("imageio_ffmpeg", reason="there is no other FFmpeg")
    assert status_of(monkeypatch, *COMMAND, "--turntable", 2, "-o", tmp_path / "a.mp4") == 0
    assert (tmp_path / "a.mp4").exists()


def test_a_program_that_does_not_run_or_end_is_no_ffmpeg(tmp_path, monkeypatch, capsys, ffmpeg_without_encoders):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr("fragtracer.apps.cli.video._PATIENCE", 0.5)
    for text, said in (
        ("neither a script nor a program", "Exec format error"),
        ("#!/bin/sh\nexec sleep 20\n", "it has not written a frame within 0.5 s"),
    ):
        ffmpeg_without_encoders.write_text(text)
        assert status_of(monkeypatch, *COMMAND, "--turntable", 2, "-o", tmp_path / "a.mp4") == 2
        assert f"{ffmpeg_without_encoders}: {said}; " in capsys.readouterr().err
