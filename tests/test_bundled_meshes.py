# SPDX-License-Identifier: MIT
"""The bundled meshes are what scripts/make_scene_meshes.py makes, small, and face outwards."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fragtracer.io import read_model
from fragtracer.resources import folder

SCRIPTS = Path(__file__).parents[1] / "scripts"
BUNDLED = folder("scenes") / "meshes"


@pytest.fixture(scope="module")
def makers():
    pytest.importorskip("scipy", reason="scipy is not installed: the meshes cannot be made again")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(SCRIPTS)
        makers = importlib.import_module("make_scene_meshes").MAKERS
    return {make.__name__.replace("_", "-"): make for make in makers}


def test_they_are_what_the_script_makes(makers):
    assert {path.stem for path in BUNDLED.glob("*.glb")} == set(makers)
    for name, make in makers.items():
        (part,) = read_model(BUNDLED / f"{name}.glb").mesh.parts
        read, (*arrays, triangles) = part.geometry, make()
        for values, made, tolerance in zip(
            (read.positions, read.normals, read.uvs), arrays, (1e-6, 1e-3, 1e-6), strict=True
        ):
            np.testing.assert_allclose(values[read.triangles], made[triangles], atol=tolerance, err_msg=name)


def test_they_are_small():
    assert sum(path.stat().st_size for path in BUNDLED.glob("*.glb")) < 2_500_000


def test_normals_and_triangles_agree_on_the_front(makers):
    for name in makers:
        geometry = read_model(BUNDLED / f"{name}.glb").mesh.parts[0].geometry
        a, b, c = geometry.positions[geometry.triangles].swapaxes(0, 1)
        faces = np.cross(b - a, c - a)
        normals = geometry.normals[geometry.triangles].sum(axis=1)
        assert ((faces * normals).sum(axis=1) > 0).mean() > 0.995, name


def test_bodies_have_their_front_outside():
    """The volume of each connected body is positive by the divergence theorem; sheets face +y or +z."""
    sheets = {"height-field": 1, "cloth": 1, "leaf": 1, "sheet": 2}  # name: axis of the front
    for path in BUNDLED.glob("*.glb"):
        geometry = read_model(path).mesh.parts[0].geometry
        corners = np.float64(geometry.positions)[geometry.triangles]
        a, b, c = corners.swapaxes(0, 1)
        if path.stem in sheets:
            assert np.cross(b - a, c - a).sum(axis=0)[sheets[path.stem]] > 0, path.stem
            continue
        _, places = np.unique(corners.reshape(-1, 3).round(6), axis=0, return_inverse=True)
        edges = places.reshape(-1, 3)[:, [0, 1, 1, 2]].reshape(-1, 2).T
        _, bodies = connected_components(coo_array((np.ones(edges.shape[1]), edges)), directed=False)
        volumes = np.bincount(bodies[places[::3]], (a * np.cross(b, c)).sum(axis=1) / 6)
        assert (volumes > 0).all(), (path.stem, volumes)
