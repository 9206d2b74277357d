# SPDX-License-Identifier: MIT
"""medium/: the phase function, transmittance, and free flights."""

from typing import Any

import moderngl
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from fragtracer.packing import pack
from fragtracer.packing.media import grid_cells, largest_densities
from fragtracer.probe import probe
from fragtracer.scene import Density, Material, Medium, Scene, Sphere

from .chi_square import assert_fits, chi_square, fit, nodes
from .domains import Cone
from .scene_probe import scene_probe

PHASE, MEDIUM = ["medium/phase.glsl"], ["medium/medium.glsl"]
COEFFICIENTS = (-0.9, -0.3, 0.0, 1e-4, 0.6, 0.95)
WO = (0.6, 0.0, 0.8)
COUNT = 1 << 16
EXTINCTION, ALBEDO = np.array([0.5, 2.0, 6.0]), np.array([0.9, 0.5, 0.3])


def henyey_greenstein(g: float, cosine: np.ndarray) -> np.ndarray:
    return (1 - g**2) / (1 + g**2 - 2 * g * cosine) ** 1.5 / (4 * np.pi)


@pytest.mark.parametrize("g", COEFFICIENTS)
def test_phase_function(ctx: moderngl.Context, g: float) -> None:
    """Its values, its integral, and the mean cosine of the angle from straight on, which is g."""
    wi, weights = nodes(Cone(tuple(-x for x in WO), 2.0), (96, 4), (16, 4))
    value = probe(ctx, PHASE, f"p = phase_eval({g}, vec3{WO}, wi);", {"wi": wi}, {"p": 1})["p"].astype(np.float64)
    cosine = -wi @ np.array(WO)
    np.testing.assert_allclose(value, henyey_greenstein(g, cosine), rtol=1e-5)
    assert value @ weights == pytest.approx(1, abs=2e-5)
    assert (value * cosine) @ weights == pytest.approx(g, abs=2e-5)


def test_phase_samples(ctx: moderngl.Context) -> None:
    """They have the phase function as their density."""
    u = np.random.default_rng(1).random((COUNT, 2))
    fits = {}
    for g in COEFFICIENTS:
        wi = probe(ctx, PHASE, f"wi = phase_sample({g}, vec3{WO}, u);", {"u": u}, {"wi": 3})["wi"].astype(np.float64)
        np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=2e-6)
        axis = np.array(WO) * (-1 if g > 0 else 1)
        domain = Cone(tuple(axis), 2.0)
        fits[str(g)] = fit(
            domain, wi, lambda w, g=g: henyey_greenstein(g, -w @ np.array(WO)), cells=(512, 4), order=(8, 4)
        )
    assert_fits(fits)


def flights(ctx: moderngl.Context, throughput: np.ndarray, distance: float) -> dict[str, np.ndarray]:
    medium = f"Medium(vec3{tuple(EXTINCTION.tolist())}, 0.0, vec3{tuple(ALBEDO.tolist())}, 0, -1)"
    ray, worth = "Ray(vec3(0.0), vec3(1.0))", f"vec3{tuple(throughput.tolist())}"
    body = f"MediumSample s = medium_sample({medium}, {ray}, {distance}, {worth}, u);\n"
    body += "t = s.distance; weight = s.weight; scatters = float(s.scatters);"
    u = np.random.default_rng(2).random((COUNT, 2))
    found = probe(ctx, MEDIUM, body, {"u": u}, {"t": 1, "weight": 3, "scatters": 1}, {"HAS_MEDIA": 1})
    return {name: values.astype(np.float64) for name, values in found.items()}


@pytest.mark.parametrize("throughput", [(1.0, 1.0, 1.0), (0.2, 1.0, 0.05), (0.0, 0.0, 1.0)])
def test_free_flights(ctx: moderngl.Context, throughput: tuple[float, float, float]) -> None:
    """Their density is the mean of those of the channels by what the path is worth in each, and each weight what is
    scattered, or passes, over that."""
    worth = np.array(throughput)
    found = flights(ctx, worth, 0.7)
    transmittance = np.exp(-EXTINCTION * found["t"][:, None])
    scatters = found["scatters"] > 0
    value = np.where(scatters[:, None], ALBEDO * EXTINCTION * transmittance, transmittance)
    density = np.where(scatters[:, None], EXTINCTION * transmittance, transmittance) @ (worth / worth.sum())
    np.testing.assert_allclose(found["weight"], value / density[:, None], rtol=2e-6)
    ends = np.linspace(0, 0.7, 21)
    passed = np.exp(-np.outer(ends, EXTINCTION)) @ (worth / worth.sum())
    expected = COUNT * np.append(passed[:-1] - passed[1:], passed[-1])
    observed = np.append(np.histogram(found["t"][scatters], ends)[0], (~scatters).sum())
    assert chi_square(observed.astype(float), expected) > 1e-3
    # Whatever the colours, no weight makes a path worth more than it was.
    assert ((found["weight"] * worth).sum(1) <= worth.sum() * (1 + 1e-6)).all()


WAYS = {  # distance, point, least
    "aside": (3.0, (0.5, 0.0, 1.0), 0.0),
    "behind": (3.0, (0.1, 0.0, -5.0), 0.0),
    "beyond": (2.0, (0.2, 0.1, 40.0), 0.0),
    "on the way": (2.0, (0.0, 0.0, 1.5), 0.25),
    "without an end": (1e30, (0.0, 2.0, 1.0), 0.5),
}


def seen_angle(t: np.ndarray, point: tuple[float, float, float], least: float) -> np.ndarray:
    """Of distances along +z, seen from the point."""
    aside = max(np.hypot(*point[:2]), least, 1e-4 * np.linalg.norm(point))
    return np.arctan2(t - point[2], aside) - np.arctan2(-point[2], aside)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (2.0, -1.0, 0.5)], ids=["origin", "elsewhere"])
@pytest.mark.parametrize(("distance", "point", "least"), WAYS.values(), ids=WAYS)
def test_equiangular_samples(ctx: moderngl.Context, distance: float, point: Any, least: float, origin: Any) -> None:
    """From the point, the angles of samples are uniform, and the density is what that makes of distances."""
    u = np.random.default_rng(4).random(COUNT)
    body = f"Ray ray = Ray(vec3{origin}, vec3(0.0, 0.0, 1.0)); vec3 point = ray.origin + vec3{point};\n"
    body += f"Equiangular way = equiangular_over(ray, {distance}, point, {least});\n"
    body += "t = equiangular_sample(way, u); p = equiangular_pdf(way, t);"
    found = probe(ctx, ["medium/equiangular.glsl"], body, {"u": u}, {"t": 1, "p": 1})
    t, pdf = found["t"].astype(np.float64), found["p"].astype(np.float64)
    assert t.min() >= 0
    assert t.max() <= distance * (1 + 1e-5)
    whole = seen_angle(np.array(distance), point, least)
    np.testing.assert_allclose(seen_angle(t, point, least) / whole, u, atol=2e-6)
    aside = max(np.hypot(*point[:2]), least, 1e-4 * np.linalg.norm(point))
    np.testing.assert_allclose(pdf, aside / (whole * (aside**2 + (t - point[2]) ** 2)), rtol=2e-5)


@pytest.mark.parametrize("throughput", [(1.0, 1.0, 1.0), (0.0, 0.2, 1.0)])
def test_points_to_take_light_from(ctx: moderngl.Context, throughput: tuple[float, float, float]) -> None:
    """Half of them are where the path goes on, and half equiangular; each weight is what is scattered over the density
    of both, and so the mean of all is what is scattered in the whole."""
    distance, point, radius = 0.7, (0.0, 0.15, 0.4), 0.1
    medium = f"Medium(vec3{tuple(EXTINCTION.tolist())}, 0.0, vec3{tuple(ALBEDO.tolist())}, 0, -1)"
    ray, worth = "Ray(vec3(0.0), vec3(0.0, 0.0, 1.0))", f"vec3{throughput}"
    body = (
        f"MediumSample s = medium_sample({medium}, {ray}, {distance}, {worth}, u.xy); scatters = float(s.scatters);\n"
    )
    body += f"Equiangular way = equiangular_over({ray}, {distance}, vec3{point}, {radius});\n"
    body += f"s = medium_lit_point({medium}, {distance}, {worth}, s, way, u.z);\n"
    body += "t = s.distance; weight = s.weight;"
    u = np.random.default_rng(5).random((COUNT, 3))
    found = probe(ctx, MEDIUM, body, {"u": u}, {"t": 1, "weight": 3, "scatters": 1}, {"HAS_MEDIA": 1})
    t, weight = (found[name][found["scatters"] > 0].astype(np.float64) for name in ("t", "weight"))
    share = np.array(throughput) / sum(throughput)
    whole = seen_angle(np.array(distance), point, radius)
    scatters = (1 - np.exp(-EXTINCTION * distance)) @ share
    value = EXTINCTION * np.exp(-EXTINCTION * t[:, None])
    equiangular = 0.15 / (whole * (0.15**2 + (t - point[2]) ** 2))
    np.testing.assert_allclose(
        weight, ALBEDO * value / (0.5 * value @ share + 0.5 * scatters * equiangular)[:, None], rtol=2e-5
    )
    ends = np.linspace(0, distance, 33)
    flown = (1 - np.exp(-np.outer(ends, EXTINCTION))) @ share / scatters
    expected = len(t) * np.diff(0.5 * flown + 0.5 * seen_angle(ends, point, radius) / whole)
    assert chi_square(np.histogram(t, ends)[0].astype(float), expected) > 1e-3
    error = weight.std(0) / np.sqrt(len(t))
    assert (np.abs(weight.mean(0) * scatters - ALBEDO * (1 - np.exp(-EXTINCTION * distance))) < 5 * error + 0.005).all()


def test_light_passes_by_beers_law(ctx: moderngl.Context) -> None:
    """Also where nothing is extinguished for ever."""
    medium = "Medium(vec3(0.0, 0.5, 3.0), 0.0, vec3(0.0), 0, -1)"
    distance = np.array([0.0, 0.1, 1.0, 20.0, 1e30])
    body = f"t = medium_transmittance({medium}, Ray(vec3(0.0), vec3(1.0)), d, 1u);"
    found = probe(ctx, MEDIUM, body, {"d": distance}, {"t": 3}, {"HAS_MEDIA": 1})["t"]
    np.testing.assert_allclose(found, np.exp(-np.outer(distance, (0.0, 0.5, 3.0))), rtol=4e-6, atol=1e-30)


def interpolated(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Of the unit cube (n, 3), by scipy; beyond the outer centres the value there."""
    axes = [(np.arange(n) + 0.5) / n for n in values.shape]
    inside = np.clip(places[:, ::-1], [a[0] for a in axes], [a[-1] for a in axes])
    single = [len(a) == 1 for a in axes]
    axes = [np.array([0.5, 1.5]) if one else a for a, one in zip(axes, single, strict=True)]
    padded = np.pad(values, [(0, int(one)) for one in single], mode="edge")
    return RegularGridInterpolator(axes, padded)(inside)


@pytest.mark.parametrize("shape", [(4, 3, 5), (1, 2, 1)])
def test_density_is_interpolated_between_voxels(ctx: moderngl.Context, shape: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(3)
    values, low, high = rng.random(shape), np.array([-1.0, 2.0, 0.5]), np.array([1.0, 2.5, 4.0])
    bounds = (tuple(low.tolist()), tuple(high.tolist()))
    scene = Scene(
        materials={"cloud": Material(model="null", interior="smoke")},
        media={"smoke": Medium(density=Density(values), bounds=bounds)},
        spheres=[Sphere((0.0, 2.0, 0.0), 1.0, "cloud")],
    )
    packed = pack(scene, scene.render, 8, 8)
    unit = rng.random((4096, 3)) * 1.2 - 0.1
    position = low + unit * (high - low) - packed.origin
    body = "d = grid_density(grid_load(0), position);"
    found = scene_probe(ctx, packed, MEDIUM, body, {"position": position}, {"d": 1})["d"]
    np.testing.assert_allclose(found, interpolated(values, unit), rtol=2e-5, atol=2e-6)


def spike() -> tuple[Density, np.ndarray, np.ndarray]:
    """A grid that is thin but for one voxel, and the corners of its box."""
    values = np.full((20, 18, 24), 0.02)
    values[6, 11, 15] = 40
    return Density(values), np.array([-1.0, 0.0, -2.0]), np.array([1.0, 1.5, 1.0])


@pytest.mark.parametrize("most", [1, 3, 8, 16, 64])
def test_no_density_is_above_that_of_its_cell(most: int) -> None:
    """Also where it is interpolated across the sides of cells; and some voxel next to the cell has that density."""
    rng = np.random.default_rng(6)
    values = rng.random((7, 16, 33)) ** 8
    cells = largest_densities(Density(values), most)
    assert cells.shape == tuple(min(most, n) for n in values.shape)
    unit = rng.random((1 << 14, 3))
    edges = unit[: 1 << 12] * cells.shape[::-1]
    unit = np.concatenate([unit, np.round(edges) / cells.shape[::-1]])
    inside = np.minimum((unit * cells.shape[::-1]).astype(int), np.array(cells.shape[::-1]) - 1)
    above = cells[inside[:, 2], inside[:, 1], inside[:, 0]]
    assert (interpolated(values.astype(np.float32), unit) <= above * (1 + 1e-6)).all()
    for z, y, x in np.ndindex(cells.shape):
        bounds = zip((z, y, x), cells.shape, values.shape, strict=True)
        near = tuple(slice(max(0, int(i * n / c - 0.5)), int((i + 1) * n / c + 0.5) + 1) for i, c, n in bounds)
        assert cells[z, y, x] == values[near].astype(np.float32).max()
    assert most > 1 or cells.max() == np.float32(values.max())


def test_cells_are_as_many_as_pay() -> None:
    """Many where most is empty, and one where a ray would only be stopped by them."""
    density, low, high = spike()
    assert grid_cells(density, high - low, 100.0).size == 16**3
    assert grid_cells(density, high - low, 5.0).size == 4**3
    assert grid_cells(Density(np.ones((20, 20, 20))), high - low, 5.0).size == 1
    assert grid_cells(density, high - low, 1e-3).size == 1


def test_light_passes_a_spike_as_in_float64(ctx: moderngl.Context) -> None:
    """Through cells of their own largest densities, along rays from anywhere: in the mean what the integral of the
    density leaves, by ratio tracking, and by delta tracking as the share of paths that arrive."""
    density, low, high = spike()
    rng, count, turns = np.random.default_rng(7), 48, 1024
    medium = Medium(extinction=(0.5, 1.0, 2.0), density=density, bounds=(tuple(low.tolist()), tuple(high.tolist())))
    scene = Scene(
        materials={"cloud": Material(model="null", interior="smoke")},
        media={"smoke": medium},
        spheres=[Sphere((0.0, 0.0, 0.0), 1.0, "cloud")],
    )
    packed = pack(scene, scene.render, 8, 8)
    assert packed.scene_records["Grid"].shape[0] == 1
    spot = low + (np.array([15.5, 11.5, 6.5]) / (24, 18, 20)) * (high - low)
    start = rng.normal(size=(count, 3)) * 2
    start[:4] = spot  # from within
    aim = spot + rng.normal(size=(count, 3)) * 0.08
    direction = aim - start
    direction[4], direction[5] = (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)  # along axes
    start[4], start[5] = spot - (0.01, 0.02, 4.0), spot + np.array((4.0, 0.01, 0.02))
    distance = rng.uniform(2.0, 6.0, count)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    body = """Medium medium = medium_load(1);
Ray ray = Ray(start, direction);
passed = medium_transmittance(medium, ray, far, hash_uint(uint(number)));
MediumSample s = medium_sample(medium, ray, far, vec3(1.0), u);
arrived = s.scatters ? vec3(0.0) : s.weight;
"""
    rays = {"start": start - packed.origin, "direction": direction, "far": distance}
    inputs = {name: np.repeat(values, turns, axis=0) for name, values in rays.items()}
    inputs |= {"number": np.arange(count * turns), "u": rng.random((count * turns, 2))}
    results = scene_probe(ctx, packed, MEDIUM, body, inputs, {"passed": 3, "arrived": 3})
    found = {name: values.reshape(count, turns, 3) for name, values in results.items()}
    t = (np.arange(8000) + 0.5) / 8000
    places = (start[:, None] + (t[:, None] * distance[:, None, None]) * direction[:, None] - low) / (high - low)
    values = interpolated(density.values.astype(np.float64), places.reshape(-1, 3))
    values *= ((places >= 0) & (places <= 1)).all(-1).ravel()
    depth = values.reshape(count, -1).mean(1) * distance
    expected = np.exp(-np.outer(depth, (0.5, 1.0, 2.0)))
    assert (expected[:, 1] < 0.8).sum() > 20
    for values in found.values():
        error = np.maximum(values.std(1), np.sqrt(expected * (1 - expected))) / np.sqrt(turns)
        assert (np.abs(values.mean(1) - expected) < 5 * error + 2e-4).all()
