# SPDX-License-Identifier: MIT
"""Which meshes are closed, and that to know it keeps none of them."""

import gc
import weakref

import numpy as np
import pytest

from fragtracer import Geometry, Image
from fragtracer.packing.atlas import mean_color
from fragtracer.packing.interiors import is_closed

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.mark.parametrize(
    ("positions", "triangles", "expected"),
    [
        (CORNERS, FACES, True),
        (CORNERS, FACES[:, ::-1], True),
        (CORNERS, FACES[1:], False),
        (CORNERS, [*FACES[:3], FACES[3, ::-1]], False),
        (CORNERS, [*FACES, *FACES], True),
        (CORNERS, [*FACES, FACES[0]], False),
        (CORNERS, [*FACES, (2, 2, 3), (1, 1, 1)], True),
        (CORNERS[FACES].reshape(-1, 3), np.arange(12).reshape(4, 3), True),
        (np.where(CORNERS[FACES] == 0, [[[-0.0]], [[0.0]]] * 2, 1).reshape(-1, 3), np.arange(12).reshape(4, 3), True),
        (np.zeros((0, 3)), np.zeros((0, 3), int), True),
    ],
    ids=["", "inwards", "a gap", "a face turned", "twice", "a face twice", "no area", "apart", "minus zero", "nothing"],
)
def test_closed_meshes(positions, triangles, expected):
    assert is_closed(Geometry(positions, triangles)) is expected


def test_what_was_asked_once_is_not_kept():
    geometry, image = Geometry(CORNERS, FACES), Image(np.full((1, 1, 3), 255, np.uint8))
    assert is_closed(geometry)
    assert mean_color(image) == (1.0, 1.0, 1.0)
    kept = weakref.ref(geometry), weakref.ref(image)
    del geometry, image
    gc.collect()
    assert [one() for one in kept] == [None, None]
