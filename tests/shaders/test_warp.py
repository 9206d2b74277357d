# SPDX-License-Identifier: MIT
"""core/warp.glsl: each map of the unit square has the density that it says."""

import moderngl
import numpy as np
import pytest

from fragtracer.probe import probe

from .chi_square import assert_fits, fit
from .domains import Box, Cone, Disk, Domain, Triangle

WARP = ["core/warp.glsl"]
BELOW_ONE = np.nextafter(np.float32(1), np.float32(0))
CORNERS = np.array([(u, v) for u in (0, 1e-30, 0.5, BELOW_ONE) for v in (0, 1e-30, 0.5, BELOW_ONE)], np.float32)

# Function, width of its result, arguments after u, arguments of the pdf, domain.
WARPS: list[tuple[str, int, str, str, Domain]] = [
    ("square_to_disk", 2, "", "", Disk()),
    ("square_to_cosine_hemisphere", 3, "", "point", Cone()),
    ("square_to_uniform_sphere", 3, "", "", Cone(height=2)),
    ("square_to_triangle", 2, "", "", Triangle()),
    *[
        # A distant cone has fewer float32 values of z than cells, so its rim is where xy says.
        ("square_to_uniform_cone", 3, f", {height:.9f}", f"{height:.9f}", Cone(height=height, slack=1e-4))
        for height in (1.9, 1.0, 0.3, 1e-2, 1e-4, 1e-8)
    ],
]
IDS = [f"{name[10:]}{arguments}" for name, _, arguments, _, _ in WARPS]


@pytest.mark.parametrize(("name", "width", "arguments", "pdf_arguments", "domain"), WARPS, ids=IDS)
def test_samples_have_the_density(
    ctx: moderngl.Context, name: str, width: int, arguments: str, pdf_arguments: str, domain: Domain
) -> None:
    def pdf(points: np.ndarray) -> np.ndarray:
        return probe(ctx, WARP, f"pdf = {name}_pdf({pdf_arguments});", {"point": points}, {"pdf": 1})["pdf"]

    u = np.random.default_rng(1).random((1 << 20, 2), np.float32)
    point = probe(ctx, WARP, f"point = {name}(u{arguments});", {"u": u}, {"point": width})["point"]
    # Few cells, for a wrong density that is only a little aslant.
    assert_fits({name: fit(domain, point, pdf, cells=(8, 8))})


@pytest.mark.parametrize(("name", "width", "arguments", "pdf_arguments", "domain"), WARPS, ids=IDS)
def test_results_lie_in_the_domain(
    ctx: moderngl.Context, name: str, width: int, arguments: str, pdf_arguments: str, domain: Domain
) -> None:
    u = np.concatenate([CORNERS, np.random.default_rng(2).random((1 << 16, 2), np.float32)])
    body = f"point = {name}(u{arguments}); pdf = {name}_pdf({pdf_arguments});"
    result = probe(ctx, WARP, body, {"u": u}, {"point": width, "pdf": 1})
    point = result["point"].astype(np.float64)
    assert np.isfinite(point).all()
    if width == 3:
        assert np.abs(np.linalg.norm(point, axis=1) - 1).max() < 3e-7
    s, _ = domain.locate(point)
    assert s.min() >= 0
    assert s.max() <= 1 + 3e-7
    assert (result["pdf"] >= 0).all()


def test_disk_keeps_its_formula(ctx: moderngl.Context) -> None:
    """u.x is the angle in turns and u.y the square of the radius, so what is stratified stays so."""
    u = np.random.default_rng(3).random((1 << 16, 2), np.float32)
    disk = probe(ctx, WARP, "disk = square_to_disk(u);", {"u": u}, {"disk": 2})["disk"]
    expected, _ = Disk().place(u[:, 1].astype(np.float64), u[:, 0].astype(np.float64))
    np.testing.assert_allclose(disk, expected, rtol=0, atol=4e-7)


def test_square_to_itself_is_uniform() -> None:
    """The numbers these tests draw are themselves uniform."""
    u = np.random.default_rng(1).random((1 << 20, 2), np.float32)
    assert_fits({"u": fit(Box(), u, lambda points: np.ones(len(points)))})
