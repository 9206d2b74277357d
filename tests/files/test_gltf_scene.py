# SPDX-License-Identifier: MIT
"""Scenes of glTF files: nodes, cameras and lights, and what is not shown."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fragtracer.io.toml import load, save

from .data import Gltf


def test_nodes_multiply_from_the_root(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    gltf = Gltf(
        nodes=[
            {"children": [1, 2], "translation": [10, 0, 0]},
            {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 5, 6, 7, 1]},
            {"mesh": 0},
        ],
        scenes=[{"nodes": [3]}, {"nodes": [0]}],
        scene=1,
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: scenes but one$"):
        model = gltf.read(tmp_path)
    assert model.mesh.parts[0].geometry is model.mesh.parts[1].geometry
    points = [
        part.geometry.positions @ np.array(part.matrix)[:3, :3].T + np.array(part.matrix)[:3, 3]
        for part in model.mesh.parts
    ]
    np.testing.assert_allclose(points[0], [[10, 0, 0], [10, 2, 0], [7, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(points[1], [[15, 6, 7], [16, 6, 7], [15, 6, 6]], atol=1e-12)


HALF = np.sqrt(0.5)


def with_lights(lights: list[dict[str, Any]], nodes: list[dict[str, Any]]) -> Gltf:
    """A triangle, and ``lights``, each at the node of its number."""
    links = [{"extensions": {"KHR_lights_punctual": {"light": index}}} for index in range(len(lights))]
    gltf = Gltf(
        extensionsUsed=["KHR_lights_punctual"],
        extensions={"KHR_lights_punctual": {"lights": lights}},
        nodes=[{"mesh": 0}, *(node | link for node, link in zip(nodes, links, strict=True))],
    )
    gltf.content["scenes"] = [{"nodes": list(range(len(nodes) + 1))}]
    gltf.triangle()
    return gltf


def test_cameras(tmp_path: Path) -> None:
    gltf = Gltf(
        cameras=[
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 1, "znear": 0}},
            {"type": "perspective", "perspective": {"yfov": np.pi / 4, "znear": 0.1}},
        ],
        nodes=[
            {"mesh": 0},
            {"camera": 0},
            {"camera": 1, "translation": [7, 0, 0], "rotation": [0, HALF, 0, HALF], "scale": [3, 3, 3]},
        ],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: orthographic cameras$"):
        model = gltf.read(tmp_path)
    [camera] = model.cameras
    assert camera.fov_degrees == pytest.approx(45)
    np.testing.assert_allclose(camera.position, [7, 0, 0])
    np.testing.assert_allclose(camera.target, [0.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(camera.up, [0, 3, 0], atol=1e-12)


@pytest.mark.parametrize("scale", [[1, 1, 1], [3, 3, 3], [1e-30, 2e-30, 3e-30], [1e30, 1, 5]])
def test_lights(tmp_path: Path, scale: list[float]) -> None:
    """The intensity of a spot light is on its axis; scale changes neither that nor the cone."""
    spot = {"innerConeAngle": np.pi / 12, "outerConeAngle": np.pi / 3}
    model = with_lights(
        [
            {"type": "point", "intensity": 3, "color": [1, 0.5, 0]},
            {"type": "directional", "intensity": 2, "color": [0.5, 1, 2]},
            {"type": "spot", "intensity": 5, "color": [1, 0, 0.5], "spot": spot},
            {"type": "spot"},
        ],
        [
            {"translation": [1, 2, 3], "scale": scale},
            {"translation": [9, 9, 9], "rotation": [-HALF, 0, 0, HALF], "scale": scale},
            {"translation": [4, 5, 6], "rotation": [0, HALF, 0, HALF], "scale": scale},
            {"scale": scale},
        ],
    ).read(tmp_path)
    [point], [sun], [turned, default] = model.lights, model.directional_lights, model.spot_lights
    assert (point.position, point.radius) == ((1, 2, 3), 0)
    np.testing.assert_allclose(point.intensity, [3, 1.5, 0])
    np.testing.assert_allclose(sun.direction, [0, -1, 0], atol=1e-12)
    assert sun.irradiance == (1, 2, 4)
    assert (turned.position, turned.intensity) == ((4, 5, 6), (5, 0, 2.5))
    np.testing.assert_allclose(turned.direction, [-1, 0, 0], atol=1e-12)
    assert (turned.inner_degrees, turned.outer_degrees) == pytest.approx((15, 60))
    assert (default.position, default.direction, default.intensity) == ((0, 0, 0), (0, 0, -1), (1, 1, 1))
    assert (default.inner_degrees, default.outer_degrees) == pytest.approx((0, 45))


def test_lights_below_scaled_nodes(tmp_path: Path) -> None:
    gltf = with_lights([{"type": "spot"}], [{"translation": [1, 0, 0]}])
    gltf.content["nodes"].append({"children": [1], "rotation": [0, HALF, 0, HALF], "scale": [2, 2, 2]})
    gltf.content["scenes"] = [{"nodes": [0, 2]}]
    [spot] = gltf.read(tmp_path).spot_lights
    np.testing.assert_allclose(spot.position, [0, 0, -2], atol=1e-12)
    np.testing.assert_allclose(spot.direction, [-1, 0, 0], atol=1e-12)
    assert spot.intensity == (1, 1, 1)


@pytest.mark.parametrize(
    ("cone", "degrees"),
    [
        ({"innerConeAngle": 0.5, "outerConeAngle": 0.5}, (28.619, 28.648)),
        ({"innerConeAngle": 1.0, "outerConeAngle": 0.5}, (28.619, 28.648)),
        ({"outerConeAngle": 1.5707964}, (0, 90)),
        ({"outerConeAngle": 1e-5}, (0, 0.001)),
    ],
)
def test_cones_at_their_limits(tmp_path: Path, cone: dict[str, float], degrees: tuple[float, float]) -> None:
    """Exporters write a hard edge as two equal angles, and π/2 rounded up; of others, none is too narrow."""
    [spot] = with_lights([{"type": "spot", "spot": cone}], [{}]).read(tmp_path).spot_lights
    assert (spot.inner_degrees, spot.outer_degrees) == pytest.approx(degrees, rel=1e-4)


def test_what_of_lights_is_ignored(tmp_path: Path) -> None:
    gltf = with_lights(
        [{"type": "point", "range": 10}, {"type": "spot", "range": 10}, {"type": "directional"}],
        [{}, {}, {"scale": [1, 1, 0]}],
    )
    with pytest.warns(UserWarning, match="ignored") as caught:
        model = gltf.read(tmp_path)
    [warning] = caught
    assert str(warning.message).endswith(
        "ignored: the range of lights, the light of nodes[3] (its scale of 0 leaves it no direction)"
    )
    assert (len(model.lights), len(model.spot_lights), len(model.directional_lights)) == (1, 1, 0)


@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_a_model_with_a_light_gets_no_others(tmp_path: Path, kind: str) -> None:
    scene = load(with_lights([{"type": kind}], [{}]).write(tmp_path / "x.gltf"))
    assert [len(scene.lights), len(scene.spot_lights), len(scene.directional_lights)] == [
        int(kind == other) for other in ("point", "spot", "directional")
    ]
    assert not any(scene.ambient.radiance)
    save(scene, tmp_path / "x.toml")
    assert load(tmp_path / "x.toml") == scene


@pytest.mark.parametrize(
    ("aspect", "size"),
    [(None, (640, 480)), (1, (480, 480)), (16 / 9, (640, 360)), (0.5, (240, 480)), (1e30, (640, 1)), (1e-30, (1, 480))],
)
def test_the_picture_has_the_shape_that_the_first_camera_gives_it(
    tmp_path: Path, aspect: float | None, size: tuple[int, int]
) -> None:
    perspectives = [{"yfov": 1.0, "znear": 0.1}, {"yfov": 1.0, "znear": 0.1, "aspectRatio": 3}]
    if aspect is not None:
        perspectives[0]["aspectRatio"] = aspect
    gltf = Gltf(
        cameras=[{"type": "perspective", "perspective": item} for item in perspectives],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}, {"camera": 1, "translation": [0, 0, 5]}],
        scenes=[{"nodes": [0, 1, 2]}],
    )
    gltf.triangle()
    with pytest.warns(UserWarning, match="ignored: cameras after the first$"):
        scene = load(gltf.write(tmp_path / "x.glb"))
    assert scene.camera.position == (0, 0, 3)
    assert (scene.render.width, scene.render.height) == size


def test_what_is_not_shown_is_listed(tmp_path: Path) -> None:
    gltf = Gltf(
        extensionsUsed=["KHR_materials_unlit", "KHR_materials_variants", "KHR_xmp_json_ld"],
        animations=[{}],
        nodes=[{"mesh": 0}],
        scenes=[{"nodes": [0]}, {"nodes": []}],
        images=[{"uri": "none.png"}],
        textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )
    weights = gltf.array([[1, 0, 0, 0]] * 3)
    gltf.triangle(material=0, targets=[{"COLOR_1": weights}], attributes={"COLOR_1": weights, "_ID": weights})
    gltf.content["meshes"][0]["weights"] = [1]
    gltf.content["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 1})
    with pytest.warns(UserWarning, match="ignored") as caught:
        model = gltf.read(tmp_path)
    assert len(caught) == 1
    assert str(caught[0].message).endswith(
        "x.gltf: ignored: KHR_materials_variants, KHR_xmp_json_ld, animations (none is chosen), scenes but one, "
        "COLOR_1, _ID, COLOR_1 of morph targets, "
        "images[0]: none.png: no such file, points and lines"
    )
    assert model.materials["material 0"].albedo_texture is None
