# SPDX-License-Identifier: MIT
"""Probes of bsdf/bsdf.glsl."""

import re
from collections.abc import Mapping

import moderngl
import numpy as np

from fragtracer.gpu.specialise import Specialisation
from fragtracer.packing.records import BsdfModel
from fragtracer.resources import folder

from . import Floats
from .bsdf_models import Model, Parameters
from .bsdf_oracle import Direction
from .kept import kept_probe

UP = (0.0, 0.0, 1.0)
_STRUCT = re.search(r"struct Bsdf \{(.*?)\};", (folder("shaders") / "bsdf/model.glsl").read_text(), re.DOTALL)
assert _STRUCT
# The parameters of all models, with their types.
FIELDS = {name: kind for kind, name in re.findall(r"^\s*(\w+) (\w+);", _STRUCT[1], re.MULTILINE) if name != "model"}


def run(
    ctx: moderngl.Context,
    model: Model,
    parameters: Parameters,
    body: str,
    inputs: Mapping[str, Floats],
    outputs: Mapping[str, int],
    wo: Direction = UP,
    **features: int,
) -> dict[str, Floats]:
    """A probe in which `b` is the BSDF and `wo` the direction to the viewer; results in float64.

    Parameters and viewer are uniforms, so that all probes with the same body share one program. Parameters that the
    model does not have are 0. ``features`` whose names begin with u_ are uniforms. That no material has a thin film is
    compiled in, as into all programs; with one, which is much code, other models are left out.
    """
    switches = {name: features.pop(name) for name in list(features) if name.startswith("u_")}
    values = vars(parameters)
    constants = {"u_without_iridescence": 1}
    if values.get("iridescence", 0.0) > 0:
        absent = sum(1 << other for other in BsdfModel if other.name != model.name)
        constants = {"u_without_iridescence": 0, "u_absent_models": absent}
    assert set(values) <= set(FIELDS), f"{model.name} has parameters that the shader's Bsdf lacks"
    declarations = [f"uniform {FIELDS[name]} u_{name};" for name in values]
    arguments = ", ".join(f"u_{name}" if name in values else f"{kind}(0)" for name, kind in FIELDS.items())
    glsl = "\n".join(
        ["uniform vec3 u_wo;", *declarations, f"Bsdf the_bsdf() {{ return Bsdf(BSDF_{model.name}, {arguments}); }}"]
    )
    result = kept_probe(
        ctx,
        ["bsdf/bsdf.glsl", "probe/bsdf.glsl"],
        "Bsdf b = the_bsdf(); vec3 wo = u_wo;\n" + body,
        inputs,
        outputs,
        defines={**model.features, **features},
        generated={"probe/bsdf.glsl": glsl},
        constants=Specialisation(constants),
        uniforms={f"u_{name}": value for name, value in values.items()} | {"u_wo": wo} | switches,
    )
    return {name: values.astype(np.float64) for name, values in result.items()}
