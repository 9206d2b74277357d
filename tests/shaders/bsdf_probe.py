# SPDX-License-Identifier: MIT
"""Probes of bsdf/bsdf.glsl."""

import math
import re
from collections.abc import Hashable, Mapping
from pathlib import Path

import moderngl
import numpy as np

from fragtracer import probe
from fragtracer.resources import folder

from . import Floats
from .bsdf_models import Model, Parameters
from .bsdf_oracle import Direction

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
    model does not have are 0. ``features`` whose names begin with u_ are uniforms.
    """
    switches = {name: features.pop(name) for name in list(features) if name.startswith("u_")}
    values = vars(parameters)
    assert set(values) <= set(FIELDS), f"{model.name} has parameters that the shader's Bsdf lacks"
    widths = tuple((name, math.prod(np.shape(column)[1:])) for name, column in inputs.items())
    defines = tuple(({**model.features, **features}).items())
    # Programs are kept, so nothing may change in the folder, which is another one where errors are planted; and they
    # keep their uniforms, so each is asked for with the same ones.
    what = ctx, probe.folder("shaders"), model.name, tuple(values), body, widths, tuple(outputs.items()), defines
    key = (what, tuple(switches))
    if key not in _kept:
        if len(_kept) == _MOST_KEPT:
            _kept.pop(next(iter(_kept))).release()
        _kept[key] = _program(*what)
    result = _kept[key](inputs, {f"u_{name}": value for name, value in values.items()} | {"u_wo": wo} | switches)
    return {name: values.astype(np.float64) for name, values in result.items()}


_MOST_KEPT = 8
_kept: dict[Hashable, probe.Probe] = {}


def _program(
    ctx: moderngl.Context,
    _root: Path,
    model: str,
    parameters: tuple[str, ...],
    body: str,
    inputs: tuple[tuple[str, int], ...],
    outputs: tuple[tuple[str, int], ...],
    defines: tuple[tuple[str, int], ...],
) -> probe.Probe:
    """That of :func:`run`."""
    declarations = [f"uniform {FIELDS[name]} u_{name};" for name in parameters]
    arguments = ", ".join(f"u_{name}" if name in parameters else f"{kind}(0)" for name, kind in FIELDS.items())
    glsl = "\n".join(
        ["uniform vec3 u_wo;", *declarations, f"Bsdf the_bsdf() {{ return Bsdf(BSDF_{model}, {arguments}); }}"]
    )
    return probe.Probe(
        ctx,
        ["bsdf/bsdf.glsl", "probe/bsdf.glsl"],
        "Bsdf b = the_bsdf(); vec3 wo = u_wo;\n" + body,
        dict(inputs),
        dict(outputs),
        dict(defines),
        {"probe/bsdf.glsl": glsl},
    )
