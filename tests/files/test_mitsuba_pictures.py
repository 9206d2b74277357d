# SPDX-License-Identifier: MIT
"""Pictures of Mitsuba's scene files, against Mitsuba's own and those of the scenes that they were."""

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from command import status_of
from fast_mitsuba import need_fast_mitsuba
from rendering import rendered

from fragtracer.apps.compare import compare_scene, run
from fragtracer.errors import FragtracerError
from fragtracer.io.toml import load, save
from fragtracer.reference.export import export_mitsuba
from fragtracer.reference.render import ReferenceRenderer
from fragtracer.scene import SHAPES

from .mitsuba_files import PATHS, SENSOR, quietly, scene_file, written

pytest.importorskip("mitsuba", reason="Mitsuba is not installed")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["surfaces", "shapes"])
def test_pictures_are_those_of_mitsuba(tmp_path: Path, name: str) -> None:
    """Of the file itself."""
    need_fast_mitsuba()
    path = scene_file(tmp_path, name)
    comparison = compare_scene(quietly(path), (48, 36), 512, margin=0.02, file=path)
    verdict = comparison.verdict
    assert verdict.outcome == "agreement", (verdict.outcome, verdict.differing, verdict.image.pair.relative_difference)


def test_a_hidden_environment_is_hidden_in_the_file_too(tmp_path: Path) -> None:
    """Where Mitsuba renders it for us."""
    hidden = '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>'
    seen = []
    for head in (hidden + SENSOR, PATHS + SENSOR):
        path = written(tmp_path, '<emitter type="constant"/>', head)
        with ReferenceRenderer(load(path), (4, 4), "scalar_rgb", file=path) as renderer:
            seen.append(renderer.sample(1, 0))
    assert not seen[0].any()
    assert (seen[1] > 0).all()


@pytest.mark.parametrize("name", ["surfaces", "shapes"])
def test_saved_as_a_scene_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The same scene comes back."""
    monkeypatch.chdir(tmp_path)
    scene = quietly(scene_file(tmp_path, name))
    save(scene, "saved.toml")
    again = load("saved.toml")
    for field in ("camera", "render", "materials", "media", "environment", "lights", "directional_lights", *SHAPES):
        assert getattr(again, field) == getattr(scene, field), field
    parts = ([part for mesh in one.meshes for part in mesh.parts] for one in (scene, again))
    assert len({tuple(part.geometry.digest for part in found) for found in parts}) == 1


def test_the_command_compares_with_the_file_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, asked = written(tmp_path, '<emitter type="constant"/><shape type="sphere"/>'), []

    def compared(*_: Any, **keywords: Any) -> None:
        asked.append(keywords["file"])
        raise FragtracerError("enough")

    monkeypatch.setattr(run, "compare_scene", compared)
    assert status_of(monkeypatch, "compare", path) == 2
    assert status_of(monkeypatch, "compare", "cornell-box") == 2
    assert asked == [path, None]
    assert status_of(monkeypatch, "compare", path, "--geometry", "karis") == 2
    assert "leave --geometry and --multiple-scattering out" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["cornell-box", "glass"])
def test_a_bundled_scene_comes_back(ctx: moderngl.Context, tmp_path: Path, name: str) -> None:
    """Written for Mitsuba, with its own plugins, and read again: the same picture, by the same random numbers."""
    scene = load(name)
    export_mitsuba(scene, tmp_path)
    one, other = (rendered(ctx, each, 16, (32, 24), shared=True) for each in (scene, quietly(tmp_path / "scene.xml")))
    np.testing.assert_allclose(other.mean((0, 1)), one.mean((0, 1)), rtol=1e-4)
    assert np.median(np.abs(other - one) / one.mean()) < 1e-5
