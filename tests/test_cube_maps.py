# SPDX-License-Identifier: MIT
"""The maps of the split-sum approximation against float64, against what they stand for, and kept on disk."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
import split_sum_oracle as oracle
from numpy.typing import NDArray
from rendering import Planter

from fragtracer.gpu import cube_maps
from fragtracer.gpu.cube_maps import MapSizes, brdf_map, environment_maps
from fragtracer.probe import probe
from fragtracer.scene.environment import lookup

SMALL = MapSizes(prefiltered=32, levels=4, samples=1024, irradiance=16, brdf=64)
ROWS = 128  # of the environments


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRAGTRACER_CACHE", str(tmp_path / "cache"))


def levels_of(cube: NDArray[np.float32], size: int, levels: int) -> Iterator[NDArray[np.float32]]:
    row = 0
    for level in range(levels):
        width = (size >> level) + 2
        yield cube[row : row + width, : 6 * width]
        row += width


def texels(rng: np.random.Generator, size: int, count: int) -> Iterator[tuple[int, int, np.ndarray]]:
    """Some texels of a level, rims included, and their directions."""
    directions = oracle.cube_directions(size)
    for _ in range(count):
        row, column = rng.integers(size + 2), rng.integers(6 * (size + 2))
        yield row, column, directions[row, column]


@cache
def integrals(sharpness: float = 0.0) -> oracle.Integrals:
    """Of the picture with that sun."""
    return oracle.Integrals(oracle.picture(ROWS, sharpness))


@cache
def sun_pyramid(size: int) -> list[NDArray[np.float64]]:
    """Of a picture with a small bright sun."""
    return oracle.pyramid(oracle.picture(ROWS, sharpness=2000), size, taps=int(np.ceil(4 * 2 * ROWS / (np.pi * size))))


def irradiance_error(ctx: moderngl.Context) -> float:
    found = environment_maps(ctx, oracle.picture(ROWS, sharpness=300), SMALL)["irradiance"]
    errors = [
        np.abs(found[row, column] / integrals(300).irradiance(normal) - 1).max()
        for row, column, normal in texels(np.random.default_rng(1), SMALL.irradiance, 40)
    ]
    return float(max(errors))


def lobe_error(ctx: moderngl.Context) -> float:
    """Of the prefiltered map against the integral, under a smooth environment."""
    pixels = oracle.picture(ROWS)
    found = environment_maps(ctx, pixels, SMALL)["prefiltered"]
    errors = []
    for number, level in enumerate(levels_of(found, SMALL.prefiltered, SMALL.levels)):
        alpha = (number / (SMALL.levels - 1)) ** 2
        for row, column, normal in texels(np.random.default_rng(number), SMALL.prefiltered >> number, 12):
            wanted = integrals().lobe_mean(normal, alpha) if alpha else lookup(pixels, normal)
            errors.append(np.abs(level[row, column] / wanted - 1).max())
    return float(max(errors))


def formula_error(ctx: moderngl.Context) -> float:
    """Of the prefiltered map against the same formula in float64, under a small bright sun."""
    pixels = oracle.picture(ROWS, sharpness=2000)
    few = replace(SMALL, samples=32)  # so that each of them counts
    found = environment_maps(ctx, pixels, few)["prefiltered"]
    size = 64
    source = sun_pyramid(size)
    errors = []
    for number, level in enumerate(levels_of(found, SMALL.prefiltered, SMALL.levels)):
        alpha = (number / (SMALL.levels - 1)) ** 2
        for row, column, normal in texels(np.random.default_rng(number), SMALL.prefiltered >> number, 25):
            if number:
                wanted = oracle.prefiltered(source, normal, alpha, few.samples)
            else:
                wanted = oracle.cube_lookup(source, normal[None], np.array([np.log2(size / SMALL.prefiltered)]))[0]
            errors.append(np.abs(level[row, column] / wanted - 1).max())
    return float(max(errors))


def brdf_error(ctx: moderngl.Context, geometry: str) -> float:
    found = brdf_map(ctx, geometry, SMALL)
    g1 = oracle.g1_smith if geometry == "SMITH" else oracle.g1_environment
    rng = np.random.default_rng(3)
    places = [(0, 10), (63, 63), (63, 0), (5, 2), *rng.integers(0, SMALL.brdf, (40, 2))]
    return max(
        float(np.abs(found[row, column, :2] - oracle.brdf((column + 0.5) / 64, (row + 0.5) / 64, g1)).max())
        for row, column in places
        if row or column  # a mirror at grazing incidence: the sum of the oracle is too coarse
    )


def test_irradiance_is_the_integral(ctx: moderngl.Context) -> None:
    assert irradiance_error(ctx) < 2e-3


def test_prefiltered_map_is_the_integral_over_the_lobe(ctx: moderngl.Context) -> None:
    assert lobe_error(ctx) < 5e-3


def test_prefiltered_map_is_the_formula(ctx: moderngl.Context) -> None:
    assert formula_error(ctx) < 5e-3


@pytest.mark.parametrize("geometry", ["SMITH", "KARIS_ENVIRONMENT"])
def test_brdf_map_is_the_integral(ctx: moderngl.Context, geometry: str) -> None:
    assert brdf_error(ctx, geometry) < 5e-3


def test_brdf_map_of_one_point(ctx: moderngl.Context) -> None:
    """Every point of the sums counts, the first too. By a mirror the normal view's lobe is the mirrored direction."""
    found = brdf_map(ctx, "SMITH", replace(SMALL, samples=1))
    assert found[..., 0].max() > 0.5
    np.testing.assert_allclose(found[0, :, 2], (np.arange(SMALL.brdf) + 0.5) / SMALL.brdf, atol=0.01)


def test_uniform_light_stays_what_it_is(ctx: moderngl.Context) -> None:
    maps = environment_maps(ctx, np.full((4, 8, 3), 0.7, np.float32), SMALL)
    assert maps["prefiltered"].shape == (34 + 18 + 10 + 6, 6 * 34, 3)
    np.testing.assert_allclose(maps["irradiance"], 0.7, rtol=1e-5)
    for level in levels_of(maps["prefiltered"], SMALL.prefiltered, SMALL.levels):
        np.testing.assert_allclose(level, 0.7, rtol=1e-5)


@pytest.mark.parametrize("place", [(3, 100), (60, 0), (127, 255), (64, 17)])
def test_a_sun_of_one_texel_keeps_its_energy(ctx: moderngl.Context, place: tuple[int, int]) -> None:
    pixels = np.zeros((ROWS, 2 * ROWS, 3), np.float32)
    pixels[place] = 1e4
    directions, angle = oracle.sphere(4 * ROWS)
    power = lookup(pixels, directions)[:, 0] @ angle
    levels = cube_maps.pyramid(ctx, pixels)
    for level in levels[:4]:
        size = level.shape[0] - 2
        x = 2 * np.arange(size + 1) / size - 1
        corners = np.arctan2(x[:, None] * x, np.sqrt(1 + x[:, None] ** 2 + x**2))
        angle = np.diff(np.diff(corners, axis=0), axis=1)
        faces = level.reshape(size + 2, 6, size + 2, 3)[1:-1, :, 1:-1, 0]
        assert (faces * angle[:, None, :]).sum() == pytest.approx(power, rel=0.02)


@cache
def sunny_map(ctx: moderngl.Context) -> NDArray[np.float32]:
    return environment_maps(ctx, oracle.picture(ROWS, sharpness=300), SMALL)["prefiltered"]


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 0.9, 1.0])
def test_no_seam_shows_at_the_edges_of_faces(ctx: moderngl.Context, roughness: float) -> None:
    rng = np.random.default_rng(5)
    edge = np.concatenate([np.ones((600, 2)), rng.uniform(-1, 1, (600, 1))], axis=1) * rng.choice([-1, 1], (600, 3))
    edge = np.array([e[rng.permutation(3)] for e in edge])
    corner = rng.choice([-1.0, 1.0], (40, 3))
    points = np.concatenate([edge, corner])
    step = rng.normal(size=points.shape) * 1e-5
    sides = [looked_up(ctx, sunny_map(ctx), d, f"32, 4, d, {roughness * 3}") for d in (points + step, points - step)]
    assert np.abs(sides[0] / sides[1] - 1).max() < 2e-3


def looked_up(ctx: moderngl.Context, cube: NDArray[np.float32], d: NDArray[np.float64], rest: str) -> Any:
    """What cube_lookup finds in a cube map, of whose arguments ``rest`` are the others, in directions ``d``."""
    texture = cube_maps.texture_of(ctx, cube)
    includes = ["texture/cube.glsl", "probe_sampler"]
    sampler = {"probe_sampler": "uniform highp sampler2D u_cube;"}
    body = f"c = cube_lookup(u_cube, {rest});"
    found = probe(ctx, includes, body, {"d": d}, {"c": 3}, generated=sampler, resources={"u_cube": texture})["c"]
    texture.release()
    return found


def test_lookup_finds_its_direction(ctx: moderngl.Context) -> None:
    pixels = oracle.picture(2 * ROWS)
    rng = np.random.default_rng(6)
    d = rng.normal(size=(2000, 3))
    fine = MapSizes(prefiltered=128, levels=2, samples=16, irradiance=16)
    found = looked_up(ctx, environment_maps(ctx, pixels, fine)["prefiltered"], d, "128, 2, d, 0.0")
    np.testing.assert_allclose(found, lookup(pixels, d), rtol=1e-3)


def test_second_start_does_not_compute(ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pixels = oracle.picture(16)
    first, table = environment_maps(ctx, pixels, SMALL), brdf_map(ctx, "SMITH", SMALL)
    programs = []

    class Spy(cube_maps.FullscreenProgram):
        def __init__(self, *arguments: object) -> None:
            programs.append(arguments[2])
            super().__init__(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(cube_maps, "FullscreenProgram", Spy)
    again = environment_maps(ctx, pixels, SMALL)
    np.testing.assert_array_equal(brdf_map(ctx, "SMITH", SMALL), table)
    assert not programs
    for name, values in first.items():
        np.testing.assert_array_equal(again[name], values)
    brdf_map(ctx, "KARIS_ENVIRONMENT", SMALL)
    assert programs == ["split_sum/brdf_map.frag"]
    pixels[3, 4] += 1
    environment_maps(ctx, pixels, SMALL)
    assert "split_sum/prefilter.frag" in programs
    programs.clear()
    for file in (tmp_path / "cache").glob("environment-*"):
        file.write_bytes(file.read_bytes()[:-7])
    with pytest.warns(UserWarning, match="damaged"):
        environment_maps(ctx, pixels, SMALL)
    assert programs


PREFILTER, IRRADIANCE = "split_sum/prefilter.frag", "split_sum/irradiance.frag"
MUTATIONS = [
    ("cosine forgotten", IRRADIANCE, "weight * cos_theta * vec4", "weight * vec4", irradiance_error, 2e-3),
    ("solid angle forgotten", IRRADIANCE, "1.0 / (length2 * length2)", "1.0 / sqrt(length2)", irradiance_error, 2e-3),
    ("a row left out", IRRADIANCE, "for (int y = 0;", "for (int y = 1;", irradiance_error, 2e-3),
    ("mip level without its root", PREFILTER, "return 0.5 * log2", "return log2", formula_error, 5e-3),
    ("mip level one too high", PREFILTER, "return 0.5 * log2", "return 1.0 + 0.5 * log2", formula_error, 5e-3),
    ("cosine not as weight", PREFILTER, "sum += wi.z * vec4", "sum += vec4", lobe_error, 5e-3),
    ("roughness for alpha", PREFILTER, "vndf(u_alpha, wo, ham", "vndf(sqrt(u_alpha), wo, ham", lobe_error, 5e-3),
    ("half vector for light", PREFILTER, "frame_to_world(frame, wi)", "frame_to_world(frame, wh)", lobe_error, 5e-3),
    ("map upside down", "split_sum/from_equirect.frag", "vec2(d.y, length", "vec2(-d.y, length", lobe_error, 5e-3),
    ("map mirrored", "split_sum/from_equirect.frag", "vec2(-d.z, d.x)", "vec2(-d.z, -d.x)", lobe_error, 5e-3),
]  # fmt: skip


@pytest.mark.parametrize(("name", "file", "text", "replacement", "error", "limit"), MUTATIONS)
def test_planted_errors_are_found(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, file: str, text: str,
    replacement: str, error: object, limit: float,
) -> None:  # fmt: skip
    Planter(monkeypatch, tmp_path, ("gpu.cube_maps",))(file, text, replacement)
    assert error(ctx) > limit  # type: ignore[operator]


@pytest.mark.parametrize(
    ("text", "replacement"),
    [("(1.0 - grazing, grazing)", "(1.0, grazing)"), ("1.0 - clamp(dot(wo, wh)", "1.0 - clamp(wi.z")],
)
def test_planted_errors_of_the_brdf_map_are_found(
    ctx: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, replacement: str
) -> None:
    Planter(monkeypatch, tmp_path, ("gpu.cube_maps",))("split_sum/brdf_map.frag", text, replacement)
    assert brdf_error(ctx, "KARIS_ENVIRONMENT") > 5e-3


def test_k_of_the_environment_is_not_that_of_a_lamp(ctx: moderngl.Context) -> None:
    """What tells the masking terms apart is larger than the error that passes."""
    smith, environment = (brdf_map(ctx, name, SMALL) for name in ("SMITH", "KARIS_ENVIRONMENT"))
    assert np.abs(smith - environment).max() > 0.02
