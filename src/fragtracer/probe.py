# SPDX-License-Identifier: MIT
"""Runs functions of the shader library over tables of numbers, to test them one by one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragtracer.gpu.context import nearest_texture
from fragtracer.gpu.outputs import drawing_to
from fragtracer.gpu.program import FullscreenProgram
from fragtracer.resources import folder

Resource = Any  # a texture of moderngl
_WIDTH = 1024
_TYPES = {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"}
_SWIZZLES = {1: "x", 2: "xy", 3: "xyz", 4: "xyzw"}


class Probe:
    """The program of :func:`probe`, for tables of the same columns; release it, or use it in a ``with`` block.

    ``inputs`` are the widths of the columns by name.
    """

    def __init__(
        self,
        ctx: Any,
        includes: Sequence[str],
        body: str,
        inputs: Mapping[str, int],
        outputs: Mapping[str, int],
        defines: Mapping[str, int | str] | None = None,
        generated: Mapping[str, str] | None = None,
        text_pass: Callable[[str], str] | None = None,
    ) -> None:
        self._ctx, self._outputs = ctx, dict(outputs)
        generated = {**(generated or {}), "probe": _source(includes, body, inputs, outputs)}
        self._program = FullscreenProgram(ctx, folder("shaders"), "probe", defines, generated, text_pass)

    def __call__(
        self,
        inputs: Mapping[str, ArrayLike],
        uniforms: Mapping[str, object] | None = None,
        resources: Mapping[str, Resource] | None = None,
    ) -> dict[str, NDArray[np.float32]]:
        """The outputs, as :func:`probe` returns them."""
        ctx, program = self._ctx, self._program
        columns = {name: _column(values) for name, values in inputs.items()}
        rows = {len(column) for column in columns.values()}
        if len(rows) != 1:
            raise ValueError(f"the inputs must have the same number of rows, not {sorted(rows)}")
        count = rows.pop()
        height = -(-count // _WIDTH)
        textures = [_texture(ctx, column, height) for column in columns.values()]
        targets = [ctx.texture((_WIDTH, height), 4, dtype="f4") for _ in self._outputs]
        try:
            program.set({f"u_in_{name}": unit for unit, name in enumerate(columns)} | dict(uniforms or {}))
            for unit, texture in enumerate(textures):
                texture.use(unit)
            for unit, (name, resource) in enumerate((resources or {}).items(), len(textures)):
                program.set({name: unit})
                program.use(name, resource, unit)
            with drawing_to(ctx, targets):
                program.draw()
            tables = [np.frombuffer(t.read(), np.float32).reshape(-1, 4)[:count] for t in targets]
        finally:
            for texture in (*targets, *textures):
                texture.release()
        return {n: t[:, 0] if w == 1 else t[:, :w] for (n, w), t in zip(self._outputs.items(), tables, strict=True)}

    def release(self) -> None:
        self._program.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def probe(
    ctx: Any,
    includes: Sequence[str],
    body: str,
    inputs: Mapping[str, ArrayLike],
    outputs: Mapping[str, int],
    defines: Mapping[str, int | str] | None = None,
    generated: Mapping[str, str] | None = None,
    uniforms: Mapping[str, object] | None = None,
    resources: Mapping[str, Resource] | None = None,
    text_pass: Callable[[str], str] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """Evaluate GLSL for every row of a table.

    Parameters
    ----------
    includes
        Shader files to include, in this order.
    body
        Statements that read the inputs and assign the outputs, by name.
    inputs
        Columns, (n,) or (n, k) with k from 1 to 4, as float32; they appear as float or veck.
    outputs
        Names and widths (1 to 4) of the results, at most eight.
    defines, generated, uniforms, text_pass
        As for :class:`FullscreenProgram`.
    resources
        Textures by the name of their sampler.

    Returns
    -------
    dict
        For each output, float32 (n,) or (n, k).

    Raises
    ------
    ShaderError
        If the code does not compile.
    """
    with Probe(ctx, includes, body, widths_of(inputs), outputs, defines, generated, text_pass) as run:
        return run(inputs, uniforms, resources)


def widths_of(inputs: Mapping[str, ArrayLike]) -> dict[str, int]:
    """Those of columns, (n,) or (n, k), by name."""
    return {name: _column(values).shape[1] for name, values in inputs.items()}


def _column(values: ArrayLike) -> NDArray[np.float32]:
    column = np.asarray(values, np.float32)
    return column[:, None] if column.ndim == 1 else column


def _texture(ctx: Any, column: NDArray[np.float32], height: int) -> Any:
    texels = np.zeros((height * _WIDTH, 4), np.float32)
    texels[: len(column), : column.shape[1]] = column
    return nearest_texture(ctx, (_WIDTH, height), 4, texels.tobytes())


def _source(includes: Sequence[str], body: str, inputs: Mapping[str, int], outputs: Mapping[str, int]) -> str:
    lines = [f'#include "{path}"' for path in ("core/texels.glsl", *includes)]
    lines += [f"uniform highp sampler2D u_in_{name};" for name in inputs]
    lines += [f"OUTPUT({i}) out_{name};" for i, name in enumerate(outputs)]
    lines.append("void main() {")
    texel = "texelFetch(u_in_{}, ivec2(gl_FragCoord.xy), 0).{}"
    lines += [f"    {_TYPES[k]} {name} = {texel.format(name, _SWIZZLES[k])};" for name, k in inputs.items()]
    lines += [f"    {_TYPES[k]} {name} = {_TYPES[k]}(0.0);" for name, k in outputs.items()]
    lines += body.splitlines()
    lines += [f"    output_write(out_{n}, vec4({', '.join([n] + ['0.0'] * (4 - k))}));" for n, k in outputs.items()]
    return "\n".join([*lines, "}"])
