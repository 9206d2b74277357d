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


def test_tangents_of_a_torus_are_its_derivatives() -> None:
    """Along dP/du, with the bitangent against dP/dv as v runs downwards (glTF 2.0, sections 3.7.2.1 and 3.9.3); of an
    image that runs slanting and unevenly around it, so that neither is a side of a triangle: u = a + 0.4 b and
    v = b + 0.2 sin b - 0.3 a of the angles a and b. The derivatives are those of P over a and b times the inverse of
    those of u and v."""
    errors = []
    for count in (24, 48):
        a, b = (x.ravel() for x in np.meshgrid(*[np.linspace(0, 2 * np.pi, count + 1)] * 2, indexing="ij"))
        out = np.stack([np.cos(a), np.sin(a), 0 * a], 1)
        around = np.stack([-np.sin(a), np.cos(a), 0 * a], 1)
        up = np.array([0.0, 0.0, 1.0])
        ring = 2 + np.cos(b)
        positions = ring[:, None] * out + np.sin(b)[:, None] * up
        normals = np.cos(b)[:, None] * out + np.sin(b)[:, None] * up
        by_a, by_b = ring[:, None] * around, -np.sin(b)[:, None] * out + np.cos(b)[:, None] * up
        uvs = np.stack([a + 0.4 * b, b + 0.2 * np.sin(b) - 0.3 * a], 1)
        jacobian = np.array([[1 + 0 * b, 0.4 + 0 * b], [-0.3 + 0 * b, 1 + 0.2 * np.cos(b)]]).transpose(2, 0, 1)
        along_u, along_v = np.einsum("knx,nkj->jnx", [by_a, by_b], np.linalg.inv(jacobian))
        row, column = (x.ravel() for x in np.mgrid[:count, :count])
        i = row * (count + 1) + column
        corners = [(i, i + count + 1, i + count + 2), (i, i + count + 2, i + 1)]
        faces = np.concatenate([np.stack(c, 1) for c in corners])
        made = with_tangents(Geometry(positions, faces, normals, uvs))
        np.testing.assert_allclose(made.positions, positions, atol=1e-6)
        inner = (a > 0) & (a < 6) & (b > 0) & (b < 6)  # with triangles all around
        cosine = (made.tangents[:, :3] * along_u / np.linalg.norm(along_u, axis=1, keepdims=True)).sum(1)
        errors.append(np.arccos(np.clip(cosine[inner], -1, 1)).max())
        bitangent = np.cross(normals, made.tangents[:, :3]) * made.tangents[:, 3:]
        assert ((bitangent * along_v).sum(1) < 0).all()
    assert errors[0] < 0.02
    assert errors[1] < 0.4 * errors[0]


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
