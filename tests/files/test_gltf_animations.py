# SPDX-License-Identifier: MIT
"""Animations of glTF files: values between keys, poses of nodes, skins and morph targets, and mistakes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from fragtracer.errors import SceneError
from fragtracer.io import AnimationError, Model, open_gltf, read_model
from fragtracer.io.gltf.animations import Curve
from fragtracer.scene import Pose

from .data import PNG, TRIANGLE, Gltf

RNG = np.random.default_rng(11)
TIMES = np.array([0.5, 0.75, 2.0, 2.25])


def quaternion(axis: Any, angle: float) -> list[float]:
    """xyzw."""
    return [*(np.sin(angle / 2) * np.asarray(axis) / np.linalg.norm(axis)), np.cos(angle / 2)]


def test_steps_lines_and_cubics_between_keys() -> None:
    """Before the first key and after the last, their values."""
    values, tangents = RNG.normal(size=(4, 3)), RNG.normal(size=(2, 4, 3))
    cubic = np.stack([tangents[0], values, tangents[1]], axis=1)
    curves = {
        "STEP": Curve(TIMES, values, "STEP"),
        "LINEAR": Curve(TIMES, values, "LINEAR"),
        "CUBICSPLINE": Curve(TIMES, cubic, "CUBICSPLINE"),
    }
    for curve in curves.values():
        for time, key in ((-1.0, 0), (0.5, 0), (0.75, 1), (2.0, 2), (2.25, 3), (9.0, 3)):
            np.testing.assert_array_equal(curve.at(time), values[key])
    for time in (0.6, 1.1, 1.9, 2.1):
        key = int(np.searchsorted(TIMES, time)) - 1
        np.testing.assert_array_equal(curves["STEP"].at(time), values[key])
        expected = [np.interp(time, TIMES, column) for column in values.T]
        np.testing.assert_allclose(curves["LINEAR"].at(time), expected, rtol=1e-14)
        ends = values[key : key + 2], np.stack([tangents[1, key], tangents[0, key + 1]])
        spline = CubicHermiteSpline(TIMES[key : key + 2], *ends)
        np.testing.assert_allclose(curves["CUBICSPLINE"].at(time), spline(time), rtol=1e-12, atol=1e-14)


def test_a_cubic_is_reproduced() -> None:
    """Of tangents per second, whatever the distance of the keys."""
    polynomial = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    slopes = polynomial.deriv()(TIMES)
    curve = Curve(TIMES, np.stack([slopes, polynomial(TIMES), slopes], axis=1)[..., None], "CUBICSPLINE")
    for time in np.linspace(0.5, 2.25, 15):
        np.testing.assert_allclose(curve.at(time), [polynomial(time)], rtol=1e-13)


def test_rotations_go_the_shorter_way_at_an_even_speed() -> None:
    ends = np.array([quaternion([1, 2, 3], 0.3), quaternion([-1, 1, 0.5], 2.5)])
    for sign in (1, -1):  # of the same rotation
        curve = Curve(np.array([0.0, 2.0]), ends * [[1], [sign]], "LINEAR", turns=True)
        slerp = Slerp([0, 2], Rotation.from_quat(ends))
        for time in (0.0, 0.3, 1.0, 1.7, 2.0):
            found = curve.at(time)
            np.testing.assert_allclose(np.linalg.norm(found), 1)
            np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), slerp(time).as_matrix(), atol=1e-14)
    about_x = Curve(np.array([0.0, 1.0]), np.array([quaternion([1, 0, 0], a) for a in (0, 3.1)]), "LINEAR", turns=True)
    np.testing.assert_allclose(about_x.at(0.25), quaternion([1, 0, 0], 0.775), atol=1e-15)
    same = Curve(np.array([0.0, 1.0]), ends[[0, 0]], "LINEAR", turns=True)
    np.testing.assert_array_equal(same.at(0.5), ends[0])


def test_rotations_by_cubics_are_normalized() -> None:
    keys = RNG.normal(size=(2, 3, 4))
    keys[:, 1] /= np.linalg.norm(keys[:, 1], axis=1, keepdims=True)
    curve = Curve(np.array([0.0, 0.5]), keys, "CUBICSPLINE", turns=True)
    spline = CubicHermiteSpline([0, 0.5], keys[:, 1], [keys[0, 2], keys[1, 0]])
    expected = spline(0.2) / np.linalg.norm(spline(0.2))
    np.testing.assert_allclose(curve.at(0.2), expected, rtol=1e-12)


def moving() -> Gltf:
    """A camera, a lamp and two triangles, one below the other, that "move"; "other" does nothing."""
    gltf = Gltf(
        nodes=[
            {"mesh": 0, "children": [1], "translation": [7, 7, 7]},
            {"mesh": 0, "rotation": [1, 0, 0, 0]},
            {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        scenes=[{"nodes": [0, 2]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 1}}],
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
    )
    gltf.triangle()
    half = np.sqrt(0.5)
    gltf.animation(
        "move",
        (0, "translation", [1, 3], [[0, 0, 0], [4, 0, 0]], "LINEAR"),
        (1, "rotation", [0, 2], [[0, 0, 0, 1], [0, 0, half, half]], "STEP"),
        (1, "scale", [0], [[1, 2, 1]], "LINEAR"),
        (2, "translation", [0, 4], [[0, 0, 8], [0, 4, 8]], "LINEAR"),
    )
    gltf.animation("move")
    gltf.animation(None)
    return gltf


def posed(gltf: Gltf, tmp_path: Path, animation: str, time: float | None) -> Model:
    return read_model(gltf.write(tmp_path / "x.gltf"), Pose(animation, time))


def placed(model: Model) -> list[Any]:
    """The vertices of each part in world space."""
    parts = ((part.geometry.positions, np.array(part.matrix)) for part in model.mesh.parts)
    return [points @ matrix[:3, :3].T + matrix[:3, 3] for points, matrix in parts]


def test_nodes_move_and_what_they_hold(tmp_path: Path) -> None:
    gltf, (a, b, c) = moving(), np.array(TRIANGLE)
    for time, along, turned in ((None, 0, False), (0.5, 0, False), (1.5, 1, False), (2.5, 3, True), (8.0, 4, True)):
        model = posed(gltf, tmp_path, "move", time)
        assert not model.ignored
        first, second = placed(model)
        np.testing.assert_allclose(first, np.add(TRIANGLE, [along, 0, 0]), atol=1e-6)
        expected = [a, b, 2 * c] if not turned else [a, [0, 1, 0], [-2, 0, 0]]
        np.testing.assert_allclose(second, np.add(expected, [along, 0, 0]), atol=1e-6)
        height = min(time or 0, 4)
        np.testing.assert_allclose(model.cameras[0].position, [0, height, 8])
        np.testing.assert_allclose(model.lights[0].position, [0, height, 8])
        assert model.mesh.pose == Pose("move", time)
    assert model.mesh.parts[0].geometry is model.mesh.parts[1].geometry


def test_without_an_animation_nothing_has_changed(tmp_path: Path) -> None:
    """Nor is anything of it read."""
    gltf = moving()
    with pytest.warns(UserWarning, match=r"ignored: animations \(none is chosen\)$"):
        rest = gltf.read(tmp_path)
    del gltf.content["animations"]
    alone = gltf.read(tmp_path, "y.gltf")
    assert rest.mesh.pose is None
    assert (rest.mesh.parts, rest.cameras, rest.lights) == (alone.mesh.parts, alone.cameras, alone.lights)
    gltf.content["animations"] = ["damaged", {"channels": [{}]}, {"name": 3}]
    with pytest.warns(UserWarning, match=r"ignored: animations \(none is chosen\)$"):
        assert gltf.read(tmp_path, "z.gltf").mesh.parts == rest.mesh.parts


def test_quaternions_of_any_length_turn_evenly(tmp_path: Path) -> None:
    """As those that are integers have."""
    gltf = moving()
    keys = gltf.array([[0, 0, 0, 32767], [0, 0, 8000, 8000]], "<i2", normalized=True)
    gltf.content["animations"][0]["samplers"][1] |= {"output": keys, "interpolation": "LINEAR"}
    _, turned = placed(posed(gltf, tmp_path, "move", 1.0))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(turned[1] - turned[0], [half, half, 0], atol=1e-6)


def test_animations_have_names_and_numbers(tmp_path: Path) -> None:
    file = open_gltf(moving().write(tmp_path / "x.gltf"))
    assert file.animations.names == ["move", "move (1)", "animation 2"]
    assert file.animations.get("0") is file.animations.get("move")
    assert (file.animations.get("move").duration, file.animations.get("2").duration) == (4, 0)
    for name in ("Move", "3", "-1", "", "9" * 5000):
        with pytest.raises(AnimationError, match=r"x.gltf: there is no animation .*; choose from move, move \(1\), "):
            file.model(Pose(name))
    with pytest.raises(AnimationError, match="there is no animation '0'; it has none"):
        posed(Gltf(), tmp_path, "0", 0.0)
    with pytest.raises(AnimationError, match=r"x.obj: only .gltf and .glb files have animations"):
        read_model(tmp_path / "x.obj", Pose("move"))


def test_morph_targets_and_skins_move(tmp_path: Path) -> None:
    """Weights as normalized integers. What no channel moves is what it was; a file stays open for many poses, and so
    what was not moved stays the same."""
    gltf = Gltf(nodes=[{"mesh": 0}, {"mesh": 1, "skin": 0}, {"children": [3]}, {}], scenes=[{"nodes": [0, 1, 2]}])
    moves = RNG.random((2, 3, 3)).astype(np.float32)
    gltf.triangle(targets=[{"POSITION": gltf.array(move)} for move in moves])
    attributes = {"JOINTS_0": gltf.array([[0, 1, 0, 0]] * 3, "<u1"), "WEIGHTS_0": gltf.array([[0.25, 0.75, 0, 0]] * 3)}
    gltf.triangle(attributes=attributes)
    gltf.content["skins"] = [{"joints": [2, 3]}]
    gltf.animation("move", (2, "translation", [0, 1], [[0, 0, 0], [4, 0, 0]], "LINEAR"))
    weights = gltf.array([0, 255, 51, 102], "<u1", normalized=True)
    (animation,) = gltf.content["animations"]
    animation["samplers"].append({"input": gltf.array([0, 1]), "output": weights})
    animation["channels"].append({"sampler": 1, "target": {"node": 0, "path": "weights"}})
    animation["channels"].append({"sampler": 0, "target": {"node": 3, "path": "translation"}})
    file = open_gltf(gltf.write(tmp_path / "x.gltf"))
    for time in (0.0, 0.5, 1.0, 0.5):
        morphed, skinned = placed(file.model(Pose("move", time)))
        a, b = 0.2 * time, 1 - 0.6 * time
        np.testing.assert_allclose(morphed, TRIANGLE + a * moves[0] + b * moves[1], atol=1e-6)
        np.testing.assert_allclose(skinned, np.add(TRIANGLE, [(1 + 0.75) * 4 * time, 0, 0]), atol=1e-6)


def test_nothing_is_decoded_for_each_pose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decoded = []
    from fragtracer.io.gltf import materials

    read = materials.read_texture
    monkeypatch.setattr(materials, "read_texture", lambda *arguments: decoded.append(1) or read(*arguments))
    gltf = moving()
    gltf.content["images"] = [{"bufferView": gltf.view(PNG), "mimeType": "image/png"}]
    gltf.content |= {"textures": [{"source": 0}], "materials": [{"emissiveTexture": {"index": 0}}]}
    gltf.content["meshes"][0]["primitives"][0]["material"] = 0
    path = gltf.write(tmp_path / "x.gltf")
    first = read_model(path, Pose("move", 0.0))
    monkeypatch.setattr(Path, "read_bytes", lambda path: pytest.fail(f"{path} is read again"))
    file = open_gltf(path)
    models = [file.model(Pose("move", time)) for time in (0.0, 1.5, 2.5)]
    assert len(decoded) == 1
    assert {id(part.geometry) for model in models for part in model.mesh.parts} == {id(first.mesh.parts[0].geometry)}


def test_a_file_that_has_changed_is_opened_again(tmp_path: Path) -> None:
    gltf = moving()
    before = posed(gltf, tmp_path, "move", 1.5)
    gltf.content["nodes"][0]["scale"] = [3, 3, 3]
    after = posed(gltf, tmp_path, "move", 1.5)
    np.testing.assert_allclose(np.ptp(placed(after)[0], axis=0), 3 * np.ptp(placed(before)[0], axis=0))


def test_what_is_no_path_of_a_node_is_ignored(tmp_path: Path) -> None:
    gltf = moving()
    channels = gltf.content["animations"][0]["channels"]
    del channels[0]["target"]["node"]
    channels[1]["target"]["path"] = "pointer"
    channels[2]["target"]["path"] = "shear"
    with pytest.warns(UserWarning, match="ignored: KHR_animation_pointer, shear of animations$"):
        model = posed(gltf, tmp_path, "move", 2.5)
    np.testing.assert_allclose(placed(model)[0], np.array(TRIANGLE) + 7)


NAN, EMPTY = np.nan, np.zeros((0, 3))
MISTAKES: dict[str, tuple[Any, str]] = {
    "no object": (lambda a, g: g.content.update(animations=[7]), "animations[0]: must be an object, got 7"),
    "no sampler": (
        lambda a, g: a["channels"][0].update(sampler=9),
        "channels[0].sampler: there is no number 9, only 4",
    ),
    "no samplers": (lambda a, g: a.pop("samplers"), "animations[0]: samplers: is missing"),
    "no node": (
        lambda a, g: a["channels"][0]["target"].update(node=3),
        "channels[0].target.node: there is no number 3, only 3 of them",
    ),
    "no accessor": (lambda a, g: a["samplers"][0].update(input=99), "samplers[0].input: there is no number 99"),
    "no interpolation": (
        lambda a, g: a["samplers"][0].update(interpolation="CUBIC"),
        "samplers[0].interpolation: must be 'LINEAR', 'STEP' or 'CUBICSPLINE', got \"CUBIC\"",
    ),
    "long accessor": (
        lambda a, g: g.content["accessors"][a["samplers"][0]["output"]].update(count=5000),
        "5000 elements end behind the buffer view",
    ),
    "type of times": (
        lambda a, g: a["samplers"][0].update(input=a["samplers"][0]["output"]),
        "animations[0].samplers[0].input: must be an accessor of type SCALAR, not VEC3",
    ),
    "type of values": (
        lambda a, g: a["samplers"][0].update(output=a["samplers"][1]["output"]),
        "animations[0].samplers[0].output: must be an accessor of type VEC3, not VEC4",
    ),
    "whole times": (
        lambda a, g: a["samplers"][0].update(input=g.array([0, 1], "<u2")),
        "samplers[0].input: must be floats, or integers that are normalized",
    ),
    "times that do not grow": (
        lambda a, g: a["samplers"][0].update(input=g.array([1, 1])),
        "samplers[0].input: each time must be greater than the one before",
    ),
    "times that are none": (
        lambda a, g: a["samplers"][0].update(input=g.array([0, NAN])),
        "samplers[0].input: has a number that is not finite",
    ),
    "infinite values": (
        lambda a, g: a["samplers"][0].update(output=g.array([[0, 0, 0], [0, np.inf, 0]])),
        "samplers[0].output: has a number that is not finite",
    ),
    "no keys": (
        lambda a, g: a["samplers"][0].update(input=g.array(EMPTY[:, :1]), output=g.array(EMPTY)),
        "samplers[0].input: must have 1 keys at least, not 0",
    ),
    "one key of a cubic": (
        lambda a, g: a["samplers"][2].update(interpolation="CUBICSPLINE"),
        "samplers[2].input: must have 2 keys at least, not 1",
    ),
    "fewer values than keys": (
        lambda a, g: a["samplers"][0].update(output=g.array([[0, 0, 0]])),
        "samplers[0].output: must have 2 elements for 2 keys, not 1",
    ),
    "a cubic without tangents": (
        lambda a, g: a["samplers"][0].update(interpolation="CUBICSPLINE"),
        "samplers[0].output: must have 6 elements for 2 keys, not 2",
    ),
    "no rotation": (
        lambda a, g: a["samplers"][1].update(output=g.array([[0, 0, 0, 1], [0, 0, 0, 0]])),
        "samplers[1].output: has a quaternion of length 0",
    ),
    "a matrix": (
        lambda a, g: g.content["nodes"][0].update(matrix=np.eye(4).ravel().tolist()),
        "channels[0].target: its node has a matrix, which cannot be animated",
    ),
    "the same twice": (
        lambda a, g: a["channels"][3]["target"].update(node=0),
        "channels[3].target: another channel has it, too",
    ),
    "no targets": (
        lambda a, g: a["channels"][0]["target"].update(path="weights"),
        "animations[0].channels[0].target: its node has no morph targets",
    ),
    "overflow": (
        lambda a, g: a["samplers"][0].update(
            output=g.array([[3e38] * 3] * 6), interpolation="CUBICSPLINE", input=g.array([0, 9])
        ),
        "nodes[0]: its world matrix overflows",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(tmp_path: Path, name: str) -> None:
    change, message = MISTAKES[name]
    gltf = moving()
    change(gltf.content["animations"][0], gltf)
    with pytest.raises(SceneError) as caught:
        posed(gltf, tmp_path, "0", 1.5)
    text = str(caught.value)
    assert text.startswith(f"{tmp_path / 'x.gltf'}: ")
    assert message in text
