# SPDX-License-Identifier: MIT
"""Probes whose programs are kept: to compile one often takes longer than all that a test asks of it."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer import probe
from fragtracer.gpu.specialise import Specialisation

_MOST = 64
_kept: dict[Hashable, probe.Probe] = {}  # the last ones used, the newest last


def kept_probe(
    ctx: moderngl.Context,
    includes: Sequence[str],
    body: str,
    inputs: Mapping[str, ArrayLike],
    outputs: Mapping[str, int],
    *,
    uniforms: Mapping[str, object] | None = None,
    resources: Mapping[str, probe.Resource] | None = None,
    constants: Specialisation | None = None,
    **texts: Mapping[str, Any],
) -> dict[str, NDArray[np.float32]]:
    """As :func:`fragtracer.probe.probe`, with ``constants`` compiled in; ``texts`` are its defines and generated files.

    Nothing may change in the folder of the shaders meanwhile, which is another one where errors are planted. Programs
    keep their uniforms and the units of their textures, so each is asked for with the same ones.
    """
    widths = probe.widths_of(inputs)
    options = (tuple(some.items()) for some in (widths, outputs, *texts.values()))
    names = (frozenset(some or {}) for some in (uniforms, resources))
    compiled_in = None if constants is None else constants.key
    key = (ctx, probe.folder("shaders"), tuple(includes), body, *texts, *options, *names, compiled_in)
    if (program := _kept.pop(key, None)) is None:
        text_pass = None if constants is None else constants.apply
        program = probe.Probe(ctx, includes, body, widths, outputs, text_pass=text_pass, **texts)
    _kept[key] = program
    if len(_kept) > _MOST:
        _kept.pop(next(iter(_kept))).release()
    return program(inputs, uniforms, resources)
