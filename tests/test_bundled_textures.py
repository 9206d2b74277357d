# SPDX-License-Identifier: MIT
"""The bundled textures are what scripts/textures.py makes, and small."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from fragtracer.io.textures import read_texture
from fragtracer.resources import folder

SCRIPT = Path(__file__).parents[1] / "scripts" / "textures.py"
BUNDLED = folder("scenes") / "textures"


@pytest.fixture(scope="module")
def made() -> dict[str, np.ndarray]:
    spec = importlib.util.spec_from_file_location("textures_script", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.textures()


def test_they_are_what_the_script_makes(made: dict[str, np.ndarray]) -> None:
    assert {path.stem for path in BUNDLED.glob("*.png")} == set(made)
    for name, pixels in made.items():
        bundled = read_texture(BUNDLED / f"{name}.png").pixels.astype(int)
        difference = np.abs(bundled.reshape(pixels.shape) - pixels)
        assert difference.max() <= 1, name  # a processor may round another way


def test_they_are_small() -> None:
    assert sum(path.stat().st_size for path in BUNDLED.iterdir()) < 1_000_000


def test_normals_are_unit_and_point_out(made: dict[str, np.ndarray]) -> None:
    for name in (name for name in made if name.endswith("_normal")):
        normals = made[name] / 127.5 - 1
        assert np.abs(np.linalg.norm(normals, axis=2) - 1).max() < 0.02
        assert normals[..., 2].min() > 0


def test_all_but_the_leaf_repeat_without_a_seam(made: dict[str, np.ndarray]) -> None:
    """The step from the last row or column to the first is like the largest within, as between boards of the wood."""
    for name in made.keys() - {"leaf"}:
        pixels = made[name].astype(float).reshape(*made[name].shape[:2], -1)
        for axis in (0, 1):
            steps = np.abs(pixels - np.roll(pixels, 1, axis)).mean(axis=(1 - axis, 2))
            assert steps[0] <= 2 * steps[1:].max() + 0.5, (name, axis)
