# SPDX-License-Identifier: MIT
"""The bundled field of spheres is what scripts/make_sphere_field.py makes, and has what a field promises."""

import importlib
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from fragtracer.io.toml import dump, load
from fragtracer.resources import folder

SCRIPT = Path(__file__).parents[1] / "scripts" / "make_sphere_field.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(SCRIPT.parent)
        return importlib.import_module(SCRIPT.stem)


def test_it_is_what_the_script_makes(script: ModuleType) -> None:
    text = (folder("scenes") / "sphere-field.toml").read_bytes().decode()
    assert dump(script.sphere_field(script.SPHERES)) == text
    assert script.SPHERES == 480


@pytest.mark.parametrize("count", [3, 100, 250, 480, 1000])
def test_spheres_stand_apart_with_a_material_each(script: ModuleType, count: int) -> None:
    scene = script.sphere_field(count)
    assert len(scene.spheres) == count
    assert len({sphere.material for sphere in scene.spheres}) == count
    assert len(set(scene.materials.values())) == len(scene.materials) == count + 1
    centers = np.array([sphere.center for sphere in scene.spheres])
    radii = np.array([sphere.radius for sphere in scene.spheres])
    distances = np.linalg.norm(centers[:, None] - centers, axis=2) - radii[:, None] - radii
    np.fill_diagonal(distances, 1)
    assert distances.min() > 0
    np.testing.assert_array_equal(centers[:, 1], radii)


def test_kinds_of_material(script: ModuleType) -> None:
    materials = script.sphere_field(480).materials.values()
    metals = [item for item in materials if item.metallic == 1]
    plastics = [item for item in materials if item.metallic == 0 and item.specular == 1]
    assert min(len(metals), len(plastics)) > 80
    for group in (metals, plastics):
        assert np.ptp([item.roughness for item in group]) > 0.3


def test_command_line(tmp_path: Path) -> None:
    file = tmp_path / "field.toml"
    subprocess.run([sys.executable, str(SCRIPT), "--spheres", "1000", str(file)], check=True)
    assert len(load(file).spheres) == 1000


def test_weekend_is_what_its_script_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPT.parent)
    text = (folder("scenes") / "weekend.toml").read_bytes().decode()
    assert dump(importlib.import_module("make_weekend").weekend()) == text
