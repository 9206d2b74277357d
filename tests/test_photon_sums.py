# SPDX-License-Identifier: MIT
"""What photons bring is added up right, by the process or by a GPU."""

import shutil
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from test_gpu import Scarce
from test_light_tracing import spheres, sunlit

from fragtracer.errors import DeviceError, ShaderError
from fragtracer.gpu.context import max_size, nearest_texture
from fragtracer.gpu.outputs import Outputs
from fragtracer.gpu.program import PointsProgram
from fragtracer.gpu.specialise import Level
from fragtracer.gpu.splats import GpuSums
from fragtracer.light_tracing import PHOTONS, LightTracing, sums
from fragtracer.light_tracing.sums import ProcessSums, Splats
from fragtracer.light_tracing.tracer import LightTracer
from fragtracer.packing import pack
from fragtracer.packing.targets import targets_of
from fragtracer.resources import folder
from fragtracer.scene import RenderSettings


@pytest.mark.parametrize("size", [(7, 5), (5, 7)])
def test_a_gpu_adds_up_as_the_process_does(ctx: Any, size: tuple[int, int]) -> None:
    """Each photon to its pixel and half, and none that is unseen, not finite or cut short."""
    rng, height = np.random.default_rng(3), size[1]
    both = ProcessSums(size), GpuSums(ctx, size)
    for half in (0, 1, 1):
        splats, places = rng.random((2, 40, 30, 4), np.float32)
        splats[..., 3] = rng.choice([0, 1, -1], (40, 30), p=[0.3, 0.6, 0.1])
        splats[splats[..., 3] < 0, :3] = np.nan
        places[..., :2] = rng.integers(0, size, (40, 30, 2))
        drawn = [nearest_texture(ctx, (30, 40), 4, texels.tobytes()) for texels in (splats, places)]
        ctx.blend_equation = moderngl.FUNC_SUBTRACT  # as a program beside this one may have left it
        for each in both:
            each.add((drawn[0], drawn[1]), half)
    assert both[1].non_finite == both[0].non_finite > 300
    found = [each.read(0, height) for each in both]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)
    for each in both:
        np.testing.assert_array_equal(each.read(1, 2), each.read(0, height)[:, 1:3])
    nothing, splats[3, 4] = np.zeros_like(splats), (0.0, 0.0, 0.0, -2.0)
    others = Outputs(ctx, [nearest_texture(ctx, size)])
    for each in both:
        drawn[0].write(splats.tobytes())
        with pytest.raises(DeviceError, match="fewer bounces"):
            each.add((drawn[0], drawn[1]), 0)
        others.use()
        others.restrict(1, 2)  # what is drawn there, and no more
        each.clear()
        assert each.non_finite == 0
        assert not each.read(0, height).any()
        each.write(found[0], 5)
        drawn[0].write(nothing.tobytes())
        each.add((drawn[0], drawn[1]), 0)
        np.testing.assert_allclose(each.read(0, height), found[0], rtol=1e-6)
        assert each.non_finite == 5
        each.release()
    others.release()
    for texture in drawn:
        texture.release()


def test_the_process_adds_up_where_a_gpu_cannot(ctx: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a driver that does not blend such textures, nor pictures that leave no room for another row."""
    monkeypatch.setattr(sums, "is_software", lambda _: False)
    for size, kind in (((4, 3), GpuSums), ((4, max_size(ctx)), ProcessSums)):
        found = sums.sums_of(ctx, size)
        assert isinstance(found, kind)
        found.release()
    monkeypatch.setattr(PointsProgram, "add", lambda self, count: self._draw(moderngl.POINTS, count))
    assert isinstance(sums.sums_of(ctx, (4, 3)), ProcessSums)


def test_each_pixel_of_a_large_picture_has_photons(ctx: Any) -> None:
    """Of more than can be numbered in float32."""
    size = 8192, 8192
    packed = pack(sunlit(), RenderSettings(), *size)
    tracer = LightTracer(ctx)
    tracer.load(packed, targets_of(packed, sunlit()), size, Level.NOTHING)
    found = Splats.read(tracer.trace(0), size[1])
    high = found.row < size[1] // 2
    assert (high & (found.column % 2 == 1)).sum() > 100
    assert (high & (found.column % 2 == 0)).sum() > 100
    tracer.release()


def test_after_a_program_that_does_not_compile_the_last_one_is_there(ctx: Any, tmp_path: Path) -> None:
    shutil.copytree(folder("shaders"), tmp_path / "broken")
    (tmp_path / "broken/light_tracing.frag").write_text("no shader")
    packed = pack(sunlit(), RenderSettings(), 8, 4)
    known: tuple[Any, ...] = packed, targets_of(packed, sunlit()), (8, 4), Level.NOTHING
    tracer = LightTracer(ctx)
    tracer.load(*known)
    before = [texture.read() for texture in tracer.trace(0)]
    with pytest.raises(ShaderError):
        tracer.load(*known, root=tmp_path / "broken")
    tracer.load(*known)
    assert [texture.read() for texture in tracer.trace(0)] == before
    tracer.release()


def test_an_odd_number_of_passes_has_no_difference_of_its_own(ctx: Any) -> None:
    """As where the window shows a picture."""
    light = LightTracing(ctx)
    packed = pack(spheres(), RenderSettings(), 2, 1)
    light.load(packed, spheres(), (2, 1), 0.5, Level.NOTHING)
    each = np.full((1, 2, 3), 7.0 * PHOTONS)  # that a pass brings
    state = {"photons_per_sample": 0.5, "light_passes": 3, "light_non_finite": 0}
    light.restore(state, {"light.sums": np.stack([2 * each, each, each])})
    radiance, difference, _ = light.light(0, 1)
    np.testing.assert_allclose(radiance, 7.0)
    np.testing.assert_allclose(difference, 0.0, atol=1e-12)
    light.release()


@pytest.mark.parametrize("textures", range(3))
def test_sums_that_do_not_fit_leave_nothing_behind(ctx: moderngl.Context, textures: int) -> None:
    scarce: Any = Scarce(ctx, textures)
    with pytest.raises(DeviceError, match="no memory for the photons of 8x4"):
        GpuSums(scarce, (8, 4))
    assert sum(isinstance(resource, moderngl.Texture) for resource in scarce.living) == textures
    assert all(isinstance(resource.mglo, moderngl.mgl.InvalidObject) for resource in scarce.living)
    assert scarce.error_was_taken
