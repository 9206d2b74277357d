# SPDX-License-Identifier: MIT
"""Writes docs/correctness.md: for every feature the difference from Mitsuba and the smallest detectable bias.

usage: python scripts/correctness.py [--quick]

Takes hours on two cores: a first run of each row, which is thrown away, says how many samples the row needs.
--quick renders that first run with a sixteenth of the samples, is content with it and writes nothing.
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from fragtracer.apps.compare import compare_scene
from fragtracer.apps.compare.run import Comparison
from fragtracer.apps.compare.verdict import Verdict
from fragtracer.io.toml import bundled, load
from fragtracer.scene import Ambient, Camera, Light, Material, Plane, Rectangle, RenderSettings, Scene, Sphere

OUTPUT = Path(__file__).parents[1] / "docs" / "correctness.md"
SIZE, SPP, BATCHES, MARGIN = (320, 180), 512, 16, 0.005
MOST_SPP = 32 * SPP
JUDGED, BLOCK_BIAS = 0.9, 0.01  # what the samples are spent for

HEAD = """\
# What is proved, and how well

Each row is a comparison by `fragtracer compare`: the same scene rendered by fragtracer and by Mitsuba, whose material
is an independent implementation of the same formulas. Each makes {batches} independent batches of {size} pixels.
A difference counts however small it is and however dark the place: there is no allowance. The columns:

- *spp*: samples per pixel of each renderer, in all. A first run with {spp}, which is thrown away, says how many are
  needed for {judged} % of the regions that are not black to be judged and for the median block to detect
  {block_bias} %; at most {most_spp} are spent.
- *seed*: of both renderers, another one in each row: rows are independent of each other. No two rows share an image.
- *difference*: the relative difference of the image mean, in the colour where it is largest.
- *detectable*: the smallest bias of the image mean that this run would have found with a probability of 95 %, in the
  colour where that is largest.
- *blocks*: the same for the median and for the worst of about 144 blocks in three colours, those that are black in both
  images left out.
- *judged*: how many of the 4 x 4 regions in three colours, black ones left out, were measured well enough to be tested
  for equivalence.
- *parts*: how many of all parts (whole, regions, blocks, three colours each) have means that differ significantly, at
  α = 0.01 over all of them.
- *verdict*: *agreement* means that no part differs and that the image mean, and every region judged, is equivalent
  within {margin} %. What the other regions and darker or noisier blocks may hide is what *blocks* says.

Two of Mitsuba's single-precision errors would show without an allowance: its sphere emitter computes 1 - cos of the
light's cone by subtraction (22 % too much on a plane 340 m away), and its rays start some tenths of a millimetre off a
surface (a ten-thousandth of the square metre around a shadow in light-size-0 is lit that should not be, or the other
way about). So the reference has an emitter (`reference/plugins/sphere_light.py`) and an integrator
(`reference/plugins/path.py`) of its own: the first is right to 0.002 % from 0.2 m to 100 km, the second has less than a
tenth of those points wrong, against closed forms and float64 ray casting (`tests/reference/test_precision.py`).
`tests/reference/test_path.py` compares the integrator with Mitsuba's own `path` and `volpath`, and
`tests/test_reference_lambert.py` compares fragtracer with Mitsuba without any plugin. Intersections, emitters on other
shapes, films and filters are Mitsuba's. The disk that stands for an infinite plane has its rim 0.00002 pixels below the
horizon; with 0.002 pixels, sky without noise showed the difference.

One kind of false difference is known: light that one renderer finds so rarely that a small dark part misses it in every
batch. fragtracer draws the points of a gaussian pixel filter by its density, Mitsuba weighs evenly drawn ones: in black
sky two pixels from a lit sphere fragtracer has its first such point after some ten thousand samples. So the rows of
pixel filters are of a scene without black background.

Of meshes, intersection, light sampling and texture filtering are Mitsuba's own. Shading normals, normal maps, alpha and
unlit materials follow our own rules, which a Mitsuba plugin (`reference/plugins/surface.py`) implements a second time.
`tests/test_reference_meshes.py` compares each of them on its own.

Mitsuba is not the only evidence. The parts of the shader library are tested alone (`tests/shaders/`), `integrator/`
and `display/` by pictures; there are closed forms (`tests/test_furnace.py`, `tests/test_direct_light.py`) and a test
that the error converges to 65,536 samples per pixel without a floor (`tests/test_convergence.py`). The tests are
tested too: `tests/test_mutations.py` plants each of the errors of `tests/mutations.py`, one at a time, at least one in
every file of GLSL, and requires that the test which it names passes without it and fails with it; `make mutate` plants
random errors and lists those that no test finds.

Written by `python scripts/correctness.py` on {date} with fragtracer {fragtracer},
Mitsuba {mitsuba} ({variant}) and {renderer}.

{not_met}

| scene | what is special | spp | seed | difference | detectable | blocks: median, worst | judged | parts | verdict |
|---|---|---|---|---|---|---|---|---|---|
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
        yield "three-spheres-ambient", f"{kind} pixel filter", _with("three-spheres-ambient", pixel_filter=kind)
    for special, scene in of_materials():
        yield "(of the script)", special, scene
    lens = Camera(position=(0.0, 1.4, 4.2), target=(0.0, 0.45, 0.0), fov_degrees=35.0, aperture_radius=0.1)
    yield "three-spheres", "thin lens", replace(load("three-spheres"), camera=lens)


def of_materials() -> Iterator[tuple[str, Scene]]:
    """What light passes, and what coats and brushing do, each on one shape over a matte floor."""
    left, right = Sphere((-0.6, 0.5, 0.0), 0.5, "one"), Sphere((0.6, 0.5, 0.0), 0.5, "other")
    balls = {"spheres": [left, right]}
    glass, rough = {"model": "dielectric", "roughness": 0.0}, {"model": "dielectric", "roughness": 0.5}
    x, y, z = (1.4, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.2)
    low, high = (-0.7, 0.05, -0.1), (0.7, 1.05, 0.1)
    back = tuple(tuple(-c for c in edge) for edge in (x, y, z))
    corners = [(low, y, x), (low, x, z), (low, z, y), (high, back[0], back[1]), (high, back[2], back[0])]
    slab = [Rectangle(*corner, "one") for corner in (*corners, (high, back[1], back[2]))]
    pane = [Rectangle((-0.8, 0.0, 0.4), (1.6, 0.0, 0.3), (0.0, 1.2, 0.0), "one")]
    colored = {"attenuation_color": (0.9, 0.5, 0.2), "attenuation_distance": 0.5}
    bubble = [Sphere((0.0, 0.6, 0.0), 0.55, "one"), Sphere((0.1, 0.6, 0.0), 0.35, "other")]
    air = {"model": "dielectric", "roughness": 0.0, "ior": 1.0, "priority": 1}
    satin = {"model": "rough-plastic", "albedo": (0.8, 0.4, 0.2)}
    brushed = {"roughness": 0.4, "anisotropy": 0.8}
    yield "a slab of rough glass", _stage({"rectangles": slab}, rough, {})
    yield "a bubble in a sphere of glass", _stage({"spheres": bubble}, glass, air)
    yield "a pane", _stage({"rectangles": pane}, {"model": "thin-dielectric"}, {})
    yield "coloured glass, smooth and rough", _stage(balls, glass | colored, rough | colored)
    yield (
        "plastic, nonlinear and linear",
        _stage(balls, {"model": "plastic", "albedo": (0.8, 0.4, 0.2)}, {"model": "plastic", "nonlinear": False}),
    )
    yield (
        "rough plastic, nonlinear and linear",
        _stage(balls, satin | {"roughness": 0.3}, satin | {"roughness": 0.7, "nonlinear": False}),
    )
    yield (
        "anisotropic facets",
        _stage(balls, brushed | {"albedo": (0.8, 0.5, 0.3)}, brushed | {"model": "conductor", "metal": "gold"}),
    )
    yield (
        "the diffuse factor of the half vector",
        _stage(balls, {"diffuse_factor": "half-vector"}, {"diffuse_factor": "half-vector", "roughness": 0.2}),
    )


def _stage(shapes: Mapping[str, Any], one: Mapping[str, Any], other: Mapping[str, Any]) -> Scene:
    return Scene(
        camera=Camera((0.0, 1.4, 4.0), (0.0, 0.5, 0.0), fov_degrees=30.0),
        materials={"matt": Material(albedo=(0.6, 0.5, 0.4), specular=0.0)}
        | {"one": Material(**one), "other": Material(**other)},
        planes=[Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), "matt")],
        lights=[Light((-1.0, 3.0, 2.0), 0.5, power=300.0)],
        ambient=Ambient(0.3),
        render=RenderSettings(bounces=8),
        **shapes,
    )


def _with(name: str, **settings: object) -> Scene:
    scene = load(name)
    return replace(scene, render=replace(scene.render, **settings))


def compared(scene: Scene, seed: int, quick: bool) -> Comparison:
    """With the samples that a first run with other random numbers says are needed."""
    # With emitters alone in view, all noise is at their edges, and samples are cheap.
    spp = SPP * (8 if scene.render.bounces == 0 else 1) // (16 if quick else 1)
    first = compare_scene(scene, SIZE, spp, BATCHES, seed + 1, MARGIN)
    if quick:
        return first
    factor = 1.2 * first.verdict.spp_factor_for(JUDGED, BLOCK_BIAS)
    return compare_scene(scene, SIZE, int(np.clip(factor * spp, spp, max(spp, MOST_SPP))), BATCHES, seed, MARGIN)


def row(name: str, special: str, comparison: Comparison) -> str:
    verdict = comparison.verdict
    difference = verdict.image.pair.relative_difference[0, 0]
    largest = difference[abs(difference).argmax()]
    seen = f"{100 * verdict.detectable_bias.max():.3f} %" if comparison.ours.picture.any() else "both images black"
    blocks = ", ".join(_percent(bias) for bias in verdict.block_biases)
    judged, lit = verdict.judged_share
    parts = f"{verdict.differing} of {verdict.comparisons}"
    cells = [name, special, comparison.spp, comparison.seed, f"{100 * largest:+.3f} %", seen, blocks]
    return " | ".join(["", *map(str, cells), f"{judged} of {lit}", parts, verdict.outcome, ""]).strip()


def _percent(share: float) -> str:
    """Two significant digits, and all before the decimal point."""
    return f"{100 * share:.{2 if 100 * share < 10 else 0}{'g' if 100 * share < 10 else 'f'}} %"


def not_met(verdicts: list[tuple[str, str, Verdict]]) -> str:
    """Which rows have fewer regions judged, or a less precise median block, than was asked for."""
    short = []
    for name, special, verdict in verdicts:
        judged, lit = verdict.judged_share
        median, _ = verdict.block_biases
        if judged < JUDGED * lit or median > BLOCK_BIAS:
            short.append(f"{name}, {special} ({judged} of {lit}; {_percent(median)})")
    if not short:
        return "Every row has what the samples were spent for."
    return "Rows whose samples were not enough (regions judged; median block): " + "; ".join(short) + "."


def main(quick: bool) -> None:
    rows, verdicts = [], []
    for number, (name, special, scene) in enumerate(cases()):
        comparison = compared(scene, 2 * number, quick)
        rows.append(row(name, special, comparison))
        verdicts.append((name, special, comparison.verdict))
        print(rows[-1], flush=True)
    facts = {
        "batches": BATCHES,
        "size": f"{SIZE[0]} x {SIZE[1]}",
        "spp": SPP,
        "most_spp": MOST_SPP,
        "judged": f"{100 * JUDGED:g}",
        "block_bias": f"{100 * BLOCK_BIAS:g}",
        "margin": 100 * MARGIN,
        "not_met": not_met(verdicts),
        "date": date.today().isoformat(),
        "fragtracer": version("fragtracer"),
        "mitsuba": version("mitsuba"),
        "variant": comparison.reference.device,
        "renderer": comparison.ours.device,
    }
    print(facts["not_met"])
    if not quick:
        OUTPUT.write_text(HEAD.format(**facts) + "\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
