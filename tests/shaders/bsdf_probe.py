# SPDX-License-Identifier: MIT
"""Probes of bsdf/bsdf.glsl."""

import re
from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np

from fragtracer.gpu.specialise import Specialisation
from fragtracer.packing.records import BsdfModel
from fragtracer.resources import folder

from . import Floats
from .bsdf_models import MODELS
from .bsdf_models.model import Model, Parameters
from .bsdf_oracle import Direction
from .kept import kept_probe

UP = (0.0, 0.0, 1.0)
_STRUCT = re.search(r"struct Bsdf \{(.*?)\};", (folder("shaders") / "bsdf/model.glsl").read_text(), re.DOTALL)
assert _STRUCT
# The parameters of all models, with their types.
FIELDS = {name: kind for kind, name in re.findall(r"^\s*(\w+) (\w+);", _STRUCT[1], re.MULTILINE) if name != "model"}
_ZEROS = {"int": 0, "float": 0.0, "vec3": (0.0,) * 3, "vec4": (0.0,) * 4}


def without_others(model: Model) -> dict[str, int]:
    """The features of a program that has no other models."""
    own = (model.feature, *model.features)
    return {other.feature: 0 for other in MODELS.values() if other.feature not in own}


def run(
    ctx: moderngl.Context,
    model: Model,
    parameters: Parameters,
    body: str,
    inputs: Mapping[str, Floats],
    outputs: Mapping[str, int],
    wo: Direction = UP,
    has_all_models: bool = False,
    **features: int,
) -> dict[str, Floats]:
    """A probe in which `b` is the BSDF and `wo` the direction to the viewer; results in float64.

    Parameters and viewer are uniforms, so that all probes with the same body share one program. Parameters that the
    model does not have are 0. A program that ``has_all_models``, which takes long to compile, has a uniform for the
    model, too. ``features`` whose names begin with u_ are uniforms. That no material has a thin film is compiled in, as
    into all programs; where one has, which is much code, other models are left out in any case.
    """
    switches = {name: features.pop(name) for name in list(features) if name.startswith("u_")}
    values: dict[str, Any] = dict(vars(parameters))
    has_film = values.get("iridescence", 0.0) > 0
    constants = {"u_without_iridescence": int(not has_film)}
    if has_film or not has_all_models:
        constants["u_absent_models"] = sum(1 << other for other in BsdfModel if other.name != model.name)
    assert set(values) <= set(FIELDS), f"{model.name} has parameters that the shader's Bsdf lacks"
    named = f"BSDF_{model.name}"
    declarations = ["uniform vec3 u_wo;"]
    if has_all_models:
        values = {name: _ZEROS[kind] for name, kind in FIELDS.items()} | values
        switches["u_model"], named = int(BsdfModel[model.name]), "u_model"
        declarations.append("uniform int u_model;")
    declarations += [f"uniform {kind} u_{name};" for name, kind in FIELDS.items() if name in values]
    arguments = ", ".join(f"u_{name}" if name in values else f"{kind}(0)" for name, kind in FIELDS.items())
    glsl = "\n".join([*declarations, f"Bsdf the_bsdf() {{ return Bsdf({named}, {arguments}); }}"])
    result = kept_probe(
        ctx,
        ["bsdf/bsdf.glsl", "probe/bsdf.glsl"],
        "Bsdf b = the_bsdf(); vec3 wo = u_wo;\n" + body,
        inputs,
        outputs,
        defines={**({} if has_all_models else without_others(model)), **model.features, **features},
        generated={"probe/bsdf.glsl": glsl},
        constants=Specialisation(constants),
        uniforms={f"u_{name}": value for name, value in values.items()} | {"u_wo": wo} | switches,
    )
    return {name: values.astype(np.float64) for name, values in result.items()}
