# SPDX-License-Identifier: MIT
"""What the traversal of the BVH is told of its depth."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from fragtracer.io.toml import load
from fragtracer.packing import PackedScene, instances, pack
from fragtracer.packing.records import Words
from fragtracer.packing.shapes import Kind
from fragtracer.scene import Material, Scene, Sphere


def most_waiting(packed: PackedScene) -> int:
    """Groups of records that wait on any way to a leaf, if rays enter the bounds of all children."""
    words: Words = packed.tables["u_shapes"][1].reshape(-1, 4, 4)
    first = packed.uniforms["u_bvh_root"]
    most, todo = 0, [(first, 0, False)]
    while todo:
        record, waiting, has_siblings = todo.pop()
        t0, _, t2, _ = words[record - first]
        below = waiting + has_siblings
        if (kind := t0[3] >> 24) == Kind.NODE:
            todo += [(int(t2[2]) + i, below, t2[3] > 1) for i in range(t2[3])]
        elif kind == Kind.INSTANCE:
            todo.append((int(words[record - first, 1, 3]), below, False))
        most = max(most, waiting)
    return most


def spheres(count: int) -> Scene:
    rng = np.random.default_rng(count)
    balls = tuple(Sphere(tuple(c), 0.1, "m") for c in rng.normal(size=(count, 3)).tolist())
    return Scene(materials={"m": Material(double_sided=False)}, spheres=balls)


@pytest.mark.parametrize(
    ("scene", "repeated"),
    [*product(("knot", "ring"), (0, 10**9)), *((count, 0) for count in (1, 2, 5, 70, 3000))],  # instances are of meshes
)
def test_the_stack_holds_what_waits(scene: str | int, repeated: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last group is held beside it."""
    monkeypatch.setattr(instances, "MOST_REPEATED", repeated)
    if isinstance(scene, str):
        chosen = load(scene)
        chosen = replace(chosen, meshes=(*chosen.meshes, *chosen.meshes))
    else:
        chosen = spheres(scene)
    packed = pack(chosen, chosen.render, 64, 64, 0)
    assert packed.uniforms["u_bvh_stack"] == max(0, most_waiting(packed) - 1)
