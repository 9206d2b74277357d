# SPDX-License-Identifier: MIT
"""The split-sum approximation against the truth: the errors add up, and each is what it is said to be."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from fragtracer.apps.compare import approximation
from fragtracer.apps.compare import approximation_report as report
from fragtracer.apps.compare.approximation import (
    Approximation,
    by_roughness_and_angle,
    measure_approximation,
    sphere_angles,
    stages,
)
from fragtracer.gpu.cube_maps import MapSizes
from fragtracer.scene import Camera, Geometry, Image, Light, Material, Mesh, Part, Scene, Sphere, Texture
from fragtracer.scene.environment import Environment, Gradient

GRADIENT = Environment(gradient=Gradient(zenith=(0.2, 0.5, 1.0), horizon=(1.0, 0.9, 0.7), ground=(0.2, 0.1, 0.1)))
METALS = {"rough": Material(albedo=0.9, metallic=1.0, roughness=0.8), "fine": Material(metal="gold", roughness=0.3)}
TWO = Scene(
    camera=Camera((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), fov_degrees=35.0),
    materials=METALS,
    spheres=(Sphere((-1.0, 0.0, 0.0), 0.9, "rough"), Sphere((1.0, 0.0, 0.0), 0.9, "fine")),
    environment=GRADIENT,
)


@pytest.fixture(autouse=True, scope="module")
def _coarse_maps() -> Iterator[None]:
    """Made in a quarter of the time; lookups in them have larger errors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fragtracer.gpu.tracer._MAPS", MapSizes(samples=256, irradiance=16, brdf=256))
        yield


@pytest.fixture(scope="module")
def two(ctx: moderngl.Context) -> Approximation:
    with ctx:
        return measure_approximation(TWO, (64, 32), spp=128, context=ctx)


def test_errors_add_up(two: Approximation) -> None:
    *terms, total = two.terms()
    assert [term.error for term in terms] == [stage.error for stage in two.stages[1:]]
    assert sum(term.bias for term in terms) == pytest.approx(total.bias, abs=1e-12)
    surfaces = two.surfaces
    whole = (two.split_sum - two.truth)[surfaces].mean() / two.truth[surfaces].mean()
    assert total.bias == pytest.approx(whole, abs=1e-12)
    np.testing.assert_allclose(sum(two.relative(i, i - 1) for i in range(1, len(two.stages))), two.relative())


def test_standard_error_is_that_of_the_noise() -> None:
    """Each time, not only in the mean, for noise of a known size in every pixel."""
    rng = np.random.default_rng(5)
    surfaces = np.ones((20, 25), bool)
    for _ in range(20):
        halves = np.ones((2, 2, 20, 25, 3)) + 0.3 * rng.standard_normal((2, 2, 20, 25, 1))
        found = Approximation(TWO, tuple(stages(TWO)[:2]), halves, surfaces, np.ones((20, 25)), 2, "none")
        assert found.terms()[0].bias_error == pytest.approx(0.3 / np.sqrt(500), rel=0.15)


def test_signs_that_are_known(two: Approximation) -> None:
    """Light that is lost darkens, occlusion that is forgotten brightens."""
    bias = {term.error: term.bias for term in two.terms()}
    assert bias["lost multiple scattering"] < -0.01
    assert bias["missing interreflection"] < 0
    assert bias["missing occlusion"] > 0.001
    assert bias["diffuse factor"] == pytest.approx(0, abs=1e-12)  # of metals
    assert abs(bias["lookups"]) < 0.01


def test_one_convex_body_has_neither_occlusion_nor_interreflection(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(approximation, "stages", lambda scene: stages(scene)[1:4])
    found = measure_approximation(replace(TWO, spheres=TWO.spheres[:1]), (32, 16), spp=64, context=ctx)
    *terms, _ = found.terms()
    assert [term.error for term in terms] == ["missing interreflection", "missing occlusion"]
    for term in terms:
        assert abs(term.bias) < 3 * term.bias_error + 1e-4


@pytest.mark.parametrize("coat", [0.0, 1.0])
def test_uniform_light_leaves_what_the_brdf_alone_gets_wrong(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, coat: float
) -> None:
    """Nor do lamps take part, which are points from the first step on, under a coat as well."""
    monkeypatch.setattr(approximation, "stages", lambda scene: stages(scene)[3:])
    rough = replace(METALS["rough"], coat=coat, coat_roughness=0.3)
    lamp = Light((2.0, 3.0, 4.0), 0.1, power=100.0)
    changes = {"spheres": TWO.spheres[:1], "materials": {"rough": rough}, "lights": (lamp,)}
    white = replace(TWO, environment=Environment(radiance=1.0), **changes)
    found = {term.error: term for term in measure_approximation(white, (32, 16), spp=256, context=ctx).terms()}
    for error in ("factorisation", "n = v = r", "lookups"):
        assert abs(found[error].bias) < 3 * found[error].bias_error + 2e-3
        assert (found[error].rms or 0.0) < 0.01
    assert (found["another masking"].rms or 0.0) > 0.01


def test_stages_follow_the_scene() -> None:
    errors = [stage.error for stage in stages(TWO)]
    assert "lights as points" not in errors
    assert "occlusion map" not in errors
    lamp = replace(TWO, lights=(Light((0.0, 3.0, 0.0), power=1.0),))
    assert [s.error for s in stages(lamp)][3] == "lights as points"
    texture = Texture(Image(np.full((2, 2), 0.5, np.float32), "linear"))
    worn = replace(TWO, materials={**METALS, "worn": Material(occlusion_texture=texture)})
    assert stages(worn)[-1].error == "occlusion map"


def test_angles_are_those_of_the_picture(two: Approximation) -> None:
    index, angle = sphere_angles(two)
    assert set(np.unique(index)) == {-1, 0, 1}
    assert not index[:, :4].max() >= 0
    for sphere in (0, 1):
        seen = angle[index == sphere]
        assert seen.min() < 6
        assert 60 < seen.max() <= 90  # pixels that a surface fills do not reach the rim
    assert (index[:, :32] != 1).all()
    rows = list(by_roughness_and_angle(two))
    assert [(metallic, roughness) for metallic, roughness, _ in rows] == [(1.0, 0.3), (1.0, 0.8)]
    assert rows[1][2][0] < -0.05  # what a rough metal loses by single scattering


def test_report(two: Approximation, tmp_path: Path) -> None:
    text = report.summary(two)
    assert "lost multiple scattering" in text
    assert "Rows mix in" not in text
    brushed = replace(
        two.scene,
        materials=METALS
        | {
            "brushed": Material(anisotropy=0.5),
            "velvet": Material(sheen_color=0.5),
            "soap": Material(iridescence=0.5),
            "leaf": Material(diffuse_transmission=0.5),
            "glass": Material(model="dielectric"),
        },
    )
    noisy = (
        np.where(np.arange(2)[:, None, None, None] == 0, 1.0, -1.0)
        * np.arange(len(two.stages))[:, None, None, None, None]
    )
    others = replace(two, scene=brushed, halves=np.broadcast_to(noisy, two.halves.shape))
    assert report.summary(others).endswith(
        "what is not isotropic metallic-roughness without sheen, films and diffuse transmission: "
        "brushed, velvet, soap, leaf, glass."
    )
    assert "—" in report.summary(others)
    numbers = json.loads(json.dumps(report.to_json(others), allow_nan=False))
    assert numbers["terms"][0]["rms"] is None
    assert len(numbers["terms"]) == len(numbers["stages"])
    report.write_report(tmp_path / "r.html", two)
    page = (tmp_path / "r.html").read_text()
    assert page.count("<img") == 3 + len(two.stages) - 1
    report.write_pictures(tmp_path / "p.png", two)
    report.write_error_maps(tmp_path / "m.png", two)


def test_occlusion_map_darkens(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch) -> None:
    texture = Texture(Image(np.full((2, 2), 0.25, np.float32), "linear"))
    material = Material(albedo=0.8, occlusion_texture=texture, occlusion_strength=0.8)
    quad = Geometry([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)], uvs=[(0, 0)] * 4)
    scene = Scene(
        camera=Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0)),
        materials={"worn": material},
        meshes=(Mesh((Part(quad, "worn"),)),),
        environment=GRADIENT,
    )
    monkeypatch.setattr(approximation, "stages", lambda scene: stages(scene)[-2:])
    found = measure_approximation(scene, (16, 8), spp=4, context=ctx)
    np.testing.assert_allclose(found.pictures[-1], found.pictures[-2] * (1 - 0.8 * 0.75), rtol=1e-5)
    plain = replace(scene, materials={"worn": replace(material, occlusion_texture=None)}, meshes=())
    assert len(stages(plain)) == len(stages(scene)) - 1
