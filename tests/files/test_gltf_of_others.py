# SPDX-License-Identifier: MIT
"""glTF files of others, where there are any."""

import numpy as np
import pytest

from fragtracer.io import bounds, read_model

from .data import shared

BOX = (12, (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
REAL = {
    "Box/glTF-Binary/Box.glb": BOX,
    "Box/glTF-Embedded/Box.gltf": BOX,
    "Box/glTF/Box.gltf": BOX,
    "BoxTextured/glTF-Binary/BoxTextured.glb": BOX,
    "BoxTextured/glTF-Embedded/BoxTextured.gltf": BOX,
    "BoxTextured/glTF-pbrSpecularGlossiness/BoxTextured.gltf": BOX,
    "BoxTextured/glTF/BoxTextured.gltf": BOX,
    "Cameras/glTF-Embedded/Cameras.gltf": (2, (0, 0, -0.70759), (1, 0.706623, 0)),
    "Cameras/glTF/Cameras.gltf": (2, (0, 0, -0.70759), (1, 0.706623, 0)),
    "SimpleMeshes/glTF-Embedded/SimpleMeshes.gltf": (2, (0, 0, 0), (2, 1, 0)),
    "SimpleMeshes/glTF/SimpleMeshes.gltf": (2, (0, 0, 0), (2, 1, 0)),
    "TextureCoordinateTest/glTF-Embedded/TextureCoordinateTest.gltf": (10, (-1.2, -1.2, 0), (1.2, 1.2, 0.052591)),
    "TextureCoordinateTest/glTF/TextureCoordinateTest.gltf": (10, (-1.2, -1.2, 0), (1.2, 1.2, 0.052591)),
    "Triangle/glTF-Embedded/Triangle.gltf": (1, (0, 0, 0), (1, 1, 0)),
    "Triangle/glTF/Triangle.gltf": (1, (0, 0, 0), (1, 1, 0)),
}


@pytest.mark.filterwarnings("ignore:.*ignored:UserWarning")
@pytest.mark.parametrize("name", REAL)
def test_real_files(name: str) -> None:
    triangles, low, high = REAL[name]
    model = read_model(shared("gltf", name))
    assert sum(len(part.geometry.triangles) for part in model.mesh.parts) == triangles
    np.testing.assert_allclose(bounds(model.mesh), [low, high], atol=1e-5)
    if name.startswith("BoxTextured"):
        texture = model.materials["Texture"].albedo_texture
        assert texture is not None
        assert texture.image.pixels.shape[:2] == (256, 256)
    if name.startswith("Box/"):
        assert model.materials["Red"].albedo == pytest.approx((0.8, 0, 0))
        assert model.materials["Red"].metallic == 0
    if name.startswith("Cameras"):
        assert model.ignored == ("orthographic cameras",)
        [camera] = model.cameras
        np.testing.assert_allclose(camera.position, [0.5, 0.5, 3])
        assert camera.fov_degrees == pytest.approx(np.degrees(0.7))
    else:
        assert model.cameras == ()


def test_texture_coordinate_test_is_laid_out_as_its_readme_says() -> None:
    model = read_model(shared("gltf", "TextureCoordinateTest/glTF/TextureCoordinateTest.gltf"))
    corner = {"TopLeft": (0, 0), "TopRight": (1, 0), "BottomLeft": (0, 1), "BottomRight": (1, 1)}
    for part in model.mesh.parts:
        name = part.material.removesuffix("Material")
        if name in corner:
            points = part.geometry.positions @ np.array(part.matrix)[:3, :3].T + np.array(part.matrix)[:3, 3]
            center = points.mean(axis=0)
            # Its front is -z, so its right is -x.
            assert (int(center[0] < 0), int(center[1] < 0)) == corner[name]
            assert part.geometry.uvs is not None
            np.testing.assert_allclose(np.round(part.geometry.uvs.mean(axis=0)), corner[name])
