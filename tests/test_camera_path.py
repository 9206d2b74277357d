# SPDX-License-Identifier: MIT
"""Cameras that move: through their keys, smoothly, within bounds; once around; and files of keys."""

from dataclasses import replace

import numpy as np
import pytest

from fragtracer.camera_path import CameraPath, turntable
from fragtracer.errors import SceneError
from fragtracer.io.toml.camera_paths import load_camera_path
from fragtracer.scene import Camera

CAMERA = Camera((0.0, 1.0, 4.0), (0.0, 0.5, 0.0), fov_degrees=40.0)


def path_of(**values) -> CameraPath:
    frames = values.pop("frames")
    rows = [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]
    return CameraPath({frame: replace(CAMERA, **row) for frame, row in zip(frames, rows, strict=True)})


def test_it_goes_through_its_keys_and_is_smooth() -> None:
    """Also where keys are unequally far apart: the step from frame to frame changes by little at a key."""
    places = [(0.0, 1.0, 4.0), (2.0, 1.5, 3.0), (3.0, 1.0, 0.0), (2.0, 2.0, -3.0)]
    path = path_of(frames=(10, 110, 160, 400), position=places)
    assert path.frames == range(10, 401)
    for frame, place in zip((10, 110, 160, 400), places, strict=True):
        assert path.camera(frame).position == place
    points = np.array([path.camera(frame).position for frame in path.frames])
    bends = np.linalg.norm(np.diff(points, n=2, axis=0), axis=1)
    assert bends.max() < 0.05 * np.linalg.norm(np.diff(points, axis=0), axis=1).max()


def test_a_parabola_is_followed_exactly() -> None:
    """By Catmull and Rom's tangents, between keys that have neighbours."""
    times = np.array([0, 10, 20, 50, 60])

    def expected(t: float) -> tuple[float, float, float]:
        return 0.1 * t, 0.002 * t**2, 4.0 - 0.05 * t

    path = path_of(frames=times.tolist(), position=[expected(float(t)) for t in times])
    for frame in range(10, 51):
        np.testing.assert_allclose(path.camera(frame).position, expected(frame), atol=1e-12)


def test_numbers_stay_between_their_keys_and_cameras_can_rest() -> None:
    rested = (1.0, 1.0, 3.0)
    path = path_of(
        frames=(0, 10, 20, 30),
        position=[(0.0, 1.0, 4.0), rested, rested, (5.0, 1.0, 3.0)],
        fov_degrees=[5.0, 5.0, 90.0, 90.0],
        aperture_radius=[0.0, 0.1, 0.1, 0.0],
    )
    cameras = [path.camera(frame) for frame in path.frames]
    assert all(camera.position == rested for camera in cameras[10:21])
    assert [camera.fov_degrees for camera in cameras[:11]] == [5.0] * 11
    assert (np.diff([camera.fov_degrees for camera in cameras[10:21]]) > 0).all()
    assert max(camera.aperture_radius for camera in cameras) <= 0.1 + 1e-15
    assert cameras[15].focus_distance is None


def test_the_focus_moves_where_a_key_has_one() -> None:
    path = path_of(frames=(0, 10), focus_distance=[2.0, None])
    assert path.camera(5).focus_distance == pytest.approx((2 + CAMERA.focal_distance) / 2)


def test_a_turntable_goes_around_counter_clockwise() -> None:
    camera = replace(CAMERA, up=(0.0, 2.0, 0.0))
    path = turntable(camera, 8)
    assert path.frames == range(1, 9)
    np.testing.assert_allclose(path.camera(1).position, camera.position)
    np.testing.assert_allclose(path.camera(3).position, (4.0, 1.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(path.camera(5).position, (0.0, 1.0, -4.0), atol=1e-12)
    assert {path.camera(n).target for n in path.frames} == {camera.target}


KEYS = """
[[key]]
frame = 1
[[key]]
frame = 11
position = [4, 1, 0]
fov_degrees = 60
"""


def test_a_file_gives_what_changes(tmp_path) -> None:
    file = tmp_path / "path.toml"
    file.write_text(KEYS)
    path = load_camera_path(file, CAMERA)
    assert path.camera(1) == CAMERA
    middle = path.camera(6)
    assert middle.position == (2.0, 1.0, 2.0)
    assert middle.fov_degrees == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (KEYS.replace("11", "1"), r"key\[1\]\.frame: must be greater than that of the key before, 1"),
        (KEYS.replace("60", "200"), r"key\[1\]\.fov_degrees: must be less than 180, got 200"),
        (KEYS.replace("[4, 1, 0]", "[0, 0.5, 0]"), r"key\[1\]: position and target are the same point"),
        (KEYS.replace("frame = 1\n", ""), r"key\[0\]\.frame: is missing"),
        (KEYS.replace("position", "pos"), r"key\[1\]\.pos: there is no such key; did you mean position"),
        (KEYS.replace("[[key]]", "[[keys]]"), r"keys: there is no such key; did you mean key"),
        ("", r"key: must be tables \[\[key\]\]"),
        ("key = 3", r"key: must be tables"),
        ("key = [3]", r"key\[0\]: must be a table"),
        ("[[key", "not a TOML file"),
    ],
)
def test_mistakes_are_named(tmp_path, text: str, words: str) -> None:
    file = tmp_path / "path.toml"
    file.write_text(text)
    with pytest.raises(SceneError, match=f"{file}: {words}"):
        load_camera_path(file, CAMERA)
    with pytest.raises(SceneError, match="no such file"):
        load_camera_path(tmp_path / "none.toml", CAMERA)
