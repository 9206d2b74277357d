# SPDX-License-Identifier: MIT
"""The benchmarks at a tiny size: which rows there are and what must hold between them. No test looks at the time."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from fragtracer.apps.bench import (
    ablations,
    convergence,
    environment,
    memory,
    meshes,
    scaling,
    speed,
    suite,
    sweep,
    yardstick,
)
from fragtracer.apps.bench.cases import case, with_settings
from fragtracer.apps.bench.contenders import Sampling
from fragtracer.apps.bench.error import REFERENCE_SAMPLINGS, Reference, make_reference
from fragtracer.apps.bench.frames import frame_time
from fragtracer.apps.bench.plan import Benchmark, Plan, Progress
from fragtracer.apps.bench.statistics import Estimate
from fragtracer.apps.bench.tables import Table
from fragtracer.apps.bench.work import count_work
from fragtracer.apps.cli.bench import NAMES
from fragtracer.errors import FragtracerError
from fragtracer.gpu.cube_maps import MapSizes
from fragtracer.gpu.timer import DrawTimer
from fragtracer.reference.variant import find_llvm, mitsuba_variant
from fragtracer.scene import Scene

TINY = (16, 9)
needs_mitsuba = pytest.mark.skipif(find_llvm() is None, reason="scalar_rgb is too slow for these tests")


def _run(benchmark: Any, plan: Plan) -> Table:
    shares: list[float] = []
    table: Table = benchmark.table(plan)
    benchmark.run(plan, table, lambda share, text: shares.append(share))
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    known = {column.name for column in table.columns}
    assert all(set(row) <= known and set(table.keys) <= set(row) for row in table.rows)
    return table


def _value(cell: object) -> float:
    assert isinstance(cell, Estimate)
    return cell.value


def test_command_knows_all_benchmarks() -> None:
    assert tuple(suite.BENCHMARKS) == NAMES


def test_sweep_has_the_ten_rows_of_the_document() -> None:
    rows = _run(sweep.BENCHMARK, Plan(size=TINY, runs=1)).rows
    numbers = [(row["rays"], row["bounces"], row["light_samples"], row["document_fps"]) for row in rows]
    assert len(numbers) == 10
    assert numbers[0] == (5, 1, 1, "> 60")
    assert numbers[-1] == (15, 5, 15, "14")
    assert all(_value(row[name]) > 0 for row in rows for name in ("fps", "rays_per_second", "ns_per_vertex"))


def test_sweep_of_chosen_numbers_is_every_combination() -> None:
    plan = Plan(rays=(5, 10), bounces=(1, 5, 10), light_samples=(1, 2))
    assert len(set(sweep.combinations(plan))) == 12
    assert sweep.combinations(Plan(rays=(7,))) == [(7, 5, 1)]


def test_slow_row_is_given_up_and_says_so() -> None:
    plan = Plan(size=(64, 64), rays=(64,), runs=1, row_limit=1e-9)
    (row,) = _run(sweep.BENCHMARK, plan).rows
    assert "fps" not in row
    assert str(row["note"]).startswith("stopped: a frame takes about")


@pytest.mark.parametrize("bounces", [1, 4])
def test_work_of_a_furnace_is_known(bounces: int) -> None:
    # Every ray meets a wall, Russian roulette is off: bounces vertices, and one ray more.
    scene = with_settings(
        case("furnace"), TINY, bounces=bounces, russian_roulette=False, light_samples=3, estimator="nee"
    )
    work = count_work(scene)
    assert work.vertices == pytest.approx(bounces)
    assert work.path_rays == pytest.approx(bounces + 1)
    assert 0 < work.shadow_rays <= 3 * bounces


@needs_mitsuba
def test_speed_against_mitsuba() -> None:
    plan = Plan(scenes=("three-spheres-lambert", "cornell-box"), size=TINY, runs=2, seconds=0.01, sampler="independent")
    rows = _run(speed.BENCHMARK, plan).rows
    assert [row["scene"] for row in rows] == ["three-spheres-lambert", "cornell-box"]
    assert all(_value(row[name]) > 0 for row in rows for name in ("fragtracer", "mitsuba", "ratio"))


class FakeMitsuba:
    """Of a sampling, and nothing else."""

    def __init__(self, scene: Scene, seed: int, variant: str | None, sampling: Sampling) -> None:
        self.sampling = sampling

    def __enter__(self) -> "FakeMitsuba":
        return self

    def __exit__(self, *_: object) -> None: ...


def test_mitsuba_has_the_sampler_that_does_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yardstick, "Mitsuba", FakeMitsuba)
    scene, tried = with_settings(case("cornell-box"), (512, 512)), []

    def cost(mitsuba: Any) -> float:
        return {Sampling("multijitter", 64): 1.0, Sampling("orthogonal", 49): 2.0}.get(mitsuba.sampling, 3.0)

    assert yardstick.sampling_for(scene, Plan(), cost, tried.append) == Sampling("multijitter", 64)
    assert len(tried) == 10
    assert yardstick.sampling_for(scene, Plan(sampler="orthogonal"), cost, tried.append) == Sampling("orthogonal", 49)
    large = with_settings(scene, (1920, 1080))  # as many paths as fit
    assert yardstick.sampling_for(large, Plan(), cost, tried.append).spp == 16


def test_lambert_case_is_matte_and_keeps_its_light() -> None:
    scene = case("three-spheres-lambert")
    assert all(max(*m.specular_f0, *m.specular_f90) == 0 for m in scene.materials.values())
    assert scene.lights == case("three-spheres").lights
    assert max(case("cornell-box-lambert").materials["lamp"].emission) > 0


@needs_mitsuba
@pytest.mark.parametrize("sampling", [*REFERENCE_SAMPLINGS, Sampling("independent"), Sampling("multijitter")], ids=str)
def test_numbers_of_the_reference_are_independent(sampling: Sampling) -> None:
    """Of many dimensions, as those of long paths, drawn alone and in pairs; those of multijitter are not."""
    draws, pixels, share = 6, 1 << 15, 0.8
    with mitsuba_variant("llvm_ad_rgb"):
        import mitsuba as mi

        sampler = mi.load_dict({"type": sampling.sampler, "sample_count": sampling.spp})
        sampler.set_samples_per_wavefront(sampling.spp)
        sampler.seed(0, sampling.spp * pixels)
        numbers = [u for _ in range(draws) for u in (sampler.next_1d(), *sampler.next_2d())]
        below = np.all([np.array(u) < share for u in numbers], axis=0)
    expected = share ** (3 * draws)
    off = abs(below.mean() - expected) / np.sqrt(expected * (1 - expected) / below.size)
    assert (off < 4) == (sampling.sampler != "multijitter")


def test_passes_of_the_reference_fit_into_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """The longest that do, and the shortest where none does."""

    def mitsuba(scene: Scene, seed: int, variant: str | None, sampling: Sampling) -> None:
        raise InterruptedError(sampling.spp)

    monkeypatch.setattr("fragtracer.apps.bench.error.Mitsuba", mitsuba)
    for size, spp in (((512, 512), 49), ((1000, 1000), 25), ((1920, 1080), 9), ((3840, 2160), 9)):
        with pytest.raises(InterruptedError, match=f"^{spp}$"):
            make_reference(with_settings(case("cornell-box"), size), 1.0, "mitsuba")


@needs_mitsuba
@pytest.mark.parametrize("reference", ["both", "own", "mitsuba"])
def test_error_over_time(reference: Any) -> None:
    plan = Plan(
        scenes=("cornell-box",), size=(32, 32), runs=1, seconds=0.25, reference=reference, sampler="independent"
    )
    rows = _run(convergence.BENCHMARK, plan).rows
    assert [row["seconds"] for row in rows] == [0.25 / 16, 0.25 / 8, 0.25 / 4, 0.25 / 2, 0.25]
    errors = [_value(row["fragtracer_error"]) for row in rows]
    spp = [_value(row["fragtracer_spp"]) for row in rows]
    assert spp == sorted(spp)
    assert errors[-1] < errors[0] or spp[-1] == spp[0]


def test_noise_of_the_reference_is_taken_off() -> None:
    rng = np.random.default_rng(0)
    truth = np.ones((200, 200, 3))

    def noisy(sigma: float, bias: float = 0.0) -> Any:
        return truth + bias + rng.normal(0, sigma, truth.shape)

    reference = Reference(noisy(0.1), noisy(0.1))
    assert reference.relative_mse(noisy(0.05)) == pytest.approx(0.05**2, rel=0.1)
    assert reference.noise == pytest.approx(0.1**2 / 2, rel=0.05)
    assert reference.relative_bias(noisy(0.1, 0.2), noisy(0.1, 0.2)) == pytest.approx(0.2, rel=0.05)
    assert reference.relative_bias(noisy(0.1), noisy(0.1)) < 0.02


def test_the_worst_pixels_are_left_out_and_no_noise_of_the_reference_with_them() -> None:
    """Which is larger in some pixels than in others, and than the error."""
    rng = np.random.default_rng(0)
    deviation = rng.choice([0.001, 0.05], (400, 400, 1))

    def noisy(sigma: float) -> Any:
        return 1 + sigma * deviation * rng.normal(size=(400, 400, 3))

    reference, image, other = Reference(noisy(2.0), noisy(2.0)), noisy(1.0), noisy(1.0)
    image[:20, :20] += 50.0  # a quarter of the pixels that are left out
    truth = Reference(np.ones((400, 400, 3)), np.ones((400, 400, 3)))
    assert reference.trimmed_mse(image, other) == pytest.approx(truth.trimmed_mse(image, other), rel=0.05)
    assert truth.trimmed_mse(image, other) < truth.relative_mse(image) / 1000


def test_variants_have_as_many_samples_as_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though they may take more at once."""

    class Fake:
        def __init__(self, scene: Any, number: int, *_: Any, **__: Any) -> None:
            self.step, self.spp = scene
            self.seconds = float(self.spp)

        def __enter__(self) -> Any:
            return self

        def __exit__(self, *_: Any) -> None:
            pass

        def sample(self, spp: int) -> None:
            self.spp += spp
            self.seconds += 3 * spp

        def image(self) -> Any:
            return np.full((2, 2, 3), float(self.spp))

    monkeypatch.setattr(ablations, "Ours", Fake)
    reference = Reference(np.zeros((2, 2, 3)), np.zeros((2, 2, 3)))
    default: Any
    changed: Any
    default, changed = (16, 48), (32, 0)
    row = ablations._row(default, changed, ablations.VARIANTS[0], reference, Plan(runs=1, seconds=1), lambda *_: None)
    assert (_value(row["time"]), _value(row["error"])) == (3.0, 1.0)


def test_ablations_have_a_row_for_each_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = [v for v in ablations.VARIANTS if v.name.startswith(("hash", "one BSDF", "BSDF sampling"))]
    benchmark = Benchmark(ablations.BENCHMARK.table, partial(ablations._run, chosen, ()))
    rows = _run(benchmark, Plan(scenes=("three-spheres",), size=TINY, runs=2, seconds=0.02)).rows
    assert [row["variant"] for row in rows] == [v.name for v in chosen]
    assert all(_value(row["time"]) > 0 for row in rows)


def test_scaling_has_a_curve_for_each_quantity() -> None:
    plan = Plan(size=TINY, rays=(1, 2, 4), bounces=(1,), light_samples=(1, 2), runs=1)
    rows = _run(scaling.BENCHMARK, plan).rows
    curves = dict.fromkeys(row["quantity"] for row in rows)
    assert list(curves) == ["rays", "bounces", "light samples", "image side"]
    assert [row["exponent"] is not None for row in rows if row["quantity"] == "rays"] == [False, False, True]


def test_environment_is_measured_empty_and_full_by_both_integrators(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("psutil")
    monkeypatch.setattr("fragtracer.gpu.tracer._MAPS", MapSizes(prefiltered=32, samples=64, irradiance=16, brdf=64))
    rows = _run(environment.BENCHMARK, Plan(scenes=("overcast",), size=TINY, runs=1)).rows
    cases = [(row["objects"], row["integrator"]) for row in rows]
    assert cases[:2] == [(0, "path"), (0, "split-sum")]
    assert [integrator for _, integrator in cases[2:]] == ["path", "split-sum"]
    assert cases[2][0] == cases[3][0] > 0
    for row in rows:
        assert row["fps"].value > 0
        assert row["gpu_mib"] > 0
    assert {row["document_fps"] for row in rows[:2]} == {environment.DOCUMENT["empty"][0]}
    scene = case(environment.SCENE)
    assert f"{len(scene.spheres) + len(scene.meshes)} objects" in environment.DOCUMENT


def test_memory_is_reported_over_time() -> None:
    pytest.importorskip("psutil")
    rows = _run(memory.BENCHMARK, Plan(scenes=("mirror",), size=TINY, seconds=0.1)).rows
    assert all(row["host_mib"] <= row["peak_mib"] and row["gpu_mib"] > 0 for row in rows)  # type: ignore[operator]


def test_ctrl_c_keeps_the_rows_so_far() -> None:
    def interrupt(share: float, text: str) -> None:
        if share > 0.1:
            raise KeyboardInterrupt

    results = suite.run_suite(["sweep"], Plan(size=TINY, runs=1), interrupt)
    assert not results.complete
    assert len(results.tables[0].rows) == 1


def test_error_keeps_the_rows_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> None:
        raise FragtracerError("no such thing")

    monkeypatch.setitem(suite.BENCHMARKS, "memory", (Benchmark(memory.table, fail),))
    plan = Plan(size=TINY, rays=(1,), runs=1)
    results = suite.run_suite(["sweep", "memory"], plan, lambda share, text: None)
    assert (results.complete, results.failure) == (False, "no such thing")
    assert [(table.name, len(table.rows)) for table in results.tables] == [("sweep", 1)]
    with pytest.raises(FragtracerError, match="no such thing"):
        suite.run_suite(["memory"], plan, lambda share, text: None)


def test_suite_runs_all_that_was_asked_for() -> None:
    progress: Progress = lambda share, text: None  # noqa: E731
    results = suite.run_suite(["sweep", "memory"], Plan(size=TINY, rays=(1,), runs=1, seconds=0.01), progress)
    assert results.complete
    assert [table.name for table in results.tables] == ["sweep", "memory"]
    assert {"processor", "GL renderer", "date", "fragtracer"} <= set(results.machine)


def test_gpu_clock_measures_draws_too(ctx: Any) -> None:
    framebuffer = ctx.simple_framebuffer((64, 64))
    timer = DrawTimer(ctx, gpu_clock=True)
    with timer:
        framebuffer.clear()
        ctx.finish()
    assert timer.seconds > 0
    framebuffer.release()


def test_frames_are_timed_by_the_wall_clock_of_a_software_renderer() -> None:
    frame = frame_time(with_settings(case("mirror"), TINY, rays=1), runs=3)
    assert frame.seconds is not None
    assert frame.seconds.runs == 3


@pytest.mark.parametrize("numbers", [{"rays": (0,)}, {"bounces": (-1,)}, {"light_samples": (5, 2000)}])
def test_impossible_numbers_are_refused(numbers: dict[str, tuple[int, ...]]) -> None:
    with pytest.raises(FragtracerError, match="give whole numbers from"):
        Plan(**numbers)


@needs_mitsuba
def test_meshes_have_a_row_for_each_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "TRIANGLES", (100, 1000, 5000))
    rows = _run(meshes.BENCHMARK, Plan(size=TINY, runs=1, seconds=0.01, sampler="independent")).rows
    np.testing.assert_allclose([row["triangles"] for row in rows], meshes.TRIANGLES, rtol=0.1)
    for row in rows:
        assert all(_value(row[name]) > 0 for name in ("build", "rate", "ns", "fragtracer", "mitsuba", "ratio"))
    assert "±" in str(rows[-1]["exponent"])


def test_the_knot_is_closed_and_faces_outwards() -> None:
    geometry = meshes.knot(2000)
    corners = geometry.positions[geometry.triangles]
    sides = np.sort(np.concatenate([geometry.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()
    volume = np.einsum("nx,nx->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert 10 < volume < 40
