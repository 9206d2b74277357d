# SPDX-License-Identifier: MIT
"""Writes docs/correctness.md: for every feature the difference from Mitsuba and the smallest detectable bias.

usage: python scripts/correctness.py [--minutes N] [--again COMMIT]

A first run of each row, which is thrown away, says how many samples the row needs. All rows take hours on two cores, so
each is kept in docs/correctness.json as soon as it is made, with the commit that made it, and the table is written
again: --minutes ends after the row during which they have passed, and the next call goes on with what is missing, rows
that need few samples first. --again forgets the rows that were made by a commit.
"""

import argparse
import json
import subprocess
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from fragtracer.apps.compare import compare_scene
from fragtracer.apps.compare.run import Comparison
from fragtracer.io.toml import bundled, load
from fragtracer.scene import Ambient, Camera, Light, Material, Plane, Rectangle, RenderSettings, Scene, Sphere

CHECKOUT = Path(__file__).parents[1]
OUTPUT, KEPT = (CHECKOUT / "docs" / f"correctness.{suffix}" for suffix in ("md", "json"))
SIZE, SPP, BATCHES, MARGIN = (320, 180), 512, 16, 0.005
MOST_SPP = 32 * SPP
FIRST_OF_EMITTERS = 8  # times SPP, of the first run where emitters alone are seen
JUDGED, BLOCK_BIAS = 0.9, 0.01  # what the samples are spent for

HEAD = """\
# What is proved, and how well

Each row is a comparison by `fragtracer compare`: the same scene rendered by fragtracer and by Mitsuba, whose material
is an independent implementation of the same formulas. Each makes {batches} independent batches of {size} pixels.
A row of a scene "as it is" is that by `fragtracer compare SCENE --size {size_option} --spp SPP --seed SEED --margin
{margin}`, with the numbers that stand in it.
A difference counts however small it is and however dark the place: there is no allowance. The columns:

- *spp*: samples per pixel of each renderer, in all. A first run with {spp} ({most_first_spp} for 0 bounces), which
  is thrown away, says how many are needed for {judged} % of the regions that are not black to be judged and for the
  median block to detect {block_bias} %; at most {most_spp} are spent.
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

For the same reason the comparison is of paths alone, sampled evenly: `compare` and these rows leave guiding and the
gradient domain off, and adaptive sampling and light tracing unless the scene file says `"on"`, which no bundled one
does. In the dark far floor of three-spheres guided paths find 0.1 % more light, reflected by the spheres, which
unguided ones, fragtracer's own and Mitsuba's, do not meet once in sixteen batches. What is on by default is held
against such paths by tests: adaptive sampling (`tests/test_adaptive_sampling.py`), guiding (`tests/test_guiding.py`),
light tracing, whose photons bring what paths find of the same light, where both find it
(`tests/test_light_tracing.py`), and the gradient domain (`tests/test_gradient_domain.py`). A copy of mirror with
`light_tracing = "on"` agrees with Mitsuba (`compare FILE --size 96x54 --spp 65536`, 2026-11-25: none of 483 tests
finds a difference; one of 0.062 % of the picture's mean would have been found with a probability of 95 %); with few
samples it does not (160 x 90 pixels, the 1024 samples of `compare`: +0.9 % on a ball that shows light from the
mirrors), since paths, Mitsuba's and fragtracer's, meet too little of that light to know how much they miss. Paths of
12 times 4,096 samples have what photons have there to 0.2 %, their standard error.

Of meshes, intersection, light sampling and texture filtering are Mitsuba's own. Shading normals, normal maps, alpha and
unlit materials follow our own rules, which a Mitsuba plugin (`reference/plugins/surface.py`) implements a second time.
`tests/test_reference_meshes.py` compares each of them on its own.

The driver is Mesa's llvmpipe here, which reads tables from images; that the textures of other drivers give the same
pictures is tested with softpipe (`tests/test_gpu.py`); `doctor` and 588 tests passed once with those on zink, Mesa's
OpenGL over Vulkan (lavapipe, Mesa 22.3). An NVIDIA driver was asked twice: by `fragtracer doctor`, whose 55 checks it
passed, and by 2,087 tests, of which 21 failed, and, when that was mended, by 2,588, of which three failed. What they
show is in [performance.md](performance.md#on-a-gpu). Apple's, Intel's and AMD's drivers were never asked; `fragtracer
doctor` asks a driver the first of what these tests ask: whether it compiles all programs, and whether arithmetic,
sampled directions, intersections, the way through the BVH, texels, energy and the agreement of estimators are right.
Dielectrics, media and environments it only compiles.

**Random scenes** put together what neither bundled scenes nor tests do:

```
python scripts/random_scenes.py --seeds 800 860
python scripts/random_scenes.py --ways --seeds 820 850
```

The first draws materials of all models, textured, coated, with sheen, with alpha, blended, on meshes of all attributes
or none and on other shapes, dielectrics and media within each other, lights of all kinds, environments and fog, and
judges each scene as `compare` does (48 x 36 pixels, 1024 samples; commit 4ea2dc4). Of these 60, 53 agree, 6 are too
noisy to say, and one differs, but agrees with other random numbers and four times the samples, twice. The second holds
our own ways to sample against plain paths: guiding, light tracing, and both with adaptive sampling or in the gradient
domain. Of its 120 comparisons 108 agree, 12 are too noisy to say, and none differs. Since there are grounds that are
spheres, thin films, diffuse transmission and black backs among them, 79 of 100 scenes agree (`--spp 512`, `--seeds
7000 7060` of commit b525d9e and `--seeds 8000 8040` of f5c0ff0), 17 are too noisy, 2 Mitsuba cannot show, and 2 differ
in dark blocks, but agree with other random numbers and four times the samples. Of 40 comparisons of our own ways
(`--ways --seeds 8100 8110 --spp 256` of f5c0ff0) 33 agree, 3 are too noisy, and 4 differ: one agrees with other
numbers, and the others are of a scene in which panes mirror a directional light, which light tracing alone finds.
Before there were coats, sheen and flat shapes among them, 100 of 120 scenes (`--seeds 400 520` of commit 9cf5614)
agreed, 14 were too noisy, 2 Mitsuba cannot show, and 4 differed: three agree with other random numbers; in the fourth,
paths met the shadow of a pane so rarely that their error was not known. Rays to lights pass panes since, and it
agrees.

Mitsuba is not the only evidence. The parts of the shader library are tested alone (`tests/shaders/`), `integrator/`
and `display/` by pictures; there are closed forms (`tests/test_furnace.py`, `tests/test_direct_light.py`) and a test
that the error converges to 65,536 samples per pixel without a floor (`tests/test_convergence.py`). The tests are
tested too: `tests/test_mutations.py` plants each of the errors of `tests/mutations/`, one at a time, at least one in
every file of GLSL, and requires that the test which it names passes without it and fails with it; `make mutate` plants
random errors and lists those that no test finds. Of its 200 (seed 1, judged at commits 09e70e9, 92e4bab and 3b15303)
160 were found (six of them planted by hand, by tests that the script did not run or that came since), 25 change
nothing, by reading (other random numbers, as good; channels that nobody reads; a guard against divisions that round
up), and **15 (7.5 %; the goal was 2 %) survived**. Seven of these were left by all tests: rays through instances of a
hundredth and less were taken for their opposites; the point of equiangular sampling was mirrored at the origin of the
ray; the record beside the sun's was read where it is met; prefiltered maps lacked their first sample; a fourth medium
that has no index got one; normals at odds with their triangle stayed so; blue was dispersed by 1 % too much. The other
eight were left by the tests of their folder and not given to all others: records of point lights one texel apart, no
samples of glossy surfaces and metals for grazing viewers, two errors of the BRDF map, the relative error in the
viewer, the numbers of objects in mattes, and vertices that share the random numbers of the camera. Each has a test
since, which was seen to find it. `docs/mutations.jsonl` has all of them. When tests were shortened, 73 were planted
again that a changed file had found (2026-11-29): it, or another one of the same folder of shaders, finds 71, and the
other two only give other random numbers, with which a noisy comparison had failed.

Written by `python scripts/correctness.py` with Mitsuba {mitsuba} ({variant}) and {renderer}; the last column names the
commit of fragtracer that made the row.

{summary}

{not_met}

{missing}

| scene | feature | spp | seed | difference | detectable | blocks: median, worst | judged | parts | verdict | commit |
|---|---|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Row:
    """What is known of a case; shares are of 1, ``detectable`` is None where both images are black."""

    scene: str
    special: str
    commit: str
    needed_spp: int  # by the first run
    spp: int = 0  # of the run that counts, 0 before it
    seed: int = 0
    difference: float = 0.0
    detectable: float | None = None
    median_block: float = 0.0
    worst_block: float = 0.0
    judged: int = 0
    lit: int = 0
    differing: int = 0
    parts: int = 0
    outcome: str = ""

    @property
    def is_short(self) -> bool:
        """Whether fewer regions were judged, or the median block less precisely, than was asked for."""
        return self.judged < JUDGED * self.lit or self.median_block > BLOCK_BIAS

    def __str__(self) -> str:
        seen = "both images black" if self.detectable is None else f"{100 * self.detectable:.3f} %"
        blocks = f"{_percent(self.median_block)}, {_percent(self.worst_block)}"
        judged, parts = f"{self.judged} of {self.lit}", f"{self.differing} of {self.parts}"
        cells = (self.spp, self.seed, f"{100 * self.difference:+.3f} %", seen, blocks, judged, parts, self.outcome)
        return " | ".join(["", self.scene, self.special, *map(str, cells), self.commit, ""]).strip()


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
    paint = {"albedo": (0.5, 0.02, 0.02), "metallic": 0.5, "roughness": 0.6, "coat": 1.0}
    satin = {"albedo": (0.2, 0.4, 0.8), "roughness": 0.8, "coat": 0.7, "coat_roughness": 0.4, "coat_ior": 1.8}
    yield "clear coats, smooth and rough", _stage(balls, paint, satin)
    frosted = {"model": "rough-thin-dielectric", "roughness": 0.4, "transmittance": (0.8, 1.0, 0.9)}
    yield "a ball behind a frosted pane", _stage({"rectangles": pane, "spheres": [right]}, frosted, {"metal": "gold"})


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


def first_run(case: tuple[str, str, Scene], seed: int, commit: str) -> Row:
    """How many samples a row needs."""
    name, special, scene = case
    # All noise is at the edges of the emitters then, and samples are cheap.
    spp = SPP * (FIRST_OF_EMITTERS if scene.render.bounces == 0 else 1)
    factor = 1.2 * compare_scene(scene, SIZE, spp, BATCHES, seed, MARGIN).verdict.spp_factor_for(JUDGED, BLOCK_BIAS)
    return Row(name, special, commit, int(np.clip(factor * spp, spp, max(spp, MOST_SPP))))


def full_run(row: Row, scene: Scene, seed: int, commit: str) -> tuple[Row, Comparison]:
    """The row as it counts, from other random numbers than the first run."""
    comparison = compare_scene(scene, SIZE, row.needed_spp, BATCHES, seed, MARGIN)
    verdict = comparison.verdict
    difference = verdict.image.pair.relative_difference[0, 0]
    median_block, worst_block = map(float, verdict.block_biases)
    judged, lit = map(int, verdict.judged_share)
    made = Row(
        *(row.scene, row.special, commit, row.needed_spp, comparison.spp, comparison.seed),
        difference=float(difference[abs(difference).argmax()]),
        detectable=float(verdict.detectable_bias.max()) if comparison.ours.picture.any() else None,
        median_block=median_block,
        worst_block=worst_block,
        judged=judged,
        lit=lit,
        differing=int(verdict.differing),
        parts=int(verdict.comparisons),
        outcome=str(verdict.outcome),
    )
    return made, comparison


def _percent(share: float) -> str:
    """Two significant digits, and all before the decimal point."""
    return f"{100 * share:.{2 if 100 * share < 10 else 0}{'g' if 100 * share < 10 else 'f'}} %"


def document(rows: list[Row], of_all: int, devices: Mapping[str, str]) -> str:
    """The text of docs/correctness.md."""
    made = [row for row in rows if row.spp]
    agree = sum(row.outcome == "agreement" for row in made)
    differing, parts = sum(row.differing for row in made), sum(row.parts for row in made)
    summary = f"**{agree} of {len(made)} rows agree; {differing} of {parts:,} parts differ.**"
    short = [f"{r.scene}, {r.special} ({r.judged} of {r.lit}; {_percent(r.median_block)})" for r in made if r.is_short]
    not_met = "Every row has what the samples were spent for."
    if short:
        not_met = f"Rows whose samples were not enough (regions judged; median block): {'; '.join(short)}."
    missing = "No row is missing."
    if len(made) < of_all:
        waiting = [f"{row.scene}, {row.special} ({row.needed_spp} spp)" for row in rows if not row.spp]
        missing = f"{of_all - len(made)} of {of_all} rows were not made yet. Of them the first run says: " + (
            f"{'; '.join(waiting)}." if waiting else "nothing yet."
        )
    facts = {
        "batches": BATCHES,
        "size": f"{SIZE[0]} x {SIZE[1]}",
        "size_option": "x".join(map(str, SIZE)),
        "spp": SPP,
        "most_first_spp": FIRST_OF_EMITTERS * SPP,
        "most_spp": MOST_SPP,
        "judged": f"{100 * JUDGED:g}",
        "block_bias": f"{100 * BLOCK_BIAS:g}",
        "margin": 100 * MARGIN,
        "summary": summary,
        "not_met": not_met,
        "missing": missing,
    }
    return HEAD.format(**facts, **devices) + "\n".join(map(str, made)) + "\n"


def current_commit() -> str:
    command = ["git", "-C", str(CHECKOUT), "rev-parse", "--short", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def main() -> None:
    parser = argparse.ArgumentParser(description="Write docs/correctness.md, row by row.")
    parser.add_argument("--minutes", type=float, default=float("inf"), metavar="N", help="end after so many")
    parser.add_argument("--again", metavar="COMMIT", help="forget the rows that were made by this commit")
    options = parser.parse_args()
    end = time.monotonic() + 60 * options.minutes
    commit = current_commit()
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.is_file() else {"devices": {}, "rows": []}
    rows = {(row["scene"], row["special"]): Row(**row) for row in kept["rows"] if row["commit"] != options.again}
    devices: dict[str, str] = kept["devices"]
    scenes = {(name, special): scene for name, special, scene in cases()}
    seeds = {key: 2 * (crc32(", ".join(key).encode()) % 1_000_000) for key in scenes}
    assert len(set(seeds.values())) == len(seeds)

    def write() -> None:
        known = [rows[key] for key in scenes if key in rows]
        KEPT.write_text(json.dumps({"devices": devices, "rows": [*map(asdict, known)]}, indent=1), encoding="utf-8")
        if devices:
            OUTPUT.write_text(document(known, len(scenes), devices), encoding="utf-8")

    def keep(row: Row) -> None:
        rows[row.scene, row.special] = row
        write()

    write()  # what stands above the table may be another text now
    for key, scene in scenes.items():
        if key not in rows and time.monotonic() < end:
            keep(first_run((*key, scene), seeds[key] + 1, commit))
            print(f"{key}: {rows[key].needed_spp} spp", flush=True)
    for row in sorted((rows[key] for key in scenes if key in rows), key=lambda row: row.needed_spp):
        if not row.spp and time.monotonic() < end:
            key = row.scene, row.special
            made, comparison = full_run(row, scenes[key], seeds[key], commit)
            devices = {
                "mitsuba": version("mitsuba"),
                "variant": comparison.reference.device,
                "renderer": comparison.ours.device,
            }
            keep(made)
            print(made, flush=True)


if __name__ == "__main__":
    main()
