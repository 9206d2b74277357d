# SPDX-License-Identifier: MIT
"""Probes of bsdf/cook_torrance.glsl, and the materials and angles to try it with."""

from collections.abc import Mapping

import moderngl
import numpy as np

from fragtracer.gpu.probe import probe
from fragtracer.shader_composer import CONSTANTS

from . import Floats
from .bsdf_oracle import Direction, Material
from .includes import BSDF

WHITE = (1.0, 1.0, 1.0)
MATERIALS = {
    "lambert": Material(diffuse=(0.8, 0.5, 0.2)),
    "plastic": Material(diffuse=(0.6, 0.3, 0.1), f0=(0.04, 0.04, 0.04), f90=WHITE),
    "white dielectric": Material(diffuse=WHITE, f0=(0.04, 0.04, 0.04), f90=WHITE),
    "diamond": Material(diffuse=WHITE, f0=(0.17, 0.17, 0.17), f90=WHITE),
    "faint plastic": Material(diffuse=WHITE, f0=(0.02, 0.02, 0.02), f90=(0.5, 0.5, 0.5)),
    "red plastic": Material(diffuse=WHITE, f0=(0.04, 0.002, 0.0), f90=(1.0, 0.1, 0.0)),
    "half metallic": Material(diffuse=(0.5, 0.35, 0.15), f0=(0.52, 0.37, 0.165), f90=WHITE),
    "gold": Material(f0=(1.0, 0.71, 0.29), f90=WHITE),
    "white metal": Material(f0=WHITE, f90=WHITE),
}
ALPHAS = [1e-3, 1e-2, 0.1, 0.5, 1.0]
DEGREES = [0, 45, 80, 89]
TERMS = ["SMITH", "SCHLICK_BECKMANN", "KARIS"]

# The material and the viewer are uniforms, so that all probes with the same body share one program.
_MATERIAL = """
uniform vec3 u_diffuse; uniform float u_alpha; uniform vec3 u_f0; uniform vec3 u_f90; uniform vec3 u_wo;
Bsdf the_bsdf() { return Bsdf(u_diffuse, u_alpha, u_f0, u_f90); }
"""


def run(
    ctx: moderngl.Context,
    body: str,
    inputs: Mapping[str, Floats],
    outputs: Mapping[str, int],
    material: Material,
    wo: Direction = (0.0, 0.0, 1.0),
    term: str = "SMITH",
    **features: int,
) -> dict[str, Floats]:
    """A probe in which `b` is the material and `wo` the direction to the viewer; results in float64."""
    uniforms = {f"u_{name}": value for name, value in vars(material).items()} | {"u_wo": wo}
    result = probe(
        ctx,
        [*BSDF, "probe/material.glsl"],
        "Bsdf b = the_bsdf(); vec3 wo = u_wo;\n" + body,
        inputs,
        outputs,
        {"GEOMETRY_TERM": CONSTANTS[f"GEOMETRY_{term}"], **features},
        {"probe/material.glsl": _MATERIAL},
        uniforms,
    )
    return {name: values.astype(np.float64) for name, values in result.items()}
