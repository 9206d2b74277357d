# SPDX-License-Identifier: MIT
"""Motion blur: pictures are the mean over the moments that a shutter is open for."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from agreement import assert_agree
from command import TINY, status_of
from moving_model import model
from scipy import stats

import fragtracer as ft
from fragtracer.apps.cli.frames import Frames, frames_of
from fragtracer.camera_path import turned
from fragtracer.errors import FragtracerError
from fragtracer.io.images import read_image, read_metadata
from fragtracer.io.playing import Playing
from fragtracer.io.toml import load
from fragtracer.renderer import Renderer
from fragtracer.scene import PLAIN, Scene
from fragtracer.shutter import Shutter

SIZE = (32, 24)


@pytest.fixture
def playing(tmp_path: Path) -> Playing:
    """A model whose mesh, light and camera move."""
    return Playing(load(model(tmp_path / "x.glb"), animation="rise"), True)


def turning(name: str, share: float = 0.1) -> Any:
    """The scene ``name``, around which the camera turns by that share of a circle while the shutter is open."""
    scene = load(name)
    return lambda time: replace(scene, camera=turned(scene.camera, share * time))


def test_moments_are_stratified_and_each_as_likely() -> None:
    shutter = Shutter(lambda _: load("mirror"), 32)
    times = np.array([[shutter.time(number, seed) for number in range(32)] for seed in range(200)])
    assert (times >= 0).all()
    assert (times < 1).all()
    for some in (times[:, :8], times):
        gaps = np.diff(np.sort(some, axis=1), axis=1)
        np.testing.assert_allclose(gaps, 1 / some.shape[1], atol=1e-9)
    for number in (0, 5):
        assert stats.kstest(times[:, number], "uniform").pvalue > 1e-3
    assert [shutter.samples(spp) for spp in (1, 64, 65, 1000)] == [2, 2, 4, 32]
    with pytest.raises(ValueError, match="one moment at least, not for 0"):
        Shutter(lambda _: load("mirror"), 0)


def test_a_picture_is_the_mean_of_its_moments(ctx: moderngl.Context, playing: Playing) -> None:
    """Sample by sample, of whatever moves; and so are its layers, and the parts of its light."""
    moments = playing.at(0), playing.at(1)
    shutter = Shutter(lambda time: moments[time >= 0.5], 2)
    first = int(shutter.time(0, 7) >= 0.5)
    options: dict[str, Any] = {"context": ctx, "moves": True, "animated": True, "aovs": ["direct"]}
    with Renderer(playing.at(0.5), SIZE, seed=7, **options, **PLAIN) as renderer:
        renderer.reset(shutter=shutter, spp=8)
        renderer.sample(3)  # not all of a moment
        renderer.sample(5)
        image, albedo = renderer.image(), renderer.aov("albedo")
        parts = [renderer.aov(part) for part in ("emission", "direct", "indirect")]
        assert renderer.metadata()["moments"] == "2"
        renderer.sample(8)  # the moments go on after layers were drawn
        assert renderer.metadata()["moments"] == "4"
        renderer.reset(shutter=shutter, spp=64)
        renderer.render(until=1.0)
        assert renderer.spp == 64  # no picture is good before it has seen all moments
        renderer.reset()
        renderer.render(until=1.0)
        assert renderer.spp == 16
        assert "shutter" not in renderer.metadata()
    alone = []
    for number, which in enumerate((first, 1 - first)):
        options = {"context": ctx, "moves": True, "animated": True, "first_sample": 4 * number}
        with Renderer(playing.at(0.5), SIZE, seed=7, **options, **PLAIN) as renderer:
            renderer.reset(moments[which])
            renderer.sample(4)
            alone.append((renderer.image(), renderer.aov("albedo")))
    assert np.abs(alone[0][0] - alone[1][0]).mean() > 0.1 * image.mean()
    np.testing.assert_allclose(image, (alone[0][0] + alone[1][0]) / 2, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(sum(parts), image, rtol=2e-6, atol=1e-9)
    assert np.abs(albedo - (alone[0][1] + alone[1][1]) / 2).mean() < 0.05 * albedo.mean()  # of other samples


def test_photons_are_of_all_moments(ctx: moderngl.Context) -> None:
    """Light traced from the lights, and found by guided paths, has the mean of light found by plain ones, where half of
    the moments see none of it: each picture has photons of both halves."""
    scene = load("caustic")
    x, y, z = scene.camera.position
    away = replace(scene, camera=replace(scene.camera, target=(x, y + 1.0, z - 0.1)))
    shutter = Shutter(lambda time: scene if time < 0.5 else away, 4)
    stacks = []
    for choice in ("on", "off"):
        images = []
        with Renderer(
            scene, SIZE, context=ctx, moves=True, **PLAIN | {"light_tracing": choice, "guiding": choice}
        ) as r:
            for seed in range(16):
                r.reset(shutter=shutter, seed=seed, spp=512)
                images.append(r.render(512))
        stacks.append(images)
    assert_agree(*stacks, resolution=0.06, blocks=(2, 2))


def test_it_goes_on_from_a_checkpoint(ctx: moderngl.Context, tmp_path: Path) -> None:
    """With the bits of a picture that was not interrupted, even if it is to have more samples than was meant."""
    at = turning("three-spheres")
    options: dict[str, Any] = {"context": ctx, "moves": True, **PLAIN}
    with Renderer(at(0.5), SIZE, **options) as renderer:
        renderer.reset(shutter=Shutter(at, 4, "a"), spp=16)
        renderer.sample(6)
        renderer.save(tmp_path / "film.npz")
        renderer.sample(26)
        whole = renderer.image()
    with Renderer(at(0.5), SIZE, **options) as renderer:
        renderer.reset(shutter=Shutter(at, 4, "a"), spp=32)
        renderer.resume(tmp_path / "film.npz")
        renderer.sample(26)
        np.testing.assert_array_equal(renderer.image(), whole)
        renderer.reset(shutter=Shutter(at, 4, "b"))
        with pytest.raises(FragtracerError, match="shutter is a there, b here"):
            renderer.resume(tmp_path / "film.npz")
        renderer.reset()
        with pytest.raises(FragtracerError, match="shutter is a there, unknown here"):
            renderer.resume(tmp_path / "film.npz")


def test_a_moment_that_fails_leaves_the_picture(ctx: moderngl.Context) -> None:
    at = turning("mirror")

    def failing(time: float) -> Scene:
        if fails:
            raise FragtracerError("no such moment")
        return at(time)

    fails = False
    with Renderer(at(0.5), SIZE, context=ctx, moves=True, **PLAIN) as renderer:
        renderer.reset(shutter=Shutter(failing, 4), spp=8)
        renderer.sample(2)
        before, fails = renderer.image(), True
        with pytest.raises(FragtracerError, match="no such moment"):
            renderer.sample(2)
        np.testing.assert_array_equal(renderer.image(), before)
        fails = False
        renderer.sample(2)
        assert renderer.spp == 4


def test_the_time_of_a_frame(tmp_path: Path) -> None:
    """Half of it is before the frame and half after it. A way ends at rest, a turntable and a loop do not."""
    scene = load(model(tmp_path / "x.glb"), animation="rise")
    output = tmp_path / "a.#.png"

    def cameras(frames: Frames, number: int) -> list[Any]:
        shutter = frames.shutter(number)
        assert shutter is not None
        return [shutter.at(time).camera for time in (0.0, 0.5, 1.0)]

    around = frames_of(scene, output, None, None, 8, None, exposed=0.5, moments=4)
    assert cameras(around, 1) == [turned(scene.camera, share / 8) for share in (-0.25, 0, 0.25)]
    assert cameras(around, 3)[1] == around.scene(3).camera
    (tmp_path / "way.toml").write_text(
        "[[key]]\nframe = 1\nposition = [0, 1, 6]\n[[key]]\nframe = 3\nposition = [2, 1, 6]\n"
    )
    way = frames_of(scene, output, None, tmp_path / "way.toml", None, None, exposed=1.0, moments=4)
    x = [[round(camera.position[0], 9) for camera in cameras(way, number)] for number in (1, 2, 3)]
    assert x == [[0, 0, 0.5], [0.5, 1, 1.5], [1.5, 2, 2]]
    assert frames_of(scene, output, None, None, 8, None).shutter(1) is None

    def tops(repeats: bool, number: int) -> list[float]:
        moving = Playing(scene, True, repeats)
        frames = frames_of(scene, output, None, None, None, 4, moving, exposed=0.5, moments=4)
        shutter = frames.shutter(number)
        assert shutter is not None
        found = (shutter.at(time).meshes[0].parts[0].geometry.positions[2, 1] for time in (0.0, 0.5, 1.0))
        return [round(float(top), 9) for top in found]

    assert tops(False, 2) == tops(True, 2) == [1.75, 2, 2.25]
    assert tops(False, 1) == [1, 1, 1.25]
    assert tops(True, 1) == [4.75, 1, 1.25]


def test_frames_have_motion_blur(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    """By the command, layers and denoising included; a frame with another shutter is another picture."""
    command = ["render", model(tmp_path / "x.glb"), *TINY, "--spp", 8, "--animation", "rise", "--fps", 2]
    command += ["--frames", 2, "-o", tmp_path / "a.#.exr", "--aov", "albedo"]
    images = []
    for more, finished in (([], False), (["--shutter", 0.5], False), (["--shutter", 0.5], True)):
        assert status_of(monkeypatch, *command, *more) == 0
        assert ("finished before" in capsys.readouterr().out) == finished
        images.append(read_image(tmp_path / "a.2.exr"))
    assert np.abs(images[0] - images[1]).max() > 0.01
    assert read_metadata(tmp_path / "a.2.exr")["shutter"] == "0.5 of a frame in 32 moments"
    assert read_metadata(tmp_path / "a.2.exr")["moments"] == "4"
    around = ["render", "mirror", "-o", tmp_path / "m.#.exr", "--turntable", 3]
    refused = {
        "--shutter is for frames": ["render", "mirror", "-o", tmp_path / "m.png", "--shutter", 0.5],
        "give --shutter SHARE": [*command, "--moments", 4],
        "--aov motion is of a moment": [*around, "--aov", "motion", "--shutter", 0.5],
        "not possible together with --cluster": [*around, "--cluster", "local:1", "--shutter", 0.5],
    }
    for said, words in refused.items():
        assert status_of(monkeypatch, *words) == 2
        assert said in capsys.readouterr().err


def test_a_shutter_is_part_of_the_library() -> None:
    assert ft.Shutter is Shutter
