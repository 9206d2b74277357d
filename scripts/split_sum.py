# SPDX-License-Identifier: MIT
"""Writes docs/split-sum.md and its pictures: what the split-sum approximation gets wrong, error by error.

usage: python scripts/split_sum.py [--quick]

Takes some minutes on two cores; --quick takes a sixteenth of the samples and writes to a temporary folder.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

from fragtracer.apps.compare import words
from fragtracer.apps.compare.approximation import ANGLES, Approximation, by_roughness_and_angle, measure_approximation
from fragtracer.apps.compare.approximation_report import write_error_maps, write_pictures
from fragtracer.io.toml import load
from fragtracer.scene import Camera, Scene

DOCS = Path(__file__).parents[1] / "docs"
SPHERES, WHOLE = ((280, 280), 256), ((300, 200), 96)  # size and samples per pixel of each estimator

HEAD = """\
# The split-sum approximation, held against the truth

Game engines light surfaces from an environment without tracing rays: the irradiance of each direction, the mean light
over the specular lobe of each roughness, and the mean reflectance of that lobe are tabulated beforehand, and a pixel
looks up three numbers (Karis 2013, *Real Shading in Unreal Engine 4*). fragtracer has this approximation as an
integrator beside its path tracer, so that what it gets wrong can be seen and measured:

```
fragtracer render spheres-49 -o out.png --integrator split-sum
fragtracer compare spheres-49 --split-sum --report report.html --json report.json
```

## What is looked up

For a surface of normal n, seen from v, with r the mirrored direction:

    kd · albedo · E(n)/π  +  P(r, roughness) · (F · scale + F90 · bias)         all times the occlusion texture
    F  = F0 + (max((1 - roughness) F90, F0) - F0) (1 - n·v)⁵,   kd = (1 - F)(1 - metallic)

- **E**, irradiance, 32² texels for each face of a cube: the sum over all texels of the environment at 64² a face.
- **P**, the prefiltered environment: 128² to 8² a face for five roughnesses from 0 to 1. Each texel takes 1024
  directions of a Hammersley set, with the density of the GGX lobe for n = v = r, weighted by their cosine; a direction
  looks up the level of the environment (at most 512² a face) whose texels are as large as the direction's share of the
  lobe, so that a small sun does not show as dots. Between roughnesses two levels are mixed.
- **scale** and **bias**, 512² over n·v and roughness: the lobe's reflectance for F0 and F90, with Schlick's masking and
  k = roughness²/2.
- Lights are points without shadows, with k = (roughness + 1)²/8; the sun of a sky is one of them. Meshes that emit are
  seen, and give no light.

The maps are computed on the GPU (`shaders/split_sum/`) and kept on disk under a digest of all they depend on: a second
start reads them. They lie in the system's folder for caches, or in the one that `FRAGTRACER_CACHE` names; a damaged
file is noticed by its digest and made anew, and beyond 2 GiB the files unused for longest go.
Cube maps are seamless: each face carries a rim of its neighbours' texels.

Tests hold the maps to float64 integrals (`tests/test_cube_maps.py`): irradiance within 0.2 % under a soft sun;
the prefiltered map within 0.5 % of the same formula in float64, and of the integral under a smooth environment; the
BRDF map within 0.005. Closed forms hold the integrator, and each step below (`tests/test_split_sum.py`).

## One error at a time

Between the truth and the approximation lie estimators that make one more error each. The first are the path tracer:
with facets that reflect light more than once (`multiple_scattering`, a published fit: material.md), without, and with
one bounce. From there on, the same program as the approximation's *integrates* ∫ L(wi) g(wi) dwi with samples by the
material and by the environment (multiple importance sampling) instead of looking up, g changing by one thing each time:

| step | g |
|---|---|
| direct light | f(wo, wi) cos θi, where nothing is in the way |
| lights as points | the same, and all other lights as the approximation takes them (left out where there are none) |
| missing occlusion | the same, whatever is in the way |
| another masking | G with k = roughness²/2 in the specular lobe and in nothing else |
| diffuse factor | kd · albedo cos θi/π instead of what passes the rough interface twice |
| factorisation | (F0 scale + F90 bias) times the lobe D n·h/(4 v·h) cos θi, scaled so that its integral is 1 |
| n = v = r | the same lobe for n and v along r |
| doubled Fresnel | F in the place of F0 |
| lookups | the maps instead of the integrals |
| occlusion map | times the occlusion texture (left out where there is none) |

A coat and what lies below it are two surfaces from the diffuse factor on, and under lights always: light of the lower
one passes the coat twice at the angle of view. Other models than metallic-roughness, brushed surfaces, sheen, thin
films and light that is transmitted diffusely, which lookups and lamps leave out, and media are not what the steps are
about: their rows mix in what the approximation leaves out of them, and a sentence names them.

Neighbours differ by exactly what their row says, and the changes add up to the whole difference. Their order is part of
the measurement: another would give other shares. Bias is the mean change of the surfaces in the picture, relative to
their mean radiance in truth, with its standard error from what two independent halves differ by in each pixel; rms is
the root mean square of pixels, with noise taken out by multiplying the halves. The truth has 8 bounces.

Written by `python scripts/split_sum.py` on {date} with fragtracer {fragtracer} and {renderer}.

"""


def spheres_alone() -> Scene:
    """The 49 spheres under the sky without its sun, which for the approximation is a lamp and no environment."""
    scene = load("spheres-49")
    assert scene.environment is not None
    assert scene.environment.sky is not None
    sky = replace(scene.environment, sky=replace(scene.environment.sky, sun=False), strength=0.05)
    camera = Camera((0.0, 0.0, 19.0), (0.0, 0.0, 0.0), fov_degrees=25.5)
    return replace(scene, environment=sky, meshes=(), camera=camera)


def term_table(found: Approximation) -> Iterator[str]:
    yield "| error | what it does | bias | rms |\n|---|---|---|---|"
    for term in found.terms():
        bias = words.with_error(term.bias, term.bias_error)
        yield f"| {term.error} | {term.explanation} | {bias} | {words.percent(term.rms)} |"


def angle_table(found: Approximation, metallic: float, error: str = "") -> Iterator[str]:
    """Of the whole difference, or of one error."""
    errors = [stage.error for stage in found.stages]
    stage, against = (errors.index(error), errors.index(error) - 1) if error else (-1, 0)
    edges = [f"{low:.0f}° to {high:.0f}°" for low, high in pairwise(ANGLES)]
    yield f"| roughness | {' | '.join(edges)} |\n|---|{'---|' * len(edges)}"
    for kind, roughness, row in by_roughness_and_angle(found, stage, against):
        if kind == metallic:
            cells = ["—" if v != v else words.minus(f"{100 * v:+.1f} %") for v in row]
            yield f"| {roughness:.2f} | {' | '.join(cells)} |"


def main(quick: bool) -> None:
    target = Path(tempfile.mkdtemp()) if quick else DOCS
    (target / "images").mkdir(exist_ok=True)
    share = 16 if quick else 1
    spheres = measure_approximation(spheres_alone(), SPHERES[0], SPHERES[1] // share)
    whole = measure_approximation(load("spheres-49"), WHOLE[0], WHOLE[1] // share)
    facts = {"date": date.today(), "fragtracer": version("fragtracer"), "renderer": spheres.device}
    limits = [
        write_pictures(target / "images" / "split-sum-spheres.png", spheres),
        write_error_maps(target / "images" / "split-sum-errors.png", spheres),
        write_pictures(target / "images" / "split-sum-demonstration.png", whole),
    ]
    text = [HEAD.format(**facts), "### 49 spheres under a clear sky, its sun left out\n"]
    text += ["Roughness grows to the right, metallic upwards.\n", "![](images/split-sum-spheres.png)\n"]
    text += [*term_table(spheres), ""]
    text.append(f"Each error by itself, from blue ({-limits[1]:.0%} of the truth) to red ({limits[1]:+.0%}):\n")
    text += ["![](images/split-sum-errors.png)\n", "### By roughness and angle of view\n"]
    text.append("The whole difference on the metals of the same picture, relative to the truth there:\n")
    text += [*angle_table(spheres, 1.0), "", "On the dielectrics:\n", *angle_table(spheres, 0.0), ""]
    text += ["What n = v = r alone changes on the metals:\n", *angle_table(spheres, 1.0, "n = v = r"), ""]
    text += ["### The whole demonstration, with its sun\n", "![](images/split-sum-demonstration.png)\n"]
    text += [*term_table(whole), ""]
    path = target / "split-sum.md"
    path.write_text("\n".join(text), encoding="utf-8", newline="\n")
    print(path)


if __name__ == "__main__":
    main("--quick" in sys.argv[1:])
