# SPDX-License-Identifier: MIT
"""Writes docs/correctness.md: for every feature the difference from Mitsuba and the smallest detectable bias.

usage: python scripts/correctness.py [--quick]

Takes about ten minutes on two cores; --quick renders a sixteenth of the samples and writes nothing.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path

from fragtracer.apps.compare import compare_scene
from fragtracer.apps.compare.run import Comparison
from fragtracer.io.toml import bundled, load
from fragtracer.scene import Camera, Scene

OUTPUT = Path(__file__).parents[1] / "docs" / "correctness.md"
SIZE, SPP, BATCHES, MARGIN = (320, 180), 512, 16, 0.005

HEAD = """\
# What is proved, and how well

Each row is a comparison by `fragtracer compare`: the same scene rendered by fragtracer and by Mitsuba, whose material
is an independent implementation of the same formulas. Each makes {batches} independent batches of {size} pixels,
{spp} samples per pixel in all (8 times as many where nothing scatters). *Difference* is the relative difference of the
image mean, in the colour where it is largest. *Detectable* is the smallest bias of the image mean that this run would
have found with a probability of 95 %, in the colour where that is largest. *Parts* counts those of the image (whole,
4 x 4 regions, about 144 blocks, three colours each) whose means differ significantly, at α = 0.01 over all of them. The
verdict *agreement* means that no part differs and that the image mean, and every region measured well enough, is
equivalent within {margin} %.

Differences of less than 0.02 % of the image mean are not counted: the reference allowance, the largest error of
Mitsuba's own single precision that was measured. Its sphere emitter computes 1 - cos of the light's cone by subtraction
(22 % too much on a plane 340 m away in red-bounce, where a closed form shows that fragtracer is right to 0.05 %), and
its rays start some tenths of a millimetre off a surface (0.03 % at the shadow's edge in light-size-0, against float64
ray casting). The effect on these two images was measured once, by hand; `tests/reference/test_precision.py` measures
the causes. Without the allowance, at the default size and samples of `compare`, parts differ in three scenes: 41 of 483
in red-bounce, 4 in light-size-small, 3 in light-size-0.

Of meshes, intersection, light sampling and texture filtering are Mitsuba's own. Shading normals, normal maps, alpha and
unlit materials follow our own rules, which a Mitsuba plugin (`reference/plugins/surface.py`) implements a second time.
`tests/test_reference_meshes.py` compares each of them on its own.

Mitsuba is not the only evidence. Every function of the shader library is tested alone (`tests/shaders/`); there are
closed forms (`tests/test_furnace.py`, `tests/test_direct_light.py`) and a test that the error converges to 65,536
samples per pixel without a floor (`tests/test_convergence.py`). The tests are tested too: `tests/test_mutations.py`
plants each of the errors of `tests/mutations.py`, one at a time, and requires that each is found.

Written by `python scripts/correctness.py` on {date} with fragtracer {fragtracer},
Mitsuba {mitsuba} ({variant}) and {renderer}.

| scene | what is special | difference | detectable | parts | verdict |
|---|---|---|---|---|---|
"""


def cases() -> Iterator[tuple[str, str, Scene]]:
    """Scene name, what is special about it, and the scene."""
    for name in bundled():
        yield name, "as it is", load(name)
    for name in ("three-spheres", "roughness-grid", "mirror"):
        for geometry in ("smith-height-correlated", "schlick-beckmann", "karis"):
            yield name, f"geometry term {geometry}", _with(name, geometry=geometry)
    for name in ("three-spheres", "roughness-grid"):
        yield name, "multiple scattering", _with(name, multiple_scattering=True)
    for name in ("three-spheres", "three-spheres-ambient", "cornell-box"):
        for bounces in (0, 1, 2, 10):
            for light_samples in (1, 8) if bounces else (1,):
                special = f"{bounces} bounces, {light_samples} light sample{'s' * (light_samples > 1)}"
                yield name, special, _with(name, bounces=bounces, light_samples=light_samples)
    for kind in ("tent", "gaussian"):
        yield "red-bounce", f"{kind} pixel filter", _with("red-bounce", pixel_filter=kind)
    lens = Camera(position=(0.0, 1.4, 4.2), target=(0.0, 0.45, 0.0), fov_degrees=35.0, aperture_radius=0.1)
    yield "three-spheres", "thin lens", replace(load("three-spheres"), camera=lens)


def _with(name: str, **settings: object) -> Scene:
    scene = load(name)
    return replace(scene, render=replace(scene.render, **settings))


def row(name: str, special: str, comparison: Comparison) -> str:
    verdict = comparison.verdict
    difference = verdict.image.pair.relative_difference[0, 0]
    largest = difference[abs(difference).argmax()]
    seen = f"{100 * verdict.detectable_bias.max():.3f} %" if comparison.ours.picture.any() else "both images black"
    parts = f"{verdict.differing} of {verdict.comparisons}"
    return f"| {name} | {special} | {100 * largest:+.3f} % | {seen} | {parts} | {verdict.outcome} |"


def main(quick: bool) -> None:
    rows = []
    for name, special, scene in cases():
        # With emitters alone in view, all noise is at their edges, and samples are cheap.
        spp = SPP * (8 if scene.render.bounces == 0 else 1) // (16 if quick else 1)
        comparison = compare_scene(scene, SIZE, spp, BATCHES, margin=MARGIN)
        rows.append(row(name, special, comparison))
        print(rows[-1], flush=True)
    facts = {
        "batches": BATCHES,
        "size": f"{SIZE[0]} x {SIZE[1]}",
        "spp": SPP,
        "margin": 100 * MARGIN,
        "date": date.today().isoformat(),
        "fragtracer": version("fragtracer"),
        "mitsuba": version("mitsuba"),
        "variant": comparison.reference.device,
        "renderer": comparison.ours.device,
    }
    if not quick:
        OUTPUT.write_text(HEAD.format(**facts) + "\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
