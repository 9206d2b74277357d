# SPDX-License-Identifier: MIT
"""The command as a user runs it: in a process of its own where that matters, else in the one of the tests."""

import io
import logging
import os
import re
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest
from command import TINY, status_of

import fragtracer as ft
from fragtracer.apps import cli
from fragtracer.apps.cli.info import contents
from fragtracer.apps.cli.picture import write_or_rescue
from fragtracer.apps.cli.preparation import preparing
from fragtracer.errors import FragtracerError, OutputError
from fragtracer.films import SavedFilm
from fragtracer.gpu import context as contexts
from fragtracer.io.images import read_image, read_metadata, write_image

FRAGTRACER = (sys.executable, "-m", "fragtracer")


def run_alone(*arguments):
    """In a process of its own."""
    command = [*FRAGTRACER, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture
def run(monkeypatch, capsys):
    """In this process; what a user would see as a traceback fails the test."""

    def command(*arguments):
        with warnings.catch_warnings():
            warnings.simplefilter("default")
            status = status_of(monkeypatch, *arguments)
        return subprocess.CompletedProcess(arguments, status, *capsys.readouterr())

    return command


def test_wide_vectors_leave_the_bits_alone(tmp_path, monkeypatch):
    """The command asks for 512 bits where there are some; all other tests calculate with 256."""
    if not contexts._has_wide_vectors():
        pytest.skip("there are no wide vectors with this processor and driver")
    command = "render", "roughness-grid", "--size", "48x32", "--spp", 40, "-o"
    assert run_alone(*command, tmp_path / "narrow.exr").returncode == 0
    monkeypatch.delenv("LP_NATIVE_VECTOR_WIDTH")
    assert run_alone(*command, tmp_path / "wide.exr").returncode == 0
    drivers = [read_metadata(tmp_path / name)["gl_renderer"] for name in ("narrow.exr", "wide.exr")]
    assert "256 bits" in drivers[0]
    assert "512 bits" in drivers[1]
    np.testing.assert_array_equal(read_image(tmp_path / "narrow.exr"), read_image(tmp_path / "wide.exr"))


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".npy", ".png"])
def test_render_writes_every_format(run, tmp_path, suffix):
    output = tmp_path / f"box{suffix}"
    done = run("render", "cornell-box", "-o", output, "--size", "20x12", "--spp", 4)
    assert done.returncode == 0, done.stderr
    assert "4 samples per pixel" in done.stdout
    image = read_image(output)
    assert image.shape == (12, 20, 3)
    assert image.mean() > 0


def test_the_error_is_said_where_it_is_known_and_what_a_screen_cannot_show(run, tmp_path):
    options = ("-o", tmp_path / "box.png", "--size", "16x16", "--spp")
    for spp, exposure, error, hint in (
        (1, 0, "1 samples per pixel, mean error not known", ""),
        (2, 8, "% mean error", "this is nearly all white; --exposure auto, here 1."),
        (2, -4, "% mean error", "this is nearly all black; --exposure auto, here 1."),
    ):
        done = run("render", "cornell-box", *options, spp, "--exposure", exposure)
        assert error in done.stdout
        assert hint in done.stderr
        assert bool(hint) == bool(done.stderr)


def test_an_exr_says_how_it_was_made(run, tmp_path):
    output = tmp_path / "box.exr"
    run("render", "cornell-box", "-o", output, "--size", "16x16", "--spp", 3, "--bounces", 2, "--seed", 7)
    found = read_metadata(output)
    expected = {"scene": "cornell-box", "spp": "3", "bounces": "2", "seed": "7", "non_finite_samples": "0"}
    assert expected.items() <= found.items()
    assert "gl_renderer" in found
    assert found["software"].startswith("fragtracer ")


def test_the_same_command_gives_the_same_image(tmp_path):
    images = []
    for name in ("a.npy", "b.npy"):
        run_alone("render", "three-spheres", "-o", tmp_path / name, "--size", "32x18", "--spp", 8, "--seed", 3)
        images.append(read_image(tmp_path / name))
    np.testing.assert_array_equal(*images)


def test_exposure_and_tone_curve_act_on_png_alone(run, tmp_path):
    options = ("--size", "16x16", "--spp", 4, "--exposure", -2, "--tonemap", "aces")
    run("render", "furnace", "-o", tmp_path / "f.npy", *options)
    run("render", "furnace", "-o", tmp_path / "f.png", *options)
    assert read_image(tmp_path / "f.npy").mean() == pytest.approx(0.5, rel=0.1)
    assert read_image(tmp_path / "f.png").mean() < 0.3


def test_until_stops_at_the_error_asked_for(run, tmp_path):
    done = run("render", "three-spheres-ambient", "-o", tmp_path / "f.exr", "--size", "16x16", "--until", 5)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split(",")[1].split("%")[0]) <= 5


def test_time_stops_early(run, tmp_path):
    done = run("render", "furnace", "-o", tmp_path / "f.exr", "--size", "64x64", "--time", 0.5, "--spp", 2**24)
    assert done.returncode == 0, done.stderr
    assert int(read_metadata(tmp_path / "f.exr")["spp"]) < 2**24


def test_for_a_short_time_nothing_is_learned(run, tmp_path):
    output = tmp_path / "f.exr"
    done = run("render", "caustic", "-o", output, "--size", "320x180", "--time", 0.01)
    assert done.returncode == 0, done.stderr
    for decision in ("guiding_decision", "light_tracing_decision"):
        assert "takes less time" in read_metadata(output)[decision]


def test_a_terminal_shows_what_a_picture_waits_for(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    shown = {}
    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr(sys, "stderr", stream)
        with preparing():
            logging.getLogger("fragtracer.guiding").info("tracing photons for path guiding")
            during = stream.getvalue()
        shown[stream.isatty()] = during
        logging.getLogger("fragtracer.guiding").info("not shown any more")
        assert "any more" not in stream.getvalue()
    assert "tracing photons for path guiding …" in shown[True]
    assert shown[False] == ""


def test_no_memory_left_is_a_sentence(monkeypatch, capsys):
    def need_too_much():
        raise MemoryError("Unable to allocate 9 EiB")

    monkeypatch.setattr(cli, "app", need_too_much)
    assert status_of(monkeypatch) == 2
    assert capsys.readouterr().err == "fragtracer: there is not enough memory for this: Unable to allocate 9 EiB\n"


@pytest.fixture
def interrupted(monkeypatch):
    """Calls a command, in this process, that is to end as an interrupted one."""

    def call(*words):
        monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # which main() changes
        monkeypatch.setattr(sys, "argv", ["fragtracer", *map(str, words)])
        with pytest.raises(SystemExit, match="130"):
            cli.main()

    before = {signum: signal.getsignal(signum) for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield call
    for signum, handler in before.items():
        signal.signal(signum, handler)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, FragtracerError])
def test_what_others_make_of_an_interruption_is_one(monkeypatch, capsys, interrupted, error):
    """C code may have met the signal, and turned the exception into one of its own."""

    def interrupt(*_, **__):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        raise error

    monkeypatch.setattr("fragtracer.io.toml.load", interrupt)
    interrupted("compare", "cornell-box")
    assert capsys.readouterr().err == "fragtracer: interrupted\n"


@pytest.mark.parametrize("is_first", [False, True])
def test_a_signal_while_a_picture_is_written_waits(tmp_path, monkeypatch, capsys, interrupted, is_first):
    sample, write = ft.Renderer.render, ft.write_image

    def render(renderer, **_):
        sample(renderer, spp=1)
        if not is_first:
            signal.raise_signal(signal.SIGTERM)

    def write_slowly(*arguments, **options):
        signal.raise_signal(signal.SIGTERM)
        write(*arguments, **options)

    monkeypatch.setattr(ft.Renderer, "render", render)
    monkeypatch.setattr("fragtracer.io.images.write_image", write_slowly)
    output = tmp_path / "a.exr"
    interrupted("render", "cornell-box", "-o", output, *TINY)
    assert read_metadata(output)["spp"] == "1"
    said = [] if is_first else ["interrupted: writing what there is; other signals wait until that is done"]
    assert capsys.readouterr().err.splitlines() == [*said, "fragtracer: interrupted"]


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_render_keeps_what_it_has(tmp_path, signum):
    output = tmp_path / "f.exr"
    command = [*FRAGTRACER, "render", "furnace", "-o", str(output), "--size", "32x32", "--spp", str(2**24)]
    command += ["--checkpoint", str(tmp_path)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "env": os.environ | {"FORCE_COLOR": "1"}}
    # Whoever runs the tests in the background may have them ignore Ctrl-C, and a child inherits that.
    with subprocess.Popen(
        command, text=True, preexec_fn=lambda: signal.signal(signum, signal.SIG_DFL), **pipes
    ) as process:
        shown = ""
        while not re.search(r"\d{4}/\d+ spp", shown):  # more than one pass takes
            more = os.read(process.stderr.fileno(), 4096).decode()
            assert more, shown
            shown += more
        process.send_signal(signum)
        out, err = process.communicate()
    assert process.returncode == 130
    assert "interrupted" in out
    assert "Traceback" not in err
    spp = int(read_metadata(output)["spp"])
    assert f"{spp} samples per pixel" in out
    assert spp > 0
    assert read_image(output).mean() == pytest.approx(0.5, rel=0.05)
    assert SavedFilm.read(tmp_path / "film.npz").spp == spp


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nothing", "-o", "a.png"), ("nothing: no such file or bundled scene", "three-spheres")),
        (("furnace", "-o", "a.jpg"), ("a.jpg", ".exr", ".png")),
        (("furnace", "-o", "nowhere/a.png"), ("nowhere",)),
        (("furnace", "-o", "a.png", "--size", "0x10"), ("--size 0x10", "640x480")),
        (("furnace", "-o", "a.png", "--size", "99999x10"), ("--size", "16384")),
        (("furnace", "-o", "a.png", "--bounces", "-1"), ("--bounces", "0")),
        (("furnace", "-o", "a.png", "--spp", "many"), ("--spp", "integer")),
        (("furnace", "-o", "a.png", "--tonemap", "film"), ("--tonemap", "reinhard")),
    ],
)
def test_bad_input_gets_one_message(run, monkeypatch, tmp_path, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = run("render", *arguments)
    assert done.returncode == 2
    assert all(word in done.stderr for word in words), done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("option", ["--variant", "--batches", "--margin", "--geometry", "--multiple-scattering"])
def test_split_sum_refuses_what_it_would_pass_over(run, option):
    value = {"--variant": ["scalar_rgb"], "--geometry": ["karis"], "--multiple-scattering": []}.get(option, ["4"])
    done = run("compare", "overcast", "--split-sum", option, *value)
    assert done.returncode == 2
    assert f"--split-sum measures without {option}: leave that out" in done.stderr


def test_a_broken_scene_file_names_file_and_key(tmp_path):
    scene = tmp_path / "mine.toml"
    scene.write_text('[[sphere]]\ncenter = [0, 0, 0]\nradius = -1\nmaterial = "a"\n[material.a]\n')
    done = run_alone("render", scene, "-o", tmp_path / "a.png")
    assert done.returncode == 2
    assert "mine.toml: sphere[0].radius" in done.stderr
    assert "Traceback" not in done.stderr


def test_version_is_printed():
    done = run_alone("--version")
    assert (done.returncode, done.stdout) == (0, f"fragtracer {ft.__version__}\n")


def test_info_names_the_renderer(run):
    done = run("info")
    assert done.returncode == 0
    assert "GL renderer" in done.stdout
    assert "Mitsuba" in done.stdout


def test_info_says_what_a_model_holds(run, tmp_path):
    path = tmp_path / "x.obj"
    path.write_text("mtllib none.mtl\nv 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    done = run("info", str(path))
    assert done.returncode == 0
    assert "x: 1 triangles in 1 parts" in done.stdout
    assert "from [0, 0, 0] to [2, 1, 0] m" in done.stdout
    warning = f"fragtracer: warning: {path}: ignored: none.mtl (no such file; its materials are grey)\n"
    assert done.stderr == warning


def test_info_counts_every_kind_of_shape_and_light():
    materials = {"a": ft.Material(blend="b", blend_weight=0.25), "b": ft.Material()}
    spot = ft.SpotLight((0, 1, 0), (0, -1, 0), 1.0)
    scene = ft.Scene(
        materials=materials,
        disks=[ft.Disk((0, 0, 0), (0, 1, 0), 1.0, "a")] * 3,
        spot_lights=[spot] * 2,
        directional_lights=[ft.DirectionalLight((0, -1, 0), 1.0)],
    )
    lines = [line.split() for line in contents(scene)]
    assert ["disks", "3"] in lines
    assert ["spot", "lights", "2"] in lines
    assert ["directional", "lights", "1"] in lines
    assert ["blend", "a:", "b", "by", "0.25"] in lines


def test_a_model_is_rendered(run, tmp_path):
    (tmp_path / "x.obj").write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    image = tmp_path / "x.exr"
    done = run("render", str(tmp_path / "x.obj"), "-o", str(image), "--size", "32x24", "--spp", "16")
    assert done.returncode == 0, done.stderr
    pixels = read_image(image)
    background = np.abs(pixels - 0.3).max(axis=2) < 1e-4
    assert 0.3 < background.mean() < 0.9


def test_scenes_lists_each_with_its_line(run):
    done = run("scenes")
    assert done.returncode == 0
    lines = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert {"three-spheres", "cornell-box", "furnace", "roughness-grid", "mirror", "red-bounce"} <= lines.keys()


def test_a_killed_render_goes_on(tmp_path, monkeypatch, capsys):
    """By signal 9, after its first checkpoint; it ends with the bits of one that was left alone."""
    command = ["render", "three-spheres-ambient", *TINY, "--spp", 8000, "--rays", 16, "--no-adaptive"]
    kept = ["--checkpoint", tmp_path / "kept"]
    film = tmp_path / "kept" / "film.npz"
    first = [*FRAGTRACER, *command, "-o", tmp_path / "a.npy", *kept, "--every", 0]
    with subprocess.Popen(list(map(str, first))) as process:
        while not film.exists():
            assert process.poll() is None
            time.sleep(0.01)
        process.kill()
    assert not (tmp_path / "a.npy").exists()
    assert status_of(monkeypatch, *command, "-o", tmp_path / "a.npy", *kept) == 2
    assert "there is a checkpoint; go on from it with --resume" in capsys.readouterr().err
    assert status_of(monkeypatch, *command, "-o", tmp_path / "a.npy", *kept, "--resume") == 0
    assert status_of(monkeypatch, *command, "-o", tmp_path / "b.npy") == 0
    np.testing.assert_array_equal(*(read_image(tmp_path / name) for name in ("a.npy", "b.npy")))
    assert status_of(monkeypatch, *command, "-o", tmp_path / "a.npy", *kept, "--resume", "--seed", 3) == 2
    assert "seed is 0 there, 3 here" in capsys.readouterr().err


def test_films_are_merged(tmp_path, monkeypatch, capsys):
    command = ["render", "three-spheres-ambient", *TINY, "--no-adaptive", "-o"]
    for first in (0, 8):
        part = ["--spp", 8, "--first-sample", first, "--checkpoint", tmp_path / str(first)]
        assert status_of(monkeypatch, *command, tmp_path / "a.npy", *part) == 0
    folders = [tmp_path / str(first) for first in (8, 0)]
    assert status_of(monkeypatch, "merge", *folders, "-o", tmp_path / "whole.exr") == 0
    assert "16 samples per pixel of 2 films" in capsys.readouterr().out
    found = read_metadata(tmp_path / "whole.exr")
    assert (found["spp"], found["samples"], found["bounces"]) == ("16", "0-7, 8-15", "1")
    assert status_of(monkeypatch, *command, tmp_path / "b.npy", "--spp", 16) == 0
    expected = read_image(tmp_path / "b.npy")
    np.testing.assert_allclose(read_image(tmp_path / "whole.exr"), expected, rtol=1e-5, atol=1e-6 * expected.max())
    assert status_of(monkeypatch, "merge", *folders, "-o", tmp_path / "whole.npz") == 0
    assert status_of(monkeypatch, "merge", folders[0], tmp_path / "whole.npz", "-o", tmp_path / "c.exr") == 2
    assert "both have the samples 8 to 15" in capsys.readouterr().err
    assert status_of(monkeypatch, "merge", folders[0], folders[0], "-o", tmp_path / "c.exr") == 2
    assert "is named more than once" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--every", "5"], "--every needs --checkpoint DIR"),
        (["--resume"], "--resume needs --checkpoint DIR"),
        (["--checkpoint", "/dev/null/kept"], "cannot be the folder of a checkpoint"),
        (["--first-sample", "3", "--no-adaptive"], "give an even number"),
        (["--first-sample", "0"], "--first-sample needs --no-adaptive"),
        (["--first-sample", "4", "--no-adaptive", "--light-tracing", "on"], "needs --light-tracing off"),
        (["--first-sample", "0", "--no-adaptive", "--gradient-domain", "on"], "needs --gradient-domain off"),
        (["--first-sample", "4", "--no-adaptive", "--integrator", "split-sum"], "needs --integrator path"),
    ],
)
def test_bad_checkpoints_get_one_message(tmp_path, monkeypatch, capsys, arguments, words):
    command = ["render", "cornell-box", "-o", tmp_path / "a.png", *TINY, "--spp", 1]
    assert status_of(monkeypatch, *command, *arguments) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("option", ["time", "until", "worst", "gamma", "bloom", "environment-rotation"])
@pytest.mark.parametrize("value", ["inf", "nan"])
def test_numbers_that_are_not_finite_get_one_message(tmp_path, monkeypatch, capsys, option, value):
    command = ["render", "cornell-box", "-o", tmp_path / "a.png", *TINY, "--spp", 1, f"--{option}", value]
    assert status_of(monkeypatch, *command) == 2
    assert f"Invalid value for '--{option}'" in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()


def test_before_the_first_sample_an_interruption_leaves_the_file_that_is_there(tmp_path, monkeypatch, capsys):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("fragtracer.renderer.Renderer.render", interrupt)
    output = tmp_path / "a.png"
    output.write_text("a picture")
    assert status_of(monkeypatch, "render", "cornell-box", "-o", output, *TINY) == 130
    assert output.read_text() == "a picture"
    said = ["a.png: interrupted before the first sample; not written", "fragtracer: interrupted"]
    assert capsys.readouterr().err.splitlines() == [f"{tmp_path}/{said[0]}", said[1]]


@pytest.mark.parametrize("command", ["render", "info", "compare"])
def test_a_scene_without_light_is_told_of(tmp_path, monkeypatch, capsys, command):
    monkeypatch.setattr("fragtracer.apps.compare.compare_scene", lambda *_, **__: type("Found", (), {"exit_status": 0}))
    monkeypatch.setattr("fragtracer.apps.compare.summary", str)
    scene = tmp_path / "dark.toml"
    scene.write_text('[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = "a"\n[material.a]\n')
    options = ["-o", tmp_path / "a.png", *TINY, "--spp", 1] if command == "render" else []
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert status_of(monkeypatch, command, scene, *options) == 0
    said = "warning: dark: this scene has no light, and is black: give it a [[light]], [ambient] or [environment]"
    assert capsys.readouterr().err.count(said) == 1


def test_a_picture_made_of_a_frame_is_none(tmp_path, monkeypatch):
    metadata = {"frame": "1", "frame_digest": "abc", "denoised_layer": "OIDN", "scene": "box"}
    write_image(tmp_path / "a.exr", np.ones((2, 2, 3)), metadata)
    assert status_of(monkeypatch, "develop", tmp_path / "a.exr", "-o", tmp_path / "a.png") == 0
    found = read_metadata(tmp_path / "a.png")
    assert found["scene"] == "box"
    assert found.keys().isdisjoint(metadata.keys() - {"scene"})


@pytest.mark.parametrize("missing", ["jinja2", "matplotlib"])
def test_what_a_report_lacks_is_said_before_the_work(tmp_path, monkeypatch, capsys, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    command = ["compare", "cornell-box", "--split-sum", "--report", tmp_path / "a.html", "--json", tmp_path / "a.json"]
    monkeypatch.setattr("fragtracer.apps.compare.approximation.measure_approximation", None)
    assert status_of(monkeypatch, *command) == 2
    assert "is not installed; pip install 'fragtracer[reference]'" in capsys.readouterr().err


def test_a_disk_that_is_full_is_noticed_before_the_work(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 9000})())
    output = tmp_path / "a.png"
    command = ["render", "cornell-box", "-o", output, *TINY, "--checkpoint", tmp_path / "kept"]
    assert status_of(monkeypatch, *command) == 2
    assert "kept: a checkpoint takes up to 1 MB, 0 MB are free" in capsys.readouterr().err


@pytest.mark.parametrize("has_room", [True, False])
def test_a_picture_whose_disk_has_become_full_is_elsewhere(tmp_path, monkeypatch, has_room):
    def write(path, *arguments):
        if path.parent == tmp_path or not has_room:
            raise OutputError(f"{path}: cannot write: No space left on device")
        write_image(path, *arguments)

    monkeypatch.setattr("fragtracer.io.images.write_image", write)
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    here.mkdir()
    elsewhere.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    problem = f"{tmp_path}/a.npy: cannot write: No space left on device"
    if has_room:
        with pytest.raises(OutputError) as raised:
            write_or_rescue(tmp_path / "a.npy", np.ones((2, 2, 3)))
        (rescued,) = here.glob("rescued-*/a.npy")
        assert str(raised.value) == f"{problem}; the picture is in {rescued}"
        assert read_image(rescued).all()
    else:
        with pytest.raises(OutputError, match=f"{re.escape(problem)}$"):
            write_or_rescue(tmp_path / "a.npy", np.ones((2, 2, 3)))
        assert not [*here.iterdir(), *elsewhere.iterdir()]


def test_a_verdict_is_printed_though_no_file_can_be_written(tmp_path, monkeypatch, capsys):
    def fail(path, *_):
        raise OutputError(f"{path.name}: cannot write: No space left on device")

    for name in ("compare_scene", "to_json"):
        monkeypatch.setattr(f"fragtracer.apps.compare.{name}", lambda *_, **__: {})
    monkeypatch.setattr("fragtracer.apps.compare.summary", lambda _: "they agree")
    monkeypatch.setattr("fragtracer.apps.compare.write_report", fail)
    monkeypatch.setattr("fragtracer.output.replacing", fail)
    command = ["compare", "cornell-box", "--report", tmp_path / "a.html", "--json", tmp_path / "a.json"]
    assert status_of(monkeypatch, *command) == 2
    out, err = capsys.readouterr()
    assert out == "they agree\n"
    assert all(f"{name}: cannot write: No space" in err for name in ("a.json", "a.html"))


def test_a_disk_that_fills_up_is_a_warning(tmp_path, monkeypatch, capsys):
    """The render goes on, and the picture is written."""

    def fail(film, path):
        raise OutputError(f"{path}: cannot write: No space left on device")

    monkeypatch.setattr(SavedFilm, "write", fail)
    output = tmp_path / "a.png"
    command = ["render", "cornell-box", "-o", output, *TINY, "--spp", 4, "--checkpoint", tmp_path / "kept"]
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert status_of(monkeypatch, *command) == 0
    assert "no checkpoint: " in capsys.readouterr().err
    assert output.exists()
