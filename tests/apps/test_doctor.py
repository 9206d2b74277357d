# SPDX-License-Identifier: MIT
"""The doctor passes where the suite does, and notices a driver that computes something else."""

from importlib import import_module

import pytest
from command import status_of
from rendering import Planter

from fragtracer.apps.doctor import CHECKS, Finding, examine
from fragtracer.apps.doctor.report import write_report
from fragtracer.errors import ShaderError

# For each check, an error in the shaders that it has to notice: file, text, replacement.
SICKNESS = {
    "numbers": ("core/hash.glsl", "v ^= v >> 16u;", "v ^= v >> 15u;"),
    "samplers": (
        "core/warp.glsl",
        "vec3(p, sqrt(max(0.0, 1.0 - dot(p, p))))",
        "normalize(vec3(p, 1.02 * sqrt(max(0.0, 1.0 - dot(p, p)))))",
    ),
    "intersections": ("shape/sphere.glsl", "near = b - half_chord;", "near = b - 1.001 * half_chord;"),
    "flat intersections": ("shape/flat.glsl", "dot(uv, uv) - 1.0", "dot(uv, uv) - 1.01"),
    "traversal": ("shape/bvh.glsl", "near.w <= far.w && node.count > 3u", "false"),
    "texels in traversal": (
        "texture/texture.glsl",
        "texture_wrap(uv.y, t.wrap_v)",
        "texture_wrap(uv.y + 0.01, t.wrap_v)",
    ),
    "furnace": ("integrator/path.glsl", "*= scattered.weight", "*= 0.99 * scattered.weight"),
    "estimators": ("light/area.glsl", "(cos_theta * area)", "(1.1 * cos_theta * area)"),
    "determinism": ("film/film.glsl", "first + uint(max(mean.a + variance.a, 0.0))", "first + uint(u_rays)"),
}


@pytest.mark.parametrize("check", SICKNESS)
def test_it_notices(ctx, check, monkeypatch, tmp_path):
    plant = Planter(monkeypatch, tmp_path)
    plant(*SICKNESS[check])
    if check == "determinism":
        plant("film/film.glsl", "struct Film {", "uniform int u_rays;\nstruct Film {")
        plant("pathtracer.frag", "uniform int u_rays;  // paths per fragment in this pass\n", "")
    findings = import_module(f"fragtracer.apps.doctor.{check.split()[-1]}").findings(ctx)
    assert not all(finding.passed for finding in findings)


def test_a_program_that_does_not_compile_is_a_finding(ctx, monkeypatch, tmp_path):
    Planter(monkeypatch, tmp_path)("integrator/path.glsl", "Path path_begin(", "Paht path_begin(")
    first = next(examine(ctx))
    assert not first.passed
    assert "integrator/path.glsl:" in first.detail


def test_an_error_becomes_a_finding(ctx, monkeypatch):
    def fail(_):
        raise ShaderError("no")

    monkeypatch.setattr("fragtracer.apps.doctor.compile.findings", fail)
    first = next(examine(ctx))
    assert (first.check, first.passed, first.detail) == ("compile", False, "no")


def test_the_report_says_what_failed(tmp_path):
    findings = [Finding("numbers", "hash <x>", True, "0 of 9"), Finding("furnace", "mis", False, "0.4")]
    write_report(tmp_path / "r.html", {"GL renderer": "test & try"}, findings)
    page = (tmp_path / "r.html").read_text("utf-8")
    assert "1 of 2 checks failed" in page
    assert CHECKS["furnace"] in page
    assert "hash &lt;x&gt;" in page
    assert "test &amp; try" in page


# Those of the bundled scenes that other checks need; what the doctor does with each is the same.
SOME = ["furnace", "roughness-grid"]


@pytest.mark.slow
def test_it_passes_here_and_writes_a_report(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fragtracer.apps.doctor.compile.bundled", lambda: SOME)
    status = status_of(monkeypatch, "doctor", "--report", tmp_path / "r.html")
    out = capsys.readouterr().out
    assert status == 0, out
    *lines, summary = out.splitlines()
    findings = [line for line in lines if line.startswith("passed")]
    assert summary == f"{len(findings)} passed, 0 failed"
    assert {line.split()[1] for line in findings} == set(CHECKS)
    assert f"all {len(findings)} checks passed" in (tmp_path / "r.html").read_text("utf-8")
