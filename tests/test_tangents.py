# SPDX-License-Identifier: MIT
"""Tangents from texture coordinates: along u, the bitangent up the image, smooth, split where the image is mirrored."""

import numpy as np

from fragtracer.scene import Geometry
from fragtracer.scene.tangents import with_tangents

QUAD = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
FACES = [(0, 1, 2), (0, 2, 3)]
UPRIGHT = [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)]  # v runs downwards


def test_an_upright_image() -> None:
    made = with_tangents(Geometry(QUAD, FACES, uvs=UPRIGHT))
    np.testing.assert_allclose(made.tangents, [(1, 0, 0, 1)] * 4, atol=1e-7)
    assert np.array_equal(made.positions[made.triangles], np.array(QUAD)[np.array(FACES)])


def test_a_mirrored_image_turns_the_bitangent_over() -> None:
    mirrored = [(1 - u, v) for u, v in UPRIGHT]
    made = with_tangents(Geometry(QUAD, FACES, uvs=mirrored))
    np.testing.assert_allclose(made.tangents, [(-1, 0, 0, -1)] * 4, atol=1e-7)


def test_any_affine_image() -> None:
    """P = p0 + u a + v b: the tangent is along a, the bitangent -b's side."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b, p0 = rng.normal(size=(3, 3))
        uv = rng.random((3, 2))
        made = with_tangents(Geometry(p0 + uv @ np.stack([a, b]), [(0, 1, 2)], uvs=uv))
        corners = made.positions[made.triangles[0]]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        tangent, sign = made.tangents[0, :3], made.tangents[0, 3]
        np.testing.assert_allclose(tangent, a / np.linalg.norm(a), atol=1e-5)
        assert np.dot(sign * np.cross(normal, tangent), -b) > 0


def test_a_cylinder_has_tangents_around_it() -> None:
    angle = np.linspace(0, 2 * np.pi, 33)
    ring = np.stack([np.cos(angle), np.zeros(33), -np.sin(angle)], axis=1)
    positions = np.concatenate([ring, np.add(ring, (0, 1, 0))])
    uvs = np.concatenate([np.stack([angle, np.full(33, v)], axis=1) for v in (1.0, 0.0)])
    first = np.arange(32)
    triangles = np.concatenate(
        [np.stack([first, first + 1, first + 34], axis=1), np.stack([first, first + 34, first + 33], axis=1)]
    )
    normals = np.concatenate([ring, ring])
    made = with_tangents(Geometry(positions, triangles, normals, uvs))
    x, _, z = made.positions.T
    around = np.stack([z, 0 * x, -x], axis=1)
    np.testing.assert_allclose(made.tangents[:, :3], around, atol=1e-6)
    assert (made.tangents[:, 3] == 1).all()


def test_vertices_are_split_where_the_image_is_mirrored() -> None:
    """Two halves of a quad that share an edge, the image of one mirrored."""
    positions = [(-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]
    uvs = [(1.0, 1.0), (0.0, 1.0), (0.0, 0.0), (1.0, 1.0)]
    colors = np.arange(12.0).reshape(4, 3)
    made = with_tangents(Geometry(positions, [(0, 1, 2), (1, 3, 2)], uvs=uvs, colors=colors))
    assert len(made.positions) == 6
    left, right = made.tangents[made.triangles]
    np.testing.assert_allclose(left, [(-1, 0, 0, -1)] * 3, atol=1e-7)
    np.testing.assert_allclose(right, [(1, 0, 0, 1)] * 3, atol=1e-7)
    assert np.array_equal(made.colors[made.triangles[1]], colors[[1, 3, 2]])


def test_what_has_tangents_or_no_coordinates_stays() -> None:
    plain = Geometry(QUAD, FACES)
    given = Geometry(QUAD, FACES, uvs=UPRIGHT, tangents=[(0, 1, 0, 1)] * 4)
    second = Geometry(QUAD, FACES, uvs_1=UPRIGHT)
    assert with_tangents(plain) is plain
    assert with_tangents(given) is given
    assert with_tangents(second) is second
    assert with_tangents(second, 1).tangents is not None


def test_coordinates_without_area_give_no_tangent() -> None:
    made = with_tangents(Geometry(QUAD, FACES, uvs=[(0.5, 0.5)] * 4))
    assert np.array_equal(made.tangents[:, :3], np.zeros((4, 3)))
