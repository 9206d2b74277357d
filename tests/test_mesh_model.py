# SPDX-License-Identifier: MIT
"""Meshes and images from arrays: what fits is kept, what does not is one clear error."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from fragtracer import Density, Geometry, Image, Material, Panorama, Part, RenderSettings

POSITIONS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
WHOLE = "triangles must hold whole numbers from 0 to 2, the last of the vertices"


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"triangles": [[0.0, 1, 2]]}, WHOLE),
        ({"triangles": [[0, 1, 3]]}, WHOLE),
        ({"triangles": [[0, 1, -1]]}, WHOLE),
        ({"triangles": np.array([[0, 1, 2**63]], np.uint64)}, WHOLE),
        ({"triangles": [[True, False, True]]}, "triangles must hold numbers, got bool"),
        ({"triangles": [[0, 1, 2, 0]]}, r"triangles must be an array of \(n, 3\), got \(1, 4\)"),
        ({"triangles": [0, 1, 2]}, r"triangles must be an array of \(n, 3\), got \(3,\)"),
        ({"triangles": [[0, 1, 2], [0]]}, r"triangles must be an array of \(n, 3\), its rows all of a length"),
        ({"triangles": None}, r"triangles must be an array of \(n, 3\), got \(\)"),
        ({"positions": np.zeros((3, 5))}, r"positions must be an array of \(n, 3\), got \(3, 5\)"),
        ({"positions": [[0, 0, 0], [1, 0]]}, r"positions must be an array of \(n, 3\), its rows all of a length"),
        ({"positions": {}}, r"positions must be an array of \(n, 3\), got \(\)"),
        ({"positions": [["a", "b", "c"]]}, "positions must hold numbers, got <U1"),
        ({"positions": np.array([[None] * 3] * 3)}, "positions must hold numbers, got object"),
        ({"positions": np.zeros((3, 3), complex)}, "positions must hold numbers, got complex128"),
        ({"positions": [*POSITIONS[:2], [0, np.nan, 0]]}, "positions must be finite, and none beyond"),
        ({"positions": [*POSITIONS[:2], [0, 1e39, 0]]}, "positions must be finite, and none beyond"),
        ({"normals": [[0, 0, 1]]}, "normals must have a row for each of the 3 vertices, got 1"),
        ({"normals": [[0, 0, 1e39]] * 3}, "normals must be finite"),
        ({"uvs": [[0, 0, 0]] * 3}, r"uvs must be an array of \(n, 2\), got \(3, 3\)"),
        ({"tangents": [[0, 0, 1]] * 3}, r"tangents must be an array of \(n, 4\), got \(3, 3\)"),
        ({"colors": [[1, 1]] * 3}, r"colors must be an array of \(n, 3 or 4\), got \(3, 2\)"),
        ({"colors": np.full((3, 3), 255, np.uint8)}, "colors must be linear, from 0 to 1, not bytes"),
    ],
)
def test_what_does_not_fit_is_one_clear_error(arrays: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        Geometry(**{"positions": POSITIONS, "triangles": [[0, 1, 2]], **arrays})


@pytest.mark.parametrize(
    ("pixels", "more", "message"),
    [
        (np.zeros((2, 2, 5)), {}, r"\(height, width, 1 to 4\) numbers, got \(2, 2, 5\)"),
        (np.zeros((2, 2, 3), int), {}, "uint8 or float32, got int64"),
        (np.full((2, 2, 3), 1e300), {}, "must be finite, as float32"),
        (np.full((2, 2, 3), np.nan, np.float32), {}, "must be finite"),
        (np.zeros((2, 2, 3)), {"color_space": "sRGB"}, "color_space must be one of srgb, linear, got 'sRGB'"),
    ],
)
def test_pixels_that_are_no_texture(pixels: Any, more: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Image(pixels, **more)


def test_the_arrays_of_the_caller_stay_his() -> None:
    positions, triangles, pixels = (
        np.array(POSITIONS, float),
        np.array([[0, 1, 2]], np.int32),
        np.zeros((2, 2, 3), "u1"),
    )
    geometry, image = Geometry(positions, triangles), Image(pixels)
    positions[0], triangles[0], pixels[0] = 7, 0, 255
    assert geometry == Geometry(POSITIONS, [[0, 1, 2]])
    assert image == Image(np.zeros((2, 2, 3), np.uint8))
    assert not geometry.positions.flags.writeable
    assert not image.pixels.any()


@pytest.mark.parametrize(
    "content",
    [
        Geometry(POSITIONS, [[0, 1, 2]], normals=POSITIONS),
        Image(np.zeros((2, 2, 3), np.uint8)),
        Density(np.ones((2, 2, 2))),
        Panorama(np.ones((2, 4, 3))),
    ],
    ids=lambda content: type(content).__name__,
)
def test_copies_of_arrays_are_as_read_only(content: Any) -> None:
    """In another process, too: what they are known by was computed once."""
    for copied in (pickle.loads(pickle.dumps(content)), copy.copy(content), copy.deepcopy(content)):
        assert copied == content
        arrays = [value for value in vars(copied).values() if isinstance(value, np.ndarray)]
        assert arrays
        assert not any(array.flags.writeable for array in arrays)


@pytest.mark.parametrize("matrix", [np.diag([2, 3, 4, 1]), np.diag([2.0, 3, 4, 1]).tolist()])
def test_the_matrix_of_a_part_may_be_an_array(matrix: Any) -> None:
    part = Part(Geometry(POSITIONS, [[0, 1, 2]]), "m", matrix)
    np.testing.assert_array_equal(part.matrix, np.diag([2, 3, 4, 1]))
    for wrong in (np.eye(3), np.array(1.0)):
        with pytest.raises(ValueError, match="matrix"):
            Part(part.geometry, "m", matrix=wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"the last row of matrix must be 0 0 0 1, got \(0\.0, 0\.0, 0\.0, 2\.0\)"):
        Part(part.geometry, "m", matrix=2 * np.eye(4))  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers() -> None:
    assert Material(albedo=np.array(0.3)) == Material(albedo=0.3)  # type: ignore[arg-type]
    assert RenderSettings(bounces=np.int64(2), spp=np.array(3)) == RenderSettings(bounces=2, spp=3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="bounces"):
        RenderSettings(bounces=np.float64(2))  # type: ignore[arg-type]


def test_a_path_is_no_texture() -> None:
    with pytest.raises(ValueError, match="albedo_texture"):
        Material(albedo_texture="a.png")  # type: ignore[arg-type]
