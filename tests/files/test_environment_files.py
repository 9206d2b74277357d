# SPDX-License-Identifier: MIT
"""Environments in scene files and on the command line."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from command import status_of

from fragtracer.errors import FragtracerError, OutputError, SceneError
from fragtracer.io.images import read_image, write_image
from fragtracer.io.toml import dump, load, parse, save
from fragtracer.io.toml.environments import read_panorama
from fragtracer.scene import Environment, Gradient, Panorama, Scene, Sky


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    write_image(tmp_path / "sky.exr", np.random.default_rng(0).random((4, 8, 3)))
    return tmp_path / "sky.exr"


def test_a_picture_is_found_beside_the_scene(picture):
    scene_path = picture.parent / "scene.toml"
    scene_path.write_text('[environment]\nfile = "sky.exr"\nrotation_degrees = 30\nvisible = false\nbackground = 0.5\n')
    environment = load(scene_path).environment
    np.testing.assert_array_equal(environment.pixels, read_image(picture))
    assert (environment.rotation_degrees, environment.visible, environment.background) == (30, False, (0.5, 0.5, 0.5))


def test_saved_scenes_are_read_again(picture, tmp_path):
    environments = [
        Environment(image=read_panorama(picture), rotation_degrees=10.0, tint=(1.0, 0.5, 0.25)),
        Environment(radiance=(1.0, 2.0, 3.0), strength=2.0),
        Environment(gradient=Gradient(1.0, 2.0, (0.0, 0.5, 0.0)), visible=False),
        Environment(sky=Sky(turbidity=4.0, sun=False)),
        Environment(sky=Sky()),
    ]
    (tmp_path / "deeper").mkdir()
    for number, environment in enumerate(environments):
        path = tmp_path / "deeper" / f"{number}.toml"
        save(Scene(name=str(number), environment=environment), path)
        assert load(path).environment == environment
    assert 'file = "../sky.exr"' in (tmp_path / "deeper" / "0.toml").read_text()


def test_a_picture_without_a_file_cannot_be_written():
    with pytest.raises(OutputError, match="in no file"):
        dump(Scene(environment=Environment(image=Panorama(np.ones((2, 4, 3))))))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[environment]", "environment: give one of these: file, radiance"),
        ("[environment]\nfile = 3", "environment.file: must be a text in quotes, got 3"),
        ('[environment]\nfile = "gone.hdr"', "gone.hdr: cannot read: No such file"),
        ('[environment]\nfile = "sky.jpeg2"', "sky.jpeg2: cannot read this kind of image"),
        ("[environment]\nradiance = 1\nrotatoin_degrees = 3", "rotatoin_degrees: there is no such key; did you mean"),
        ('[environment]\nradiance = 1\nstrength = "a"', 'environment.strength: must be a number, got "a"'),
        ("[environment]\nradiance = 1\nstrength = -1", "environment.strength: must be at least 0, got -1"),
        (
            "[environment]\nradiance = 1\n[environment.sky]",
            "environment: give only one of these, not radiance and sky: file",
        ),
        ("[environment.sky]\nturbidity = 0", "environment.sky.turbidity: must be at least 1, got 0"),
        ("[environment.gradient]\nzenith = 1\nground = 1", "environment.gradient.horizon: is missing"),
        ("environment = 3", "environment: must be a table, written [environment], got 3"),
        ("[environment]\nsky = 3", "environment.sky: must be a table"),
    ],
)
def test_mistakes_are_said_in_one_line(tmp_path, text, message):
    with pytest.raises(SceneError) as error:
        parse(text, tmp_path / "scene.toml")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_bad_pixels_are_counted_and_dark(tmp_path):
    pixels = np.ones((3, 4, 3), np.float32)
    pixels[0, 0, 1], pixels[1, 1], pixels[2, 2, 0] = np.nan, np.inf, -1.0
    write_image(tmp_path / "bad.exr", pixels)
    with pytest.warns(
        UserWarning, match=r"bad\.exr: 2 pixels are NaN or infinite .*; 1 pixels are negative in a channel, which"
    ):
        panorama = read_panorama(tmp_path / "bad.exr")
    expected = np.ones((3, 4, 3))
    expected[0, 0] = expected[1, 1] = 0
    expected[2, 2, 0] = 0
    np.testing.assert_array_equal(panorama.pixels, expected)


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fragtracer", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_the_command_line_names_an_environment(picture, monkeypatch, tmp_path):
    scene = tmp_path / "empty.toml"
    scene.write_text("[environment]\nradiance = 1\n")

    def sky(*options: str) -> np.ndarray:
        given = ("-o", tmp_path / "b.npy", "--size", "8x8", "--spp", "4", *options)
        assert status_of(monkeypatch, "render", scene, *given) == 0
        return read_image(tmp_path / "b.npy")

    assert (sky() == 1).all()
    assert (sky("--environment-strength", "3") == 3).all()
    mine = sky("--environment", str(picture))
    assert mine.std() > 0
    turned = sky("--environment", str(picture), "--environment-rotation", "120")
    assert not np.array_equal(mine, turned)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it says that there is no light
        assert not sky("--environment", "none").any()


def test_a_picture_beside_another_light_is_named_as_the_file_names_it(picture, tmp_path):
    with pytest.raises(SceneError, match="give only one of these, not file and radiance: file, radiance,"):
        parse(f'[environment]\nfile = "{picture}"\nradiance = 1', tmp_path / "scene.toml")


@pytest.mark.parametrize(("option", "value"), [("strength", "1e39"), ("rotation", "-1e39")])
def test_a_number_that_is_no_float32_is_refused_by_the_name_of_its_option(picture, monkeypatch, capsys, option, value):
    given = ("--environment", picture, f"--environment-{option}", value)
    assert status_of(monkeypatch, "render", "furnace", "-o", "a.npy", *given) == 2
    expected = f"--environment-{option} {float(value):g}: give a finite number, at most 3.4e+38"
    assert expected in capsys.readouterr().err


def test_a_file_of_another_kind_is_no_exr(tmp_path):
    (tmp_path / "a.exr").write_text("hello")
    with pytest.raises(FragtracerError, match="does not begin as an OpenEXR file"):
        read_panorama(tmp_path / "a.exr")


def test_an_environment_that_is_not_there_cannot_be_turned(tmp_path):
    done = run("render", "furnace", "-o", str(tmp_path / "a.npy"), "--environment-rotation", "10")
    assert done.returncode == 2
    assert "no environment to change" in done.stderr
    assert "Traceback" not in done.stderr
